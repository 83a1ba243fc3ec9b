"""Jobs as users write them, in YAML or JSON: names for parts and places, steps, repetitions.

    name: one cube
    parts:                      where named parts stand at the start, [x, y] or [x, y, z] in metres;
      cube: [0.50, 1.10]        without z, z is the cell's grasp height
    places:
      tray: [1.10, 0.50, 0.40]
    pallets:                    grids of places, spanned by their corners
      box: {corners: [[0.3, 1.0], [0.5, 1.0], [0.3, 1.2]], rows: 3, columns: 4}
    steps:                      home · pick · place · approach · line · gripper: open|close · move: {a, b, c}
      - home
      - pick: cube
      - place: tray
      - for_each: box           every cell, row by row
        do:
          - approach: box[each]
            speed: 50 %         share of the speed, for this step
      - wait: 2 s               wait · set · wait_for · ask: see `process.spec.statements`
      - if: {input: 3, is: on}  or {answer: yes}: the answer to the last question before it
        then: [home]
        else: []
    repeat: 1

The order of the keys does not matter. Parts, places, pallets, repeat and name may be omitted; a job from a file is then
named after the file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from math import isnan, nan
from pathlib import Path
from reprlib import repr
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, Self, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PlainValidator,
    SerializerFunctionWrapHandler,
    StrictBool,
    Tag,
    ValidationError,
    create_model,
    model_serializer,
    model_validator,
)

from dmc41x3.i18n import phrase
from maya_un.errors import InvalidJob, InvalidValue
from maya_un.process.spec.pallet import MOST_CELLS, check_counts
from maya_un.process.spec.statements import ELSE, ONE_KIND, STATEMENTS, THEN, Condition, JobStatement, Share
from maya_un.robot.primitives import PRIMITIVES
from maya_un.robot.primitives.primitive import Argument, JointTarget, Switch, Target, read_joints, read_point
from maya_un.validation import nearest, reason_of
from maya_un.values import Joints, Point

T = TypeVar("T")

Coordinates = tuple[float, ...]
"""x, y and optionally z [m]."""


def point_of(coordinates: Coordinates, grasp_height: float) -> Point:
    """Return coordinates as a point; without z it is at `grasp_height` [m]."""
    x, y, *z = coordinates
    return Point(x, y, *(z or [grasp_height]))


def _explained(read: Callable[[], T]) -> T:
    try:
        return read()
    except InvalidValue as error:
        value = error.details["value"]
        place = str(error.details["key"]).removeprefix("it").removeprefix(".")
        reason = phrase("{reason}, not {value}", reason=error.details["reason"], value=value)
        raise ValueError(f"{place}: {reason}" if place else reason) from error


def _coordinates(value: object) -> Coordinates:
    point = _explained(lambda: read_point(value, "it", nan))
    return (point.x, point.y) if isnan(point.z) else tuple(point)


def _spot(value: object) -> str | Coordinates:
    return value if isinstance(value, str) else _coordinates(value)


def _joints(value: object) -> Joints:
    return _explained(lambda: read_joints(value, "it"))


def _goal(value: object) -> str | Joints:
    return value if isinstance(value, str) else _joints(value)


def _whole(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError(phrase("it must be a whole number, not {value}", value=repr(value)))  # noqa: TRY004 - pydantic's way
    return value


def _printable(name: str) -> str:
    if not name.isprintable():
        raise ValueError(phrase("a name is made of characters that can be printed"))
    return name


Name = Annotated[str, Field(min_length=1, max_length=64), AfterValidator(_printable)]
"""A name that a job defines."""

Spot = Annotated[str | Coordinates, PlainValidator(_spot)]
"""A place: by its name, or as [x, y] or [x, y, z] in m."""

Place = Annotated[Coordinates, PlainValidator(_coordinates)]
"""A place as [x, y] or [x, y, z] in m."""

Goal = Annotated[str | Joints, PlainValidator(_goal)]
"""Joints: by the name of a taught pose, or as [a, b, c] in rad and m."""

JointValues = Annotated[Joints, PlainValidator(_joints)]
"""Joints as [a, b, c] in rad and m."""

Whole = Annotated[int, BeforeValidator(_whole)]
"""A whole number; 2.0 and true are refused."""


class Grid(BaseModel):
    """A pallet as written: two to four corners in reading order, and the numbers of rows and columns.

    Corners are places or names of places; `Pallet.spanned` documents how many a grid needs.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    corners: Annotated[tuple[Spot, ...], Field(min_length=1)]
    rows: Whole
    columns: Whole

    @model_validator(mode="after")
    def _possible(self) -> Self:
        check_counts(self.rows, self.columns, len(self.corners))
        return self


