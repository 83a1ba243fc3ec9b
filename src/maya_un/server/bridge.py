"""The way from the server's real-time loop into the stack's loop, whose clock may be scaled."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Awaitable, Callable, Mapping
from typing import TypeVar

from maya_un.api.service import Service
from maya_un.events import Event
from maya_un.values import Point

T = TypeVar("T")


class Bridge:
    """Posts wishes to `service`, which lives in `loop`, and awaits their answers in the caller's loop.

    Neither loop ever blocks on the other. `parts` tells where the twin's parts stand by its own record; a real
    machine has none.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        service: Service,
        parts: Callable[[], Mapping[str, Point]] | None = None,
    ) -> None:
        self._loop = loop
        self._service = service
        self.parts = parts

    async def call(self, wish: Callable[[Service], Awaitable[T]]) -> T:
        """Return the answer to `wish`, carried out in the stack's loop; raises what it raises.

        Cancelling the caller cancels the wish.
        """

        async def carried_out() -> T:
            return await wish(self._service)

        return await asyncio.wrap_future(asyncio.run_coroutine_threadsafe(carried_out(), self._loop))

    async def events(self, since: int, patience: float = 0.0) -> list[Event]:
        """Return all events numbered above `since`; without any, wait up to `patience` [s, real time] for one."""
        past = await self._past(since)
        if past or patience <= 0.0:
            return past
        try:
            async with asyncio.timeout(patience):
                await self.call(lambda service: _next_event(service, since))
        except TimeoutError:
            return []
        return await self._past(since)

    async def _past(self, since: int) -> list[Event]:
        async def looked_up(service: Service) -> list[Event]:
            return service.events_since(since)

        return await self.call(looked_up)


async def _next_event(service: Service, since: int) -> Event:
    events = service.follow_events(since)
    try:
        return await anext(events)
    finally:
        if isinstance(events, AsyncGenerator):
            await events.aclose()
