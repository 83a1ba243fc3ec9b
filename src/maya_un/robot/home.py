"""Home: find the switches, so that the counts mean lengths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from maya_un.robot.sketch import Sketch


@dataclass(frozen=True, slots=True)
class Home:
    """Home all axes, from wherever the robot is. The gripper stays as it is."""

    command: ClassVar[str] = "home"

    def draw(self, sketch: Sketch) -> None:
        """Draw one phase: `home`."""
        sketch.home("home")
