"""The controller layer on a graph: its actions, services and topics, one command at a time."""

from __future__ import annotations

import asyncio
import json
from collections import deque
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import asynccontextmanager
from contextvars import Context, copy_context
from dataclasses import asdict
from typing import Protocol

from maya_ros.graph import diagnostics
from maya_ros.graph.conversions import joints_of, path_from_message
from maya_ros.graph.events import ControllerView, EventPublisher, EventSource
from maya_ros.graph.halts import Halts
from maya_ros.graph.outcome import trigger_failure
from maya_ros.graph.protocol import Feedback, Graph, GraphHandle, Message
from maya_ros.graph.servers.tasks import (
    ActionProgress,
    ActionSlot,
    BackgroundTasks,
    Clock,
    clock_or_loop,
    diagnosed,
    every,
    tasks,
    trigger,
)
from maya_ros.graph.table import (
    ABORT,
    COMMAND,
    EVENT,
    FOLLOW,
    GRIPPER,
    HOME,
    MOVE,
    OUTPUT,
    PAUSE,
    RECOVER,
    RESUME,
    SPEED,
    STOP,
    Row,
)
from maya_ros.graph.timing import MotionTimer
from maya_un.errors import MayaError
from maya_un.events import MotionStopped
from maya_un.motion.path import Route
from maya_un.values import Joints, Progress, StopReport

LOOK_RATE = 1.0
"""Rate of the check for changes without an event [Hz]."""


class ControllerLayer(ControllerView, Protocol):
    """The part of a controller layer that this server needs; `GalilController` implements it."""

    @property
    def events(self) -> EventSource:
        """The source of its events."""
        ...

    @property
    def stops(self) -> int:
        """Number of stops and aborts so far."""
        ...

    def progress(self) -> Progress | None:
        """Progress of the motion under way, None at rest."""
        ...

    async def home(self) -> None:
        """Find the switches."""
        ...

    async def move(self, target: Joints) -> None:
        """Go to joints (rad, m, m)."""
        ...

    async def follow(self, path: Route, *, speed: float = 1.0) -> None:
        """Follow a path that starts at the robot's position."""
        ...

    async def gripper(self, open_: bool) -> None:
        """Open or close the gripper."""
        ...

    async def output(self, number: int, *, on: bool) -> None:
        """Switch a digital output of the controller."""
        ...

    async def stop(self) -> StopReport:
        """Begin to brake at once, on the path."""
        ...

    async def abort(self) -> None:
        """Stop without deceleration."""
        ...

    async def pause(self) -> StopReport:
        """Brake on the path and hold all motion."""
        ...

    async def resume(self) -> None:
        """Continue motion after a pause."""
        ...

    async def recover(self) -> None:
        """Clear a fault."""
        ...

    async def override(self, ratio: float) -> None:
        """Scale the speed of all motion."""
        ...


