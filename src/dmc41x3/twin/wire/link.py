"""Connections of the virtual controller: over TCP, and in memory."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Coroutine
from typing import Protocol, cast

from dmc41x3.twin.handles import Handle, HandleProtocol
from dmc41x3.wire.transport import LoopbackTransport

SEGMENT = 450
"""Most bytes of a reply in one packet; a longer one goes out in several."""


_MOST_UNREAD = 4 * 1024 * 1024
"""Bytes that wait for a host that does not read; with more it is given up, as a controller does by its retries."""


class WireLink(Protocol):
    """One connection: bytes out, an end in order, an end by force."""

    def send(self, data: bytes) -> None:
        """Send bytes; after the end they are lost."""
        ...

    def close(self) -> None:
        """End the connection when everything is sent."""
        ...

    def cut(self) -> None:
        """End the connection at once."""
        ...


class LinkOwner(Protocol):
    """Whom a link tells what happens to it."""

    def accept(self, link: WireLink, peer: tuple[str, int], kind: HandleProtocol, port: int) -> Handle | None:
        """Give a new connection to `port` a handle, None where it is not to be had."""
        ...

    def received(self, handle: Handle, data: bytes) -> None:
        """Take bytes that came."""
        ...

    def ended(self, handle: Handle, broken: bool) -> None:
        """Take notice that a connection has ended, by the other side or because it was found `broken`."""
        ...

    def spawn(self, work: Coroutine[None, None, None]) -> None:
        """Run `work` beside the rest."""
        ...


def segments(data: bytes) -> list[bytes]:
    """Return a reply in the pieces in which it goes out."""
    return [data[start : start + SEGMENT] for start in range(0, len(data), SEGMENT)]


class TcpLink(asyncio.Protocol):
    """A TCP connection: one that came, or the one that IH opened for `handle`."""

    def __init__(self, owner: LinkOwner, handle: Handle | None = None) -> None:
        self._owner = owner
        self._transport: asyncio.Transport | None = None
        self._handle = handle
        self._unread = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take a handle, or hang up where there is none."""
        self._transport = cast("asyncio.Transport", transport)
        sock: socket.socket = transport.get_extra_info("socket")
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if self._handle is not None:
            return
        peer, port = transport.get_extra_info("peername"), transport.get_extra_info("sockname")[1]
        self._handle = self._owner.accept(self, (str(peer[0]), int(peer[1])), HandleProtocol.TCP, port)
        if self._handle is None:
            self._transport.abort()

    def data_received(self, data: bytes) -> None:
        """Hand bytes over, as they are cut."""
        if self._handle is not None and self._handle.open:
            self._owner.received(self._handle, data)

    def connection_lost(self, exc: Exception | None) -> None:
        """Tell the owner; with an error the other side was found gone."""
        if self._handle is not None:
            self._owner.ended(self._handle, exc is not None or self._unread)

    def pause_writing(self) -> None:
        """Take no more commands of a host that does not read what the last ones printed."""
        if self._transport is not None:
            self._transport.pause_reading()

    def resume_writing(self) -> None:
        """Take commands again."""
        if self._transport is not None:
            self._transport.resume_reading()

    def send(self, data: bytes) -> None:
        """Send bytes, a packet at a time."""
        transport = self._transport
        if transport is None or transport.is_closing():
            return
        if transport.get_write_buffer_size() > _MOST_UNREAD:
            self._unread = True
            transport.abort()
        for segment in segments(data):
            if transport.is_closing():
                return
            transport.write(segment)

    def close(self) -> None:
        """End the connection when everything is sent."""
        if self._transport is not None:
            self._transport.close()

    def cut(self) -> None:
        """End the connection at once."""
        if self._transport is not None:
            self._transport.abort()


class LoopbackLink:
    """A connection in memory: the controller's end."""

    def __init__(self, owner: LinkOwner, end: LoopbackTransport) -> None:
        self._owner = owner
        self._end = end
        self._open = True

    async def run(self, handle: Handle) -> None:
        """Read until the other side ends."""
        while data := await self._end.read():
            if handle.open:
                self._owner.received(handle, data)
        self._open = False
        self._owner.ended(handle, broken=False)
        await self._end.close()

    def send(self, data: bytes) -> None:
        """Send bytes, in one piece."""
        if self._open:
            self._end.write(data)

    def close(self) -> None:
        """End the connection; what is on its way still arrives."""
        self._open = False
        self._owner.spawn(self._end.close())

    def cut(self) -> None:
        """End the connection; what is on its way is lost."""
        self._open = False
        self._end.cut()
