"""Plans of primitives: their actions, and the builder that primitives use.

The plan of a primitive is computed and checked as a whole before anything moves: actions are added one after the other,
and each path is checked at once.

`PlanningMachine` is the machine for which it plans: a controller, or `controller.planner.OfflineMachine`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice, product
from math import dist, floor, hypot
from typing import NamedTuple, Protocol

from dmc41x3.i18n import phrase
from maya_un.config import Config, Units
from maya_un.controller.homing import homed_pose
from maya_un.controller.protocol import Inspection, Preview, require_output
from maya_un.errors import NotHomed, PathRefused, TrajectoryRefused, Unreachable
from maya_un.kinematics.limits import length_text
from maya_un.kinematics.mechanism import Mechanism
from maya_un.kinematics.workspace import Limit, Reason, Workspace
from maya_un.motion.path import Path, Route
from maya_un.robot.transfer import TransferPlanner
from maya_un.schema.previews import PhasePreview
from maya_un.values import GripperState, Joints, Point


class Pose(NamedTuple):
    """State at the start or end of a primitive: joints (rad, m, m), None before homing; and the gripper."""

    joints: Joints | None
    gripper: GripperState


@dataclass(frozen=True, slots=True)
class HomingAction:
    """Find the switches; its duration depends on the robot's true position, so it is unknown in advance."""

    phase: str
    end: Joints

    @property
    def duration(self) -> None:
        """Always None: the duration is unknown in advance."""
        return None

    def phases(self) -> tuple[PhasePreview, ...]:
        """Return its one phase."""
        return (PhasePreview(self.phase, None),)


@dataclass(frozen=True, slots=True)
class TravelAction:
    """Move along `path` from the robot's position without a stop, at a share `speed` of the limits, as in `preview`.

    `turn` is the number of the via at which a second phase begins, and that phase's name; None for a single phase.
    """

    phase: str
    path: Path
    preview: Preview
    turn: tuple[int, str] | None = None
    speed: float = 1.0

    @property
    def duration(self) -> float:
        """The duration [s]."""
        return self.preview.duration

    def phases(self) -> tuple[PhasePreview, ...]:
        """Return its phases in order."""
        if self.turn is None:
            return (PhasePreview(self.phase, self.duration),)
        via, name = self.turn
        passed = self.preview.vias[via]
        return PhasePreview(self.phase, passed), PhasePreview(name, self.duration - passed)


@dataclass(frozen=True, slots=True)
class GripAction:
    """Open or close the gripper; `duration` is the wait until it has moved [s]. `grasps` a part when it closes."""

    phase: str
    open: bool
    duration: float
    grasps: bool = False

    def phases(self) -> tuple[PhasePreview, ...]:
        """Return its one phase."""
        return (PhasePreview(self.phase, self.duration),)


@dataclass(frozen=True, slots=True)
class OutputAction:
    """Switch a digital output; the controller does so at once."""

    phase: str
    number: int
    on: bool
    duration: float = 0.0

    def phases(self) -> tuple[PhasePreview, ...]:
        """Return its one phase."""
        return (PhasePreview(self.phase, self.duration),)


Action = HomingAction | TravelAction | GripAction | OutputAction


@dataclass(frozen=True, slots=True)
class ActionDetail:
    """An action in detail: its phases, its duration [s] (None for a homing), and its motion, None without one."""

    phases: tuple[PhasePreview, ...]
    duration: float | None
    motion: Inspection | None


@dataclass(frozen=True, slots=True)
class PrimitivePreview:
    """Preview of a primitive.

    `duration` [s] is the sum of the phases, None with a homing among them. `lowest` and `highest` bound the gripper
    point on the way [m], None without travel. `end` is the end pose.
    """

    duration: float | None
    phases: tuple[PhasePreview, ...]
    lowest: float | None
    highest: float | None
    end: Pose


@dataclass(frozen=True, slots=True)
class PrimitivePlan:
    """The actions of one primitive in order, every path in them checked, and the end pose."""

    actions: tuple[Action, ...]
    end: Pose

    def preview(self) -> PrimitivePreview:
        """Return the preview of the plan."""
        travels = [action.preview for action in self.actions if isinstance(action, TravelAction)]
        durations = [action.duration for action in self.actions]
        known = [duration for duration in durations if duration is not None]
        return PrimitivePreview(
            duration=sum(known) if len(known) == len(durations) else None,
            phases=tuple(phase for action in self.actions for phase in action.phases()),
            lowest=min((travel.lowest for travel in travels), default=None),
            highest=max((travel.highest for travel in travels), default=None),
            end=self.end,
        )


