"""The robot layer: it plans primitives, caches recent plans, and executes them by the controller layer.

Cached plans of primitives: a job runs the plan that it previewed, computed once.

In a worker (`maya_un.workers`) plans are computed on the planner of the controller layer (`controller.planner`).

The robot layer runs one primitive at a time, planned and checked as a whole before anything moves.

`Robot` is the interface for the layers above. `PlanningRobot` is shared with the client across a ROS graph.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from typing import Protocol

import numpy as np

from maya_un.config import Config
from maya_un.controller.planner import OWN, START_TOLERANCE, drawer
from maya_un.controller.protocol import Controller
from maya_un.errors import Busy, Faulted, NotConnected, NotHomed, PathRefused, Stopped, TrajectoryRefused, Unreachable
from maya_un.events import PhaseBegun
from maya_un.kinematics.workspace import Workspace
from maya_un.robot.gripper import GripperTracker
from maya_un.robot.plan_builder import (
    Action,
    ActionDetail,
    GripAction,
    HomingAction,
    OutputAction,
    PlanBuilder,
    PlanningMachine,
    Pose,
    PrimitivePlan,
    PrimitivePreview,
    TravelAction,
)
from maya_un.robot.primitives import Primitive
from maya_un.values import Mode, Point
from maya_un.workers import Workers

_REMEMBERED = 4096


class Plans:
    """Computes plans on `ground`, and caches them by primitive and start."""

    def __init__(self, ground: PlanningMachine) -> None:
        self._ground = ground
        self._plans: dict[tuple[Primitive, Pose, float], tuple[PrimitivePlan, Workspace]] = {}

    @property
    def config(self) -> Config:
        """The machine's constants."""
        return self._ground.config

    def plan(self, primitive: Primitive, start: Pose, speed: float = 1.0) -> PrimitivePlan:
        """Return the plan at a share `speed` of the limits, cached or new.

        A plan cached in another workspace is reused only if it is unchanged in this one. Raises the errors of
        `Robot.preview`.
        """
        workspace = self._ground.workspace
        known = self._plans.get((primitive, start, speed))
        if known is not None and (known[1] is workspace or self._holds(known[0])):
            plan = known[0]
        else:
            builder = PlanBuilder(self._ground, start, speed)
            primitive.plan(builder)
            plan = builder.build()
        if len(self._plans) >= _REMEMBERED:
            self._plans.clear()
        self._plans[primitive, start, speed] = (plan, workspace)
        return plan

    def preview(self, primitive: Primitive, start: Pose, speed: float = 1.0) -> PrimitivePreview:
        """Return the preview of `primitive` from `start`; raises as `plan` does."""
        return self.plan(primitive, start, speed).preview()

    def inspect(
        self, primitive: Primitive, start: Pose, samples: int = 200, speed: float = 1.0
    ) -> tuple[list[ActionDetail], Pose]:
        """Return the details of every action of `primitive` from `start`, and its end pose; raises as `plan` does.

        Every motion has `samples` samples.
        """
        plan = self.plan(primitive, start, speed)
        details: list[ActionDetail] = []
        for action in plan.actions:
            motion = (
                self._ground.inspect(action.path, speed=action.speed, samples=samples)
                if isinstance(action, TravelAction)
                else None
            )
            details.append(ActionDetail(action.phases(), action.duration, motion))
        return details, plan.end

    def _holds(self, plan: PrimitivePlan) -> bool:
        """Return whether `plan` is unchanged in this workspace: homing measures strokes, and zones lower speeds."""
        travels = [action for action in plan.actions if isinstance(action, TravelAction)]
        try:
            return all(self._ground.preview(travel.path, speed=travel.speed) == travel.preview for travel in travels)
        except (Unreachable, PathRefused, TrajectoryRefused):
            return False


def on_paper(workspace: Workspace) -> Plans:
    """Return the plans of this worker for a workspace."""
    return drawer().on(workspace, Plans)


def plan(
    workspace: Workspace, primitive: Primitive, start: Pose, speed: float = 1.0
) -> Generator[None, None, PrimitivePlan]:
    """Return the plan of a primitive in a worker; raises as `Plans.plan` does."""
    yield
    return on_paper(workspace).plan(primitive, start, speed)


