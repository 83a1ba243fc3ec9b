"""A virtual controller with ideal axes, and somebody who talks to it."""

from __future__ import annotations

from typing import Self

from dmc41x3.language.record import DataRecord, decode
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.motion.axis import Axis
from dmc41x3.twin.network import Handle
from dmc41x3.twin.plant import BenchPlant


class Bench:
    """Time stands still until `at` moves it; motors are on by default."""

    def __init__(self, axes: int = 3, servo: bool = True) -> None:
        self.plant = BenchPlant(axes)
        self.machine = VirtualDmc(self.plant, axes=axes)
        self.now = 0.0
        self.handle = self.connect()
        if servo:
            self.do("SH")

    def connect(self) -> Handle:
        """Take one more handle."""
        handle = self.machine.connect(("127.0.0.1", 1000))
        assert handle is not None
        return handle

    def at(self, now: float) -> Self:
        """Let time pass until `now` [s]."""
        self.now = now
        self.machine.advance(now)
        return self

    def raw(self, text: str) -> bytes:
        """Send bytes as they are and return the bytes that come back."""
        if not self.handle.open:
            self.handle = self.connect()
        return self.machine.receive(self.handle, text.encode("latin-1"), self.now)

    def say(self, text: str) -> str:
        """Send one line and return everything that comes back."""
        return self.raw(text + "\r").decode("ascii")

    def do(self, *lines: str) -> None:
        """Send lines that must all be accepted."""
        for line in lines:
            assert self.say(line) == ":" * (line.count(";") + 1), line

    def value(self, expression: str) -> float:
        """Return what MG prints for an expression."""
        reply = self.say(f"MG {expression}")
        assert reply.endswith("\r\n:"), (expression, reply)
        return float(reply[:-3])

    def code(self, command: str) -> int:
        """Send a command that must be refused and return the code of TC."""
        assert self.say(command) == "?", command
        return int(self.say("TC")[:-3])

    def switch(self, axis: int, *, forward: bool = True, reverse: bool = True, home: bool = True) -> None:
        """Set the inputs of an axis now; the bench announces no events, so the machine is polled."""
        self.plant.set_inputs(axis, forward=forward, reverse=reverse, home=home)
        self.machine.unit.core.look()

    def positions(self) -> list[int]:
        """Return RP of all axes."""
        return [int(text) for text in self.say("RP")[:-3].split(",")]

    def record(self) -> DataRecord:
        """Return the data record."""
        return decode(self.raw("QR\r")[:-1])

    def axis(self, index: int) -> Axis:
        """Return an axis of the machine, to look into."""
        return self.machine.unit.axes[index]