class PlanningMachine(Protocol):
    """The machine for planning: a controller, or `controller.planner.OfflineMachine`."""

    @property
    def config(self) -> Config:
        """The machine's constants."""
        ...

    @property
    def mechanism(self) -> Mechanism:
        """Its geometry."""
        ...

    @property
    def workspace(self) -> Workspace:
        """Its workspace."""
        ...

    def preview(self, path: Route, *, speed: float = 1.0) -> Preview:
        """Check and time `path` as a motion would."""
        ...

    def inspect(self, path: Route, *, speed: float = 1.0, samples: int = 200) -> Inspection | None:
        """Return the details of the motion along `path`."""
        ...


_ROUNDS = 200
_SHARES = tuple(0.001 * 2.0**step for step in range(10))


def point_text(point: Point) -> str:
    """Return a point [m] as text."""
    return f"({point.x:.4f}, {point.y:.4f}, {point.z:.4f}) m"


@dataclass(frozen=True, slots=True)
class ApproachTarget:
    """The requirement of a target: the point `clearance` [m] above it is in the workspace.

    With `touched`, the target itself as well.
    """

    workspace: Workspace
    clearance: float
    touched: bool

    def above(self, target: Point) -> Point:
        """Return the approach point of `target`."""
        return target._replace(z=target.z + self.clearance)

    def why_not(self, target: Point) -> Reason | None:
        """Return why `target` [m] or its approach point is not reachable, None if the requirement is met."""
        own = self.workspace.why_not(target) if self.touched else None
        reason = own or self.workspace.why_not(self.above(target))
        if reason is None or reason is own or reason.limit is Limit.NUMBER:
            return reason
        text = phrase(
            "its approach point is {length} higher, and there {reason}",
            length=length_text(self.clearance),
            reason=reason,
        )
        return replace(reason, text=text)

    def candidates(self, target: Point, inside: Point | None) -> Iterator[Point]:
        """Yield reachable targets, the one nearest to `target` first, then deeper and deeper towards `inside`.

        They keep the direction of the boom: only radius and height change towards those of `inside`.
        """
        nearest = self._nearest(target)
        yield from self._in_tenths(nearest)
        if inside is not None:
            ratio = hypot(inside.x, inside.y) / hypot(nearest.x, nearest.y)
            for share in _SHARES:
                stretch, height = 1.0 + (ratio - 1.0) * share, nearest.z + (inside.z - nearest.z) * share
                yield from self._in_tenths(Point(nearest.x * stretch, nearest.y * stretch, height))
        yield nearest

    def _nearest(self, target: Point) -> Point:
        """Return the nearest reachable target: from one of the two points, else by iterating between them."""
        place = self._by_above(target)
        if self.why_not(place) is None:
            return place
        place = self.workspace.nearest(target)
        for _ in range(_ROUNDS):
            if self.why_not(place) is None:
                break
            place = self.workspace.nearest(self._by_above(place))
        return place

    def _by_above(self, target: Point) -> Point:
        nearest = self.workspace.nearest(self.above(target))
        return nearest._replace(z=nearest.z - self.clearance)

    def _in_tenths(self, point: Point) -> Iterator[Point]:
        """Yield the nearest reachable target in whole tenths of a millimetre beside `point`, as its text shows it."""
        steps = [[(floor(value * 1e4) + step) / 1e4 for step in (-1, 0, 1, 2)] for value in point]
        beside = sorted((Point(*place) for place in product(*steps)), key=lambda place: dist(place, point))
        yield from islice((place for place in beside if self.why_not(place) is None), 1)


