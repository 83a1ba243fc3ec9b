"""One websocket of the endpoint: the handshake, received data, sent data, and the end.

The library `websockets` provides the protocol, but not reading and writing: messages are carried out as they arrive,
frames that many clients share go straight to the transport, and no client is waited for. Compression of the transport
is off: it needs a state for each connection, and messages are small.
"""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from http import HTTPStatus
from ipaddress import ip_address
from typing import Protocol, cast

from starlette.datastructures import Headers
from websockets.frames import Frame, Opcode
from websockets.http11 import Request
from websockets.protocol import State
from websockets.server import ServerProtocol

from maya_ros.rosbridge.limits import LONGEST_MESSAGE, READ_AT_ONCE
from maya_un.errors import MayaError
from maya_un.http.errors import language_of
from maya_un.http.stream.messages import (
    HIGH_WATER,
    KERNEL_BUFFER,
    LINGER,
    LOW_WATER,
    PING_INTERVAL,
    PING_TIMEOUT,
    SILENT,
)

HANDSHAKE = 10.0
"""Longest wait for a client's handshake [s]."""

GOING = 1012
"""Closing code: the service ends (IANA's register of codes, "service restart")."""

_FORWARDED = ("forwarded", "x-forwarded-for", "x-real-ip")


class MessageHandler(Protocol):
    """Executes the messages of a client."""

    on_calm: Callable[[], None] | None

    @property
    def busy(self) -> bool:
        """Whether it should receive no more messages now."""
        ...

    def take(self, *texts: str | bytes) -> None:
        """Carry out messages that arrived together."""
        ...


class RosbridgeHost(Protocol):
    """Admits clients."""

    def refusal(self, headers: Headers) -> MayaError | None:
        """Return why a client is refused, None if it is admitted."""
        ...

    def enter(self, wire: RosbridgeWire, headers: Headers, source: str, *, local: bool) -> MessageHandler:
        """Start the session of a client."""
        ...

    def leave(self, wire: RosbridgeWire) -> None:
        """End the session: the connection is closed."""
        ...


class RosbridgeWire(asyncio.BufferedProtocol):
    """One connection; see `client.SenderWire` for its use by a sender."""

    def __init__(self, host: RosbridgeHost) -> None:
        self._host = host
        self._loop = asyncio.get_running_loop()
        self._conn = ServerProtocol(max_size=LONGEST_MESSAGE, logger=SILENT)
        self._conversation: MessageHandler | None = None
        self._parts: list[bytes] = []
        self._read = bytearray(READ_AT_ONCE)
        self._timer: asyncio.TimerHandle | None = None
        self._waiting = b""
        self._pings = 0
        self.on_room: Callable[[], None] | None = None
        self.full = False
        self._live = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Limit the buffers for a slow client, and the time until the handshake."""
        self._transport = cast("asyncio.Transport", transport)
        self._transport.set_write_buffer_limits(HIGH_WATER, LOW_WATER)
        connection = transport.get_extra_info("socket")
        if connection is not None:
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, KERNEL_BUFFER)
        self._timer = self._loop.call_later(HANDSHAKE, self._transport.abort)

    def get_buffer(self, sizehint: int) -> bytearray:
        """Return the buffer for received data, whose size limits the work of one turn."""
        del sizehint
        return self._read

    def buffer_updated(self, nbytes: int) -> None:
        """Handle received data."""
        self._conn.receive_data(bytes(self._read[:nbytes]))
        texts: list[bytes] = []
        for event in self._conn.events_received():
            if isinstance(event, Request):
                self._open(event)
            elif isinstance(event, Frame):
                texts += self._taken(event)
        if texts and self._conversation is not None:
            self._conversation.take(*texts)
        self._flush()
        self._live = self._live and self._conn.state is State.OPEN
        if self._conn.close_expected():
            self._linger()
        elif self._conversation is not None and self._conversation.busy:
            self._transport.pause_reading()

    def eof_received(self) -> bool:
        """Handle the end from the other side."""
        self._conn.receive_eof()
        self._flush()
        return False

    def connection_lost(self, exc: Exception | None) -> None:
        """End the session."""
        del exc
        self._live = False
        self._stop_timer()
        if self._conversation is not None:
            self._conversation = None
            self._host.leave(self)

    def pause_writing(self) -> None:
        """Mark the wire as full: the client is slow."""
        self.full = True

    def resume_writing(self) -> None:
        """Mark the wire as not full, and call `on_room`."""
        self.full = False
        if self.on_room is not None:
            self.on_room()

    def write(self, frames: bytes) -> None:
        """Send complete frames without waiting; after the end, send nothing."""
        if self._live:
            self._transport.write(frames)

    def end(self, code: int, reason: str) -> None:
        """Close with `code` and `reason`; abort the connection if the client does not respond."""
        self._live = False
        if self._conn.state is State.OPEN:
            self._conn.send_close(code, reason)
            self._flush()
            self._transport.resume_reading()
            self._linger()
        else:
            self._transport.abort()

    def _open(self, request: Request) -> None:
        headers = Headers(
            raw=[
                (name.lower().encode(), value.encode("latin-1", "replace"))
                for name, value in request.headers.raw_items()
            ]
        )
        response = self._conn.accept(request)
        refusal = self._host.refusal(headers)
        if refusal is not None:
            text = f"{refusal.code}: {refusal.text(language_of(headers))}\n"
            response = self._conn.reject(HTTPStatus.FORBIDDEN, text)
        self._conn.send_response(response)
        self._flush()
        if self._conn.state is not State.OPEN:
            return
        self._live = True
        self._stop_timer()
        self._ping_later()
        self._conversation = self._host.enter(self, headers, self._source, local=self._is_local(headers))
        self._conversation.on_calm = self._resume

    def _is_local(self, headers: Headers) -> bool:
        """Return whether the client is on this machine; a forwarded client is not."""
        try:
            return ip_address(self._source).is_loopback and not any(name in headers for name in _FORWARDED)
        except ValueError:
            return False

    @property
    def _source(self) -> str:
        """Address of the client."""
        peer = self._transport.get_extra_info("peername")
        return str(peer[0]) if peer else ""

    def _resume(self) -> None:
        if not self._transport.is_closing():
            self._transport.resume_reading()

    def _taken(self, frame: Frame) -> tuple[bytes, ...]:
        """Return the message that a frame completes, if any."""
        match frame.opcode:
            case Opcode.TEXT | Opcode.BINARY | Opcode.CONT:
                self._parts.append(bytes(frame.data))
                if frame.fin:
                    content, self._parts = b"".join(self._parts), []
                    return (content,)
            case Opcode.PONG:
                self._ponged(bytes(frame.data))
            case _:
                pass
        return ()

    def _flush(self) -> None:
        """Send the protocol's pending data."""
        for data in self._conn.data_to_send():
            if self._transport.is_closing():
                return
            if data:
                self._transport.write(data)
            elif self._transport.can_write_eof():
                self._transport.write_eof()

    def _ping_later(self) -> None:
        self._timer = self._loop.call_later(PING_INTERVAL, self._ping)

    def _ping(self) -> None:
        self._pings += 1
        self._waiting = b"%d" % self._pings
        if self._live:
            self._conn.send_ping(self._waiting)
            self._flush()
        self._timer = self._loop.call_later(PING_TIMEOUT, self._transport.abort)

    def _ponged(self, payload: bytes) -> None:
        if payload == self._waiting and self._conn.state is State.OPEN:
            self._stop_timer()
            self._ping_later()

    def _linger(self) -> None:
        self._stop_timer()
        self._timer = self._loop.call_later(LINGER, self._transport.abort)

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