def gripper_path(workspace: Workspace, found: PrimitivePlan, most: int) -> tuple[Point, ...]:
    """Return at most `most` points of the gripper [m] on the path of a plan: the ends of its motions, and others.

    The others have equal distances. It is computed in a worker.
    """
    planner, travels = drawer().planner, [action for action in found.actions if isinstance(action, TravelAction)]
    if not travels:
        return ()
    knots = [planner.plan(workspace, travel.path, 1.0).knots for travel in travels]
    points = workspace.mechanism.fk_many(np.concatenate(knots))
    way = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    ends = way[np.cumsum([len(part) for part in knots]) - 1][: most // 2]
    ways = np.union1d(ends, np.linspace(0.0, way[-1], most - len(ends)))
    return tuple(Point(*row) for row in np.column_stack([np.interp(ways, way, axis) for axis in points.T]).tolist())


OnPhase = Callable[[str], None]
"""Called with the name of each phase as it begins."""


class Robot(Protocol):
    """The skills of Maya: one primitive at a time, planned and checked as a whole before anything moves."""

    @property
    def config(self) -> Config:
        """The machine's constants."""
        ...

    @property
    def pose(self) -> Pose:
        """The present pose; its joints are None before homing."""
        ...

    @property
    def can_teleop(self) -> bool:
        """Whether the robot accepts a command: homed, not moving, not in use by another client."""
        ...

    @property
    def holding(self) -> bool | None:
        """Whether the gripper holds a part, None if unknown; no sensor measures it."""
        ...

    def seen(self, *, holding: bool) -> None:
        """Store a user's answer whether the closed gripper holds a part, until it is opened or closed again."""
        ...

    def preview(self, primitive: Primitive, start: Pose, speed: float = 1.0) -> PrimitivePreview:
        """Return the preview of `primitive` from `start`, at a share `speed` of the limits; sends nothing.

        Raises the errors of `run`: `Unreachable`, `PathRefused`, `NotHomed`, `GripperNotEmpty` or `GripperEmpty`.
        """
        ...

    def inspect(
        self, primitive: Primitive, start: Pose, samples: int = 200, speed: float = 1.0
    ) -> tuple[list[ActionDetail], Pose]:
        """Return the details of every action of `primitive` from `start`, and its end pose; raises as `preview`.

        Every motion has `samples` samples.
        """
        ...

    async def run(self, primitive: Primitive, on_phase: OnPhase | None = None, speed: float = 1.0) -> None:
        """Do `primitive` and return when it is done; every phase emits an event and calls `on_phase`.

        It travels at a share `speed` of the limits, above 0 up to 1, which multiplies with the speed override. An error
        before the start moves nothing. Raises `NotConnected`, `Faulted`, `NotHomed`, `Busy`, the errors of
        `preview`, and `Stopped` or a `MachineError` if the motion ended early. Cancelling it stops on the path; the
        gripper keeps its state.
        """
        ...


class PlanningRobot:
    """Returns the pose, the content of the gripper and previews of primitives; serializes primitives.

    The subclass runs the plan (`protocol.Robot`). `workers` compute plans that are about to run; without workers this
    process does.
    """

    def __init__(self, controller: Controller, config: Config, workers: Workers | None = None) -> None:
        self._controller = controller
        self._workers = workers
        self._memory = GripperTracker(controller.events)
        self._running: Primitive | None = None
        self._plans = Plans(controller)
        self.config = config

    @property
    def running(self) -> Primitive | None:
        """The primitive that this object runs now, None without one."""
        return self._running

    @property
    def pose(self) -> Pose:
        """The present pose; its joints are None before homing."""
        state = self._controller.state
        return Pose(state.joints if state.homed else None, self._memory.state(state))

    @property
    def can_teleop(self) -> bool:
        """Whether the robot accepts a command: homed, not moving, and no primitive runs here."""
        state = self._controller.state
        return state.mode is Mode.IDLE and state.homed and self._running is None

    @property
    def holding(self) -> bool | None:
        """Whether the gripper holds a part: True after a pick, False when open, None when closed for other reasons.

        No sensor measures it; it follows from the commands that were executed, or from a user's answer.
        """
        return self._memory.holding(self._controller.state)

    def seen(self, *, holding: bool) -> None:
        """Store a user's answer whether the closed gripper holds a part, until it is opened or closed again."""
        self._memory.seen(holding=holding)

    def preview(self, primitive: Primitive, start: Pose, speed: float = 1.0) -> PrimitivePreview:
        """Return the preview of `primitive` from `start`, at a share `speed` of the limits; sends nothing.

        Raises the errors of `run` for its target, its path and the gripper: `Unreachable`, `PathRefused`, `NotHomed`,
        `GripperNotEmpty`, `GripperEmpty`.
        """
        return self._plans.preview(primitive, start, speed)

    def inspect(
        self, primitive: Primitive, start: Pose, samples: int = 200, speed: float = 1.0
    ) -> tuple[list[ActionDetail], Pose]:
        """Return the details of every action of `primitive` from `start`, and its end pose; raises as `preview` does.

        Every motion has `samples` samples.
        """
        return self._plans.inspect(primitive, start, samples, speed)

    @contextmanager
    def _turn(self, primitive: Primitive) -> Iterator[None]:
        """Mark `primitive` as the running one for the block; raises `Busy` if another runs."""
        if self._running is not None:
            raise Busy(doing=self._running.command)
        self._running = primitive
        try:
            yield
        finally:
            self._running = None

    def _enter(self, phase: str, primitive: Primitive, on_phase: OnPhase | None) -> None:
        """Emit the event that a phase begins, and call `on_phase`."""
        self._controller.events.emit(PhaseBegun(phase, primitive.command))
        if on_phase is not None:
            on_phase(phase)

    async def _planned(self, primitive: Primitive, speed: float = 1.0) -> PrimitivePlan:
        """Return the plan from the robot's position, which has not moved meanwhile; raises as `preview`.

        A worker takes some time: raises `Stopped` if a stop comes meanwhile. A difference that a motion may begin with
        is no motion: the encoders of a robot at rest are never quite still.
        """
        if self._workers is None:
            return self._plans.plan(primitive, self.pose, speed)
        stops = self._controller.stops
        while True:
            start, workspace = self.pose, self._controller.workspace
            planned = await self._workers.run(plan, workspace, primitive, start, speed, whose=OWN)
            if self._controller.stops != stops:
                raise Stopped
            if workspace == self._controller.workspace and _is_near(start, self.pose):
                return planned.value


def _is_near(one: Pose, other: Pose) -> bool:
    """Return whether a motion that was planned from `one` may begin at `other`."""
    if one.joints is None or other.joints is None:
        return one == other
    ways = zip(one.joints, other.joints, START_TOLERANCE, strict=True)
    return one.gripper == other.gripper and all(abs(was - now) <= most for was, now, most in ways)


class MayaRobot(PlanningRobot):
    """Runs primitives on a controller; see `protocol.Robot`."""

    async def run(self, primitive: Primitive, on_phase: OnPhase | None = None, speed: float = 1.0) -> None:
        """Do `primitive` and return when it is done; every phase emits an event and calls `on_phase`.

        It travels at a share `speed` of the limits, which multiplies with the speed override. The primitive is checked
        as a whole first: an error before the start has moved and sent nothing. Raises `NotConnected`, `Faulted`,
        `NotHomed`, `Busy`, the errors of `preview`, and `Stopped` or a `MachineError` if it ended early. Cancelling it
        stops on the path; the gripper keeps its state.
        """
        with self._turn(primitive):
            self._require_ready(primitive)
            plan = await self._planned(primitive, speed)
            self._require_ready(primitive)
            for action in plan.actions:
                await self._do(action, lambda phase: self._enter(phase, primitive, on_phase))

    def _require_ready(self, primitive: Primitive) -> None:
        state = self._controller.state
        match state.mode:
            case Mode.DISCONNECTED:
                raise NotConnected
            case Mode.FAULT:
                raise Faulted(fault=state.fault.message if state.fault else "")
            case Mode.HOMING | Mode.MOVING | Mode.STOPPING:
                raise Busy(doing=state.mode.value)
            case Mode.NOT_HOMED if primitive.needs_homing:
                raise NotHomed(command=self._controller.config.homing_command)
            case Mode.NOT_HOMED | Mode.IDLE | Mode.PAUSED:  # in a pause the controller holds the motion until resume
                pass

    async def _do(self, action: Action, enter: OnPhase) -> None:
        enter(action.phase)
        match action:
            case HomingAction():
                await self._controller.home()
            case TravelAction():
                await self._travel(action, enter)
            case GripAction(open=open_, grasps=grasps):
                if not open_:
                    self._memory.closing()
                await self._controller.gripper(open_)
                if grasps:
                    self._memory.grasped()
            case OutputAction(number=number, on=on):
                await self._controller.output(number, on=on)

    async def _travel(self, action: TravelAction, enter: OnPhase) -> None:
        if action.turn is None:
            await self._controller.follow(action.path, speed=action.speed)
            return
        turn, phase = action.turn

        def passed(via: int) -> None:
            if via == turn:
                enter(phase)

        await self._controller.follow(action.path, speed=action.speed, on_via=passed)
