"""Jobs as people write them: YAML or JSON, names for parts and places, steps, how often.

    name: one cube
    parts:                      where named parts stand at the start, [x, y] or [x, y, z] in metres;
      cube: [0.50, 1.10]        z is the cell's grasp height where it is left out
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
    repeat: 1

The order of the keys does not matter; parts, places, pallets and repeat may be left out, and so may the name: a job
from a file is then called as the file.
"""

from __future__ import annotations

from collections.abc import Mapping
from reprlib import repr
from typing import Annotated, Self

from pydantic import BaseModel, ConfigDict, Field, StrictBool, ValidationError, model_validator

from maya_un.errors import InvalidJob
from maya_un.process.pallet import MOST_CELLS
from maya_un.process.spots import Grid, Name, Place, Whole, point_of
from maya_un.process.step import COMMANDS, AnyStep, ForEach
from maya_un.values import Point

MOST_TASKS = 3_000
"""Steps times repeat of one job; on Maya that is a day and a half, and accepting it never holds the loop."""


MOST_NAMES = 1_000
"""Most parts, places and pallets each of a job, and most steps."""


class JobPallet(Grid):
    """A pallet that a job brings along; with `full`, a part stands on every cell at the start."""

    full: StrictBool = False


class Job(BaseModel):
    """A job as written; `Job.parse` reads plain data. Names are resolved by `tasks.expand`."""

    model_config = ConfigDict(frozen=True, extra="forbid")
    name: Name = "job"
    parts: Annotated[dict[Name, Place], Field(max_length=MOST_NAMES)] = Field(default_factory=dict)
    places: Annotated[dict[Name, Place], Field(max_length=MOST_NAMES)] = Field(default_factory=dict)
    pallets: Annotated[dict[Name, JobPallet], Field(max_length=MOST_NAMES)] = Field(default_factory=dict)
    steps: Annotated[tuple[AnyStep, ...], Field(min_length=1, max_length=1000)]
    repeat: Annotated[Whole, Field(ge=1, le=10_000)] = 1

    @classmethod
    def parse(cls, data: object) -> Self:
        """Return the job that plain data describes; raises `InvalidJob` with the dotted key of the first error."""
        if not isinstance(data, Mapping):
            raise InvalidJob(key="job", reason=f"it must be a mapping with {', '.join(cls.model_fields)}")
        try:
            return cls.model_validate(dict(data))
        except ValidationError as error:
            raise _refusal(error) from error

    def part_points(self, grasp_height: float) -> dict[str, Point]:
        """Return where the named parts stand at the start [m]; `tasks.starting_parts` adds those on full pallets."""
        return {name: point_of(place, grasp_height) for name, place in self.parts.items()}

    def place_points(self, grasp_height: float) -> dict[str, Point]:
        """Return the named places [m]."""
        return {name: point_of(place, grasp_height) for name, place in self.places.items()}

    @model_validator(mode="after")
    def _sensible(self) -> Self:
        seen: dict[str, str] = {}
        for kind, names in (("part", self.parts), ("place", self.places), ("pallet", self.pallets)):
            for name in sorted(names):
                if name in seen:
                    raise ValueError(f"{name!r} is both a {seen[name]} and a {kind}")
                seen[name] = kind
        if sum(grid.rows * grid.columns for grid in self.pallets.values() if grid.full) > MOST_CELLS:
            raise ValueError(f"more than {MOST_CELLS} parts stand on its full pallets")
        if sum(len(step.do) if isinstance(step, ForEach) else 1 for step in self.steps) * self.repeat > MOST_TASKS:
            raise ValueError(TOO_MANY)
        return self


TOO_MANY = f"steps times repeat is more than {MOST_TASKS}"
"""Why a job is refused that comes to too many tasks."""

_REASONS = {
    "missing": "it is missing",
    "invalid_key": "a key must be a text",
    "dict_type": "it must be a mapping of names to places",
    "tuple_type": "it must be a list",
    "string_type": "it must be a text",
    "string_too_short": "it is empty",
    "string_too_long": "it is longer than 64 letters",
    "too_short": "it is empty",
    "too_long": "it has more than 1000 steps",
    "model_type": "it must be a mapping with corners, rows and columns",
    "bool_type": "it must be true or false",
}


def _refusal(error: ValidationError) -> InvalidJob:
    first = error.errors(include_url=False)[0]
    location = [str(part) for part in first["loc"] if part != "[key]"]
    looped = location[0:1] == ["steps"] and location[2:3] == ["loop"]
    if location[0:1] == ["steps"]:
        del location[2:3]  # pydantic's mark of a step or a loop
    kind, words = first["type"], first["msg"].removeprefix("Value error, ")
    if kind == "too_long" and len(location) == 1 and location != ["steps"]:
        words, kind = f"it has more than {MOST_NAMES} entries", ""
    if kind == "extra_forbidden":
        words = f"there is no such key; known are {', '.join(_known(location, looped=looped))}"
    elif kind == "literal_error":
        words = f"it must be {first.get('ctx', {}).get('expected', 'something else')}, not {repr(first['input'])}"
    elif kind in {"greater_than_equal", "less_than_equal"}:
        words = "it must lie between 1 and 10000"
    return InvalidJob(key=".".join(location) or "job", reason=_REASONS.get(kind, words))


def _known(location: list[str], *, looped: bool) -> tuple[str, ...]:
    if location[0] == "pallets":
        return tuple(JobPallet.model_fields)
    if location[0] != "steps":
        return tuple(Job.model_fields)
    return tuple(ForEach.model_fields) if looped and len(location) == 3 else COMMANDS
