"""Builds the plan of a primitive: adds its actions one after the other, and checks each path at once."""

from __future__ import annotations

from maya_un.config import Units
from maya_un.controller.homing import homed_pose
from maya_un.controller.protocol import Preview
from maya_un.errors import NotHomed, PathRefused, TrajectoryRefused, Unreachable
from maya_un.kinematics.workspace import Reason
from maya_un.motion.path import Path
from maya_un.robot.gripper_state import GripperState
from maya_un.robot.ground import PlanningMachine
from maya_un.robot.plan import Action, GripAction, HomingAction, Pose, PrimitivePlan, TravelAction
from maya_un.robot.target import ApproachTarget, text
from maya_un.robot.transfer import TransferPlanner
from maya_un.values import Joints, Point


class PlanBuilder:
    """Collects the actions of one primitive; `pose` is where the robot will be after those added so far.

    Every method that travels raises `NotHomed`, `Unreachable` or `PathRefused`; nothing is ever sent.
    """

    def __init__(self, ground: PlanningMachine, pose: Pose) -> None:
        self._ground = ground
        self._config = ground.config
        self._actions: list[Action] = []
        self.pose = pose

    def build(self) -> PrimitivePlan:
        """Return the plan."""
        return PrimitivePlan(tuple(self._actions), self.pose)

    def home(self, phase: str) -> None:
        """Find the switches; ends at the homed pose, in whole counts."""
        units = Units.of(self._config)
        end = units.to_joints(units.to_counts(homed_pose(self._config)))
        self._actions.append(HomingAction(phase, end))
        self.pose = self.pose._replace(joints=end)

    def approach(self, phase: str, target: Point, down: str | None = None) -> Point:
        """Go to the cell's clearance above `target`, and return that point; with `down`, on to `target` itself.

        The path stays above the clearance over target and parts, except straight above start and target. `down` is the
        phase that begins above the target; the motion does not stop there. Refusals name `target`.
        """
        approach_target = ApproachTarget(self._ground.workspace, self._config.cell.clearance, touched=down is not None)
        reason = approach_target.why_not(target)
        if reason is not None:
            raise self._unreachable(approach_target, target, reason)
        try:
            self._go_above(phase, approach_target, target, down)
        except (PathRefused, Unreachable) as refusal:
            raise PathRefused(target=text(target), reason=refusal.details["reason"]) from refusal
        return approach_target.above(target)

    def _go_above(self, phase: str, approach_target: ApproachTarget, target: Point, down: str | None) -> None:
        cell, above = self._config.cell, approach_target.above(target)
        floor = max(above.z, cell.grasp_height + cell.clearance)
        goal = self._ground.workspace.require(above if down is None else target)
        planner = TransferPlanner(self._config, self._ground.mechanism, smooth=cell.smooth)
        transfer = planner.plan(self._ground.preview, self.here(), goal, floor)
        turn = None if down is None or transfer.arrival is None else (transfer.arrival, down)
        only = down if down is not None and transfer.arrival is None else phase
        self._travel(only, transfer.path, transfer.preview, turn)

    def _unreachable(self, approach_target: ApproachTarget, target: Point, reason: Reason) -> Unreachable:
        """Return the refusal of `target`; the nearest place it names is one that is not refused in its turn."""
        inside = None
        if self.pose.joints is not None:
            here = self._ground.mechanism.fk(self.pose.joints)
            inside = here._replace(z=here.z - approach_target.clearance)
        places = list(approach_target.candidates(target, inside))
        nearest = next((place for place in places if self._leads_to(approach_target, place)), places[0])
        return Unreachable(
            target=text(target),
            reason=str(reason),
            nearest=text(nearest),
            limit=str(reason.limit),
            excess=reason.excess,
            nearest_point=tuple(nearest),
        )

    def _leads_to(self, approach_target: ApproachTarget, target: Point) -> bool:
        """Return whether a plan leads to `target`; true before homing, because nobody knows."""
        if self.pose.joints is None:
            return True
        trial = PlanBuilder(self._ground, self.pose)
        try:
            trial._go_above("", approach_target, target, "" if approach_target.touched else None)
        except (PathRefused, Unreachable, TrajectoryRefused):
            return False
        return True

    def straight(self, phase: str, target: Point) -> None:
        """Go to `target` in a straight line."""
        self._ground.workspace.require(target)
        self._go(phase, Path.line(self._ground.mechanism.fk(self.here()), target))

    def joints(self, phase: str, target: Joints) -> None:
        """Go to `target` (rad, m, m), straight in joint space."""
        self._go(phase, Path.joints(self.here(), target))

    def _go(self, phase: str, path: Path) -> None:
        self._travel(phase, path, self._ground.preview(path))

    def grip(self, phase: str, *, open_: bool, grasps: bool = False) -> None:
        """Open or close the gripper."""
        self._actions.append(GripAction(phase, open_, self._config.gripper.settle_time, grasps))
        self.pose = self.pose._replace(gripper=GripperState.OPEN if open_ else GripperState.CLOSED)

    def here(self) -> Joints:
        """Return the joints of the pose; raises `NotHomed` where they are not known."""
        if self.pose.joints is None:
            raise NotHomed
        return self.pose.joints

    def _travel(self, phase: str, path: Path, preview: Preview, turn: tuple[int, str] | None = None) -> None:
        if preview.duration > 0.0:
            self._actions.append(TravelAction(phase, path, preview, turn))
        self.pose = self.pose._replace(joints=preview.end)
