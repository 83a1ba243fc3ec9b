"""Transports of bytes: a TCP connection, a serial port, UDP datagrams, or two ends in memory.

Each works in the loop in which it was created. A reader gets `b""` when the other side has ended.
"""

from __future__ import annotations

import asyncio
import errno
import os
import socket
from collections import deque
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, Protocol, TypeAlias

from dmc41x3.address import ControllerAddress, SerialAddress
from dmc41x3.errors import ConnectFailed, LinkLost
from dmc41x3.i18n import phrase
from dmc41x3.wire.serial_port import Greeting, close_port, open_port

if TYPE_CHECKING:
    from serial import Serial


class Transport(Protocol):
    """A stream of bytes to the other side. One reader at a time."""

    @property
    def peer(self) -> str:
        """Address of the other side, as shown to users."""
        ...

    async def read(self) -> bytes:
        """Return the received bytes, at least one, or `b""` at the end; raises `LinkLost` if the connection broke."""
        ...

    def write(self, data: bytes) -> None:
        """Send bytes without waiting; raises `LinkLost` after the end."""
        ...

    async def close(self) -> None:
        """End the connection and free its resources; idempotent."""
        ...


class Datagrams(Protocol):
    """Datagrams to and from the other side. They may get lost, or overtake each other. One reader at a time."""

    @property
    def peer(self) -> str:
        """Address of the other side, as shown to users."""
        ...

    async def read(self) -> bytes:
        """Return the next datagram, or `b""` at the end; raises `LinkLost` if the other side is not available."""
        ...

    def deliver(self, taker: Callable[[bytes], None]) -> None:
        """Pass datagrams to `taker` as they arrive, from now on; `read` then returns only when the connection ends."""
        ...

    def write(self, data: bytes) -> None:
        """Send one datagram; its arrival is not confirmed."""
        ...

    async def close(self) -> None:
        """Free its resources; idempotent."""
        ...


DatagramFactory: TypeAlias = Callable[[], Awaitable[Datagrams]]
"""Opens a datagram connection to the controller of a TCP link; raises `ConnectFailed`."""

_MOST_WAITING = 256
"""Most datagrams stored for a slow reader; then the oldest are dropped, as in a socket's buffer."""


def _reason(error: Exception) -> str:
    """Return the system's text for an error, without numbers and addresses."""
    if isinstance(error, OSError) and not isinstance(error, socket.gaierror) and error.errno:
        return os.strerror(error.errno)
    return getattr(error, "strerror", None) or str(error)


class _Inbox:
    """Received bytes that are not read yet, and the reader that waits for them."""

    def __init__(self) -> None:
        self._data = b""
        self._waiter: asyncio.Future[None] | None = None
        self.ended = False

    def put(self, data: bytes) -> None:
        self._data += data
        self._wake()

    def end(self, keep: bool) -> None:
        self.ended = True
        if not keep:
            self._data = b""
        self._wake()

    async def get(self) -> bytes:
        while not self._data and not self.ended:
            self._waiter = asyncio.get_running_loop().create_future()
            await self._waiter
        data, self._data = self._data, b""
        return data

    def _wake(self) -> None:
        if self._waiter is not None and not self._waiter.done():
            self._waiter.set_result(None)


class _Receiver(asyncio.Protocol):
    """The loop's side of a TCP connection."""

    def __init__(self, inbox: _Inbox, closed: asyncio.Future[Exception | None]) -> None:
        self._inbox = inbox
        self._closed = closed

    def data_received(self, data: bytes) -> None:
        self._inbox.put(data)

    def eof_received(self) -> bool:
        self._inbox.end(keep=True)
        return True  # closing is left to the owner

    def connection_lost(self, exc: Exception | None) -> None:
        if not self._closed.done():
            self._closed.set_result(exc)
        self._inbox.end(keep=True)


