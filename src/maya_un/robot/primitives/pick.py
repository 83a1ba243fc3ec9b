"""Pick: fetch a part from above."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from maya_un.errors import GripperNotEmpty
from maya_un.robot.primitives.primitive import GRASP, PartEffect, Primitive
from maya_un.values import GripperState, Point

if TYPE_CHECKING:
    from maya_un.robot.plan_builder import PlanBuilder


@dataclass(frozen=True, slots=True)
class Pick(Primitive):
    """Close the gripper on the part whose grasp point is `target` [m], and lift it by the clearance."""

    command = "pick"
    summary = "Pick up the part at {argument}."
    argument = GRASP
    part = PartEffect.TAKES
    target: Point

    def plan(self, builder: PlanBuilder) -> None:
        """Plan the phases `open` (unless it is), `approach`, `down`, `close`, `up`.

        Raises `GripperNotEmpty` where the gripper was closed: it may hold something.
        """
        if builder.pose.gripper is GripperState.CLOSED:
            raise GripperNotEmpty
        if builder.pose.gripper is not GripperState.OPEN:
            builder.grip("open", open_=True)
        above = builder.approach("approach", self.target, down="down")
        builder.grip("close", open_=False, grasps=True)
        builder.straight("up", above)
