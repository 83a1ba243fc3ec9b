"""What stands before every request: only this machine's own clients, bodies of bounded size, no traceback."""

from __future__ import annotations

from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from maya_un.errors import InvalidRequest, MayaError
from maya_un.server.crash import written_down
from maya_un.server.problems import problem

BODY_LIMIT = 1_000_000
"""Longest body of a request [bytes]; a job of ten thousand steps has about half of it."""

_OWN_NAMES = {"localhost", "127.0.0.1", "::1"}


class Guard:
    """ASGI middleware around the whole application.

    The server listens on loopback only; a browser page from elsewhere could still reach it, so the Host and
    Origin of a request must be loopback names too.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check one request, hand it on, and answer for whatever nobody foresaw."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        refusal = _stranger(Headers(scope=scope))
        if refusal is not None:
            await problem(refusal, status=403)(scope, receive, send)
            return
        body = await _whole_body(receive)
        if body is None:
            too_long = InvalidRequest(key="body", reason=f"it is longer than {BODY_LIMIT} bytes")
            await problem(too_long, status=413)(scope, receive, send)
            return
        await self._answer(scope, _replayed(body, receive), send)

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        started = False

        async def watched(message: Message) -> None:
            nonlocal started
            started = True
            await send(message)

        try:
            await self._app(scope, receive, watched)
        except Exception as error:  # noqa: BLE001 - the last door: a client gets one sentence, the log the rest
            crash = written_down(error)
            if not started:
                await problem(crash)(scope, receive, send)


def _stranger(headers: Headers) -> MayaError | None:
    host, origin = headers.get("host"), headers.get("origin")
    if _name_in(f"//{host}") not in _OWN_NAMES:
        return InvalidRequest(key="Host", reason="it is not a name of this machine's loopback")
    if origin is not None and _name_in(origin) not in _OWN_NAMES:
        return InvalidRequest(key="Origin", reason="pages from elsewhere may not command the robot")
    return None


def _name_in(url: str) -> str | None:
    try:
        return urlsplit(url).hostname
    except ValueError:  # brackets that do not close
        return None


async def _whole_body(receive: Receive) -> bytes | None:
    body = bytearray()
    while True:
        message = await receive()
        body += message.get("body", b"")
        if len(body) > BODY_LIMIT:
            return None
        if message["type"] != "http.request" or not message.get("more_body"):
            return bytes(body)


def _replayed(body: bytes, receive: Receive) -> Receive:
    waiting: list[Message] = [{"type": "http.request", "body": body, "more_body": False}]

    async def replay() -> Message:
        return waiting.pop() if waiting else await receive()

    return replay