SKILLS = tuple(name for name, primitive in PRIMITIVES.items() if primitive.in_jobs)
"""The primitives that may be steps."""

COMMANDS = (*SKILLS, *STATEMENTS)
"""The kinds of steps, besides a loop: primitives and statements."""

BARE = frozenset(name for name in SKILLS if not PRIMITIVES[name].argument.key)
"""Steps that may be written as a single word."""

SPEED = "speed"
"""The key that a step may have besides its own."""


def step_text(command: str, argument: Any) -> str:
    """Return a step as text, like `pick 0.5 1.1`; `argument` is the value of its key."""
    if argument is True:
        return command
    if isinstance(argument, JobStatement):
        return argument.words
    shown = argument if isinstance(argument, str) else " ".join([f"{number:g}" for number in argument])
    return f"{command} {shown}"


class _Step(BaseModel):
    """One step: exactly one of its keys is set, and `speed` may be: the share of the speed at which this step travels.

    The place of a primitive may be a name: of a part, a place, a cell of a pallet like `tray[1,2]` or a taught pose.
    Joints may be the name of a taught pose.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    if TYPE_CHECKING:
        speed: float | None = None

    @property
    def command(self) -> str:
        """The key that is set, besides `speed`."""
        return next(key for key in self.model_fields_set if key != SPEED)

    @property
    def argument(self) -> Any:
        """The value of the key."""
        return getattr(self, self.command)

    def __str__(self) -> str:
        return step_text(self.command, self.argument)

    @model_validator(mode="after")
    def _travels(self) -> Self:
        travels = self.command in SKILLS and PRIMITIVES[self.command].travels
        if self.speed is not None and not travels:
            raise ValueError(phrase("{command} does not travel, so it takes no speed", command=self.command))
        return self

    @model_validator(mode="before")
    @classmethod
    def _one_command(cls, data: object) -> object:
        if isinstance(data, str) and data in BARE:
            return {data: True}
        keys = [key for key in data if key != SPEED] if isinstance(data, Mapping) else []
        if not isinstance(data, Mapping) or len(keys) != 1:
            raise ValueError(
                phrase(
                    "a step is one of {commands}, like `pick: cube`, not {data}",
                    commands=", ".join(COMMANDS),
                    data=repr(data),
                )
            )
        (command,) = keys
        argument = data[command]
        if argument is None and command in BARE:
            return {**data, command: True}
        if argument is None and command in COMMANDS:
            raise ValueError(phrase("{command} needs a value", command=command))
        return dict(data)


def _type_of(argument: Argument) -> Any:
    match argument:
        case Target():
            return Spot
        case JointTarget():
            return Goal
        case Switch(on=on, off=off):
            return Literal[on, off]
        case _:
            return Literal[True]


if TYPE_CHECKING:
    Step = _Step
else:
    Step = create_model(
        "Step",
        __base__=_Step,
        __doc__=_Step.__doc__,
        __module__=__name__,
        **{name: (_type_of(PRIMITIVES[name].argument) | None, None) for name in SKILLS},
        **{name: (statement | None, None) for name, statement in STATEMENTS.items()},
        speed=(Share | None, None),
    )


def _kind(data: object) -> str:
    if isinstance(data, ForEach) or (isinstance(data, Mapping) and "for_each" in data):
        return "loop"
    return "branch" if isinstance(data, IfElse) or (isinstance(data, Mapping) and "if" in data) else "step"


AnyStep = Annotated[
    Annotated[Step, Tag("step")] | Annotated["ForEach", Tag("loop")] | Annotated["IfElse", Tag("branch")],
    Discriminator(_kind),
]
"""A step, a loop or a branch; pydantic names the kind in the location of an error."""

Steps = Annotated[tuple[AnyStep, ...], Field(max_length=1000)]
"""Steps in order."""


class ForEach(BaseModel):
    """The steps of `do` for every cell of a pallet, row by row; in them `tray[each]` is that cell.

    `for_each` names the pallet, or cells of it: `tray`, `tray[2,*]` for a row, `tray[*,1]` for a column.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    for_each: Name
    do: Annotated[Steps, Field(min_length=1)]


class IfElse(BaseModel):
    """The steps of `then` if the condition holds, else those of `else`."""

    model_config = ConfigDict(frozen=True, extra="forbid")
    condition: Condition = Field(alias="if")
    then: Annotated[Steps, Field(min_length=1)]
    otherwise: Steps = Field(default=(), alias="else")

    @model_serializer(mode="wrap")
    def _to_plain(self, serialize: SerializerFunctionWrapHandler) -> dict[str, Any]:
        whole = serialize(self)
        plain = {"if": whole["condition"], "then": whole["then"]}
        return {**plain, "else": whole["otherwise"]} if whole.get("otherwise") else plain


