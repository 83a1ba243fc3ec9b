"""UDP: whoever sends a first datagram takes a handle, and replies go back the way the commands came."""

from __future__ import annotations

import asyncio
from typing import cast

from dmc41x3.twin.handles import Handle, HandleProtocol
from dmc41x3.twin.wire.link import LinkOwner, segments
from dmc41x3.wire.transport import LoopbackDatagrams

Peer = tuple[str, int]

_LOCAL: Peer = ("127.0.0.1", 0)
_PORT = 23
"""What a connection in memory seems to come from, and to lead to."""


class UdpPort(asyncio.DatagramProtocol):
    """One UDP port of the controller. A datagram for which there is no handle is dropped without an answer."""

    def __init__(self, owner: LinkOwner) -> None:
        self._owner = owner
        self._transport: asyncio.DatagramTransport | None = None
        self._port = 0
        self._handles: dict[Peer, Handle] = {}

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Learn which port this is."""
        self._transport = cast("asyncio.DatagramTransport", transport)
        self._port = transport.get_extra_info("sockname")[1]

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        """Hand a datagram to the handle of whoever sent it, a new one where there is none."""
        peer = (str(addr[0]), int(addr[1]))
        handle = self._handles.get(peer)
        if handle is None or not handle.open:
            handle = self._owner.accept(_UdpLink(self, peer), peer, HandleProtocol.UDP, self._port)
            if handle is None:
                return
            self._handles[peer] = handle
        self._owner.received(handle, data)

    def error_received(self, exc: Exception) -> None:
        """Take no notice: nobody learns whether a datagram arrives."""

    def send_to(self, peer: Peer, data: bytes) -> None:
        """Send a reply, in datagrams of the size of a packet."""
        if self._transport is None or self._transport.is_closing():
            return
        for segment in segments(data):
            self._transport.sendto(segment, peer)

    def forget(self, peer: Peer) -> None:
        """Let the next datagram from somebody take a handle anew."""
        self._handles.pop(peer, None)

    def close(self) -> None:
        """Stop listening."""
        if self._transport is not None:
            self._transport.close()


class _UdpLink:
    """What a handle opened by a datagram sends to."""

    def __init__(self, port: UdpPort, peer: Peer) -> None:
        self._port = port
        self._peer = peer

    def send(self, data: bytes) -> None:
        self._port.send_to(self._peer, data)

    def close(self) -> None:
        self._port.forget(self._peer)

    def cut(self) -> None:
        self._port.forget(self._peer)


class LoopbackPort:
    """A way for datagrams in memory: the controller's end."""

    def __init__(self, owner: LinkOwner, end: LoopbackDatagrams) -> None:
        self._owner = owner
        self._end = end
        self._handle: Handle | None = None

    async def run(self) -> None:
        """Hand datagrams over, until `close`; the first takes a handle, and so does one after that was closed."""
        while data := await self._end.read():
            if self._handle is None or not self._handle.open:
                self._handle = self._owner.accept(_LoopbackDatagramLink(self._end), _LOCAL, HandleProtocol.UDP, _PORT)
            if self._handle is not None:
                self._owner.received(self._handle, data)

    def close(self) -> None:
        """Take no more."""
        self._end.cut()


class _LoopbackDatagramLink:
    """What a handle opened by a datagram in memory sends to; its end says nothing."""

    def __init__(self, end: LoopbackDatagrams) -> None:
        self._end = end

    def send(self, data: bytes) -> None:
        for segment in segments(data):
            self._end.write(segment)

    def close(self) -> None:
        pass

    def cut(self) -> None:
        pass


class UdpDial(asyncio.DatagramProtocol):
    """A UDP handle that IH opened: it has an address to send to, and nobody need be there."""

    def __init__(self, owner: LinkOwner, handle: Handle) -> None:
        self._owner = owner
        self._handle = handle
        self._transport: asyncio.DatagramTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Note what to send with."""
        self._transport = cast("asyncio.DatagramTransport", transport)

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        """Hand an answer over."""
        if self._handle.open:
            self._owner.received(self._handle, data)

    def error_received(self, exc: Exception) -> None:
        """Take no notice, as above."""

    def send(self, data: bytes) -> None:
        """Send bytes, in datagrams of the size of a packet."""
        if self._transport is None or self._transport.is_closing():
            return
        for segment in segments(data):
            self._transport.sendto(segment)

    def close(self) -> None:
        """Give the socket back."""
        if self._transport is not None:
            self._transport.close()

    def cut(self) -> None:
        """Give the socket back."""
        self.close()
