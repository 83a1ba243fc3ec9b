"""The asynchronous driver: executes plans with httpx and websockets in the running event loop."""

from __future__ import annotations

import asyncio
import json
import ssl
import time
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager, closing, suppress
from typing import Any, TypeVar, cast

import httpx
from websockets.asyncio.client import ClientConnection, connect

from maya_un.client import transport
from maya_un.client.request import TIMEOUT, Request
from maya_un.client.steps import (
    Awaiting,
    Connect,
    Emit,
    Line,
    Plan,
    PlanRunner,
    ReadClock,
    Receive,
    Send,
    Sleep,
    Step,
    StreamPlan,
)
from maya_un.client.transport import Finder, HeldLease, ServiceAddress
from maya_un.errors import ServiceNotRunning

T = TypeVar("T")


class AwaitingDriver(Awaiting):
    """Executes plans against the service that `find` finds; `trust` checks its certificate. For one event loop."""

    def __init__(self, find: Finder, trust: ssl.SSLContext) -> None:
        self._find = find
        self._trust = trust
        self._http = httpx.AsyncClient(verify=trust, trust_env=False)
        self._urgent = httpx.AsyncClient(verify=trust, trust_env=False)
        self.held = HeldLease()

    @property
    def address(self) -> str:
        """The address of the service, if known."""
        try:
            return self._find().url
        except ServiceNotRunning:
            return "nowhere: nothing is running"

    async def perform(self, plan: Plan[T]) -> T:
        """Return the result of a plan; an interruption is raised in the plan, so that it can clean up."""
        course: PlanRunner[T] = PlanRunner(plan)
        async with AsyncExitStack() as lines:
            while (step := course.step) is not None:
                await self._advance(course, step, lines)
        return course.result

    async def iterate(self, source: StreamPlan[T]) -> AsyncIterator[T]:
        """Yield the items of a source as they arrive."""
        course: PlanRunner[None] = PlanRunner(source)
        with closing(course):
            async with AsyncExitStack() as lines:
                while (step := course.step) is not None:
                    if isinstance(step, Emit):
                        yield cast("Emit[T]", step).value
                        course.answered(None)
                    else:
                        await self._advance(course, step, lines)

    async def close(self) -> None:
        """Close all connections."""
        await self._http.aclose()
        await self._urgent.aclose()

    async def _advance(self, course: PlanRunner[Any], step: Step | Emit[Any], lines: AsyncExitStack) -> None:
        try:
            answer = await self._carry_out(step, lines)
        except BaseException as error:  # noqa: BLE001 - the plan handles it
            course.failed(error)
        else:
            course.answered(answer)

    async def _carry_out(self, step: Step | Emit[Any], lines: AsyncExitStack) -> Any:
        match step:
            case Request():
                return await self._ask(step)
            case Sleep():
                return await asyncio.sleep(max(0.0, step.seconds))
            case ReadClock():
                return time.monotonic()
            case Connect():
                return await self._dial(step.path, lines)
            case Send() | Receive():
                return await _conversed(step)
            case Emit():
                return None

    async def _ask(self, request: Request[T]) -> T:
        if not request.urgent:
            self.held.require()
        url, headers, content = transport.encoded(request, self._find(), self.held.id)
        http = self._urgent if request.urgent else self._http
        with transport.translated():
            answer = await http.request(request.method, url, headers=headers, content=content, timeout=request.timeout)
        return transport.decoded(request, answer.status_code, answer.headers, answer.content)

    async def _dial(self, path: str, lines: AsyncExitStack) -> Line:
        await lines.aclose()
        with transport.translated():
            return Line(await lines.enter_async_context(self._connected(self._find(), path)))

    @asynccontextmanager
    async def _connected(self, service: ServiceAddress, path: str) -> AsyncIterator[ClientConnection]:
        """Open a websocket for a block; cut it at the end if the ending loop leaves no time for a closing handshake."""
        socket = await connect(
            transport.stream_url(service, path),
            ssl=self._trust if service.url.startswith("https") else None,
            additional_headers=transport.identity(service.token),
            compression=None,
            proxy=None,
            open_timeout=TIMEOUT,
            close_timeout=1.0,
        )
        try:
            yield socket
        finally:
            try:
                await socket.close()
            finally:
                socket.transport.abort()


async def _conversed(step: Send | Receive) -> str | bytes | None:
    socket = cast("ClientConnection", step.line)
    with transport.translated(), suppress(TimeoutError):
        if isinstance(step, Receive):
            async with asyncio.timeout(0.0 if step.now else None):
                return await socket.recv()
        await socket.send(json.dumps(step.message))
    return None
