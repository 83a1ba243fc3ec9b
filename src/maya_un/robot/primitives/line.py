"""Line: move straight to a place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from maya_un.robot.primitives.primitive import TARGET, Primitive
from maya_un.values import Point

if TYPE_CHECKING:
    from maya_un.robot.plan_builder import PlanBuilder


@dataclass(frozen=True, slots=True)
class Line(Primitive):
    """Move to `target` [m] in a straight line from the gripper's place; the path may come lower than the parts."""

    command = "line"
    summary = "Go in a straight line to {argument}. Caution: it may hit parts on its way."
    argument = TARGET
    target: Point

    def plan(self, builder: PlanBuilder) -> None:
        """Plan one phase: `line`."""
        builder.straight("line", self.target)
