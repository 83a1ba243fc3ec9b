"""Home: find the switches, so that the counts define lengths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from maya_un.robot.primitives.primitive import Primitive

if TYPE_CHECKING:
    from maya_un.robot.plan_builder import PlanBuilder


@dataclass(frozen=True, slots=True)
class Home(Primitive):
    """Home all axes, from any start. The gripper keeps its state."""

    command = "home"
    summary = "Find the limit switches, so that the position is known."
    needs_homing = False
    travels = False

    def plan(self, builder: PlanBuilder) -> None:
        """Plan one phase: `home`."""
        builder.home("home")