class ControllerServer:
    """Serves a controller layer; `address` is shown in /diagnostics, `speed` is how fast the loop's clock runs.

    `timer` times its motions. `clock` returns the time for message stamps [s], by default the loop's.
    """

    def __init__(
        self,
        layer: ControllerLayer,
        timer: MotionTimer,
        *,
        address: str = "",
        clock: Clock | None = None,
        speed: float = 1.0,
    ) -> None:
        self._layer = layer
        self._timer = timer
        self._halts = Halts(layer)
        self._address = address
        self._clock = clock_or_loop(clock)
        self._speed = max(1.0, speed)
        self._slot = ActionSlot(layer.events)
        self._stops = 0

    @asynccontextmanager
    async def open(self, graph: Graph) -> AsyncGenerator[None]:
        """Serve the layer while the block runs; motion that the server has started is at rest when the block ends."""
        events = graph.advertise(EVENT.name, EVENT.type, latch=EVENT.latch, queue_size=EVENT.queue_size)
        teller = EventPublisher(self._layer, events)
        async with tasks() as working:
            with self._layer.events.listening(teller.hear), self._layer.events.listening(self._halts.hear):
                held = [
                    *self._actions(graph, teller),
                    *self._services(graph, teller),
                    *self._topics(graph, teller, working),
                ]
                working.begin(every(self._speed / LOOK_RATE, teller.look), "look at the controller layer")
                working.begin(diagnosed(graph, self._statuses, self._clock, self._speed), "diagnostics")
                try:
                    yield
                finally:
                    for one in held:
                        one.close()
                    await working.settle()
                    await self._slot.free()
        events.close()

    def _actions(self, graph: Graph, teller: EventPublisher) -> list[GraphHandle]:
        layer, slot = self._layer, self._slot

        async def carried_out(work: Awaitable[None]) -> None:
            """Carry out a motion, and report a stop besides its cancel: the layer reports one end for both."""
            stops = self._stops
            try:
                await work
            except asyncio.CancelledError:
                if self._stops != stops:
                    teller.say(MotionStopped.word)
                raise

        async def home(_: Message, feedback: Feedback) -> Message:
            return await slot.act(
                "home",
                lambda: carried_out(layer.home()),
                ActionProgress(feedback, lambda phase: {"phase": phase}, ticks=False),
            )

        async def move(goal: Message, feedback: Feedback) -> Message:
            return await slot.act("move", lambda: carried_out(layer.move(joints_of(goal))), self._course(feedback))

        async def follow(goal: Message, feedback: Feedback) -> Message:
            return await slot.act(
                "follow", lambda: carried_out(self._follow(goal["trajectory"])), self._course(feedback)
            )

        rows = ((HOME, home), (MOVE, move), (FOLLOW, follow))
        return [graph.act(row.name, row.type, act) for row, act in rows]

    def _services(self, graph: Graph, teller: EventPublisher) -> list[GraphHandle]:
        layer = self._layer

        async def stop() -> str:
            """Stop; publish it even if nothing moved, because another client may be between two motions."""
            self._stops += 1
            report = await layer.stop()
            if not report.was_moving:
                teller.say(MotionStopped.word)
            return json.dumps(asdict(report), separators=(",", ":"))

        async def abort() -> str:
            self._stops += 1
            await layer.abort()
            teller.say(MotionStopped.word)
            return ""

        async def gripper(request: Message) -> Message:
            try:
                await layer.gripper(request["data"])
            except MayaError as error:
                return trigger_failure(error)
            return {"success": True, "message": ""}

        async def output(request: Message) -> Message:
            try:
                await layer.output(request["number"], on=request["on"])
            except MayaError as error:
                return trigger_failure(error)
            return {"success": True, "message": ""}

        rows: tuple[tuple[Row, Callable[[], Awaitable[str]]], ...] = (
            (STOP, stop),
            (PAUSE, lambda: _reported(layer.pause())),
            (RECOVER, lambda: _silent(layer.recover())),
            (RESUME, lambda: _silent(layer.resume())),
            (ABORT, abort),
        )
        served = [graph.serve(row.name, row.type, trigger(work)) for row, work in rows]
        own = ((GRIPPER, gripper), (OUTPUT, output))
        return [*(graph.serve(row.name, row.type, answer) for row, answer in own), *served]

    def _topics(self, graph: Graph, teller: EventPublisher, working: BackgroundTasks) -> list[GraphHandle]:
        async def reported(topic: str, work: Awaitable[object]) -> None:
            try:
                await work
            except MayaError as error:
                teller.refused(topic, error)

        def command(trajectory: Message) -> None:
            work = self._slot.do("follow", lambda: self._follow(trajectory), self._course(lambda _: None))
            working.begin(reported(COMMAND.name, work), COMMAND.name)

        async def follow_ratios() -> None:
            while ratios:
                ratio, context = ratios.pop()
                work = reported(SPEED.name, self._layer.override(ratio))
                await asyncio.get_running_loop().create_task(work, context=context)

        ratios = deque[tuple[float, Context]](maxlen=SPEED.queue_size)
        following = [working.begin(follow_ratios(), SPEED.name)]

        def speed(ratio: Message) -> None:
            """Set the newest ratio; ratios that came while another was being set are dropped."""
            ratios.append((ratio["data"], copy_context()))
            if following[0].done():
                following[0] = working.begin(follow_ratios(), SPEED.name)

        return [
            graph.subscribe(row.name, row.type, heard, queue_size=row.queue_size)
            for row, heard in ((COMMAND, command), (SPEED, speed))
        ]

    async def _follow(self, trajectory: Message) -> None:
        """Follow a path; raises `Stopped` if a stop or a fault comes while its speed is computed."""
        path, least = path_from_message(trajectory)
        halts = self._halts.count
        speed = await self._timer.speed_for(path, least)
        self._halts.require(halts)
        await self._layer.follow(path, speed=speed)

    def _course(self, feedback: Feedback) -> ActionProgress:
        return ActionProgress(feedback, lambda _: self._now(), ticks=True, speed=self._speed)

    def _now(self) -> Message:
        """Return the feedback of a motion."""
        progress, joints = self._layer.progress(), self._layer.state.joints
        a, b, c = (0.0, 0.0, 0.0) if joints is None else joints
        return {"a": a, "b": b, "c": c, "progress": 0.0 if progress is None else progress.fraction}

    def _statuses(self) -> list[diagnostics.DiagnosticStatus]:
        state = self._layer.state
        return [diagnostics.controller(state, self._address), diagnostics.axes(state)]


async def _reported(work: Awaitable[StopReport]) -> str:
    """Return the report of a stop as JSON, for the message of a response."""
    return json.dumps(asdict(await work), separators=(",", ":"))


async def _silent(work: Awaitable[None]) -> str:
    await work
    return ""
