"""Move: go to joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from maya_un.robot.sketch import Sketch
from maya_un.values import Joints


@dataclass(frozen=True, slots=True)
class MoveJoints:
    """Go to `joints` (rad, m, m), straight in joint space: the way sags, and nothing keeps it above the parts."""

    command: ClassVar[str] = "move"
    joints: Joints

    def draw(self, sketch: Sketch) -> None:
        """Draw one phase: `move`."""
        sketch.joints("move", self.joints)
