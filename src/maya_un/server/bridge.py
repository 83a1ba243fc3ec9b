"""The way from the server's real-time loop through the gate into the stack's loop, whose clock may be scaled."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Awaitable, Callable, Mapping
from dataclasses import replace
from typing import TypeVar

from maya_un.api.access.caller import LOCAL, Caller
from maya_un.api.access.callers import Callers
from maya_un.api.access.operations import Operation
from maya_un.api.gate import Gate
from maya_un.api.service import Service
from maya_un.events import Event, EventLog
from maya_un.process.journal.protocol import Journal
from maya_un.process.lease import Lease
from maya_un.values import Point

T = TypeVar("T")


class Bridge:
    """Takes wishes through the `gate` to `service`, which lives in `loop`; answers come in the caller's loop.

    Neither loop ever blocks on the other. `callers` tell who asks. Without a gate and callers it is for a service that
    nobody shares: everybody is `LOCAL`, and no audit log is kept. `parts` tells where the twin's parts stand by its own
    record; a real machine has none. `journal` is what keeps the queue, where it is to be looked at.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        service: Service,
        parts: Callable[[], Mapping[str, Point]] | None = None,
        *,
        gate: Gate | None = None,
        callers: Callers | None = None,
        journal: Journal | None = None,
    ) -> None:
        self._loop = loop
        self._service = service
        self._gate = _unwatched(service) if gate is None else gate
        self._callers = callers
        self.parts = parts
        self.journal = journal

    async def caller(
        self, authorization: str | None, lease: str, source: str, *, loopback: bool, stopping: bool
    ) -> Caller:
        """Return who shows these headers; arguments and what is raised are those of `Callers.resolve`."""
        callers = self._callers
        if callers is None:
            return replace(LOCAL, lease=lease)
        return await self.within(lambda: callers.resolve(authorization, lease, source, loopback, stopping=stopping))

    async def call(
        self, caller: Caller, operation: Operation, wish: Callable[[Service], Awaitable[T]], subject: str = ""
    ) -> T:
        """Return the answer to `wish` of `caller`, carried out in the stack's loop; raises what it and the gate raise.

        `subject` says in the audit log what it is about. Cancelling the caller cancels the wish.
        """

        async def carried_out() -> T:
            return await self._gate.call(caller, operation, wish, subject)

        return await self.within(carried_out)

    async def asked(self, wish: Callable[[Service], Awaitable[T]]) -> T:
        """Return the answer to a wish that needs no caller, like signing in, past the gate."""
        return await self.within(lambda: wish(self._service))

    async def within(self, work: Callable[[], Awaitable[T]]) -> T:
        """Return what `work` answers in the stack's loop, past the gate: for what no caller asked for."""

        async def carried_out() -> T:
            return await work()

        return await asyncio.wrap_future(asyncio.run_coroutine_threadsafe(carried_out(), self._loop))

    async def events(self, since: int, patience: float = 0.0, caller: Caller = LOCAL) -> list[Event]:
        """Return all events numbered above `since`; without any, wait up to `patience` [s, real time] for one."""
        past = await self._past(caller, since)
        if past or patience <= 0.0:
            return past
        try:
            async with asyncio.timeout(patience):
                await self.call(caller, Operation.READ, lambda service: _next_event(service, since))
        except TimeoutError:
            return []
        return await self._past(caller, since)

    async def _past(self, caller: Caller, since: int) -> list[Event]:
        async def looked_up(service: Service) -> list[Event]:
            return service.events_since(since)

        return await self.call(caller, Operation.READ, looked_up)


def _unwatched(service: Service) -> Gate:
    lease = Lease(EventLog(lambda: asyncio.get_running_loop().time()))
    return Gate(service, lease)


async def _next_event(service: Service, since: int) -> Event:
    events = service.follow_events(since)
    try:
        return await anext(events)
    finally:
        if isinstance(events, AsyncGenerator):
            await events.aclose()
