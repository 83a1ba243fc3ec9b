"""Whom the contract is held against: the virtual controller, and a real one whose address is given.

`MAYA_CONTRACT_ADDRESS=HOST[:PORT]` adds a real box. Its motors stay where they are unless `MAYA_CONTRACT_MOVES=1`
says that axis A may turn by 2000 counts.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from typing import Protocol

import pytest

from maya_un.galil.framing import Kind, Record, Reply, ReplySplitter
from maya_un.virtual.machine import VirtualDmc
from maya_un.virtual.plant import BenchPlant

ADDRESS = os.environ.get("MAYA_CONTRACT_ADDRESS", "")
MOVES = os.environ.get("MAYA_CONTRACT_MOVES", "") == "1"
EXCHANGE = 0.002
"""What one exchange takes on the virtual controller's clock [s]."""


class Wire(Protocol):
    """Carries bytes to a controller and brings some back."""

    def exchange(self, data: bytes) -> bytes:
        """Send, and return what came (at least one byte)."""
        ...

    def more(self) -> bytes:
        """Return further bytes of the same answer."""
        ...


class Virtual:
    """The virtual controller without a wire: every exchange takes a little of its time."""

    def __init__(self) -> None:
        self._machine = VirtualDmc(BenchPlant())
        handle = self._machine.connect(("127.0.0.1", 1000))
        assert handle is not None
        self._handle = handle

    def exchange(self, data: bytes) -> bytes:
        """Hand the bytes over."""
        return self._machine.receive(self._handle, data, self._machine.now + EXCHANGE)

    def more(self) -> bytes:
        """There is never more than came at once."""
        return b""


class Box:
    """A real controller."""

    def __init__(self, address: str) -> None:
        host, _, port = address.partition(":")
        self._socket = socket.create_connection((host, int(port or 23)), timeout=3.0)

    def exchange(self, data: bytes) -> bytes:
        """Send and wait for the beginning of the answer."""
        self._socket.sendall(data)
        return self.more()

    def more(self) -> bytes:
        """Wait for more; times out as the socket does."""
        return self._socket.recv(4096)

    def close(self) -> None:
        """Hang up."""
        self._socket.close()


class Talk:
    """A conversation in whole commands."""

    def __init__(self, wire: Wire, *, moves: bool) -> None:
        self._wire = wire
        self.moves = moves

    def raw(self, data: bytes, replies: int) -> list[Reply]:
        """Send bytes and return that many replies."""
        received = self._receive(data, [Kind.TEXT] * replies)
        return [reply for reply in received if isinstance(reply, Reply)]

    def say(self, command: str) -> Reply:
        """Send one command."""
        return self.raw(f"{command}\r".encode("ascii"), 1)[0]

    def text(self, command: str) -> str:
        """Send one command that must be accepted, and return what it prints."""
        reply = self.say(command)
        assert reply.ok, command
        return reply.text

    def value(self, operand: str) -> float:
        """Return an operand."""
        return float(self.text(f"MG {operand}"))

    def refused(self, command: str) -> int:
        """Send a command that must be refused and return the code."""
        assert not self.say(command).ok, command
        return int(self.text("TC1").split()[0])

    def record(self) -> bytes:
        """Return the data record."""
        (record,) = self._receive(b"QR\r", [Kind.RECORD])
        assert isinstance(record, Record)
        return record.data

    def _receive(self, data: bytes, kinds: list[Kind]) -> list[object]:
        splitter = ReplySplitter()
        for kind in kinds:
            splitter.expect(kind)
        received: list[object] = list(splitter.feed(self._wire.exchange(data)))
        while splitter.pending:
            more = self._wire.more()
            assert more, f"{splitter.pending} replies are missing"
            received += splitter.feed(more)
        assert len(received) == len(kinds), received
        return received


@pytest.fixture(params=["virtual", *(["box"] if ADDRESS else [])])
def talk(request: pytest.FixtureRequest) -> Iterator[Talk]:
    """Return a conversation with a controller."""
    if request.param == "virtual":
        yield Talk(Virtual(), moves=True)
        return
    box = Box(ADDRESS)
    yield Talk(box, moves=MOVES)
    box.close()


@pytest.fixture
def axis_a(talk: Talk) -> Iterator[Talk]:
    """Return a conversation with a controller whose axis A may move: servo on, at its origin, gentle."""
    if not talk.moves:
        pytest.skip("MAYA_CONTRACT_MOVES=1 allows axis A of the real box to turn")
    for command in ("STA", "SPA=1000", "ACA=10240", "DCA=10240", "SHA", "DPA=0"):
        talk.text(command)
    yield talk
    talk.text("STA")
