"""What every robot floor knows and works out, wherever its controller stands: all but how a primitive is done."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from maya_un.config import Config
from maya_un.controller.protocol import Controller
from maya_un.errors import Busy, PathRefused, TrajectoryRefused, Unreachable
from maya_un.events import Kind
from maya_un.kinematics.workspace import Workspace
from maya_un.robot.jaws import JawsMemory
from maya_un.robot.plan import Action, ActionDetail, Plan, Pose, PrimitivePreview, Travel
from maya_un.robot.primitives import Primitive
from maya_un.robot.protocol import OnPhase
from maya_un.robot.sketch import Sketch
from maya_un.values import Mode

_REMEMBERED = 4096


class PlanningRobot:
    """Tells where the robot is, what it holds and what a primitive would be; gives one primitive at a time its turn.

    To run it is the affair of the class that inherits (`protocol.Robot`). A plan once made is remembered by primitive
    and start: what a job previewed is what it runs, and is worked out once.
    """

    def __init__(self, controller: Controller, config: Config) -> None:
        self._controller = controller
        self._memory = JawsMemory(controller.events)
        self._running: Primitive | None = None
        self._plans: dict[tuple[Primitive, Pose], tuple[Plan, Workspace]] = {}
        self.config = config

    @property
    def running(self) -> Primitive | None:
        """The primitive under way from here, None where there is none."""
        return self._running

    @property
    def pose(self) -> Pose:
        """Where the robot is now; its joints are None before homing."""
        state = self._controller.state
        return Pose(state.joints if state.homed else None, self._memory.jaws(state))

    @property
    def can_teleop(self) -> bool:
        """Whether the robot can take a wish: homed, not moving, nothing under way from here."""
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
        return self._plan(primitive, start).preview()

    def inspect(self, primitive: Primitive, start: Pose, samples: int = 200) -> tuple[list[ActionDetail], Pose]:
        """Return the details of every action of `primitive` from `start`, and where it ends; raises as `preview` does.

        Every motion has so many `samples`.
        """
        plan = self._plan(primitive, start)
        return [self._detail(action, samples) for action in plan.actions], plan.end

    def _detail(self, action: Action, samples: int) -> ActionDetail:
        inspection = self._controller.inspect(action.path, samples=samples) if isinstance(action, Travel) else None
        return ActionDetail(action.phases(), action.duration, inspection)

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
        self._controller.events.emit(Kind.PHASE, name=phase, primitive=primitive.command)
        if on_phase is not None:
            on_phase(phase)

    def _plan(self, primitive: Primitive, start: Pose) -> Plan:
        """Return the plan, remembered or drawn; one drawn in another workspace must come to the same in this."""
        workspace = self._controller.workspace
        known = self._plans.get((primitive, start))
        if known is not None and (known[1] is workspace or self._holds(known[0])):
            plan = known[0]
        else:
            sketch = Sketch(self._controller, start)
            primitive.draw(sketch)
            plan = sketch.plan()
        if len(self._plans) >= _REMEMBERED:
            self._plans.clear()
        self._plans[primitive, start] = (plan, workspace)
        return plan

    def _holds(self, plan: Plan) -> bool:
        """Whether every path of `plan` would be gone as it says: homing measures strokes, near zones all is slower."""
        travels = [action for action in plan.actions if isinstance(action, Travel)]
        try:
            return all(self._controller.preview(travel.path) == travel.preview for travel in travels)
        except (Unreachable, PathRefused, TrajectoryRefused):
            return False
