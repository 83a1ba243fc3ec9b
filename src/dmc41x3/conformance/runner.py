"""Holds a controller to the table, over anything that carries bytes."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from dmc41x3.conformance.pattern import compiled, literal
from dmc41x3.conformance.vectors import Demand, Special, Vector, VectorStep
from dmc41x3.language.hardware import LETTERS
from dmc41x3.language.record import record_length

ASK_AGAIN = 0.02
"""How long to wait before asking the same again [s]."""

UNASKED = 0.5
"""How long a message that nobody asks for gets to come [s]."""

SETTLE = 10.0
"""How long axes get to come to rest behind a vector that moves them [s]."""

FARTHEST = 20_000
"""No vector moves an axis farther than this [counts]; what is farther away is not gone back to."""

_FENCE = VectorStep('MG "fence"\r', ("fence\r\n:",))


class ControllerChannel(Protocol):
    """One connection to a controller."""

    def send(self, data: bytes) -> None:
        """Send bytes."""
        ...

    def receive(self) -> bytes:
        """Return what has come, b"" where nothing does within the patience of whoever made this."""
        ...

    def wait(self, seconds: float) -> None:
        """Let time pass for the controller [s]."""
        ...

    def ended(self) -> bool:
        """Tell whether the other side has ended the connection."""
        ...

    def close(self) -> None:
        """Hang up; again is harmless."""
        ...


Dial = Callable[[], ControllerChannel]
"""Opens one more connection to the same controller."""


@dataclass(frozen=True, slots=True)
class VectorDifference:
    """Where a controller answered otherwise than the table has it: what was sent, expected, and received."""

    vector: Vector
    sent: str
    expected: tuple[str, ...]
    received: bytes

    def __str__(self) -> str:
        wanted = " or ".join(repr(text) for text in self.expected)
        return f"{self.vector.name}: sent {self.sent!r}, expected {wanted}, received {self.received!r}"


class _Differs(Exception):
    def __init__(self, step: VectorStep, received: bytes) -> None:
        super().__init__(step, received)
        self.step = step
        self.received = received


def run(vector: Vector, dial: Dial, axes: int) -> VectorDifference | None:
    """Hold one conversation with a controller of `axes` axes; return the first difference, None where there is none.

    Its state is put back as far as the vector says how. What a channel raises passes through.
    """
    talk = _Talk(dial, axes)
    try:
        kept = [(name, talk.value(name)) for name in vector.keep]
        try:
            for step in (*_accepted(vector.setup), *vector.steps):
                talk.take(step)
            talk.fence()
        except _Differs as differs:
            step = differs.step
            return VectorDifference(vector, step.send, step.expect, differs.received)
        finally:
            talk.restore(vector, kept)
    finally:
        talk.close()
    return None


def coalesced(vector: Vector) -> Vector:
    """Return the same conversation with as few sends as possible: every run of exchanges becomes one."""
    steps: list[VectorStep] = []
    for step in vector.steps:
        last = steps[-1] if steps else None
        if last is not None and _joins(last, step):
            steps[-1] = replace(last, send=last.send + step.send, expect=_product(last.expect, step.expect))
        else:
            steps.append(step)
    return replace(vector, steps=tuple(steps))


def _joins(one: VectorStep, other: VectorStep) -> bool:
    plain = one.special is None and other.special is None and one.times == other.times == 1
    return plain and bool(one.send and other.send) and one.on == other.on


def _product(one: tuple[str, ...], other: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(first + second for first in one for second in other)


def _origins(vector: Vector) -> str:
    """Return the axes whose origin is where the vector found them; none where it also defines other positions."""
    defined = {
        part for step in (*_accepted(vector.setup), *vector.steps) for part in _commands(step) if part[:2] == "DP"
    }
    return {frozenset({"DPA=0"}): "A", frozenset({"DP 0,0"}): "AB"}.get(frozenset(defined), "")


def _commands(step: VectorStep) -> list[str]:
    return step.send.replace("\r", ";").split(";")


def _accepted(commands: Sequence[str]) -> list[VectorStep]:
    return [VectorStep(f"{command}\r", (":",)) for command in commands]


class _Talk:
    """The connections of one vector."""

    def __init__(self, dial: Dial, axes: int) -> None:
        self._dial = dial
        self._axes = axes
        self._channels: dict[str, ControllerChannel] = {"": dial()}
        self._rest: dict[str, bytes] = {}
        self._gone: set[str] = set()

    def take(self, step: VectorStep) -> None:
        """Do one step; raises `_Differs`."""
        for _ in range(step.times):
            self._once(step)

    def fence(self) -> None:
        """See that nothing more came than was expected."""
        for name, channel in self._channels.items():
            if name not in self._gone:
                self._exchange(channel, replace(_FENCE, on=name))

    def value(self, operand: str) -> str:
        """Return what an operand is now."""
        reply = self._answer(self._channels[""], f"MG _{operand}\r")
        return reply.decode("ascii", "replace").strip(" \r\n:")

    def restore(self, vector: Vector, kept: list[tuple[str, str]]) -> None:
        """Put back what the vector changed, whatever became of it."""
        channel = self._channels[""]
        if Demand.MOVES in vector.demands:
            self._bring_to_rest(channel)
        for command in (*vector.restore, *(f"{name}={value}" for name, value in kept)):
            self._answer(channel, f"{command}\r")
        self._go_back(channel, _origins(vector))
        self._answer(channel, "TC\r")

    def close(self) -> None:
        """Hang up everywhere."""
        for channel in self._channels.values():
            channel.close()

    def _bring_to_rest(self, channel: ControllerChannel) -> None:
        self._answer(channel, f"ST {LETTERS[: self._axes]}\r")
        self._wait_for_rest(channel)

    def _wait_for_rest(self, channel: ControllerChannel) -> None:
        waited = 0.0
        asked = "|".join(f"_BG{letter}" for letter in LETTERS[: self._axes])
        while self._answer(channel, f"MG {asked}\r") != b" 0.0000\r\n:" and waited < SETTLE:
            channel.wait(ASK_AGAIN)
            waited += ASK_AGAIN

    def _go_back(self, channel: ControllerChannel, letters: str) -> None:
        """Move axes back to their origins, so that a whole table does not carry them away."""
        for letter in letters:
            try:
                place = float(self.value(f"RP{letter}"))
            except ValueError:
                continue
            if 0.0 < abs(place) <= FARTHEST and self.value(f"MO{letter}") == "0.0000":
                self._answer(channel, f"PR{letter}={-place:.0f}\r")
                self._answer(channel, f"BG{letter}\r")
        if letters:
            self._wait_for_rest(channel)

    def _once(self, step: VectorStep) -> None:
        if step.special is Special.WAIT:
            self._channels[""].wait(step.seconds)
            return
        channel = self._channels.get(step.on)
        if channel is None:
            channel = self._channels[step.on] = self._dial()
        match step.special:
            case Special.UNTIL:
                self._until(channel, step)
            case Special.RECORD:
                self._record(channel, step)
            case Special.CLOSE:
                self._channels.pop(step.on).close()
            case Special.CLOSED:
                if not channel.ended():
                    raise _Differs(replace(step, expect=("the end of the connection",)), channel.receive())
                self._gone.add(step.on)
            case _:
                self._exchange(channel, step)

    def _exchange(self, channel: ControllerChannel, step: VectorStep) -> None:
        if step.send:
            channel.send(step.send.encode("latin-1"))
        if step.expect == ("",):
            return
        patterns = [compiled(text, self._axes) for text in step.expect]
        exact = all(map(literal, step.expect))
        received = self._rest.pop(step.on, b"")
        waited = 0.0
        while True:
            end = max(pattern.begins(received) for pattern in patterns)
            if end == len(received) or (end >= 0 and exact):
                self._rest[step.on] = received[end:]
                return
            more = channel.receive()
            if not more:
                if step.send or waited >= UNASKED:
                    break
                channel.wait(ASK_AGAIN)
                waited += ASK_AGAIN
            received += more
        if end < 0:
            raise _Differs(step, received)
        self._rest[step.on] = received[end:]

    def _until(self, channel: ControllerChannel, step: VectorStep) -> None:
        patterns = [compiled(text, self._axes) for text in step.expect]
        waited = 0.0
        while True:
            received = self._answer(channel, step.send)
            if any(pattern.matches(received) for pattern in patterns):
                return
            if waited >= step.seconds:
                raise _Differs(step, received)
            channel.wait(ASK_AGAIN)
            waited += ASK_AGAIN

    def _record(self, channel: ControllerChannel, step: VectorStep) -> None:
        channel.send(step.send.encode("latin-1"))
        received = self._rest.pop(step.on, b"")
        while len(received) < 4 or len(received) <= int.from_bytes(received[2:4], "little"):
            more = channel.receive()
            if not more:
                raise _Differs(step, received)
            received += more
        length = int.from_bytes(received[2:4], "little")
        whole = step.send.strip() != "QR" or length == record_length(self._axes)
        right = whole and received[length : length + 1] == b":" and all(_holds(received, *one) for one in step.fields)
        if not right:
            raise _Differs(replace(step, expect=(f"a record with {step.fields}",)), received)
        self._rest[step.on] = received[length + 1 :]

    def _answer(self, channel: ControllerChannel, text: str) -> bytes:
        """Send one command and return its reply, whatever it is; b"" where none comes."""
        channel.send(text.encode("latin-1"))
        received = b""
        while received[-1:] not in (b":", b"?"):
            more = channel.receive()
            if not more:
                break
            received += more
        return received


def _holds(record: bytes, offset: int, kind: str, low: int, high: int, mask: int) -> bool:
    (value,) = struct.unpack_from(f"<{kind}", record, offset)
    return low <= (value & mask if mask else value) <= high
