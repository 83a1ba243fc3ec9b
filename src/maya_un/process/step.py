"""Steps of a job as people write them, and the loop over the cells of a pallet."""

from __future__ import annotations

from collections.abc import Mapping
from reprlib import repr
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, create_model, model_validator

from maya_un.process.spots import Goal, Name, Spot
from maya_un.robot.primitives import PRIMITIVES
from maya_un.robot.primitives.arguments import Argument, JointTarget, Switch, Target

COMMANDS = tuple(name for name, primitive in PRIMITIVES.items() if primitive.in_jobs)
"""The kinds of steps, besides a loop."""

BARE = frozenset(name for name in COMMANDS if not PRIMITIVES[name].argument.key)
"""Steps that may be written as a word alone."""


class _Step(BaseModel):
    """One step: exactly one of its keys is set.

    The place of a primitive may be a name: of a part, a place, a cell of a pallet like `tray[1,2]` or a taught pose.
    Joints may be the name of a taught pose.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    @property
    def command(self) -> str:
        """Which of the keys is set."""
        return next(iter(self.model_fields_set))

    @property
    def argument(self) -> Any:
        """The value of the key."""
        return getattr(self, self.command)

    def __str__(self) -> str:
        argument = self.argument
        if argument is True:
            return self.command
        shown = argument if isinstance(argument, str) else " ".join(f"{number:g}" for number in argument)
        return f"{self.command} {shown}"

    @model_validator(mode="before")
    @classmethod
    def _one_command(cls, data: object) -> object:
        if isinstance(data, str) and data in BARE:
            return {data: True}
        if not isinstance(data, Mapping) or len(data) != 1:
            raise ValueError(f"a step is one of {', '.join(COMMANDS)}, like `pick: cube`, not {repr(data)}")
        ((command, argument),) = data.items()
        if argument is None and command in BARE:
            return {command: True}
        if argument is None and command in COMMANDS:
            raise ValueError(f"{command} needs a value")
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
        **{name: (_type_of(PRIMITIVES[name].argument) | None, None) for name in COMMANDS},
    )


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
