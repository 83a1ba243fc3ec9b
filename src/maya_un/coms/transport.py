"""The interface of a transport (commands in, reports out), and the loop that keeps a connection open."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from enum import StrEnum
from random import Random
from typing import Any, Protocol

from maya_un.errors import MayaError, SessionTakenOver


class ReportKind(StrEnum):
    """Kind of a report about a step: a state, or its result."""

    ACCEPTED = "accepted"
    EXECUTING = "executing"
    RESULT = "result"


@dataclass(frozen=True, slots=True)
class SupervisorCommand:
    """A command as received: `text` is JSON in UTF-8, `key` names this delivery within the connection.

    `id` is the id of a command whose text has none; None if the transport knows none either.
    """

    key: str
    text: bytes
    id: str | None = None


@dataclass(frozen=True, slots=True)
class Report:
    """The state or result of step `id` as JSON text; `id` is None if its command had no readable id.

    `key` is that of the command's delivery, None if none is known.
    """

    id: str | None
    kind: ReportKind
    text: str
    key: str | None = None


class SupervisorChannel(Protocol):
    """A connection to the supervisors of one robot. Both methods raise `SupervisorsNotReached` when it has ended."""

    async def receive(self) -> SupervisorCommand:
        """Return the next command. Until its result is sent, a later connection delivers it again."""
        ...

    async def send(self, report: Report) -> None:
        """Send a report; return when the other side has received it. A result ends its command."""
        ...


class SupervisorTransport(Protocol):
    """A transport to the supervisors."""

    @property
    def where(self) -> str:
        """The address without credentials."""
        ...

    @property
    def default_command(self) -> str | None:
        """The default command of a step without one, from the robot's document; None if the document defines none."""
        ...

    @property
    def needs_journal(self) -> bool:
        """Whether a connection requires the id of the robot's journal, because it claims commands for that journal."""
        ...

    def connected(self, robot: str, journal: str) -> AbstractAsyncContextManager[SupervisorChannel]:
        """Connect for the robot of this name; `journal` is the id of the journal of its steps.

        Raises `SupervisorsNotReached`, and `SessionTakenOver` if another robot has taken the name.
        """
        ...


FIRST_PAUSE = 0.1
"""Pause after the first failure [s]."""

LONGEST_PAUSE = 10.0
"""Longest pause between attempts [s]."""

_AGAIN = 0.5
"""A task that does not end after its cancellation is cancelled again after this time [s]."""

GOOD = 5.0
"""After a connection of this duration, the pauses start again from the shortest [s]."""


async def keep(use: Callable[[], Awaitable[None]], failed: Callable[[MayaError], None], rng: Random) -> None:
    """Call `use` repeatedly, and `failed` with each `MayaError` that it raises, until cancelled.

    After `SessionTakenOver` it does not call `use` again: two programs with the same name would otherwise take the
    session from each other endlessly, and both would carry out commands.

    The pause doubles after each attempt and is reduced at random by up to half, so that clients of a server do not
    reconnect all at once.
    """
    loop, pause = asyncio.get_running_loop(), FIRST_PAUSE
    while True:
        began = loop.time()
        try:
            await use()
        except MayaError as error:
            if being_cancelled():  # closing the connection raised this error in place of the cancellation
                raise asyncio.CancelledError from error
            failed(error)
            if isinstance(error, SessionTakenOver):  # the other program would lose the session to this one in turn
                await asyncio.Event().wait()
        if loop.time() - began > GOOD:
            pause = FIRST_PAUSE
        await asyncio.sleep(pause * rng.uniform(0.5, 1.0))
        pause = min(2.0 * pause, LONGEST_PAUSE)


def being_cancelled() -> bool:
    """Return whether the current task is being cancelled."""
    task = asyncio.current_task()
    return task is not None and task.cancelling() > 0


async def first_to_end(*work: Awaitable[Any]) -> None:
    """Run coroutines concurrently until one ends, then cancel the others; raises its exception, if any."""
    tasks = [asyncio.ensure_future(one) for one in work]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    finally:
        left = set(tasks)
        while left:  # wait_for of Python 3.11 loses a cancellation that comes together with its result
            for task in left:
                task.cancel()
            _, left = await asyncio.wait(left, timeout=_AGAIN)
        await asyncio.gather(*tasks, return_exceptions=True)
