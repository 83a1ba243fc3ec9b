"""Can teleop: check whether the robot accepts a command."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from maya_un.robot.primitives.primitive import Primitive

if TYPE_CHECKING:
    from maya_un.robot.plan_builder import PlanBuilder


@dataclass(frozen=True, slots=True)
class CanTeleop(Primitive):
    """Do nothing; succeeds if the robot is homed and not moving, and else raises the reason."""

    command = "can_teleop"
    summary = "Tell whether the robot is ready for a command; nothing moves."
    in_jobs = False
    travels = False

    def plan(self, builder: PlanBuilder) -> None:
        """Plan nothing; raises `NotHomed` if the pose is unknown."""
        builder.here()