ForEach.model_rebuild()
IfElse.model_rebuild()

LISTS = {"steps": "", "do": "loop", THEN: "branch", ELSE: "branch"}
"""The keys of lists of steps, and the kind of step to which they belong."""

DEEPEST = 8
"""Most lists of steps in each other."""


def _require_structure(data: object) -> None:
    """Raise `InvalidJob` for lists of steps that are nested too deeply, and for a loop within a loop."""
    ahead: list[tuple[Any, str, int, bool]] = [(data, "", 0, False)]
    while ahead:
        one, key, depth, looped = ahead.pop()
        if depth > DEEPEST:
            raise InvalidJob(key=key, reason=phrase("its steps are nested more than {most} deep", most=DEEPEST))
        if looped and isinstance(one, Mapping) and "for_each" in one:
            raise InvalidJob(key=key, reason="a loop cannot contain another loop")
        for name in LISTS if isinstance(one, Mapping) else ():
            steps = one.get(name)
            if isinstance(steps, list | tuple):
                place = f"{key}.{name}" if key else name
                within = looped or name == "do"
                ahead += [(step, f"{place}.{number}", depth + 1, within) for number, step in enumerate(steps)]


MOST_TASKS = 3_000
"""Most steps times repeat of one job: on Maya a day and a half; accepting such a job does not block the loop."""


MOST_NAMES = 1_000
"""Most parts, places and pallets each of a job, and most steps."""


class JobPallet(Grid):
    """A pallet that a job defines; with `full`, a part stands on every cell at the start."""

    full: StrictBool = False


class Job(BaseModel):
    """A job as written; `Job.parse` reads plain data. Names are resolved by `tasks.expand`."""

    model_config = ConfigDict(frozen=True, extra="forbid")
    name: Name = "job"
    parts: Annotated[dict[Name, Place], Field(max_length=MOST_NAMES)] = Field(default_factory=dict)
    places: Annotated[dict[Name, Place], Field(max_length=MOST_NAMES)] = Field(default_factory=dict)
    pallets: Annotated[dict[Name, JobPallet], Field(max_length=MOST_NAMES)] = Field(default_factory=dict)
    steps: Annotated[Steps, Field(min_length=1)]
    repeat: Annotated[Whole, Field(ge=1, le=10_000)] = 1

    @classmethod
    def parse(cls, data: object) -> Self:
        """Return the job that plain data describes; raises `InvalidJob` with the dotted key of the first error."""
        if not isinstance(data, Mapping):
            raise InvalidJob(
                key="job", reason=phrase("it must be a mapping with {names}", names=", ".join(cls.model_fields))
            )
        _require_structure(data)
        try:
            return cls.model_validate(dict(data))
        except ValidationError as error:
            raise _refusal(error) from error

    def as_data(self) -> dict[str, Any]:
        """Return the job as plain data in SI, without what was not written."""
        return self.model_dump(mode="json", exclude_unset=True, warnings=False)

    def part_points(self, grasp_height: float) -> dict[str, Point]:
        """Return where the named parts stand at the start [m]; `tasks.starting_parts` adds those on full pallets."""
        return {name: point_of(place, grasp_height) for name, place in self.parts.items()}

    def place_points(self, grasp_height: float) -> dict[str, Point]:
        """Return the named places [m]."""
        return {name: point_of(place, grasp_height) for name, place in self.places.items()}

    @model_validator(mode="after")
    def _sensible(self) -> Self:
        seen: dict[str, str] = {}
        named = ((phrase("part"), self.parts), (phrase("place"), self.places), (phrase("pallet"), self.pallets))
        for kind, names in named:
            for name in sorted(names):
                if name in seen:
                    raise ValueError(
                        phrase("{name!r} is both a {first} and a {kind}", name=name, first=seen[name], kind=kind)
                    )
                seen[name] = kind
        if sum(grid.rows * grid.columns for grid in self.pallets.values() if grid.full) > MOST_CELLS:
            raise ValueError(phrase("more than {most} parts stand on its full pallets", most=MOST_CELLS))
        if _count(self.steps) * self.repeat > MOST_TASKS:
            raise ValueError(TOO_MANY)
        return self


def _count(steps: Iterable[Step | ForEach | IfElse]) -> int:
    """Return the least number of tasks of some steps."""
    count = 0
    for step in steps:
        match step:
            case ForEach():
                count += _count(step.do)
            case IfElse():
                count += 1 + _count(step.then) + _count(step.otherwise)
            case _:
                count += 1
    return count


