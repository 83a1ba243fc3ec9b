"""Planning shared by all robot implementations."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from maya_un.config import Config
from maya_un.controller.planning import OWN
from maya_un.controller.protocol import Controller
from maya_un.errors import Busy, Stopped
from maya_un.events import PhaseBegun
from maya_un.robot.gripper_tracker import GripperTracker
from maya_un.robot.plan import ActionDetail, Pose, PrimitivePlan, PrimitivePreview
from maya_un.robot.plans import Plans, plan
from maya_un.robot.primitives import Primitive
from maya_un.robot.protocol import OnPhase
from maya_un.values import Mode
from maya_un.workers import Workers


class PlanningRobot:
    """Tells where the robot is, what it holds and what a primitive would be; gives one primitive at a time its turn.

    The subclass runs the plan (`protocol.Robot`). Plans that are about to run are computed in `workers`, or without any
    here.
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
        """The primitive under way from here, None where there is none."""
        return self._running

    @property
    def pose(self) -> Pose:
        """The present pose; its joints are None before homing."""
        state = self._controller.state
        return Pose(state.joints if state.homed else None, self._memory.state(state))

    @property
    def can_teleop(self) -> bool:
        """Whether the robot accepts a command: homed, not moving, nothing under way from here."""
        state = self._controller.state
        return state.mode is Mode.IDLE and state.homed and self._running is None

    @property
    def holding(self) -> bool | None:
        """Whether the gripper holds a part: True after a pick, False when open, None when closed for other reasons.

        No sensor tells; this is what the robot was told to do and did, or what a person saw.
        """
        return self._memory.holding(self._controller.state)

    def seen(self, *, holding: bool) -> None:
        """Take a person's word for what the closed gripper holds, until it is opened or closed again."""
        self._memory.seen(holding=holding)

    def preview(self, primitive: Primitive, start: Pose) -> PrimitivePreview:
        """Return what `primitive` would be from `start`; nothing is sent.

        Raises what `run` would raise for its target, its way and the gripper: `Unreachable`, `PathRefused`,
        `NotHomed`, `GripperNotEmpty`, `GripperEmpty`.
        """
        return self._plans.preview(primitive, start)

    def inspect(self, primitive: Primitive, start: Pose, samples: int = 200) -> tuple[list[ActionDetail], Pose]:
        """Return the details of every action of `primitive` from `start`, and where it ends; raises as `preview` does.

        Every motion has so many `samples`.
        """
        return self._plans.inspect(primitive, start, samples)

    @contextmanager
    def _turn(self, primitive: Primitive) -> Iterator[None]:
        """Let `primitive` be the one under way while the block runs; raises `Busy` where another is."""
        if self._running is not None:
            raise Busy(doing=self._running.command)
        self._running = primitive
        try:
            yield
        finally:
            self._running = None

    def _enter(self, phase: str, primitive: Primitive, on_phase: OnPhase | None) -> None:
        """Tell that a phase begins."""
        self._controller.events.emit(PhaseBegun(phase, primitive.command))
        if on_phase is not None:
            on_phase(phase)

    async def _planned(self, primitive: Primitive) -> PrimitivePlan:
        """Return the plan from the position of the robot, which has not moved meanwhile; raises as `preview`.

        A worker takes some time: raises `Stopped` if a stop comes meanwhile.
        """
        if self._workers is None:
            return self._plans.plan(primitive, self.pose)
        stops = self._controller.stops
        while True:
            start, workspace = self.pose, self._controller.workspace
            planned = await self._workers.run(plan, workspace, primitive, start, whose=OWN)
            if self._controller.stops != stops:
                raise Stopped
            if (start, workspace) == (self.pose, self._controller.workspace):
                return planned.value
