"""The drawing board of the skills: draws actions one after the other from a pose, checks each path at once."""

from __future__ import annotations

from collections.abc import Sequence

from maya_un.config import Units
from maya_un.controller.homing import homed_pose
from maya_un.controller.protocol import Controller, Preview
from maya_un.errors import NotHomed, PathRefused, Unreachable
from maya_un.robot.crossing import cross
from maya_un.robot.jaws import Jaws
from maya_un.robot.plan import Action, Grip, Homing, Plan, Pose, Travel
from maya_un.robot.target import require_above, text
from maya_un.values import Joints, Point


class Sketch:
    """Collects the actions of one primitive; `pose` is where the robot will be after those drawn so far.

    Every method that travels raises `NotHomed`, `Unreachable` or `PathRefused`; nothing is ever sent.
    """

    def __init__(self, controller: Controller, pose: Pose) -> None:
        self._controller = controller
        self._config = controller.config
        self._actions: list[Action] = []
        self.pose = pose

    def plan(self) -> Plan:
        """Return what has been drawn."""
        return Plan(tuple(self._actions), self.pose)

    def home(self, phase: str) -> None:
        """Find the switches; ends at the homed pose, in whole counts."""
        units = Units.of(self._config)
        end = units.to_joints(units.to_counts(homed_pose(self._config)))
        self._actions.append(Homing(phase, end))
        self.pose = self.pose._replace(joints=end)

    def approach(self, phase: str, target: Point, *, touched: bool = True) -> Point:
        """Go to the cell's clearance above `target`, and return that point.

        On the way never lower than it and never lower than the clearance above the parts. Whatever is refused is
        refused by the name of `target`; with `touched`, also where the target itself is out of reach.
        """
        cell, workspace = self._config.cell, self._controller.workspace
        above = require_above(workspace, target, cell.clearance, touched=touched)
        floor, start, goal = max(above.z, cell.grasp_height + cell.clearance), self.here(), workspace.require(above)
        try:
            way, preview = cross(self._controller.mechanism, self._controller.preview, start, goal, floor)
        except (PathRefused, Unreachable) as refusal:
            raise PathRefused(target=text(target), reason=refusal.details["reason"]) from refusal
        self._travel(phase, way, preview)
        return above

    def straight(self, phase: str, target: Point) -> None:
        """Go to `target`, straight in joint space: near vertical where it is just above or below."""
        self.joints(phase, self._controller.workspace.require(target))

    def joints(self, phase: str, target: Joints) -> None:
        """Go to `target` (rad, m, m), straight in joint space."""
        way = (self.here(), target)
        self._travel(phase, way, self._controller.preview(way))

    def grip(self, phase: str, *, open_: bool, grasps: bool = False) -> None:
        """Open or close the gripper."""
        self._actions.append(Grip(phase, open_, self._config.gripper.settle_time, grasps))
        self.pose = self.pose._replace(jaws=Jaws.OPEN if open_ else Jaws.CLOSED)

    def here(self) -> Joints:
        """Return the joints of the pose; raises `NotHomed` where they are not known."""
        if self.pose.joints is None:
            raise NotHomed
        return self.pose.joints

    def _travel(self, phase: str, way: Sequence[Joints], preview: Preview) -> None:
        if preview.duration > 0.0:
            self._actions.append(Travel(phase, tuple(way), preview))
        self.pose = self.pose._replace(joints=preview.end)
