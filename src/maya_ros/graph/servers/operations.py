"""All operations of the service on a graph, by name: the service /call_operation.

Operations, parameters, rights, errors and answers are those of the routes of `maya_un.http`. Its application answers
the call within this process, without a socket.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Callable, Mapping
from contextlib import asynccontextmanager
from http import HTTPStatus
from typing import TYPE_CHECKING, Any, Protocol

from dmc41x3.i18n import phrase
from maya_ros.graph.access import STOPS
from maya_ros.graph.outcome import failure, success
from maya_ros.graph.protocol import Graph, Message
from maya_ros.graph.servers.process import Asker, sender
from maya_ros.graph.table import CALL_OPERATION
from maya_un.client.operations import request_of
from maya_un.client.request import Request
from maya_un.client.transport import ServiceAddress, encoded, refusal
from maya_un.errors import InvalidRequest, MayaError, Stopped
from maya_un.http.internal import InternalRequest, answered
from maya_un.process.spec.json_object import decode_object
from maya_un.service.access.operations import Caller

if TYPE_CHECKING:
    from starlette.types import ASGIApp

    from maya_un.http.bridge import Bridge

LONGEST = 16_384
"""Longest arguments of a call [characters]: they are parsed in the loop. Longer jobs go over HTTP."""

_SOURCE = ("127.0.0.1", 0)


class OperationApp(Protocol):
    """Answers requests of operations."""

    async def ready(self) -> None:
        """Wait until requests are answered at once."""
        ...

    async def ask(self, request: Request[Any], caller: Caller) -> str:
        """Return the answer as JSON, "" for none; raises the error of the operation."""
        ...


class InternalApp:
    """The application of the HTTP interface on `bridge`, for requests of this process. It belongs to one loop."""

    def __init__(self, bridge: Bridge) -> None:
        self._bridge = bridge
        self._app: asyncio.Future[ASGIApp] | None = None

    async def ready(self) -> None:
        """Wait until there is an application."""
        await self._found()

    async def _found(self) -> ASGIApp:
        if self._app is None or (self._app.done() and self._app.exception() is not None):
            self._app = asyncio.get_running_loop().run_in_executor(None, _app_of, self._bridge)
        return await asyncio.shield(self._app)

    async def ask(self, request: Request[Any], caller: Caller) -> str:
        """Return the answer as JSON, "" for none; raises the error of the operation."""
        app = await self._found()
        sent = encoded(request, ServiceAddress(""), caller.lease)
        headers = {**sent.headers, "Host": "localhost"}
        asked = InternalRequest(request.method, sent.url, headers, sent.content)
        answer = await answered(app, asked, caller, _SOURCE, asyncio.Event().wait)
        content = answer.content or b""
        if answer.status >= HTTPStatus.BAD_REQUEST:
            raise refusal(content)
        return content.decode()


def _app_of(bridge: Bridge) -> ASGIApp:
    """Return the application. For a thread: this takes a quarter of a second, which many nodes never need."""
    from maya_un.http.app import create_app  # noqa: PLC0415

    return create_app(bridge)


class OperationServer:
    """Serves /call_operation on a graph; `who` returns the caller, by default the sender of the message.

    `stops` returns the number of stops of the robot so far.
    """

    def __init__(self, app: OperationApp, stops: Callable[[], int], who: Asker = sender) -> None:
        self._app = app
        self._stops = stops
        self._who = who

    @asynccontextmanager
    async def open(self, graph: Graph) -> AsyncGenerator[None]:
        """Serve while the block runs."""
        served = graph.serve(CALL_OPERATION.name, CALL_OPERATION.type, self._answer)
        try:
            yield
        finally:
            served.close()

    async def _answer(self, message: Message) -> Message:
        stops = self._stops()
        try:
            request = request_of(message["operation"], _parameters(message["arguments"]))
            await self._app.ready()
            by = await self._who()
            if self._stops() != stops and request.method != "GET" and message["operation"] not in STOPS:
                raise Stopped
            result = await self._app.ask(request, by)
        except MayaError as error:
            return {**failure(error), "result": ""}
        return {**success(), "result": result}


def _parameters(text: str) -> Mapping[str, Any]:
    """Return the parameters of a call; raises `InvalidRequest`."""
    if len(text) > LONGEST:
        raise InvalidRequest(
            key="arguments", reason=phrase("they are longer than {most} characters; use HTTP", most=LONGEST)
        )
    return decode_object(text.encode("utf-8", "surrogatepass")) if text.strip() else {}
