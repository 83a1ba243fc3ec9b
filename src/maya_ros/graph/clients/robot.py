"""Client of the robot layer over a graph, with the protocol of the layer."""

from __future__ import annotations

import asyncio

from maya_ros.graph.clients.controller import GraphController
from maya_ros.graph.conversions import primitive_to_message
from maya_ros.graph.halts import Halts
from maya_ros.graph.outcome import cancel_on_stop, run_action
from maya_ros.graph.protocol import Graph, Message
from maya_ros.graph.table import TASK
from maya_un.config import Config
from maya_un.errors import Busy, NotOverRos
from maya_un.events import Event, GripperClosed
from maya_un.robot.plan_builder import Pose, PrimitivePreview
from maya_un.robot.primitives import Primitive
from maya_un.robot.primitives.gripper import Gripper
from maya_un.robot.primitives.pick import Pick
from maya_un.robot.robot import OnPhase, PlanningRobot
from maya_un.values import GripperState, Mode

AGAIN = 0.2
"""Period of retries while another client's command is under way [s, real time]."""


class GraphRobot(PlanningRobot):
    """Runs primitives by the robot layer of a graph; see `robot.protocol.Robot`.

    A preview is computed here by the planning of the layer itself, from the pose that `controller` reports. The layer
    executes the primitive. If the layer is gone, `NodeGone` is raised. If another client's primitive is under way,
    `run` waits for its end, and ends with it if a fault comes; `speed` is how fast the loop's clock runs.
    """

    def __init__(self, graph: Graph, controller: GraphController, config: Config, *, speed: float = 1.0) -> None:
        super().__init__(controller, config)
        self._graph = graph
        self._settled = controller.settled
        self._again = AGAIN * max(1.0, speed)
        self._halts = Halts(controller)
        controller.events.heard_by(self._halts.hear)
        controller.events.heard_by(self._hear)

    async def run(self, primitive: Primitive, on_phase: OnPhase | None = None, speed: float = 1.0) -> None:
        """Have the robot layer execute `primitive`; every phase is an event and is passed to `on_phase`.

        Raises `NotOverRos` for a `speed` other than 1, because no message of the manual holds one. Raises
        the error that the layer reports, with its code and words. Cancelling this call stops on the path; the gripper
        stays as it is.
        """
        _require_full(speed)
        with self._turn(primitive):
            try:
                await cancel_on_stop(self._controller.events, self._run(primitive, on_phase))
            finally:
                await self._settled()

    def preview(self, primitive: Primitive, start: Pose, speed: float = 1.0) -> PrimitivePreview:
        """Return the preview of `primitive` from `start`; raises as `run` does, so that no such job begins."""
        _require_full(speed)
        return super().preview(primitive, start)

    async def _run(self, primitive: Primitive, on_phase: OnPhase | None) -> None:
        if isinstance(primitive, Pick) and self.pose.gripper is GripperState.FOUND:
            await self._do(Gripper(open=True), "open", primitive, on_phase)
        await self._do(primitive, "", primitive, on_phase)

    async def _do(self, part: Primitive, name: str, primitive: Primitive, on_phase: OnPhase | None) -> None:
        """Have the layer execute `part`: `primitive`, or the part of it that is called `name`.

        The layer does not know what a person has seen: it may assume a part in a gripper that is known here to be
        empty. So the gripper is opened first, as the pick would.
        """
        phase, halts = "", self._halts.count

        def heard(feedback: Message) -> None:
            nonlocal phase
            if feedback["phase"] not in ("", phase):
                phase = feedback["phase"]
                self._enter(name or phase, primitive, on_phase)

        while True:
            try:
                await run_action(self._graph, TASK, {"task": primitive_to_message(part)}, heard)
            except Busy:
                if phase:
                    raise  # the primitive has begun
                await asyncio.sleep(self._again)
                if self._controller.state.mode not in (Mode.FAULT, Mode.DISCONNECTED):  # then the layer refuses it
                    self._halts.require(halts)
            else:
                return

    def _enter(self, phase: str, primitive: Primitive, on_phase: OnPhase | None) -> None:
        if phase == "close":
            self._memory.closing()
        super()._enter(phase, primitive, on_phase)

    def _hear(self, event: Event) -> None:
        """Remember what a pick has grasped."""
        if isinstance(event, GripperClosed) and isinstance(self._running, Pick):
            self._memory.grasped()


def _require_full(speed: float) -> None:
    if speed != 1.0:
        raise NotOverRos(request="the speed of a step")
