"""Pick: fetch a part from above."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from maya_un.errors import GripperNotEmpty
from maya_un.robot.jaws import Jaws
from maya_un.robot.primitives.arguments import GRASP
from maya_un.robot.primitives.primitive import PartEffect, Primitive
from maya_un.values import Point

if TYPE_CHECKING:
    from maya_un.robot.sketch import Sketch


@dataclass(frozen=True, slots=True)
class Pick(Primitive):
    """Close the gripper on the part whose grasp point is `target` [m], and lift it by the clearance."""

    command = "pick"
    summary = "Pick up the part at {argument}."
    argument = GRASP
    part = PartEffect.TAKES
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
