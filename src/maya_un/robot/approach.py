"""Approach: wait above a place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from maya_un.robot.sketch import Sketch
from maya_un.values import Point


@dataclass(frozen=True, slots=True)
class Approach:
    """Go to the cell's clearance above `target` [m], across the table without coming low."""

    command: ClassVar[str] = "approach"
    target: Point

    def draw(self, sketch: Sketch) -> None:
        """Draw one phase: `approach`."""
        sketch.approach("approach", self.target)
