"""The robot layer: one primitive at a time, planned and checked whole before anything moves."""

from __future__ import annotations

from maya_un.errors import Busy, Faulted, NotConnected, NotHomed
from maya_un.robot.plan import Action, GripAction, HomingAction, TravelAction
from maya_un.robot.planning import PlanningRobot
from maya_un.robot.primitives import Primitive
from maya_un.robot.protocol import OnPhase
from maya_un.values import Mode


class MayaRobot(PlanningRobot):
    """Runs primitives on a controller; see `protocol.Robot`."""

    async def run(self, primitive: Primitive, on_phase: OnPhase | None = None) -> None:
        """Do `primitive` and return when it is done; every phase is an event and told to `on_phase`.

        The whole of it is checked first: what is refused has moved nothing and sent nothing. Raises
        `NotConnected`, `Faulted`, `NotHomed`, `Busy`, what `preview` raises, and `Stopped` or a `MachineError`
        where it ended on the way. Cancelling it stops on the path; the gripper stays as it is.
        """
        with self._turn(primitive):
            self._require_ready(primitive)
            plan = await self._planned(primitive)
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
                raise NotHomed
            case Mode.NOT_HOMED | Mode.IDLE | Mode.PAUSED:  # in a pause the controller holds it until resume
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

    async def _travel(self, action: TravelAction, enter: OnPhase) -> None:
        if action.turn is None:
            await self._controller.follow(action.path)
            return
        turn, phase = action.turn

        def passed(via: int) -> None:
            if via == turn:
                enter(phase)

        await self._controller.follow(action.path, on_via=passed)
