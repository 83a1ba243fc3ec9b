"""Tasks of servers: background tasks, repeated work, triggers, and one goal at a time with its feedback."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncGenerator, Awaitable, Callable, Coroutine, Iterable, Mapping
from contextlib import asynccontextmanager, nullcontext
from dataclasses import replace
from typing import Any

from maya_ros.graph.diagnostics import DiagnosticStatus, array
from maya_ros.graph.events import EventSource
from maya_ros.graph.outcome import failure, success, trigger_failure
from maya_ros.graph.protocol import Answer, Feedback, GoalRefused, Graph, Message
from maya_ros.graph.table import DIAGNOSTICS
from maya_un.cancellation import cancel_once, run_to_end
from maya_un.errors import Busy, Cancelled, MayaError, RequestError, Stopped
from maya_un.events import Event, HomingBegun, MotionBegun, PhaseBegun

log = logging.getLogger("maya_ros.graph")
"""Log of messages that have no other receiver."""

Clock = Callable[[], float]
"""Returns the time for message stamps [s]."""


class BackgroundTasks:
    """Background tasks; none outlives the server."""

    def __init__(self) -> None:
        self._tasks: set[asyncio.Task[None]] = set()

    def begin(self, work: Coroutine[Any, Any, None], name: str) -> asyncio.Task[None]:
        """Start a task."""
        task = asyncio.get_running_loop().create_task(work, name=name)
        self._tasks.add(task)
        task.add_done_callback(self._over)
        return task

    def cancel(self) -> None:
        """Cancel all, each once."""
        for task in self._tasks:
            cancel_once(task)

    async def settle(self) -> None:
        """Cancel all tasks and return when all have ended, however often this is cancelled meanwhile."""
        self.cancel()
        await run_to_end(self._all_ended())

    async def _all_ended(self) -> None:
        while self._tasks:
            await asyncio.wait(self._tasks)

    def _over(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and task.exception() is not None:
            context = {"message": f"{task.get_name()} failed", "exception": task.exception()}
            task.get_loop().call_exception_handler(context)


@asynccontextmanager
async def tasks() -> AsyncGenerator[BackgroundTasks]:
    """Yield background tasks; all have ended when the block is left."""
    kept = BackgroundTasks()
    try:
        yield kept
    finally:
        await kept.settle()


async def every(period: float, work: Callable[[], None]) -> None:
    """Call `work` now and every `period` [s, loop time] until cancelled."""
    while True:
        work()
        await asyncio.sleep(period)


def trigger(work: Callable[[], Awaitable[str]]) -> Answer:
    """Return the handler of a service without parameters (std_srvs/Trigger): it returns the text of `work`."""

    async def answer(_: Message) -> Message:
        try:
            return {"success": True, "message": await work()}
        except MayaError as error:
            return trigger_failure(error)

    return answer


async def diagnosed(
    graph: Graph, statuses: Callable[[], Iterable[DiagnosticStatus]], clock: Clock, speed: float
) -> None:
    """Publish the status of a layer on /diagnostics until cancelled; `speed` is how fast the loop's clock runs."""
    publisher = graph.advertise(DIAGNOSTICS.name, DIAGNOSTICS.type, queue_size=DIAGNOSTICS.queue_size)
    try:
        await every(max(1.0, speed) / DIAGNOSTICS.rate, lambda: publisher.publish(array(statuses(), clock())))
    finally:
        publisher.close()


def with_values(status: DiagnosticStatus, values: Mapping[str, object]) -> DiagnosticStatus:
    """Return a status with further values."""
    return replace(status, values={**status.values, **values})


def clock_or_loop(clock: Clock | None) -> Clock:
    """Return `clock`, or the clock of the running loop for None."""
    return asyncio.get_running_loop().time if clock is None else clock


FEEDBACK_RATE = 10.0
"""Rate of the feedback of a motion [Hz]; phases are reported as they begin."""


class ActionProgress:
    """Feedback of a command: at events and, with `ticks`, also periodically during a phase.

    `look` returns the present feedback for the name of a phase. `speed` is how fast the loop's clock runs.
    """

    def __init__(self, feedback: Feedback, look: Callable[[str], Message], *, ticks: bool, speed: float = 1.0) -> None:
        self.begun = False
        self._feedback = feedback
        self._look = look
        self._period = max(1.0, speed) / FEEDBACK_RATE if ticks else 0.0
        self._phase = ""
        self._closed = False
        self._timer: asyncio.TimerHandle | None = None

    def hear(self, event: Event) -> None:
        """Take an event of the layer that carries out the command."""
        match event:
            case PhaseBegun(name):
                self.enter(name)
            case HomingBegun() | MotionBegun():
                self.enter(event.kind)
            case _:
                pass

    def enter(self, phase: str) -> None:
        """Report the start of a phase; ignored after `close`, because calls from another loop may come late."""
        if self._closed:
            return
        self._phase = phase
        if self._timer is not None:
            self._timer.cancel()
        self._tell()

    def close(self) -> None:
        """Stop reporting."""
        self._closed = True
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _tell(self) -> None:
        self.begun = True
        self._feedback(self._look(self._phase))
        if self._period:
            self._timer = asyncio.get_running_loop().call_later(self._period, self._tell)


class ActionSlot:
    """Carries out one command at a time; `events` of its layer, if any, give the feedback."""

    def __init__(self, events: EventSource | None = None) -> None:
        self._events = events
        self._doing = ""
        self._free = asyncio.Event()
        self._free.set()

    @property
    def doing(self) -> str:
        """The running command, "" for none."""
        return self._doing

    async def do(self, name: str, work: Callable[[], Awaitable[None]], course: ActionProgress) -> None:
        """Carry out a command; raises `Busy` while another runs, and the errors of `work`."""
        if self._doing:
            raise Busy(doing=self._doing)
        self._doing = name
        self._free.clear()
        try:
            with nullcontext() if self._events is None else self._events.listening(course.hear):
                await work()
        finally:
            course.close()
            self._doing = ""
            self._free.set()

    async def act(self, name: str, work: Callable[[], Awaitable[None]], course: ActionProgress) -> Message:
        """Carry out a command as the goal of an action; an error before the start is a refusal."""
        try:
            await self.do(name, work, course)
        except RequestError as error:
            if course.begun or isinstance(error, Stopped | Cancelled):
                raise
            raise GoalRefused(failure(error)) from error
        return success()

    async def free(self) -> None:
        """Return when no command is under way, however often this is cancelled meanwhile."""
        await run_to_end(self._free.wait())
