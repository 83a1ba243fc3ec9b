"""Requests that a client sends on the stream: those of HTTP, answered by the same application.

On one connection they begin in the order in which they were sent, and no other request of the same browser delays them.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from starlette.types import ASGIApp
from starlette.websockets import WebSocket

from dmc41x3.i18n import phrase
from maya_un.errors import InvalidRequest, MayaError, RequestLate, TooManyRequests
from maya_un.http.connections import source_of
from maya_un.http.errors import language_of
from maya_un.http.internal import InternalRequest, answered
from maya_un.http.log import written_down
from maya_un.http.middleware import UNLIMITED
from maya_un.http.stream.messages import error_frame, response_frame
from maya_un.service.access.operations import Caller

MOST_AT_ONCE = 16
"""Maximum number of requests of one client that wait for their answers; stop and abort are always accepted."""

MOST_DELAY = 5
"""Longest time from the sending of a request to its arrival [s]; stop and abort are accepted after any time."""

_LARGEST = 1e12
"""Largest value of `sent` that is accepted [s]."""

_PASSED_ON = ("forwarded", "host", "origin", "x-forwarded-for", "x-real-ip")
"""Headers of the handshake that decide how a request is checked and answered."""

_METHODS = frozenset({"GET", "POST", "PUT", "PATCH", "DELETE"})


class StreamRequests:
    """The requests of one client; `write` sends a frame to it, and `language` returns that of its connection."""

    def __init__(self, socket: WebSocket, write: Callable[[bytes], None], language: Callable[[], str]) -> None:
        self._app: ASGIApp = socket.app
        self._headers = {name: socket.headers[name] for name in _PASSED_ON if name in socket.headers}
        self._source = (source_of(socket), 0)
        self._write = write
        self._language = language
        self._left = asyncio.Event()
        self._tasks: set[asyncio.Task[None]] = set()

    def begin(self, message: Mapping[str, Any], caller: Caller, lease: str) -> None:
        """Begin a request for `caller`, with this lease if the message names none.

        Raises `InvalidRequest`, `TooManyRequests` if too many others wait for their answers, and `RequestLate`.
        """
        request = self._request(message)
        if request.target not in UNLIMITED:
            _require_in_time(message)
        caller = replace(caller, lease=_text(message, "lease", lease))
        if len(self._tasks) >= MOST_AT_ONCE and request.target not in UNLIMITED:
            raise TooManyRequests(limit=MOST_AT_ONCE, seconds="1", wait=1)
        task = asyncio.get_running_loop().create_task(self._answer(message, request, caller), name="request on stream")
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def end(self) -> None:
        """Tell the requests that their client has left. As over HTTP, only those end that serve nobody else."""
        self._left.set()

    def _request(self, message: Mapping[str, Any]) -> InternalRequest:
        method, path = _text(message, "method", "POST"), _text(message, "path", "")
        if method not in _METHODS:
            raise InvalidRequest(
                key="method", reason=phrase("it must be one of {choices}", choices=", ".join(sorted(_METHODS)))
            )
        if not path.startswith("/v1/") or not path.isascii() or not path.isprintable():
            raise InvalidRequest(key="path", reason="it must be a path like /v1/stop, percent-encoded")
        content = json.dumps(message["body"]).encode() if message.get("body") is not None else b""
        asked = _text(message, "language", "")
        language = language_of({"accept-language": asked}) if asked else self._language()
        headers = {**self._headers, "accept-language": language, **_key(message)}
        return InternalRequest(method, path, headers, content)

    async def _answer(self, message: Mapping[str, Any], request: InternalRequest, caller: Caller) -> None:
        try:
            answer = await answered(self._app, request, caller, self._source, self._left.wait)
        except Exception as defect:  # noqa: BLE001 - no code awaits this task; the client and the log get the error
            self._refuse(message, request, written_down(defect))
            return
        if answer.content is None:
            self._refuse(
                message, request, InvalidRequest(key="path", reason="its answer is not JSON; ask for it over HTTP")
            )
        else:
            self._write(response_frame(answer.status, answer.content, message))

    def _refuse(self, message: Mapping[str, Any], request: InternalRequest, error: MayaError) -> None:
        self._write(error_frame(error, language_of(request.headers), message))


def _require_in_time(message: Mapping[str, Any]) -> None:
    """Refuse a request that the connection held back, because its sender may have given it up: nothing moves then."""
    sent = message.get("sent")
    if sent is None:
        return
    if not isinstance(sent, int | float) or isinstance(sent, bool) or not abs(sent) <= _LARGEST:
        raise InvalidRequest(key="sent", reason="it must be a time of the stream's clock")
    delay = asyncio.get_running_loop().time() - sent
    if not delay <= MOST_DELAY:
        raise RequestLate(seconds=round(delay), most=MOST_DELAY)


def _key(message: Mapping[str, Any]) -> dict[str, str]:
    """Return the header with the idempotency key of a request, {} without one."""
    key = _text(message, "key", "")
    if not (key.isascii() and key.isprintable() and key == key.strip()):
        raise InvalidRequest(key="key", reason="it must be printable ASCII, without spaces around it")
    return {"idempotency-key": key} if key else {}


def _text(message: Mapping[str, Any], key: str, default: str) -> str:
    value = message.get(key, default)
    if not isinstance(value, str):
        raise InvalidRequest(key=key, reason="it must be a text")
    return value
