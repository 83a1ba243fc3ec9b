"""The bridge from the server's real-time loop to the stack's loop, whose clock may be scaled."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from maya_un.cancellation import cancel_once, run_to_rest
from maya_un.errors import Cancelled, MayaError
from maya_un.events import EventLog
from maya_un.process.journal.protocol import Journal
from maya_un.process.lease import ControlLease
from maya_un.schema.robot import EventMessage
from maya_un.service.access.callers import Callers
from maya_un.service.access.operations import LOCAL, Caller, Operation
from maya_un.service.queueing import MOST_EVENTS
from maya_un.service.service import Gate, Service

SHARE = 0.2
"""Fraction of the loop's time for all readers of the past and all translations together."""

LONGEST_PAUSE = 0.25
"""Longest pause after a turn [s]; a turn may have taken long because of other tasks of the loop."""


class LoopShare:
    """Gives turns in the order of requests, with a pause after each turn that leaves the loop to other tasks.

    The pause is proportional to the duration of the turn, so that all turns together take `share` of the time.
    """

    def __init__(self, share: float = SHARE) -> None:
        self._rest = 1.0 / share - 1.0
        self._turn = asyncio.Lock()
        self._free_at = 0.0

    @asynccontextmanager
    async def turn(self) -> AsyncIterator[None]:
        """Wait for a turn, which lasts as long as the block; the block must not wait for anything unbounded."""
        loop = asyncio.get_running_loop()
        async with self._turn:
            await asyncio.sleep(self._free_at - loop.time())
            began = loop.time()
            try:
                yield
            finally:
                ended = loop.time()
                self._free_at = ended + min(self._rest * (ended - began), LONGEST_PAUSE)


T = TypeVar("T")


