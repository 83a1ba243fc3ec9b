"""Gripper: open or close it at its present place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from maya_un.robot.primitives.primitive import OPEN, PartEffect, Primitive

if TYPE_CHECKING:
    from maya_un.robot.plan_builder import PlanBuilder


@dataclass(frozen=True, slots=True)
class Gripper(Primitive):
    """Open the gripper if `open` is true, else close it. Needs no homing."""

    command = "gripper"
    summary = "Open or close the gripper."
    argument = OPEN
    part = PartEffect.SETS_GRIPPER
    needs_homing = False
    travels = False
    open: bool

    def plan(self, builder: PlanBuilder) -> None:
        """Plan one phase: `open` or `close`."""
        builder.grip("open" if self.open else "close", open_=self.open)
