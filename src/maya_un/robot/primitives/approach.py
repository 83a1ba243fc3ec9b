"""Approach: move above a place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from maya_un.robot.primitives.primitive import TARGET, Primitive
from maya_un.values import Point

if TYPE_CHECKING:
    from maya_un.robot.plan_builder import PlanBuilder


@dataclass(frozen=True, slots=True)
class Approach(Primitive):
    """Move to the cell's clearance above `target` [m], across the table without coming low."""

    command = "approach"
    summary = "Go to a point above {argument}, by cell.clearance of the configuration."
    argument = TARGET
    target: Point

    def plan(self, builder: PlanBuilder) -> None:
        """Plan one phase: `approach`."""
        builder.approach("approach", self.target)
