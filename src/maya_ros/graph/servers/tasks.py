"""What doors have in common: tasks that end with them, things done again and again, services that only do something."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncGenerator, Awaitable, Callable, Coroutine, Iterable, Mapping
from contextlib import asynccontextmanager
from dataclasses import replace
from typing import Any

from maya_ros.graph.diagnostics import DiagnosticStatus, array
from maya_ros.graph.outcome import trigger_failure
from maya_ros.graph.protocol import Answer, Graph, Message
from maya_ros.graph.table import DIAGNOSTICS
from maya_un.cancellation import cancel_once, run_to_end
from maya_un.errors import MayaError

log = logging.getLogger("maya_ros.graph")
"""Where doors say what nobody else is told."""

Clock = Callable[[], float]
"""Tells the time that messages are stamped with [s]."""


class BackgroundTasks:
    """Tasks that are begun and not awaited; none outlives the door."""

    def __init__(self) -> None:
        self._tasks: set[asyncio.Task[None]] = set()

    def begin(self, work: Coroutine[Any, Any, None], name: str) -> asyncio.Task[None]:
        """Begin something."""
        task = asyncio.get_running_loop().create_task(work, name=name)
        self._tasks.add(task)
        task.add_done_callback(self._over)
        return task

    def cancel(self) -> None:
        """Cancel all, each once."""
        for task in self._tasks:
            cancel_once(task)

    async def settle(self) -> None:
        """Cancel all and return when all have ended, however often this is cancelled meanwhile."""
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
    """Have tasks that end with the block, which is left when they have."""
    kept = BackgroundTasks()
    try:
        yield kept
    finally:
        await kept.settle()


async def every(period: float, work: Callable[[], None]) -> None:
    """Do something now and every `period` [s, loop time] until cancelled."""
    while True:
        work()
        await asyncio.sleep(period)


def trigger(work: Callable[[], Awaitable[str]]) -> Answer:
    """Return the answer of a service that takes nothing (std_srvs/Trigger): what `work` says, or why it failed."""

    async def answer(_: Message) -> Message:
        try:
            return {"success": True, "message": await work()}
        except MayaError as error:
            return trigger_failure(error)

    return answer


async def diagnosed(
    graph: Graph, statuses: Callable[[], Iterable[DiagnosticStatus]], clock: Clock, speed: float
) -> None:
    """Tell on /diagnostics how a floor is, until cancelled; `speed` is how fast the loop's clock runs."""
    publisher = graph.advertise(DIAGNOSTICS.name, DIAGNOSTICS.type, queue_size=DIAGNOSTICS.queue_size)
    try:
        await every(max(1.0, speed) / DIAGNOSTICS.rate, lambda: publisher.publish(array(statuses(), clock())))
    finally:
        publisher.close()


def with_values(status: DiagnosticStatus, values: Mapping[str, object]) -> DiagnosticStatus:
    """Return a status that says something more."""
    return replace(status, values={**status.values, **values})


def clock_or_loop(clock: Clock | None) -> Clock:
    """Return a clock, that of the running loop where there is none."""
    return asyncio.get_running_loop().time if clock is None else clock
