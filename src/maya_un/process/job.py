"""Jobs as people write them: YAML or JSON, names for parts and places, steps, how often.

    name: one cube
    parts:                      where named parts stand at the start, [x, y] or [x, y, z] in metres;
      cube: [0.50, 1.10]        z is the cell's grasp height where it is left out
    places:
      tray: [1.10, 0.50, 0.40]
    steps:                      home · pick · place · approach · gripper: open|close · move: {a, b, c}
      - home
      - pick: cube
      - place: tray
    repeat: 1

The order of the keys does not matter; parts, places and repeat may be left out, and so may the name: a job from a
file is then called as the file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import isnan, nan
from reprlib import repr
from typing import Annotated, Literal, Self, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainValidator,
    ValidationError,
    model_validator,
)

from maya_un.errors import InvalidJob, InvalidValue
from maya_un.robot.primitives import read_joints, read_point
from maya_un.values import Joints, Point

T = TypeVar("T")

MOST_TASKS = 3_000
"""Steps times repeat of one job; on Maya that is a day and a half, and accepting it never holds the loop."""

COMMANDS = ("home", "pick", "place", "approach", "gripper", "move")
"""What a step may be."""

Coordinates = tuple[float, ...]
"""x, y and perhaps z [m]."""


def point_of(coordinates: Coordinates, grasp_height: float) -> Point:
    """Return coordinates as a point; z left out means `grasp_height` [m]."""
    x, y, *z = coordinates
    return Point(x, y, *(z or [grasp_height]))


def _explained(read: Callable[[], T]) -> T:
    try:
        return read()
    except InvalidValue as error:
        value = error.details["value"]
        place = str(error.details["key"]).removeprefix("it").removeprefix(".")
        raise ValueError(f"{place + ': ' * bool(place)}{error.details['reason']}, not {value}") from error


def _coordinates(value: object) -> Coordinates:
    point = _explained(lambda: read_point(value, "it", nan))
    return (point.x, point.y) if isnan(point.z) else tuple(point)


def _spot(value: object) -> str | Coordinates:
    return value if isinstance(value, str) else _coordinates(value)


def _joints(value: object) -> Joints:
    return _explained(lambda: read_joints(value, "it"))


def _repeat(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError(f"it must be a whole number, not {repr(value)}")  # noqa: TRY004 - pydantic's way
    return value


def _printable(name: str) -> str:
    if not name.isprintable():
        raise ValueError("a name is made of characters that can be printed")
    return name


Name = Annotated[str, Field(min_length=1, max_length=64), AfterValidator(_printable)]
Spot = Annotated[str | Coordinates, PlainValidator(_spot)]
Place = Annotated[Coordinates, PlainValidator(_coordinates)]


class Step(BaseModel):
    """One step: exactly one of its keys is set; a name in `pick`, `place`, `approach` is a part or a place."""

    model_config = ConfigDict(frozen=True, extra="forbid")
    home: Literal[True] | None = None
    pick: Spot | None = None
    place: Spot | None = None
    approach: Spot | None = None
    gripper: Literal["open", "close"] | None = None
    move: Annotated[Joints, PlainValidator(_joints)] | None = None

    @property
    def command(self) -> str:
        """Which of the keys is set."""
        return next(iter(self.model_fields_set))

    def __str__(self) -> str:
        argument = getattr(self, self.command)
        if self.command == "home":
            return "home"
        shown = argument if isinstance(argument, str) else " ".join(f"{number:g}" for number in argument)
        return f"{self.command} {shown}"

    @model_validator(mode="before")
    @classmethod
    def _one_command(cls, data: object) -> object:
        if data == "home":
            return {"home": True}
        if not isinstance(data, Mapping) or len(data) != 1:
            raise ValueError(f"a step is one of {', '.join(COMMANDS)}, like `pick: cube`, not {repr(data)}")
        ((command, argument),) = data.items()
        if command in COMMANDS and argument is None and command != "home":
            raise ValueError(f"{command} needs a value")
        return {"home": True} if data == {"home": None} else dict(data)


class Job(BaseModel):
    """A job as written; `Job.parse` reads plain data. Names are resolved by `tasks.expand`."""

    model_config = ConfigDict(frozen=True, extra="forbid")
    name: Name = "job"
    parts: dict[Name, Place] = Field(default_factory=dict)
    places: dict[Name, Place] = Field(default_factory=dict)
    steps: Annotated[tuple[Step, ...], Field(min_length=1, max_length=1000)]
    repeat: Annotated[int, BeforeValidator(_repeat), Field(ge=1, le=10_000)] = 1

    @classmethod
    def parse(cls, data: object) -> Self:
        """Return the job that plain data describes; raises `InvalidJob` with the dotted key of the first error."""
        if not isinstance(data, Mapping):
            raise InvalidJob(key="job", reason="it must be a mapping with name, parts, places, steps, repeat")
        try:
            return cls.model_validate(dict(data))
        except ValidationError as error:
            raise _refusal(error) from error

    def part_points(self, grasp_height: float) -> dict[str, Point]:
        """Return where the named parts stand at the start [m]."""
        return {name: point_of(place, grasp_height) for name, place in self.parts.items()}

    def place_points(self, grasp_height: float) -> dict[str, Point]:
        """Return the named places [m]."""
        return {name: point_of(place, grasp_height) for name, place in self.places.items()}

    @model_validator(mode="after")
    def _sensible(self) -> Self:
        both = sorted(self.parts.keys() & self.places.keys())
        if both:
            raise ValueError(f"{both[0]!r} is both a part and a place")
        if len(self.steps) * self.repeat > MOST_TASKS:
            raise ValueError(f"steps times repeat is more than {MOST_TASKS}")
        return self


_REASONS = {
    "missing": "it is missing",
    "invalid_key": "a key must be a text",
    "dict_type": "it must be a mapping of names to places",
    "tuple_type": "it must be a list of steps",
    "string_type": "it must be a text",
    "string_too_short": "it is empty",
    "string_too_long": "it is longer than 64 letters",
    "too_short": "it is empty",
    "too_long": "it has more than 1000 steps",
}


def _refusal(error: ValidationError) -> InvalidJob:
    first = error.errors(include_url=False)[0]
    location = [str(part) for part in first["loc"] if part != "[key]"]
    kind, words = first["type"], first["msg"].removeprefix("Value error, ")
    if kind == "extra_forbidden":
        known = COMMANDS if location[0] == "steps" else tuple(Job.model_fields)
        words = f"there is no such key; known are {', '.join(known)}"
    elif kind == "literal_error":
        words = f"it must be {first.get('ctx', {}).get('expected', 'something else')}, not {repr(first['input'])}"
    elif kind in {"greater_than_equal", "less_than_equal"}:
        words = "it must lie between 1 and 10000"
    return InvalidJob(key=".".join(location) or "job", reason=_REASONS.get(kind, words))
