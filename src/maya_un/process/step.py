"""Steps of a job as people write them, and the loop over the cells of a pallet."""

from __future__ import annotations

from collections.abc import Mapping
from reprlib import repr
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator

from maya_un.process.spots import Goal, Name, Spot

COMMANDS = ("home", "pick", "place", "approach", "line", "gripper", "move")
"""What a step may be, besides a loop."""


class Step(BaseModel):
    """One step: exactly one of its keys is set.

    A name in `pick`, `place`, `approach`, `line` is a part, a place, a cell of a pallet like `tray[1,2]` or a taught
    pose; one in `move` a taught pose.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    home: Literal[True] | None = None
    pick: Spot | None = None
    place: Spot | None = None
    approach: Spot | None = None
    line: Spot | None = None
    gripper: Literal["open", "close"] | None = None
    move: Goal | None = None

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


class ForEach(BaseModel):
    """The steps of `do` for every cell of a pallet, row by row; in them `tray[each]` is that cell.

    `for_each` names the pallet, or cells of it: `tray`, `tray[2,*]` for a row, `tray[*,1]` for a column.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    for_each: Name
    do: Annotated[tuple[Step, ...], Field(min_length=1, max_length=1000)]


def _kind(data: object) -> str:
    return "loop" if isinstance(data, ForEach) or (isinstance(data, Mapping) and "for_each" in data) else "step"


AnyStep = Annotated[Annotated[Step, Tag("step")] | Annotated[ForEach, Tag("loop")], Discriminator(_kind)]
"""A step or a loop; pydantic names which in the place of an error."""