class TcpTransport:
    """A TCP connection without Nagle's delay; created by `connect`."""

    def __init__(
        self,
        stream: asyncio.WriteTransport,
        inbox: _Inbox,
        closed: asyncio.Future[Exception | None],
        peer: str,
    ) -> None:
        self._stream = stream
        self._inbox = inbox
        self._closed = closed
        self._peer = peer

    @classmethod
    async def connect(cls, host: str, port: int, timeout: float) -> TcpTransport:
        """Connect within `timeout` [s]; raises `ConnectFailed`."""
        loop = asyncio.get_running_loop()
        peer = f"{host}:{port}"
        inbox, closed = _Inbox(), loop.create_future()
        try:
            async with asyncio.timeout(timeout):
                stream, _ = await loop.create_connection(lambda: _Receiver(inbox, closed), host, port)
        except TimeoutError:
            raise ConnectFailed(
                address=peer, reason=phrase("no answer within {seconds:g} s", seconds=timeout)
            ) from None
        except (OSError, UnicodeError, OverflowError) as error:
            raise ConnectFailed(address=peer, reason=_reason(error)) from error
        sock: socket.socket = stream.get_extra_info("socket")
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return cls(stream, inbox, closed, peer)

    @property
    def peer(self) -> str:
        """Host and port, as given to `connect`."""
        return self._peer

    async def read(self) -> bytes:
        """Return the received bytes, or `b""` at the end; raises `LinkLost` if the connection broke."""
        data = await self._inbox.get()
        if not data and self._closed.done() and (error := self._closed.result()) is not None:
            raise LinkLost(address=self._peer, reason=_reason(error)) from error
        return data

    def write(self, data: bytes) -> None:
        """Send bytes without waiting; raises `LinkLost` after the end."""
        if self._stream.is_closing():
            raise LinkLost(address=self._peer, reason="the connection is closed")
        self._stream.write(data)

    async def close(self) -> None:
        """Close the connection; bytes that are not sent yet are dropped."""
        if self._stream.get_write_buffer_size():
            self._stream.abort()
        else:
            self._stream.close()
        await asyncio.shield(self._closed)


_PIECE = 4096


class SerialTransport:
    """A serial port whose controller has been greeted; created by `connect`.

    An unplugged adapter is a broken connection. The loop sends the bytes that the port does not take at once.
    """

    def __init__(self, port: Serial, peer: str) -> None:
        self._loop = asyncio.get_running_loop()
        self._port = port
        self._file = port.fileno()
        self._peer = peer
        self._inbox = _Inbox()
        self._unsent = b""
        self._error: OSError | None = None
        self._loop.add_reader(self._file, self._readable)

    @classmethod
    async def connect(cls, address: SerialAddress, timeout: float) -> SerialTransport:
        """Open a port and greet its controller within `timeout` [s].

        Raises `SerialPortUnavailable`, or `ConnectFailed` if no controller answers.
        """
        transport = cls(open_port(address), str(address))
        try:
            async with asyncio.timeout(timeout):
                await transport._greet()
        except BaseException as error:
            await transport.close()
            if isinstance(error, TimeoutError):
                reason = phrase("no answer within {seconds:g} s at {baud} baud", seconds=timeout, baud=address.baud)
                raise ConnectFailed(address=str(address), reason=reason) from None
            raise
        return transport

    @property
    def peer(self) -> str:
        """The address, as given to `connect`."""
        return self._peer

    async def _greet(self) -> None:
        """Greet the controller; raises `ConnectFailed` if the port ends."""
        greeting = Greeting()
        try:
            self.write(greeting.data)
            while not greeting.feed(data := await self.read()) and data:
                continue
        except LinkLost as error:
            raise ConnectFailed(address=self._peer, reason=error.reason) from error

    async def read(self) -> bytes:
        """Return the received bytes, or `b""` after `close`; raises `LinkLost` if the adapter was unplugged."""
        data = await self._inbox.get()
        if not data and self._error is not None:
            raise LinkLost(address=self._peer, reason=_reason(self._error)) from self._error
        return data

    def write(self, data: bytes) -> None:
        """Send bytes without waiting; raises `LinkLost` after the end."""
        if self._inbox.ended:
            raise LinkLost(address=self._peer, reason="the connection is closed")
        waiting, self._unsent = bool(self._unsent), self._unsent + data
        if not waiting:
            self._writable()

    async def close(self) -> None:
        """Close the port; bytes that are not sent yet are dropped."""
        self._end(None)
        if self._port.is_open:
            close_port(self._port)

    def _readable(self) -> None:
        try:
            data = os.read(self._file, _PIECE)
        except BlockingIOError:
            return
        except OSError as error:
            self._end(error)
            return
        if data:
            self._inbox.put(data)
        else:
            self._end(OSError(errno.EIO, os.strerror(errno.EIO)))

    def _writable(self) -> None:
        try:
            self._unsent = self._unsent[os.write(self._file, self._unsent) :]
        except BlockingIOError:
            pass
        except OSError as error:
            self._end(error)
            return
        if self._unsent:
            self._loop.add_writer(self._file, self._writable)
        else:
            self._loop.remove_writer(self._file)

    def _end(self, error: OSError | None) -> None:
        if not self._inbox.ended:
            self._error = error
            self._loop.remove_reader(self._file)
            self._loop.remove_writer(self._file)
            self._inbox.end(keep=True)


