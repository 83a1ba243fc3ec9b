"""Who reads the stream: told by the request as everywhere, or by the first message, for browsers cannot add headers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from starlette.requests import HTTPConnection
from starlette.websockets import WebSocket

from maya_un.api.access.caller import Caller
from maya_un.api.access.operations import Operation
from maya_un.errors import NotSignedIn
from maya_un.server.bridge import Bridge
from maya_un.server.stream_messages import understood
from maya_un.server.who import caller_of

_READ = (Operation.READ,)


async def received(socket: WebSocket) -> str | bytes | None:
    """Return the next message of a client, None where the connection is over."""
    message = await socket.receive()
    if message["type"] == "websocket.disconnect":
        return None
    text: str | bytes | None = message.get("text")
    return message["bytes"] if text is None else text


async def introduced(socket: WebSocket, bridge: Bridge) -> Caller | None:
    """Return who is there, None where the connection is over; raises `NotSignedIn`, `InvalidRequest`."""
    try:
        return await caller_of(socket, bridge, _READ)
    except NotSignedIn:
        if "authorization" in socket.headers:
            raise
    text = await received(socket)
    return None if text is None else await by_token(socket, bridge, understood(text))


async def by_token(socket: WebSocket, bridge: Bridge, message: Mapping[str, Any]) -> Caller:
    """Return who shows the token of a `hello`; raises `NotSignedIn`."""
    token = message.get("token")
    if message["type"] != "hello" or not isinstance(token, str) or not token.isascii():
        raise NotSignedIn(reason="the first message is not `hello` with a token")
    others = [pair for pair in socket.scope["headers"] if pair[0] != b"authorization"]
    shown = (b"authorization", b"Bearer " + token.encode("ascii"))
    return await caller_of(HTTPConnection({**socket.scope, "headers": [*others, shown]}), bridge, _READ)
