"""Checks before every request: origin, size, rate and time; unexpected errors; the access log."""

from __future__ import annotations

import asyncio
import itertools
import logging
import secrets
from collections.abc import Mapping
from http import HTTPStatus
from math import ceil
from typing import Any

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import Response
from starlette.routing import BaseRoute, Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from dmc41x3.i18n import phrase
from maya_un import __version__
from maya_un.errors import InvalidRequest, MayaError, TooManyRequests
from maya_un.http.connections import is_local, source_of
from maya_un.http.errors import language_of, problem
from maya_un.http.log import note, written_down
from maya_un.http.metrics import Metrics
from maya_un.http.origins import OriginPolicy, Rate
from maya_un.http.protocol import STOPS_ONLY
from maya_un.service.access.callers import counted, hidden

LONG = 16_384
"""Longest body that is parsed in the loop [bytes]; only bodies that may contain a job can be longer."""

_MOST_SOURCES = 10_000


class Buckets:
    """The token buckets of all sources. A source whose bucket is full again is forgotten."""

    def __init__(self, rate: Rate) -> None:
        self._rate = rate
        self._left: dict[str, tuple[float, float]] = {}

    def __len__(self) -> int:
        return len(self._left)

    def take(self, source: str, now: float) -> None:
        """Take one request of `source` at `now` [s, loop time]; raises `TooManyRequests`."""
        name = counted(source)
        burst = self._rate.burst
        left, then = self._left.pop(name, (burst, now))
        left = min(burst, left + (now - then) * self._rate.per_second)
        if left < 1.0:
            self._left[name] = (left, now)
            wait = ceil((1.0 - left) / self._rate.per_second)
            seconds = f"{burst / self._rate.per_second:g}"
            raise TooManyRequests(limit=round(burst), seconds=seconds, wait=wait)
        self._left[name] = (left - 1.0, now)
        if len(self._left) > _MOST_SOURCES:
            del self._left[next(iter(self._left))]  # the source of the oldest request has the fullest bucket


NOWHERE = "-"
"""The path in the metrics for requests without a route."""

_LOOKING = frozenset({"GET", "HEAD", "OPTIONS"})
_UNSAID = frozenset({HTTPStatus.TOO_MANY_REQUESTS})
_METHODS = frozenset({"GET", "HEAD", "OPTIONS", "POST", "PUT", "PATCH", "DELETE"})
_LONGEST = 200


class AccessLogEntry:
    """Records one request from its start, for the metrics and the log."""

    def __init__(self, scope: Scope, metrics: Metrics) -> None:
        self._scope = scope
        self._metrics = metrics
        self._method: str = scope["method"]
        self._path: str = scope["path"]
        self._began = asyncio.get_running_loop().time()
        self._status = HTTPStatus.INTERNAL_SERVER_ERROR.value

    def watching(self, send: Send) -> Send:
        """Return a `send` that records the answer."""

        async def sent(message: Message) -> None:
            await send(message)
            if message["type"] == "http.response.start":
                self._status = message["status"]
            elif message["type"] == "http.response.body" and not message.get("more_body"):
                self._close()

        return sent

    def _close(self) -> None:
        seconds = asyncio.get_running_loop().time() - self._began
        method = self._method if self._method in _METHODS else NOWHERE
        self._metrics.answered(method, _declared(self._scope.get("route")), self._status, seconds)
        failed = self._status >= HTTPStatus.INTERNAL_SERVER_ERROR
        refused = self._status >= HTTPStatus.BAD_REQUEST and self._status not in _UNSAID
        if refused or self._method not in _LOOKING:
            self._write(logging.WARNING if failed else logging.INFO, seconds)

    def _write(self, level: int, seconds: float) -> None:
        state: Mapping[str, Any] = self._scope["state"]
        path = hidden(self._path)[:_LONGEST]
        note(
            "http",
            level,
            f"{self._method[:16]} {path} {self._status}",
            request=state["request"],
            method=self._method,
            path=path,
            status=self._status,
            code=state.get("code", 0),
            who=state.get("who", ""),
            source=(self._scope.get("client") or ("",))[0],
            seconds=round(seconds, 6),
        )


def _declared(route: BaseRoute | None) -> str:
    return route.path_format if isinstance(route, Route) else NOWHERE


BODY_LIMIT = 1_000_000
"""Longest body of a request that may contain a job [bytes]; the longest job has about half of it."""

_LONG_BODIES = ("/v1/jobs", "/v1/preview", "/v1/inspect", "/v1/config")
"""Paths whose body may contain a job or a configuration; other bodies are limited to `LONG` bytes and parsed at once.
"""

BODY_PATIENCE = 20.0
"""Time limit for the arrival of a body [s, real time]."""

UNLIMITED = frozenset({"/v1/stop", "/v1/abort"})
"""Paths without a rate limit: stopping must always work."""

_PREFLIGHT = {
    "Access-Control-Allow-Methods": "GET, POST, PUT, PATCH, DELETE",
    "Access-Control-Allow-Headers": "Authorization, Content-Type, Idempotency-Key, Maya-Lease, Accept-Language",
    "Access-Control-Max-Age": "600",
}
_SHOWN = "Maya, Maya-Request, Retry-After, Content-Disposition"


_FULL = InvalidRequest(key="connection", reason="there are too many; stop and abort are answered all the same")


class _GoneError(Exception):
    """The client disconnected before it had sent the whole body."""


