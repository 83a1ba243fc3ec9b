"""The process floor on a graph: tasks to its queue, how the queue is, its going on, and the end of everything."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncGenerator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager
from contextvars import Context, copy_context
from typing import Protocol

from maya_ros.graph.diagnostics import DiagnosticStatus
from maya_ros.graph.outcome import failure, success
from maya_ros.graph.primitives import from_message
from maya_ros.graph.protocol import Graph, GraphHandle, Message, Publisher
from maya_ros.graph.servers.tasks import (
    BackgroundTasks,
    Clock,
    clock_or_loop,
    diagnosed,
    every,
    log,
    tasks,
    trigger,
    with_values,
)
from maya_ros.graph.table import QUEUE_STATUS, RECOVER_QUEUE, RESUME_QUEUE, SEND_TASK, START_QUEUE, STOP_QUEUE, Row
from maya_un.errors import InvalidJob, InvalidValue, MayaError
from maya_un.robot.primitives import Primitive

LOOK = 0.5
"""Period of the check for changes of the queue [s, real time]."""

_ANSWERS = {"": None, "yes": True, "no": False}


class ProcessLayer(Protocol):
    """What this door needs of a process floor."""

    async def append(self, primitives: Sequence[Primitive]) -> None:
        """Append one job of these primitives, at least one; it starts when its turn comes."""
        ...

    async def end_all(self) -> None:
        """Cancel every movement, a homing and direct wishes included, and all that waits."""
        ...

    async def resume(self) -> None:
        """Continue the paused queue."""
        ...

    async def recover(self, choice: str, holding: bool | None) -> None:
        """Decide about an interrupted job; `holding` says whether the gripper holds a part (None: unknown)."""
        ...

    def status(self) -> DiagnosticStatus:
        """Return how the floor is."""
        ...

    def told(self) -> Message:
        """Return how the queue is, as plain data that JSON can say."""
        ...


class ProcessServer:
    """Offers a process floor; `clock` stamps messages [s], `speed` is how fast the loop's clock runs."""

    def __init__(self, floor: ProcessLayer, *, clock: Clock | None = None, speed: float = 1.0) -> None:
        self._floor = floor
        self._clock = clock_or_loop(clock)
        self._speed = max(1.0, speed)
        self._refused = ""
        self._coming: asyncio.Queue[tuple[Row, Sequence[Message], Context]] = asyncio.Queue()
        self._ends = 0
        self._ended_by = copy_context()

    @asynccontextmanager
    async def open(self, graph: Graph) -> AsyncGenerator[None]:
        """Listen while the block runs."""
        async with tasks() as working:
            status = graph.advertise(
                QUEUE_STATUS.name, QUEUE_STATUS.type, latch=QUEUE_STATUS.latch, queue_size=QUEUE_STATUS.queue_size
            )
            held = [*self._topics(graph, working), *self._services(graph), status]
            working.begin(every(self._speed * LOOK, self._teller(status)), "status of the queue")
            working.begin(self._take(), "tasks from topics")
            working.begin(diagnosed(graph, self._statuses, self._clock, self._speed), "diagnostics")
            try:
                yield
            finally:
                for one in held:
                    one.close()

    def _topics(self, graph: Graph, working: BackgroundTasks) -> list[GraphHandle]:
        def send(message: Message) -> None:
            self._coming.put_nowait((SEND_TASK, [message], copy_context()))

        def start(message: Message) -> None:
            self._coming.put_nowait((START_QUEUE, message["tasks"], copy_context()))

        def stop(_: Message) -> None:
            self._ends += 1
            self._ended_by = copy_context()
            while not self._coming.empty():
                self._coming.get_nowait()
            working.begin(self._told(STOP_QUEUE, self._floor.end_all), STOP_QUEUE.name)

        rows = ((SEND_TASK, send), (START_QUEUE, start), (STOP_QUEUE, stop))
        return [graph.subscribe(row.name, row.type, heard, queue_size=row.queue_size) for row, heard in rows]

    def _services(self, graph: Graph) -> list[GraphHandle]:
        async def resume() -> str:
            await self._floor.resume()
            return ""

        async def recover(request: Message) -> Message:
            try:
                await self._floor.recover(request["choice"], _answer(request["holding"]))
            except MayaError as error:
                return failure(error)
            return success()

        return [
            graph.serve(RESUME_QUEUE.name, RESUME_QUEUE.type, trigger(resume)),
            graph.serve(RECOVER_QUEUE.name, RECOVER_QUEUE.type, recover),
        ]

    def _teller(self, status: Publisher) -> Callable[[], None]:
        """Return a function that publishes the state of the queue if it has changed."""
        last = ""

        def tell() -> None:
            nonlocal last
            text = json.dumps(self._floor.told(), separators=(",", ":"))
            if text != last:
                last = text
                status.publish({"data": text})

        return tell

    async def _take(self) -> None:
        """Append what comes, in order. What was being appended when everything was to end, ends as well.

        Each is done in the context in which it came: it knows whose wish it is.
        """
        loop = asyncio.get_running_loop()
        while True:
            row, messages, context = await self._coming.get()
            ends = self._ends
            work = self._told(row, lambda messages=messages: self._append(messages))
            await loop.create_task(work, context=context)
            if self._ends != ends:
                await loop.create_task(self._told(STOP_QUEUE, self._floor.end_all), context=self._ended_by)

    async def _append(self, messages: Sequence[Message]) -> None:
        if not messages:
            raise InvalidJob(key="tasks", reason="there is none")
        await self._floor.append([from_message(message) for message in messages])

    async def _told(self, row: Row, work: Callable[[], Awaitable[None]]) -> None:
        """Do what a topic asks for; nobody waits for an answer, so a refusal is logged and told in /diagnostics."""
        try:
            await work()
        except MayaError as error:
            self._refused = f"{row.name}: {error.code} {error}"
            log.warning("%s", self._refused)
        else:
            self._refused = ""

    def _statuses(self) -> list[DiagnosticStatus]:
        return [with_values(self._floor.status(), {"last refused": self._refused})]


def _answer(word: str) -> bool | None:
    """Return what a word says of the gripper, None where it says nothing; raises `InvalidValue`."""
    if word not in _ANSWERS:
        raise InvalidValue(key="holding", value=repr(word), reason="it is yes, no or empty")
    return _ANSWERS[word]
