"""Connections of the virtual controller: TCP, UDP and memory, accepted or opened by itself (IH), and a serial port."""

from __future__ import annotations

import asyncio
import os
import socket
import tty
from collections.abc import Coroutine
from contextlib import suppress
from typing import NamedTuple, Protocol, cast

from dmc41x3 import listening
from dmc41x3.errors import AddressInUse
from dmc41x3.twin.network import RETRIES, Attempt, Handle, HandleProtocol
from dmc41x3.wire.bootp import AddressReply, AddressRequest, DhcpKind, parse_reply, request
from dmc41x3.wire.transport import LoopbackDatagrams, LoopbackTransport

SEGMENT = 450
"""Most bytes of a reply in one packet; a longer reply is sent in several."""


_PIECE = 4096

_MOST_UNREAD = 4 * 1024 * 1024
"""Most bytes that wait for a host that does not read; with more, the connection ends, as after retries."""


class WireLink(Protocol):
    """One connection: it sends bytes, and ends in order or at once."""

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
    """Receiver of the events of a link."""

    def accept(self, link: WireLink, peer: tuple[str, int], kind: HandleProtocol, port: int) -> Handle | None:
        """Return a handle for a new connection to `port`, None if the connection is refused."""
        ...

    def received(self, handle: Handle, data: bytes) -> None:
        """Process received bytes."""
        ...

    def ended(self, handle: Handle, broken: bool) -> None:
        """Handle the end of a connection, by the other side or because it was found `broken`."""
        ...

    def spawn(self, work: Coroutine[None, None, None]) -> None:
        """Run `work` in the background."""
        ...


def segments(data: bytes) -> list[bytes]:
    """Return a reply in the pieces in which it is sent."""
    return [data[start : start + SEGMENT] for start in range(0, len(data), SEGMENT)]


class TcpLink(asyncio.Protocol):
    """A TCP connection: an incoming one, or the one that IH opened for `handle`."""

    def __init__(self, owner: LinkOwner, handle: Handle | None = None) -> None:
        self._owner = owner
        self._transport: asyncio.Transport | None = None
        self._handle = handle
        self._unread = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take a handle, or abort the connection if there is none."""
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
        """Pass received bytes to the owner, in pieces of any size."""
        if self._handle is not None and self._handle.open:
            self._owner.received(self._handle, data)

    def connection_lost(self, exc: Exception | None) -> None:
        """Report the end to the owner; an error means that the other side was lost."""
        if self._handle is not None:
            self._owner.ended(self._handle, exc is not None or self._unread)

    def pause_writing(self) -> None:
        """Stop reading commands from a host that does not read its replies."""
        if self._transport is not None:
            self._transport.pause_reading()

    def resume_writing(self) -> None:
        """Read commands again."""
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
        """End the connection; data under way still arrive."""
        self._open = False
        self._owner.spawn(self._end.close())

    def cut(self) -> None:
        """End the connection; data under way are lost."""
        self._open = False
        self._end.cut()


class SerialLink:
    """The main serial port: a pseudo terminal, whose path other programs open like that of a serial port."""

    def __init__(self, owner: LinkOwner) -> None:
        self._owner = owner
        self._loop = asyncio.get_running_loop()
        self._handle: Handle | None = None
        # Its other side stays open too, or it would hang up after each program that uses the port.
        self._file, self._other = os.openpty()
        tty.setraw(self._other)
        os.set_blocking(self._file, False)
        self._unsent = b""
        self._open = True
        self.path = os.ttyname(self._other)

    def run(self, handle: Handle) -> None:
        """Pass received bytes to the owner from now on."""
        self._handle = handle
        self._loop.add_reader(self._file, self._readable)

    def send(self, data: bytes) -> None:
        """Send bytes; what exceeds the buffer while no program reads is lost."""
        if self._open and len(self._unsent) + len(data) <= _MOST_UNREAD:
            self._unsent += data
            self._writable()

    def close(self) -> None:
        """Close the port; programs that use it find it hung up, as if its adapter was unplugged."""
        if self._open:
            self._open = False
            self._loop.remove_reader(self._file)
            self._loop.remove_writer(self._file)
            os.close(self._other)
            os.close(self._file)

    def cut(self) -> None:
        """Close the port at once."""
        self.close()

    def _readable(self) -> None:
        data = os.read(self._file, _PIECE)
        if self._handle is not None:
            self._owner.received(self._handle, data)

    def _writable(self) -> None:
        with suppress(BlockingIOError):
            self._unsent = self._unsent[os.write(self._file, self._unsent) :]
        if self._unsent:
            self._loop.add_writer(self._file, self._writable)
        else:
            self._loop.remove_writer(self._file)


Peer = tuple[str, int]

_LOCAL: Peer = ("127.0.0.1", 0)
_PORT = 23
"""Address of both ends of a connection in memory."""


class UdpPort(asyncio.DatagramProtocol):
    """One UDP port of the controller. A datagram that gets no handle is dropped without an answer."""

    def __init__(self, owner: LinkOwner) -> None:
        self._owner = owner
        self._transport: asyncio.DatagramTransport | None = None
        self._port = 0
        self._handles: dict[Peer, Handle] = {}

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Store the transport and its port."""
        self._transport = cast("asyncio.DatagramTransport", transport)
        self._port = transport.get_extra_info("sockname")[1]

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        """Pass a datagram to the handle of its sender, or to a new handle if the sender has none."""
        peer = (str(addr[0]), int(addr[1]))
        handle = self._handles.get(peer)
        if handle is None or not handle.open:
            handle = self._owner.accept(_UdpLink(self, peer), peer, HandleProtocol.UDP, self._port)
            if handle is None:
                return
            self._handles[peer] = handle
        self._owner.received(handle, data)

    def error_received(self, exc: Exception) -> None:
        """Ignore errors: UDP does not report whether a datagram arrives."""

    def send_to(self, peer: Peer, data: bytes) -> None:
        """Send a reply, in datagrams of the size of a packet."""
        if self._transport is None or self._transport.is_closing():
            return
        for segment in segments(data):
            self._transport.sendto(segment, peer)

    def forget(self, peer: Peer) -> None:
        """Make the next datagram from `peer` take a new handle."""
        self._handles.pop(peer, None)

    def close(self) -> None:
        """Stop listening."""
        if self._transport is not None:
            self._transport.close()


