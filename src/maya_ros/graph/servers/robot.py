"""The robot layer on a graph: primitives by service, action and topic, one at a time."""

from __future__ import annotations

from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Protocol

from maya_ros.graph import diagnostics
from maya_ros.graph.conversions import primitive_from_message
from maya_ros.graph.outcome import failure, success
from maya_ros.graph.protocol import Feedback, Graph, Message
from maya_ros.graph.servers.tasks import (
    ActionProgress,
    ActionSlot,
    Clock,
    clock_or_loop,
    diagnosed,
    log,
    tasks,
    with_values,
)
from maya_ros.graph.table import MAYA_COMMAND, PRIMITIVE, TASK
from maya_un.errors import Busy, Faulted, MayaError, NotConnected, NotHomed
from maya_un.robot.primitives import Primitive
from maya_un.robot.primitives.can_teleop import CanTeleop
from maya_un.robot.robot import OnPhase
from maya_un.values import Mode, Progress, State


class RobotLayer(Protocol):
    """The part of a robot layer and of the layer below that this server needs."""

    @property
    def state(self) -> State:
        """Latest state; read from any thread."""
        ...

    @property
    def can_teleop(self) -> bool:
        """Whether the robot can take a command; read from any thread."""
        ...

    def progress(self) -> Progress | None:
        """Progress of the motion under way, None at rest."""
        ...

    async def run(self, primitive: Primitive, on_phase: OnPhase | None = None) -> None:
        """Execute a primitive; see `robot.protocol.Robot.run`."""
        ...


class RobotServer:
    """Serves a robot layer; `clock` stamps messages [s], `speed` is how fast the loop's clock runs."""

    def __init__(self, layer: RobotLayer, *, clock: Clock | None = None, speed: float = 1.0) -> None:
        self._layer = layer
        self._clock = clock_or_loop(clock)
        self._speed = max(1.0, speed)
        self._slot = ActionSlot()
        self._refused = ""

    @asynccontextmanager
    async def open(self, graph: Graph) -> AsyncGenerator[None]:
        """Serve /maya_command, /maya_move and /task while the block runs; afterwards the robot is at rest."""
        async with self.commands(graph), self.task(graph):
            yield

    @asynccontextmanager
    async def commands(self, graph: Graph, *, tell: bool = True) -> AsyncGenerator[None]:
        """Serve /maya_command and /maya_move; with `tell`, also publish /diagnostics."""
        async with tasks() as working:

            def requested(message: Message) -> None:
                working.begin(self._done(message), PRIMITIVE.name)

            heard = graph.subscribe(PRIMITIVE.name, PRIMITIVE.type, requested, queue_size=PRIMITIVE.queue_size)
            served = graph.serve(MAYA_COMMAND.name, MAYA_COMMAND.type, self._answer, self._quick)
            if tell:
                working.begin(diagnosed(graph, self._statuses, self._clock, self._speed), "diagnostics")
            try:
                yield
            finally:
                heard.close()
                served.close()
                await working.settle()
                await self._slot.free()

    @asynccontextmanager
    async def task(self, graph: Graph, name: str = TASK.name) -> AsyncGenerator[None]:
        """Serve the action of primitives under `name`."""
        served = graph.act(name, TASK.type, self._act)
        try:
            yield
        finally:
            served.close()
            await self._slot.free()

    async def _act(self, goal: Message, feedback: Feedback) -> Message:
        course = ActionProgress(feedback, self._look, ticks=True, speed=self._speed)
        return await self._slot.act("task", self._work(goal["task"], course), course)

    async def _answer(self, request: Message) -> Message:
        course = ActionProgress(lambda _: None, self._look, ticks=False)
        try:
            await self._slot.do("maya_command", self._work(request["task"], course), course)
        except MayaError as error:
            return failure(error)
        return success()

    async def _done(self, message: Message) -> None:
        """Execute a primitive from the topic, which has no response."""
        course = ActionProgress(lambda _: None, self._look, ticks=False)
        try:
            await self._slot.do("maya_move", self._work(message, course), course)
        except MayaError as error:
            self._refused = f"{message['command'][:40]}: {error.code} {error}"
            log.warning("%s: %s", PRIMITIVE.name, self._refused)
        else:
            self._refused = ""

    def _work(self, message: Message, course: ActionProgress) -> Callable[[], Awaitable[None]]:
        async def work() -> None:
            await self._layer.run(primitive_from_message(message), course.enter)

        return work

    def _quick(self, request: Message) -> Message | None:
        if request["task"]["command"] != CanTeleop.command:
            return None
        error = why_not(self._layer.state, can_teleop=self._layer.can_teleop, doing=self._slot.doing)
        return success() if error is None else failure(error)

    def _look(self, phase: str) -> Message:
        progress, point = self._layer.progress(), self._layer.state.point
        told: Message = {"phase": phase, "progress": 0.0 if progress is None else progress.fraction}
        return told if point is None else {**told, "position": dict(zip("xyz", point, strict=True))}

    def _statuses(self) -> list[diagnostics.DiagnosticStatus]:
        state = self._layer.state
        there = state.mode is not Mode.DISCONNECTED
        able, doing = self._layer.can_teleop, self._slot.doing
        error = why_not(state, can_teleop=able)
        why = "" if error is None else f"{error.code} {error}"
        status = diagnostics.robot(controller_there=there, can_teleop=able, running=doing, why=why)
        return [with_values(status, {"last refused": self._refused})]


def why_not(state: State, *, can_teleop: bool, doing: str = "") -> MayaError | None:
    """Return why the robot cannot take a command now, None if it is homed, at rest, and not in use."""
    if state.mode is Mode.DISCONNECTED:
        return NotConnected()
    if state.mode is Mode.FAULT:
        return Faulted(fault=state.fault.message if state.fault else "")
    if state.mode is Mode.NOT_HOMED or not state.homed:
        return NotHomed(command="maya home")
    if can_teleop and not doing:
        return None
    return Busy(doing=doing or state.mode.value)
