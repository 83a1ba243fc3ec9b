"""Gripper: open or close it where it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from maya_un.robot.sketch import Sketch


@dataclass(frozen=True, slots=True)
class Gripper:
    """Bring the gripper to a state: open where `open` is true, closed otherwise. Needs no homing."""

    command: ClassVar[str] = "gripper"
    open: bool

    def draw(self, sketch: Sketch) -> None:
        """Draw one phase: `open` or `close`."""
        sketch.grip("open" if self.open else "close", open_=self.open)