async def connect(address: ControllerAddress, timeout: float) -> Transport:
    """Connect to a controller within `timeout` [s], by TCP or by a serial port; raises `ConnectFailed`."""
    if isinstance(address, SerialAddress):
        return await SerialTransport.connect(address, timeout)
    return await TcpTransport.connect(*address, timeout)


class LoopbackTransport:
    """One of two ends in memory; created by `loopback_pair`."""

    def __init__(self, peer: str) -> None:
        self._peer = peer
        self._inbox = _Inbox()
        self._other: LoopbackTransport | None = None

    def join(self, other: LoopbackTransport) -> None:
        """Connect this end to `other`."""
        self._other = other

    @property
    def peer(self) -> str:
        """The name given to `loopback_pair`."""
        return self._peer

    async def read(self) -> bytes:
        """Return the received bytes, or `b""` at the end."""
        return await self._inbox.get()

    def write(self, data: bytes) -> None:
        """Send bytes without waiting; raises `LinkLost` after the end of this side. `read` returns the other's end."""
        if self._other is None:
            raise LinkLost(address=self._peer, reason="the connection is closed")
        if not self._other._inbox.ended:
            self._other._inbox.put(data)

    async def close(self) -> None:
        """End both directions; data under way still arrive."""
        self._end(keep=True)

    def cut(self) -> None:
        """End both directions at once; data under way are lost."""
        self._end(keep=False)

    def _end(self, keep: bool) -> None:
        if self._other is not None:
            self._other._inbox.end(keep)
            self._inbox.end(keep=False)
            self._other = None


def loopback_pair(peer: str = "loopback") -> tuple[LoopbackTransport, LoopbackTransport]:
    """Return two connected ends: the host's and the controller's."""
    ends = LoopbackTransport(peer), LoopbackTransport(peer)
    ends[0].join(ends[1])
    ends[1].join(ends[0])
    return ends


class _DatagramQueue:
    """Received datagrams that are not read yet, and the reader that waits for them."""

    def __init__(self) -> None:
        self._waiting: deque[bytes] = deque(maxlen=_MOST_WAITING)
        self._waiter: asyncio.Future[None] | None = None
        self.taker: Callable[[bytes], None] | None = None
        self.ended = False
        self.error: Exception | None = None

    def put(self, data: bytes) -> None:
        if self.taker is not None:
            self.taker(data)
            return
        self._waiting.append(data)
        self._wake()

    def end(self, error: Exception | None = None) -> None:
        self.ended, self.error = True, error
        self._wake()

    async def get(self) -> bytes:
        while not self._waiting and not self.ended:
            self._waiter = asyncio.get_running_loop().create_future()
            await self._waiter
        return self._waiting.popleft() if self._waiting else b""

    def _wake(self) -> None:
        if self._waiter is not None and not self._waiter.done():
            self._waiter.set_result(None)