class _UdpLink:
    """The peer of a handle that a datagram opened."""

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
    """A datagram connection in memory: the controller's end."""

    def __init__(self, owner: LinkOwner, end: LoopbackDatagrams) -> None:
        self._owner = owner
        self._end = end
        self._handle: Handle | None = None

    async def run(self) -> None:
        """Pass datagrams on, until `close`; the first takes a handle, as does the next one after that is closed."""
        while data := await self._end.read():
            if self._handle is None or not self._handle.open:
                self._handle = self._owner.accept(_LoopbackDatagramLink(self._end), _LOCAL, HandleProtocol.UDP, _PORT)
            if self._handle is not None:
                self._owner.received(self._handle, data)

    def close(self) -> None:
        """Accept no more datagrams."""
        self._end.cut()


class _LoopbackDatagramLink:
    """The peer of a handle that a datagram in memory opened; `close` and `cut` send nothing."""

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
    """A UDP handle that IH opened: it has an address to send to, which need not answer."""

    def __init__(self, owner: LinkOwner, handle: Handle) -> None:
        self._owner = owner
        self._handle = handle
        self._transport: asyncio.DatagramTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Store the transport."""
        self._transport = cast("asyncio.DatagramTransport", transport)

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        """Pass an answer to the owner."""
        if self._handle.open:
            self._owner.received(self._handle, data)

    def error_received(self, exc: Exception) -> None:
        """Ignore errors, as `UdpPort` does."""

    def send(self, data: bytes) -> None:
        """Send bytes, in datagrams of the size of a packet."""
        if self._transport is None or self._transport.is_closing():
            return
        for segment in segments(data):
            self._transport.sendto(segment)

    def close(self) -> None:
        """Close the socket."""
        if self._transport is not None:
            self._transport.close()

    def cut(self) -> None:
        """Close the socket."""
        self.close()


class DialOwner(LinkOwner, Protocol):
    """The dialling side: it owns the link once the other side has answered."""

    def reached(self, handle: Handle, link: WireLink) -> None:
        """Store the link of a handle that is connected now."""
        ...

    def gave_up(self, handle: Handle) -> None:
        """Close a handle whose peer does not answer."""
        ...


async def dial(caller: DialOwner, handle: Handle, pause: float) -> None:
    """Connect a handle; with TCP try again up to five times, `pause` [s] apart."""
    for attempt in range(RETRIES + 1):
        if attempt:
            await asyncio.sleep(pause)
        try:
            async with asyncio.timeout(max(pause, 0.01) * RETRIES):
                link = await _connected(caller, handle)
        except (OSError, TimeoutError):
            continue
        if not handle.open:
            link.cut()
            return
        handle.connected = True
        caller.reached(handle, link)
        return
    handle.attempt = Attempt.FAILED
    caller.gave_up(handle)


async def _connected(caller: DialOwner, handle: Handle) -> WireLink:
    loop = asyncio.get_running_loop()
    if handle.kind is HandleProtocol.TCP:
        transport, link = await loop.create_connection(lambda: TcpLink(caller, handle), *handle.peer)
    else:
        transport, link = await loop.create_datagram_endpoint(lambda: UdpDial(caller, handle), remote_addr=handle.peer)
    handle.port = transport.get_extra_info("sockname")[1]
    return link


_ATTEMPTS = 20
"""Number of attempts to find a port that is free for both TCP and UDP."""


_FIRST_WAIT, _LONGEST_WAIT = 1.0, 16.0
"""Shortest and longest time between two requests for an address [s]."""


class _Answers(asyncio.DatagramProtocol):
    """Receives the answers to the requests for an address, after `mac` and `number` have been compared."""

    def __init__(self, mac: str, number: int) -> None:
        self._mac = mac
        self._number = number
        self.received: asyncio.Queue[AddressReply] = asyncio.Queue()

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        found = parse_reply(data)
        if found is not None and (found.mac, found.number) == (self._mac, self._number):
            self.received.put_nowait(found)

    def error_received(self, exc: Exception) -> None:
        """Ignore errors: no server listens yet."""


async def ask_for_address(server: tuple[str, int], mac: str, *, dhcp: bool) -> AddressReply:
    """Ask a server for an address by DHCP or BOOTP until it answers, as a controller without one does."""
    number = int(mac.replace(":", "")[-8:], 16)
    answers = _Answers(mac, number)
    socket, _ = await asyncio.get_running_loop().create_datagram_endpoint(lambda: answers, remote_addr=server)
    asked, wait = AddressRequest(mac, number, DhcpKind.DISCOVER if dhcp else DhcpKind.NONE), _FIRST_WAIT
    try:
        while True:
            socket.sendto(request(asked))
            try:
                async with asyncio.timeout(wait):
                    found = await answers.received.get()
            except TimeoutError:
                wait = min(2.0 * wait, _LONGEST_WAIT)
                asked = AddressRequest(mac, number, DhcpKind.DISCOVER if dhcp else DhcpKind.NONE)
                continue
            if found.kind is not DhcpKind.OFFER:
                return found
            asked = AddressRequest(mac, number, DhcpKind.REQUEST, found.server, found.address)
    finally:
        socket.close()


class ListeningPort(NamedTuple):
    """One listening port; `udp` is None for TCP alone."""

    address: tuple[str, int]
    server: asyncio.AbstractServer
    udp: UdpPort | None

    def close(self) -> None:
        """Stop listening."""
        self.server.close()
        if self.udp is not None:
            self.udp.close()


async def listen(owner: LinkOwner, host: str, port: int, *, udp: bool) -> ListeningPort:
    """Listen for `owner`; port 0 chooses a free one. Raises `AddressInUse`."""
    for left in reversed(range(1 if port else _ATTEMPTS)):
        try:
            return await _open(owner, host, port, udp)
        except OSError as error:
            if not left:
                raise AddressInUse(address=f"{host}:{port}") from error
    raise AssertionError


async def _open(owner: LinkOwner, host: str, port: int, udp: bool) -> ListeningPort:
    loop = asyncio.get_running_loop()
    server = await listening.listen(host, port, lambda: TcpLink(owner))
    address = server.address
    if not udp:
        return ListeningPort(address, server, None)
    try:
        _, datagrams = await loop.create_datagram_endpoint(lambda: UdpPort(owner), local_addr=address)
    except OSError:
        server.close()
        await server.wait_closed()
        raise
    return ListeningPort(address, server, datagrams)