TOO_MANY = phrase("steps times repeat is more than {most}", most=MOST_TASKS)
"""Why a job with too many tasks is refused."""

_REASONS = {
    "dict_type": phrase("it must be a mapping of names to places"),
    "string_too_short": phrase("it is empty"),
    "too_short": phrase("it is empty"),
}
"""Reasons that are more exact for a job than those of `validation`."""


def _refusal(error: ValidationError) -> InvalidJob:
    found = error.errors(include_url=False)
    first = found[0]
    if first["type"] == "missing":  # more often a key is misspelt
        first = next((one for one in found if one["type"] == "extra_forbidden"), first)
    location, step = _untagged([part for part in first["loc"] if part != "[key]"])
    statement = STATEMENTS.get(location[-2]) if len(location) > 1 else None
    if statement is not None and statement.short == location[-1]:
        del location[-1]  # the value may stand for the statement
    kind = first["type"]
    if kind in {"too_long", "string_too_long"}:
        reason = _too_long(location[-1], first["input"], first.get("ctx", {})["max_length"])
    elif kind == "extra_forbidden":
        reason = _no_such_key(location[-1], _known(location, step))
    elif kind == "literal_error" and first.get("ctx", {}).get("expected") == "True":
        reason = phrase("it has no arguments; write `- {command}`", command=location[-1])
    elif kind == "literal_error":
        reason = phrase("{reason}, not {value}", reason=reason_of(first), value=repr(first["input"]))
    elif kind == "model_type" and location[-1] == "if":
        reason = ONE_KIND
    elif kind == "model_type" and len(location) > 1:
        names = STATEMENTS[location[-1]].keys() if location[-1] in STATEMENTS else JobPallet.model_fields
        reason = phrase("it must be a mapping with {names}", names=", ".join(names))
    elif kind in {"greater_than_equal", "less_than_equal"}:
        reason = phrase("it must lie between 1 and 10000")
    else:
        reason = _REASONS.get(kind) or reason_of(first)
    return InvalidJob(key=".".join(location) or "job", reason=reason)


def _too_long(name: str, value: object, most: int) -> str:
    """Return the reason for a text, a list or a mapping with more than `most` items."""
    if isinstance(value, str):
        return phrase("it is longer than {most} letters", most=most)
    if name in LISTS:
        return phrase("it has more than {most} steps", most=most)
    return phrase("it has more than {most} entries", most=most)


def _no_such_key(name: str, known: tuple[str, ...]) -> str:
    """Return the reason for an unknown key, with the nearest of the known ones if there is a near one."""
    names, near = ", ".join(known), nearest(name, known)
    if near is None:
        return phrase("there is no such key; known are {names}", names=names)
    return phrase("there is no such key; perhaps {name}; known are {names}", name=near, names=names)


class _FailedStep(NamedTuple):
    """The step around an error: its kind, and the number of parts of the location behind it."""

    kind: str = ""
    behind: int = 0


def _untagged(parts: list[int | str]) -> tuple[list[str], _FailedStep]:
    """Return a location without pydantic's tags of steps, and the innermost step in it."""
    location: list[str] = []
    found, tag = _FailedStep(), False
    for place, part in enumerate(parts):
        if tag:
            found, tag = _FailedStep(str(part), len(parts) - place - 1), False
            continue
        tag = isinstance(part, int) and bool(location) and location[-1] in LISTS
        location.append(str(part))
    return location, found


def _known(location: list[str], step: _FailedStep) -> tuple[str, ...]:
    if location[0] == "pallets":
        return tuple(JobPallet.model_fields)
    if location[0] != "steps":
        return tuple(Job.model_fields)
    if step.behind == 2:
        return {**STATEMENTS, "if": Condition}[location[-2]].keys()
    if step.kind == "step":
        return (*COMMANDS, "if", "for_each", SPEED)
    return ("if", THEN, ELSE) if step.kind == "branch" else tuple(ForEach.model_fields)


def load_job(path: Path) -> Job:
    """Return the job of a file; a job without a name is named after the file.

    Raises `FileUnreadable` for a file that cannot be read or parsed, `InvalidJob` with the place for its contents.
    """
    from maya_un.process.spec.documents import located, read_document  # noqa: PLC0415 - workers load no yaml

    with located(path):
        return Job.parse(_named(read_document(path), path))


def _named(data: Any, path: Path) -> Any:
    if not isinstance(data, dict) or "name" in data:
        return data
    return {**data, "name": path.stem.encode(errors="replace").decode()[:64]}