class _DatagramReceiver(asyncio.DatagramProtocol):
    """The loop's side of a UDP socket."""

    def __init__(self, letterbox: _DatagramQueue) -> None:
        self._letterbox = letterbox

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        self._letterbox.put(data)

    def error_received(self, exc: Exception) -> None:
        self._letterbox.end(exc)

    def connection_lost(self, exc: Exception | None) -> None:
        self._letterbox.end(exc)


class UdpTransport:
    """A UDP socket for one address; created by `connect`, which sends nothing yet."""

    def __init__(self, socket: asyncio.DatagramTransport, letterbox: _DatagramQueue, peer: str) -> None:
        self._socket = socket
        self._letterbox = letterbox
        self._peer = peer

    @classmethod
    async def connect(cls, host: str, port: int) -> UdpTransport:
        """Open a new socket; raises `ConnectFailed` if the address is not valid."""
        peer = f"{host}:{port}"
        letterbox = _DatagramQueue()
        try:
            endpoint, _ = await asyncio.get_running_loop().create_datagram_endpoint(
                lambda: _DatagramReceiver(letterbox), remote_addr=(host, port)
            )
        except (OSError, UnicodeError, OverflowError) as error:
            raise ConnectFailed(address=peer, reason=_reason(error)) from error
        return cls(endpoint, letterbox, peer)

    @property
    def peer(self) -> str:
        """Host and port, as given to `connect`."""
        return self._peer

    async def read(self) -> bytes:
        """Return the next datagram, or `b""` after `close`; raises `LinkLost` if the port is found closed."""
        data = await self._letterbox.get()
        if not data and self._letterbox.error is not None:
            raise LinkLost(address=self._peer, reason=_reason(self._letterbox.error)) from self._letterbox.error
        return data

    def deliver(self, taker: Callable[[bytes], None]) -> None:
        """Pass datagrams to `taker` as they arrive, from now on; `read` then returns only when the connection ends."""
        self._letterbox.taker = taker

    def write(self, data: bytes) -> None:
        """Send one datagram; after `close` it is dropped."""
        if not self._socket.is_closing():
            self._socket.sendto(data)

    async def close(self) -> None:
        """Close the socket."""
        self._socket.close()
        self._letterbox.end()


class LoopbackDatagrams:
    """One of two ends in memory; created by `datagram_pair`. Datagrams are lost only if `blocked` is true."""

    def __init__(self, peer: str) -> None:
        self._peer = peer
        self._letterbox = _DatagramQueue()
        self._other: LoopbackDatagrams | None = None
        self.blocked = False

    def join(self, other: LoopbackDatagrams) -> None:
        """Connect this end to `other`."""
        self._other = other

    @property
    def peer(self) -> str:
        """The name given to `datagram_pair`."""
        return self._peer

    async def read(self) -> bytes:
        """Return the next datagram, or `b""` after `close`."""
        return await self._letterbox.get()

    def deliver(self, taker: Callable[[bytes], None]) -> None:
        """Pass datagrams to `taker` as they arrive, from now on; `read` then returns only when the connection ends."""
        self._letterbox.taker = taker

    def write(self, data: bytes) -> None:
        """Send one datagram; while this end is `blocked`, or after the other has closed, it is dropped."""
        if self._other is not None and not self.blocked and not self._other._letterbox.ended:
            self._other._letterbox.put(data)

    async def close(self) -> None:
        """End this side; the other side is not notified, as with UDP."""
        self.cut()

    def cut(self) -> None:
        """End this side at once."""
        self._letterbox.end()


def datagram_pair(peer: str = "loopback") -> tuple[LoopbackDatagrams, LoopbackDatagrams]:
    """Return two connected ends: the host's and the controller's."""
    ends = LoopbackDatagrams(peer), LoopbackDatagrams(peer)
    ends[0].join(ends[1])
    ends[1].join(ends[0])
    return ends
