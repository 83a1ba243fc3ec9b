"""Requests of this process to the application of the HTTP interface, without a socket.

They pass the same checks as requests from outside: origin, size and rate, rights, lease, audit log. So an interface
that answers them has the operations, errors and words of HTTP.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import Any, NamedTuple
from urllib.parse import unquote

from starlette.types import ASGIApp, Message

from maya_un.http.connections import CALLER
from maya_un.service.access.operations import Caller

_JSON = ("application/json", "application/problem+json")


class InternalRequest(NamedTuple):
    """A request: its method, its path with the query (percent-encoded), its headers and its body."""

    method: str
    target: str
    headers: Mapping[str, str]
    content: bytes = b""


class InternalAnswer(NamedTuple):
    """The answer to a request. `content` is None if it is not JSON: this interface carries no files."""

    status: int
    content: bytes | None


async def answered(
    app: ASGIApp,
    request: InternalRequest,
    caller: Caller,
    source: tuple[str, int],
    left: Callable[[], Awaitable[object]],
) -> InternalAnswer:
    """Return the answer of `app` to a request of `caller`, who is connected from `source`, an address and a port.

    `left` returns when the caller no longer waits for the answer.
    """
    body: list[Message] = [{"type": "http.request", "body": request.content, "more_body": False}]
    status, content, is_json = 500, bytearray(), True

    async def receive() -> Message:
        if body:
            return body.pop()
        await left()
        return {"type": "http.disconnect"}

    async def send(message: Message) -> None:
        nonlocal status, is_json
        if message["type"] == "http.response.start":
            status = message["status"]
            kind = dict(message.get("headers", ())).get(b"content-type", b"").decode("latin-1")
            is_json = kind.partition(";")[0] in {"", *_JSON}
        elif is_json:
            content.extend(message.get("body", b""))

    await app(_scope(request, caller, source), receive, send)
    return InternalAnswer(status, bytes(content) if is_json else None)


def _scope(request: InternalRequest, caller: Caller, source: tuple[str, int]) -> dict[str, Any]:
    """Return the ASGI scope of a request with a known caller, which no connection from outside can set."""
    raw, _, query = request.target.partition("?")
    return {
        "type": "http",
        "asgi": {"version": "3.0"},
        "http_version": "1.1",
        "method": request.method,
        "scheme": "http",
        "path": unquote(raw),
        "raw_path": raw.encode(),
        "query_string": query.encode(),
        "root_path": "",
        "headers": [(key.lower().encode("latin-1"), value.encode("latin-1")) for key, value in request.headers.items()],
        "client": source,
        "server": None,
        CALLER: caller,
    }