class RequestGuard:
    """ASGI middleware around the whole application, for HTTP and websockets alike.

    The header `Maya` of every answer identifies the service; `Maya-Request` is the id of the request in the log.
    """

    def __init__(self, app: ASGIApp, edge: OriginPolicy, metrics: Metrics) -> None:
        self._app = app
        self._edge = edge
        self._metrics = metrics
        self._near, self._far, self._files = Buckets(edge.near), Buckets(edge.far), Buckets(edge.files)
        self._names = (f"{secrets.token_hex(3)}-{number}" for number in itertools.count(1))

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check one request, pass it on, and answer unexpected errors."""
        if scope["type"] not in {"http", "websocket"}:
            await self._app(scope, receive, send)
            return
        name = next(self._names)
        scope.setdefault("state", {})["request"] = name
        if scope["type"] == "http":
            send = AccessLogEntry(scope, self._metrics).watching(send)
        connection = HTTPConnection(scope)
        local = is_local(connection)
        stranger = self._edge.refusal(connection.headers)
        if not stranger and scope["state"].get(STOPS_ONLY) and scope["path"] not in UNLIMITED:
            full = problem(_FULL, language_of(connection.headers), HTTPStatus.SERVICE_UNAVAILABLE)
            full.headers["Connection"] = "close"
            await full(scope, receive, _marked(send, name, connection.headers.get("origin")))
            return
        marked = _marked(send, name, None if stranger else connection.headers.get("origin"))
        refusal = stranger or self._too_often(connection, local=local)
        if refusal is not None:
            status = HTTPStatus.FORBIDDEN if stranger else None
            await problem(refusal, language_of(connection.headers), status)(scope, receive, marked)
        elif scope["type"] == "websocket":
            with self._metrics.streams.track_inprogress():
                await self._app(scope, receive, marked)
        elif scope["method"] == "OPTIONS" and "access-control-request-method" in connection.headers:
            await Response(status_code=HTTPStatus.NO_CONTENT, headers=_PREFLIGHT)(scope, receive, marked)
        else:
            await self._http(scope, receive, marked)

    def _too_often(self, connection: HTTPConnection, *, local: bool) -> MayaError | None:
        if connection.scope["path"] in UNLIMITED:
            return None
        buckets = self._near if local else self._files if _is_file(connection.scope) else self._far
        try:
            buckets.take(source_of(connection), asyncio.get_running_loop().time())
        except TooManyRequests as error:
            return error
        return None

    async def _http(self, scope: Scope, receive: Receive, send: Send) -> None:
        language = language_of(Headers(scope=scope))
        most = BODY_LIMIT if scope["path"].startswith(_LONG_BODIES) else LONG
        try:
            async with asyncio.timeout(BODY_PATIENCE):
                body = await _whole_body(receive, most)
        except _GoneError:
            return
        except TimeoutError:
            slow = InvalidRequest(
                key="body", reason=phrase("it did not arrive within {seconds:g} s", seconds=BODY_PATIENCE)
            )
            await problem(slow, language, HTTPStatus.REQUEST_TIMEOUT)(scope, receive, send)
            return
        if body is None:
            too_long = InvalidRequest(key="body", reason=phrase("it is longer than {most} bytes", most=most))
            await problem(too_long, language, HTTPStatus.REQUEST_ENTITY_TOO_LARGE)(scope, receive, send)
            return
        if scope["method"] == "HEAD":
            scope["method"], send = "GET", _bodiless(send)
        await self._answer(scope, _replayed(body, receive), send)

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        started = False

        async def watched(message: Message) -> None:
            nonlocal started
            started = True
            await send(message)

        try:
            await self._app(scope, receive, watched)
        except Exception as error:  # noqa: BLE001 - the last handler: a client gets one sentence, the log the traceback
            crash = written_down(error)
            if not started:
                await problem(crash, language_of(Headers(scope=scope)))(scope, receive, send)


def _is_file(scope: Scope) -> bool:
    """Return whether a request is for a page or a file of it: every path with an operation is in the interface."""
    return scope.get("method") in _READING and not scope["path"].startswith(_INTERFACE)


_READING = frozenset({"GET", "HEAD"})
_INTERFACE = ("/v1/", "/metrics")

_STARTS = {"http.response.start", "websocket.http.response.start", "websocket.accept"}


def _marked(send: Send, name: str, origin: str | None) -> Send:
    """Return a `send` that adds the common headers; `origin` is the page that may read the answer, None for none."""

    async def sent(message: Message) -> None:
        if message["type"] in _STARTS:
            message.setdefault("headers", [])
            headers = MutableHeaders(scope=message)
            headers["Maya"] = __version__
            headers["Maya-Request"] = name
            headers["X-Content-Type-Options"] = "nosniff"
            headers.setdefault("Cache-Control", "no-store")
            if origin is not None:
                headers["Access-Control-Allow-Origin"] = origin
                headers["Access-Control-Expose-Headers"] = _SHOWN
                headers.add_vary_header("Origin")
        await send(message)

    return sent


def _bodiless(send: Send) -> Send:
    """Return a `send` that omits the body, for the answer to HEAD."""

    async def sent(message: Message) -> None:
        if message["type"] == "http.response.body":
            message = {**message, "body": b""}
        await send(message)

    return sent


async def _whole_body(receive: Receive, most: int) -> bytes | None:
    """Return a request's body, None if it is longer than `most` bytes."""
    body = bytearray()
    while True:
        message = await receive()
        if message["type"] != "http.request":
            raise _GoneError
        body += message.get("body", b"")
        if len(body) > most:
            return None
        if not message.get("more_body"):
            return bytes(body)


def _replayed(body: bytes, receive: Receive) -> Receive:
    waiting: list[Message] = [{"type": "http.request", "body": body, "more_body": False}]

    async def replay() -> Message:
        return waiting.pop() if waiting else await receive()

    return replay