class Bridge:
    """Passes requests through the `gate` to `service`, which runs in `loop`; answers arrive in the caller's loop.

    Neither loop ever blocks on the other. `callers` identifies callers. Without a gate and callers, the service has a
    single user: every caller is `LOCAL`, and no audit log is written. `journal` is the stored queue, for its health.
    `past` limits the share of the server's loop for all readers of the past and all translations together.
    `missing` returns the errors of missing layers, in any thread. `config_file` is the configuration file that the
    user has named. `checking` is locked while the host is checked.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        service: Service,
        *,
        gate: Gate | None = None,
        callers: Callers | None = None,
        journal: Journal | None = None,
        missing: Callable[[], Sequence[MayaError]] = list[MayaError],
        config_file: Path | None = None,
    ) -> None:
        self._loop = loop
        self._service = service
        self._gate = _unwatched(service) if gate is None else gate
        self._callers = callers
        self.journal = journal
        self.missing = missing
        self.config_file = config_file
        self.past = LoopShare()
        self.checking = asyncio.Lock()

    async def caller(
        self,
        authorization: str | None,
        lease: str,
        source: str,
        *,
        loopback: bool,
        stopping: bool,
        alone: Caller = LOCAL,
    ) -> Caller:
        """Return the caller with these headers; arguments and errors are those of `Callers.resolve`."""
        callers = self._callers
        if callers is None:
            return replace(alone, lease=lease)
        return await self.within(
            lambda: callers.resolve(authorization, lease, source, loopback, stopping=stopping, alone=alone)
        )

    async def current(self, asked: Sequence[Caller]) -> list[Caller | MayaError]:
        """Return each caller with the current role, or the error that ended the caller's rights."""
        callers = self._callers
        if callers is None:
            return list(asked)

        async def looked_at() -> list[Caller | MayaError]:
            return callers.current_of(asked)

        return await self.within(looked_at)

    def heard_by(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` in the running loop after each change of users or tokens; return a function to end this."""
        callers, here = self._callers, asyncio.get_running_loop()
        if callers is None:
            return _nothing

        def told() -> None:
            with suppress(RuntimeError):  # its loop has ended
                here.call_soon_threadsafe(listener)

        ends: list[Callable[[], None]] = []
        self._loop.call_soon_threadsafe(lambda: ends.append(callers.heard_by(told)))
        return lambda: self._end(ends)

    def _end(self, ends: list[Callable[[], None]]) -> None:
        def end() -> None:
            ends.pop()()

        with suppress(RuntimeError):  # the stack's loop has ended
            self._loop.call_soon_threadsafe(end)

    @property
    def stops(self) -> int:
        """How often the robot was stopped."""
        return self._service.stops

    async def call(
        self,
        caller: Caller,
        operation: Operation,
        work: Callable[[Service], Awaitable[T]],
        subject: str = "",
        *,
        stops: int | None = None,
    ) -> T:
        """Return the result of `work` for `caller` in the stack's loop; raises its errors and those of the gate.

        `subject` is the subject in the audit log, and `stops` the number of stops when the request came, None for now.
        Cancelling the caller cancels the request.
        """
        before = self.stops if stops is None else stops

        async def carried_out() -> T:
            return await self._gate.call(caller, operation, work, subject, stops=before)

        return await self.within(carried_out)

    async def carry(
        self, caller: Caller, operation: Operation, work: Callable[[Service], Awaitable[T]], subject: str = ""
    ) -> T:
        """Return as `call` does; a cancellation takes effect when the request has ended, for a motion at rest."""
        begun: list[asyncio.Future[T]] = []
        before, left = self.stops, False

        async def carried() -> None:
            if left:
                return
            begun.append(asyncio.ensure_future(self._gate.call(caller, operation, work, subject, stops=before)))
            await asyncio.wait(begun)
            if not begun[0].cancelled():
                begun[0].exception()

        def leave() -> None:
            nonlocal left
            left = True
            self._loop.call_soon_threadsafe(lambda: begun and cancel_once(begun[0]))

        await run_to_rest(self.within(carried), leave)
        if begun[0].cancelled():
            raise Cancelled
        return begun[0].result()

    async def asked(self, work: Callable[[Service], Awaitable[T]]) -> T:
        """Return the result of a request without a caller, like signing in; it bypasses the gate."""
        return await self.within(lambda: work(self._service))

    async def within(self, work: Callable[[], Awaitable[T]]) -> T:
        """Return the result of `work` in the stack's loop; it bypasses the gate, for work without a caller."""

        async def carried_out() -> T:
            return await work()

        return await asyncio.wrap_future(asyncio.run_coroutine_threadsafe(carried_out(), self._loop))

    async def events(
        self, caller: Caller, since: int, patience: float = 0.0, run: int | None = None, limit: int = MOST_EVENTS
    ) -> list[EventMessage]:
        """Return events of a `run` numbered above `since`, at most `limit`; `run` None is the current run.

        If the current run has no such event yet, wait up to `patience` [s, real time] for one. Raises
        `EventsForgotten`.
        """

        async def past(service: Service) -> list[EventMessage]:
            present = (await service.status()).run if run is None else run
            return await service.history.events(present, since, limit)

        async def soon(service: Service) -> None:
            if run in {None, (await service.status()).run}:
                await _next_event(service, since)

        found = await self.call(caller, Operation.READ, past)
        if found or patience <= 0.0:
            return found
        try:
            async with asyncio.timeout(patience):
                await self.call(caller, Operation.READ, soon)
        except TimeoutError:
            return []
        return await self.call(caller, Operation.READ, past)


def _nothing() -> None:
    """Do nothing: there is no listener to remove."""


def _unwatched(service: Service) -> Gate:
    lease = ControlLease(EventLog(lambda: asyncio.get_running_loop().time()))
    return Gate(service, lease)


async def _next_event(service: Service, since: int) -> None:
    events = service.follow_events(since)
    try:
        await anext(events)
    finally:
        if isinstance(events, AsyncGenerator):
            await events.aclose()
