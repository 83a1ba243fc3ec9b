"""Move: move to joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from maya_un.robot.primitives.primitive import JOINTS, Primitive
from maya_un.values import Joints

if TYPE_CHECKING:
    from maya_un.robot.plan_builder import PlanBuilder


@dataclass(frozen=True, slots=True)
class MoveJoints(Primitive):
    """Move to `joints` (rad, m, m), straight in joint space: the path sags, and may come lower than the parts."""

    command = "move"
    summary = "Go to {argument}, in a straight line in joint space. It may hit parts."
    argument = JOINTS
    joints: Joints

    def plan(self, builder: PlanBuilder) -> None:
        """Plan one phase: `move`."""
        builder.joints("move", self.joints)
