"""Can teleop: ask whether the robot can take a wish."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from maya_un.robot.sketch import Sketch


@dataclass(frozen=True, slots=True)
class CanTeleop:
    """Do nothing; succeeds where the robot is homed and not moving, and is refused with the reason otherwise."""

    command: ClassVar[str] = "can_teleop"

    def draw(self, sketch: Sketch) -> None:
        """Draw nothing; raises `NotHomed` where the pose is not known."""
        sketch.here()
