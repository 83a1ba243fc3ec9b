"""A bench whose controller runs programs, and what those say."""

from __future__ import annotations

from typing import Self

from tests.unit.dmc41x3.twin.bench import Bench

SAMPLE = 1.0 / 1024.0


class ProgramBench(Bench):
    """Programs are written as one text, lines apart; their messages go to the bench's own handle."""

    def __init__(self, program: str = "", *, axes: int = 3, servo: bool = True) -> None:
        super().__init__(axes, servo)
        self.do("CF A", "CW 2")
        if program:
            self.download(program)

    def download(self, program: str, how: str = "DL") -> None:
        """Download a program that must be taken without complaint."""
        lines = [line.strip() for line in program.strip().splitlines()]
        reply = self.raw(f"{how}\r" + "".join(f"{line}\r" for line in lines) + "\\")
        assert reply == b"::", reply

    def program(self) -> list[str]:
        """Return the lines of the program in memory."""
        reply = self.say("UL")
        assert reply.endswith("\x1a:")
        return [] if reply == "\r\n\x1a:" else reply[:-2].splitlines()

    def said(self) -> list[str]:
        """Return the lines that came unasked since the last call."""
        data = b"".join(data for handle, data in self.machine.take_messages() if handle is self.handle)
        return [line.strip() for line in data.decode("ascii").splitlines()]

    def run(self, until: float, program: str = "", start: str = "XQ") -> list[str]:
        """Start the program in memory, or a new one, and return its output until a time [s]."""
        if program:
            self.download(program)
        self.do(start)
        self.at(until)
        return self.said()

    def samples(self, count: float) -> Self:
        """Let a number of samples pass."""
        self.at(self.now + count * SAMPLE)
        return self

    def place(self, thread: int = 0) -> int:
        """Return the line a thread is in, -1 for none."""
        return int(self.value(f"_XQ{thread}"))

    def state(self, thread: int = 0) -> int:
        """Return `_HXn`: 0 stopped, 1 running, 2 waiting."""
        return int(self.value(f"_HX{thread}"))
