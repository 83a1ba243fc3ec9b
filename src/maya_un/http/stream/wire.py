"""The websocket's end of a connection: frames that clients share go straight to the transport.

uvicorn keeps the handshake, reading, pings and closing. Only messages to many readers bypass it, since every layer
above the transport would cost as much again for each of a hundred readers.
"""

from __future__ import annotations

import logging
import socket
import struct
from asyncio.transports import BaseTransport
from collections.abc import Callable

from uvicorn.config import Config
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from uvicorn.server import ServerState
from websockets.frames import Frame
from websockets.http11 import Request
from websockets.server import ServerProtocol

TEXT, BINARY = 0x81, 0x82


def framed(content: bytes, kind: int = TEXT) -> bytes:
    """Return `content` (of a text: UTF-8) as one frame."""
    length = len(content)
    if length < 126:
        return bytes((kind, length)) + content
    if length < 65_536:
        return struct.pack("!BBH", kind, 126, length) + content
    return struct.pack("!BBQ", kind, 127, length) + content


WIRE = "maya.wire"
"""The key of a connection's wire among the extensions of its ASGI scope."""

LONGEST_MESSAGE = 65_536
"""Longest message that a client may send [bytes]."""

HIGH_WATER, LOW_WATER = 65_536, 16_384
"""Nothing more is written to a connection that owes the system so much, until it is down to so little [bytes]."""

KERNEL_BUFFER = 262_144
"""Bytes that the system may buffer for a slow reader; without a bound it keeps megabytes of old states."""

PING_INTERVAL, PING_TIMEOUT = 10.0, 20.0
"""How often a client is asked whether it is alive, and how long it may take to answer [s]."""

LINGER = 2.0
"""How long a connection that ends may take to say so, before it is cut [s]."""


SILENT = logging.getLogger("maya_un.http.silent")
"""The library logs whole handshakes and messages, tokens too, where debugging is on; by this logger it never does."""
SILENT.disabled = True


class StreamWire(WebSocketsSansIOProtocol):
    """One websocket connection. `on_room` is called when a reader that was behind takes more again."""

    def __init__(
        self,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, object],
    ) -> None:
        super().__init__(config, server_state, app_state)
        self.conn = ServerProtocol(max_size=LONGEST_MESSAGE, logger=SILENT)
        self.ping_interval, self.ping_timeout = PING_INTERVAL, PING_TIMEOUT
        self.on_room: Callable[[], None] | None = None
        self.full = False

    def connection_made(self, transport: BaseTransport) -> None:
        """Bound what is kept for a reader that is behind."""
        super().connection_made(transport)
        self.transport.set_write_buffer_limits(HIGH_WATER, LOW_WATER)
        connection = transport.get_extra_info("socket")
        if connection is not None:
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, KERNEL_BUFFER)

    def handle_connect(self, event: Request) -> None:
        """Show the application this wire."""
        super().handle_connect(event)
        if not self.close_sent:
            self.scope["extensions"][WIRE] = self  # type: ignore[typeddict-unknown-key]

    def pause_writing(self) -> None:
        """Be full: the reader is behind."""
        super().pause_writing()
        self.full = True

    def resume_writing(self) -> None:
        """Take more again."""
        super().resume_writing()
        self.full = False
        if self.on_room is not None:
            self.on_room()

    @property
    def over(self) -> bool:
        """Whether nothing more can be said."""
        return self.close_sent or self.disconnected or self.transport.is_closing()

    def write(self, frames: bytes) -> None:
        """Send whole frames; never waits, and drops them where the connection is over."""
        if not self.over:
            self.transport.write(frames)

    def end(self, code: int, reason: str) -> None:
        """Close with `code` and `reason` (at most 123 bytes), and cut a client that does not take it."""
        if self.over:
            return
        self.queue.put_nowait({"type": "websocket.disconnect", "code": code, "reason": reason})
        self.conn.send_close(code, reason)
        self.transport.write(b"".join(self.conn.data_to_send()))
        self.close_sent = True
        if self.read_paused:
            self.read_paused = False
            self.transport.resume_reading()
        self._linger()

    def handle_close(self, event: Frame) -> None:
        """Answer a client that closes; one that does not take the answer is cut."""
        super().handle_close(event)
        self._linger()

    def keepalive_timeout(self) -> None:
        """Cut a client that is dead: what is kept for it would never be taken."""
        super().keepalive_timeout()
        self.transport.abort()

    def shutdown(self) -> None:
        """Close because the server ends; readers that are behind are cut."""
        super().shutdown()
        if self.full:
            self.transport.abort()

    def _linger(self) -> None:
        if self.close_timer is None and not self.disconnected:
            self.close_timer = self.loop.call_later(LINGER, self.transport.abort)
