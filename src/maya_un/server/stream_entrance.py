"""Authentication of the stream: by the request, or by the first message, since browsers cannot add headers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from starlette.websockets import WebSocket

from maya_un.api.access.caller import Caller
from maya_un.errors import InvalidRequest, NotSignedIn
from maya_un.server.bridge import Bridge
from maya_un.server.stream_messages import PROTOCOL, decoded, kind_of
from maya_un.server.who import is_local, source_of


async def received(socket: WebSocket) -> str | bytes | None:
    """Return the next message of a client, None where the connection is over."""
    message = await socket.receive()
    if message["type"] == "websocket.disconnect":
        return None
    text: str | bytes | None = message.get("text")
    return message["bytes"] if text is None else text


class StreamHandshake:
    """Names the client of `socket`; called again for every message, since a token may be revoked."""

    def __init__(self, socket: WebSocket, bridge: Bridge) -> None:
        self._socket = socket
        self._bridge = bridge
        self._shown = socket.headers.get("authorization")

    async def caller(self) -> Caller:
        """Return who is there; raises `NotSignedIn`, `TooManyRequests`."""
        source, local = source_of(self._socket), is_local(self._socket)
        return await self._bridge.caller(self._shown, "", source, loopback=local, stopping=False)

    async def introduced(self) -> Caller | None:
        """Return who is there, by the request or the first message; None where the connection is over.

        Raises `NotSignedIn`, `TooManyRequests`, `InvalidRequest`.
        """
        try:
            return await self.caller()
        except NotSignedIn:
            if self._shown is not None:
                raise
        text = await received(self._socket)
        return None if text is None else await self.meet(decoded(text))

    async def meet(self, message: Mapping[str, Any]) -> Caller:
        """Return who says `hello`, by its token where it shows one; raises as `introduced` does."""
        if kind_of(message) != "hello":
            raise NotSignedIn(reason="the first message is not `hello` with a token")
        if message.get("protocol", PROTOCOL) != PROTOCOL:
            raise InvalidRequest(key="protocol", reason=f"this is version {PROTOCOL}")
        token = message.get("token")
        if token is not None and not isinstance(token, str):
            raise InvalidRequest(key="token", reason="it is a text")
        if token is not None:
            self._shown = f"Bearer {token}"
        return await self.caller()