class PlanBuilder:
    """Collects the actions of one primitive; `pose` is the robot's pose after the actions added so far.

    `speed` is the share of the limits at which it travels.

    Every method that travels raises `NotHomed`, `Unreachable` or `PathRefused`; nothing is ever sent.
    """

    def __init__(self, ground: PlanningMachine, pose: Pose, speed: float = 1.0) -> None:
        self._ground = ground
        self._speed = speed
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
        """Move to the cell's clearance above `target`, and return that point; with `down`, continue to `target` itself.

        The path stays above the clearance over target and parts, except straight above start and target. `down` is the
        phase that begins above the target; the motion does not stop there. Errors name `target`.
        """
        approach_target = ApproachTarget(self._ground.workspace, self._config.cell.clearance, touched=down is not None)
        reason = approach_target.why_not(target)
        if reason is not None:
            raise self._unreachable(approach_target, target, reason)
        try:
            self._go_above(phase, approach_target, target, down)
        except (PathRefused, Unreachable) as refusal:
            raise PathRefused(target=point_text(target), reason=refusal.reason) from refusal
        return approach_target.above(target)

    def _go_above(self, phase: str, approach_target: ApproachTarget, target: Point, down: str | None) -> None:
        cell, above = self._config.cell, approach_target.above(target)
        transfer_height = max(above.z, cell.grasp_height + cell.clearance)
        goal = self._ground.workspace.require(above if down is None else target)
        planner = TransferPlanner(self._config, self._ground.mechanism, smooth=cell.smooth)
        transfer = planner.plan(self._preview, self.here(), goal, transfer_height)
        turn = None if down is None or transfer.arrival is None else (transfer.arrival, down)
        only = down if down is not None and transfer.arrival is None else phase
        self._travel(only, transfer.path, transfer.preview, turn)

    def _unreachable(self, approach_target: ApproachTarget, target: Point, reason: Reason) -> Unreachable:
        """Return the error for `target`; it names the nearest place to which a plan leads."""
        inside = None
        if self.pose.joints is not None:
            here = self._ground.mechanism.fk(self.pose.joints)
            inside = here._replace(z=here.z - approach_target.clearance)
        places = list(approach_target.candidates(target, inside))
        nearest = next((place for place in places if self._leads_to(approach_target, place)), places[0])
        return Unreachable(
            target=point_text(target),
            reason=str(reason),
            nearest=point_text(nearest),
            limit=str(reason.limit),
            excess=reason.excess,
            nearest_point=tuple(nearest),
        )

    def _leads_to(self, approach_target: ApproachTarget, target: Point) -> bool:
        """Return whether a plan leads to `target`, and straight up again from one that is touched.

        True before homing, because the start is unknown.
        """
        if self.pose.joints is None:
            return True
        trial = PlanBuilder(self._ground, self.pose, self._speed)
        try:
            trial._go_above("", approach_target, target, "" if approach_target.touched else None)
            if approach_target.touched:
                trial.straight("", approach_target.above(target))
        except (PathRefused, Unreachable, TrajectoryRefused):
            return False
        return True

    def straight(self, phase: str, target: Point) -> None:
        """Move to `target` in a straight line."""
        self._ground.workspace.require(target)
        self._go(phase, Path.line(self._ground.mechanism.fk(self.here()), target))

    def joints(self, phase: str, target: Joints) -> None:
        """Move to `target` (rad, m, m), straight in joint space."""
        self._go(phase, Path.joints(self.here(), target))

    def _go(self, phase: str, path: Path) -> None:
        self._travel(phase, path, self._preview(path))

    def _preview(self, path: Route) -> Preview:
        return self._ground.preview(path, speed=self._speed)

    def grip(self, phase: str, *, open_: bool, grasps: bool = False) -> None:
        """Open or close the gripper."""
        self._actions.append(GripAction(phase, open_, self._config.gripper.settle_time, grasps))
        self.pose = self.pose._replace(gripper=GripperState.OPEN if open_ else GripperState.CLOSED)

    def output(self, phase: str, number: int, *, on: bool) -> None:
        """Switch a digital output that `controller.outputs` lists; raises `InvalidValue` for others."""
        require_output(self._config, number)
        self._actions.append(OutputAction(phase, number, on))

    def here(self) -> Joints:
        """Return the joints of the pose; raises `NotHomed` before homing."""
        if self.pose.joints is None:
            raise NotHomed(command=self._config.homing_command)
        return self.pose.joints

    def _travel(self, phase: str, path: Path, preview: Preview, turn: tuple[int, str] | None = None) -> None:
        if preview.duration > 0.0:
            self._actions.append(TravelAction(phase, path, preview, turn, self._speed))
        self.pose = self.pose._replace(joints=preview.end)
