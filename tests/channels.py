"""Connections to virtual controllers for the conformance table: without a wire, by TCP, by UDP, by a
serial port.

Time is in the test's hand everywhere. On a real wire client and controller share one thread, and the controller's
loop has a clock that stands still between exchanges.
"""

from __future__ import annotations

import asyncio
import os
import select
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.network import Handle
from dmc41x3.twin.plant import BenchPlant
from dmc41x3.twin.wire.connections import SerialLink
from dmc41x3.twin.wire.server import VirtualController

EXCHANGE = 0.002
"""Duration of one exchange on the virtual controller's clock [s]."""

Cut = Callable[[bytes], list[bytes]]
"""In which pieces bytes arrive."""


def whole(data: bytes) -> list[bytes]:
    """Let bytes arrive as they were sent."""
    return [data]


def byte_by_byte(data: bytes) -> list[bytes]:
    """Let every byte arrive by itself."""
    return [data[place : place + 1] for place in range(len(data))]


def at(place: int) -> Cut:
    """Let bytes arrive in two pieces, the first of that length."""
    return lambda data: [piece for piece in (data[:place], data[place:]) if piece]


class Bench:
    """A virtual controller on a bench, without a wire."""

    def __init__(self, axes: int, cut: Cut = whole) -> None:
        self.machine = VirtualDmc(BenchPlant(axes), axes=axes)
        self.cut = cut
        self.channels: dict[Handle, Direct] = {}

    def dial(self) -> Direct:
        """Open a connection."""
        return Direct(self)

    def pass_on(self) -> None:
        """Deliver what nobody asked for."""
        for handle, data in self.machine.take_messages():
            if handle in self.channels:
                self.channels[handle].inbox += data


class Direct:
    """A connection without a wire."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._handle = bench.machine.connect(("127.0.0.1", 1000))
        self.inbox = b""
        if self._handle is not None:
            bench.channels[self._handle] = self

    def send(self, data: bytes) -> None:
        """Hand bytes over; this takes a little of the machine's time."""
        machine = self._bench.machine
        now = machine.now + EXCHANGE
        if self._handle is not None and self._handle.open:
            for piece in self._bench.cut(data):
                self.inbox += machine.receive(self._handle, piece, now)
                self._bench.pass_on()

    def receive(self) -> bytes:
        """Return what has come."""
        data, self.inbox = self.inbox, b""
        return data

    def wait(self, seconds: float) -> None:
        """Let the machine's time pass."""
        self._bench.machine.advance(self._bench.machine.now + seconds)
        self._bench.pass_on()

    def ended(self) -> bool:
        """Tell whether the machine has closed the handle."""
        return self._handle is None or not self._handle.open

    def close(self) -> None:
        """Hang up."""
        if self._handle is not None:
            self._bench.machine.disconnect(self._handle)


class HeldLoop(asyncio.SelectorEventLoop):
    """A loop whose clock moves only when the test sets it."""

    def __init__(self) -> None:
        super().__init__()
        self.held = 0.0

    def time(self) -> float:
        """Return the time that the test has set [s]."""
        return self.held

    def turn(self) -> None:
        """Run ready callbacks twice, sockets included: the second round runs callbacks of the first."""
        for _ in range(2):
            self.call_soon(self.stop)
            self.run_forever()


class Wire:
    """A virtual controller that listens on a real port of this computer."""

    def __init__(self, loop: HeldLoop, controller: VirtualController, address: tuple[str, int], cut: Cut) -> None:
        self.loop = loop
        self.controller = controller
        self.address = address
        self.cut = cut

    def tcp(self) -> Tcp:
        """Open a TCP connection."""
        return Tcp(self, socket.create_connection(self.address))

    def udp(self) -> Udp:
        """Open a UDP port that talks to the controller."""
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        sock.connect(self.address)
        return Udp(self, sock)

    def serial(self) -> Serial:
        """Open the main serial port, without an echo."""

        async def plug() -> str:
            return self.controller.serve_serial()

        channel = Serial(self, self.loop.run_until_complete(plug()))
        channel.send(b"EO 0\r")
        assert channel.receive() == b"EO 0\r\n:"
        return channel

    def wait(self, seconds: float) -> None:
        """Let the controller's time pass, and have it say what it has to say by itself."""
        self.loop.held += seconds
        self.controller.look()
        self.loop.turn()


