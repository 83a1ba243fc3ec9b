"""Line: go straight to a place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from maya_un.robot.sketch import Sketch
from maya_un.values import Point


@dataclass(frozen=True, slots=True)
class Line:
    """Go to `target` [m] in a straight line from wherever the gripper is: nothing keeps it above the parts."""

    command: ClassVar[str] = "line"
    target: Point

    def draw(self, sketch: Sketch) -> None:
        """Draw one phase: `line`."""
        sketch.straight("line", self.target)
