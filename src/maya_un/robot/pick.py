"""Pick: fetch a part from above."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from maya_un.errors import GripperNotEmpty
from maya_un.robot.jaws import Jaws
from maya_un.robot.sketch import Sketch
from maya_un.values import Point


@dataclass(frozen=True, slots=True)
class Pick:
    """Close the gripper on the part whose grasp point is `target` [m], and lift it by the clearance."""

    command: ClassVar[str] = "pick"
    target: Point

    def draw(self, sketch: Sketch) -> None:
        """Draw the phases `open` (unless it is), `approach`, `down`, `close`, `up`.

        Raises `GripperNotEmpty` where the gripper was closed: it may hold something.
        """
        if sketch.pose.jaws is Jaws.CLOSED:
            raise GripperNotEmpty
        if sketch.pose.jaws is not Jaws.OPEN:
            sketch.grip("open", open_=True)
        above = sketch.approach("approach", self.target, down="down")
        sketch.grip("close", open_=False, grasps=True)
        sketch.straight("up", above)