@contextmanager
def wire(axes: int, cut: Cut = whole) -> Iterator[Wire]:
    """Serve a virtual controller for the length of the block."""
    loop = HeldLoop()

    async def begin() -> tuple[VirtualController, tuple[str, int]]:
        controller = VirtualController(VirtualDmc(BenchPlant(axes), axes=axes))
        return controller, await controller.serve()

    try:
        controller, address = loop.run_until_complete(begin())
        try:
            yield Wire(loop, controller, address, cut)
        finally:
            loop.run_until_complete(controller.close())
    finally:
        loop.close()


class Tcp:
    """A TCP connection."""

    PATIENCE = 0.02
    """Longest time the kernel may take to deliver sent bytes [s]; only a missing answer takes it."""

    def __init__(self, wire: Wire, sock: socket.socket) -> None:
        self._wire = wire
        self._socket = sock
        self._ended = False
        if sock.type == socket.SOCK_STREAM:
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        wire.loop.turn()

    def send(self, data: bytes) -> None:
        """Send bytes, in the wire's pieces; this takes a little of the controller's time."""
        self._wire.loop.held += EXCHANGE
        for piece in self._wire.cut(data):
            try:
                self._socket.sendall(piece)
            except OSError:
                self._ended = True
                return
            self._wire.loop.turn()

    def receive(self) -> bytes:
        """Return what has come, b"" where nothing does for a while."""
        for _ in range(3):
            if select.select([self._socket], [], [], 0.0)[0] or select.select([self._socket], [], [], self.PATIENCE)[0]:
                return self._read()
            self._wire.loop.turn()
        return b""

    def wait(self, seconds: float) -> None:
        """Let the controller's time pass."""
        self._wire.wait(seconds)

    def ended(self) -> bool:
        """Return whether the other side has closed the connection; received bytes are dropped."""
        self._wire.loop.turn()
        while not self._ended and select.select([self._socket], [], [], self._closing())[0]:
            self._read()
        return self._ended

    def close(self) -> None:
        """Hang up."""
        self._socket.close()
        self._wire.loop.turn()

    def _closing(self) -> float:
        return 0.0

    def _read(self) -> bytes:
        try:
            data = self._socket.recv(65536)
        except ConnectionError:
            data = b""
        self._ended = self._ended or not data
        return data


class Serial:
    """A serial port, which has no end."""

    def __init__(self, wire: Wire, path: str) -> None:
        self._wire = wire
        self._file = os.open(path, os.O_RDWR | os.O_NOCTTY)

    def send(self, data: bytes) -> None:
        """Send bytes, in the wire's pieces; this takes a little of the controller's time."""
        self._wire.loop.held += EXCHANGE
        for piece in self._wire.cut(data):
            os.write(self._file, piece)
            self._arrive()

    def receive(self) -> bytes:
        """Return what has come, b"" where nothing does for a while: the kernel passes bytes on in its own time."""
        for _ in range(3):
            if select.select([self._file], [], [], 0.0)[0] or select.select([self._file], [], [], Tcp.PATIENCE)[0]:
                return os.read(self._file, 65536)
            self._wire.loop.turn()
        return b""

    def wait(self, seconds: float) -> None:
        """Let the controller's time pass."""
        self._wire.wait(seconds)

    def _arrive(self) -> None:
        """Wait until the kernel has passed bytes on to the controller, and let it answer."""
        link = self._wire.controller._serial_link
        assert isinstance(link, SerialLink)
        assert select.select([link._file], [], [], 5.0)[0]
        self._wire.loop.turn()

    def ended(self) -> bool:
        """Return False: nothing ends a cable."""
        return False

    def close(self) -> None:
        """Close the port."""
        os.close(self._file)


class Udp(Tcp):
    """A port that talks by datagrams, each of which arrives whole."""

    def send(self, data: bytes) -> None:
        """Send a datagram; this takes a little of the controller's time."""
        self._wire.loop.held += EXCHANGE
        self._socket.send(data)
        self._wire.loop.turn()

    def ended(self) -> bool:
        """Tell nothing of an end: datagrams have none."""
        return False
