"""The declaration of a primitive, from which all edges follow."""

from __future__ import annotations

from abc import ABC, abstractmethod
from enum import Enum, auto
from typing import TYPE_CHECKING, Any, ClassVar

from maya_un.robot.primitives.arguments import NOTHING, Argument

if TYPE_CHECKING:
    from maya_un.robot.plan_builder import PlanBuilder


class PartEffect(Enum):
    """The effect on a part. It decides whether a repetition does harm, and what the gripper holds afterwards."""

    NONE = auto()
    TAKES = auto()
    PUTS = auto()
    SETS_GRIPPER = auto()
    """It opens or closes the gripper, whatever that holds."""


class Primitive(ABC):
    """One primitive. A subclass is a frozen dataclass with at most one field, called as `argument.key`.

    `command` is its name at every edge. `summary` is its help; in it, {argument} stands for what people give. `in_jobs`
    tells whether it may be a step of a job.
    """

    __slots__ = ()
    command: ClassVar[str]
    summary: ClassVar[str]
    argument: ClassVar[Argument] = NOTHING
    part: ClassVar[PartEffect] = PartEffect.NONE
    needs_homing: ClassVar[bool] = True
    in_jobs: ClassVar[bool] = True

    @abstractmethod
    def plan(self, builder: PlanBuilder) -> None:
        """Plan its phases; raises why it cannot be done."""

    @classmethod
    def help(cls, *, names: bool = True, units: bool = False) -> str:
        """Return its help; see `Argument.phrase`."""
        return cls.summary.format(argument=cls.argument.phrase(names=names, units=units))

    @property
    def value(self) -> Any:
        """The argument, None if it has none."""
        return getattr(self, self.argument.key) if self.argument.key else None

    @property
    def words(self) -> str:
        """The primitive and its argument as a label."""
        return " ".join((self.command, *self.argument.words(self.value)))

    @classmethod
    def harmless(cls) -> bool:
        """Tell whether doing it twice does what doing it once does."""
        return cls.part not in {PartEffect.TAKES, PartEffect.PUTS}
