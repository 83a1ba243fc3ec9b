"""Place: put down the part in the gripper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from maya_un.errors import GripperEmpty
from maya_un.robot.primitives.primitive import GRASP, PartEffect, Primitive
from maya_un.values import GripperState, Point

if TYPE_CHECKING:
    from maya_un.robot.plan_builder import PlanBuilder


@dataclass(frozen=True, slots=True)
class Place(Primitive):
    """Open the gripper at `target` [m], coming from above, and rise by the clearance."""

    command = "place"
    summary = "Put down the held part at {argument}."
    argument = GRASP
    part = PartEffect.PUTS
    target: Point

    def plan(self, builder: PlanBuilder) -> None:
        """Plan the phases `approach`, `down`, `open`, `up`.

        Raises `GripperEmpty` where the gripper is open.
        """
        if builder.pose.gripper is GripperState.OPEN:
            raise GripperEmpty
        above = builder.approach("approach", self.target, down="down")
        builder.grip("open", open_=True)
        builder.straight("up", above)
