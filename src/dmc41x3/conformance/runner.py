"""Run the conformance table against a controller, over any byte channel.

An expected reply is literal text in which `<...>` stands for parts that differ between controllers.
A controller on a bench is first brought to the state that the table expects.

`<n>` is a whole number and `<v>` one with four decimals, both with the slot for their sign; `< >` a blank or none;
`<2..8>` a number between two; `<axes>` how many axes there are; `<handle>` a letter A to H; `<line>` any text
within a line, `<lines>` any text at all; `<<` is the character itself.

Commands restore the settings; a master reset would also erase the network address. A reset restores the rest (an
armed latch, the clock) after the settings have been burned.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from dmc41x3.conformance.vectors import Demand, Special, Vector, VectorStep, fresh
from dmc41x3.language.commands import LINE_LIMIT
from dmc41x3.language.hardware import LETTERS
from dmc41x3.language.record import record_length

_NUMBER = r" ?-?\d+(?:\.\d+)?"
_FIXED = {
    "n": r" ?-?\d+",
    "v": r" ?-?\d+\.\d{4}",
    " ": " ?",
    "handle": "[A-H]",
    "line": "[^\r\n]+",
    "lines": "(?s:.*?)",
}
_TOKEN = re.compile(r"<<|<([^<>]+)>")
_RANGE = re.compile(r"(-?\d+(?:\.\d+)?)\.\.(-?\d+(?:\.\d+)?)")


@dataclass(frozen=True, slots=True)
class Pattern:
    """One expected reply: its regular expression, and the ranges of the numbers that it captures."""

    form: re.Pattern[bytes]
    ranges: tuple[tuple[float, float], ...]

    def matches(self, data: bytes) -> bool:
        """Return whether all of `data` is such a reply."""
        return self._within(self.form.fullmatch(data))

    def begins(self, data: bytes) -> int:
        """Return the length of such a reply at the beginning of `data`, -1 if there is none."""
        found = self.form.match(data)
        return found.end() if found is not None and self._within(found) else -1

    def _within(self, found: re.Match[bytes] | None) -> bool:
        if found is None:
            return False
        numbers = map(float, found.groups())
        return all(low <= number <= high for number, (low, high) in zip(numbers, self.ranges, strict=True))


def compiled(text: str, axes: int) -> Pattern:
    """Return the pattern that `text` describes on a controller with `axes` axes; raises `ValueError`."""
    form, ranges, at = "", list[tuple[float, float]](), 0
    for token in _TOKEN.finditer(text):
        form += re.escape(text[at : token.start()]) + _form(token[1], axes, ranges)
        at = token.end()
    form += re.escape(text[at:])
    return Pattern(re.compile(form.encode("latin-1")), tuple(ranges))


def literal(text: str) -> bool:
    """Return whether an expected reply contains no placeholder (`<…>`)."""
    return "<" not in text


def _form(name: str | None, axes: int, ranges: list[tuple[float, float]]) -> str:
    if name is None:
        return "<"
    if name == "axes":
        return str(axes)
    if name in _FIXED:
        return _FIXED[name]
    bounds = _RANGE.fullmatch(name)
    if bounds is None:
        raise ValueError(f"<{name}> stands for nothing")
    ranges.append((float(bounds[1]), float(bounds[2])))
    return f"({_NUMBER})"


ASK_AGAIN = 0.02
"""Time between two repetitions of a request [s]."""

UNASKED = 0.5
"""Longest wait for an unsolicited message [s]."""

SETTLE = 10.0
"""Longest wait for axes to come to rest after a vector that moves them [s]."""

FARTHEST = 20_000
"""No vector moves an axis farther than this [counts]; an axis that is farther away is not moved back."""

_FENCE = VectorStep('MG "fence"\r', ("fence\r\n:",))


class ControllerChannel(Protocol):
    """One connection to a controller."""

    def send(self, data: bytes) -> None:
        """Send bytes."""
        ...

    def receive(self) -> bytes:
        """Return the received bytes, or b"" if none arrive within the channel's timeout."""
        ...

    def wait(self, seconds: float) -> None:
        """Let time pass for the controller [s]."""
        ...

    def ended(self) -> bool:
        """Return whether the other side has ended the connection."""
        ...

    def close(self) -> None:
        """Close the connection; idempotent."""
        ...


Dial = Callable[[], ControllerChannel]
"""Opens one more connection to the same controller."""


@dataclass(frozen=True, slots=True)
class VectorDifference:
    """An answer that differs from the table: the text that was sent, expected, and received."""

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
    """Hold one conversation with a controller of `axes` axes; return the first difference, or None.

    Restores the controller's state as the vector describes. Errors of the channel propagate.
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
    """Return the same conversation with as few sends as possible: consecutive exchanges are merged."""
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
    """Return the axes whose initial position the vector defines as 0; none if it defines other positions."""
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
        """Run one step; raises `_Differs`."""
        for _ in range(step.times):
            self._once(step)

    def fence(self) -> None:
        """Check that no unexpected bytes arrived; raises `_Differs`."""
        for name, channel in self._channels.items():
            if name not in self._gone:
                self._exchange(channel, replace(_FENCE, on=name))

    def value(self, operand: str) -> str:
        """Return the value of an operand as text."""
        reply = self._answer(self._channels[""], f"MG _{operand}\r")
        return reply.decode("ascii", "replace").strip(" \r\n:")

    def restore(self, vector: Vector, kept: list[tuple[str, str]]) -> None:
        """Restore what the vector changed, also after a difference."""
        channel = self._channels[""]
        if Demand.MOVES in vector.demands:
            self._bring_to_rest(channel)
        for command in (*vector.restore, *(f"{name}={value}" for name, value in kept)):
            self._answer(channel, f"{command}\r")
        self._go_back(channel, _origins(vector))
        self._answer(channel, "TC\r")

    def close(self) -> None:
        """Close all connections."""
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
        """Move axes back to their origins, so that they do not drift away over a whole table."""
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
        """Send one command and return its reply of any kind, or b"" if none arrives."""
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


_PROMPTS = (b":", b"?")
_EMPTY = "DL\r\\"


def freshen(dial: Dial, axes: int) -> None:
    """Restore every setting of a controller of `axes` axes, and erase its program, variables and arrays.

    A refused setting stays as it is; the vectors then show a difference.
    """
    channel = dial()
    try:
        _freshen(channel, axes)
    finally:
        channel.close()


def restart(dial: Dial, axes: int) -> None:
    """Restore the settings, burn them, reset the controller, and restore them again; other connections end."""
    channel = dial()
    try:
        _freshen(channel, axes)
        for command in ("IHT=>-3", "BN", "BP", "BV"):
            _say(channel, [command])
        channel.send(b"RS\r")
        channel.ended()
    finally:
        channel.close()
    _await_answer(dial)
    freshen(dial, axes)


def _freshen(channel: ControllerChannel, axes: int) -> None:
    letters = LETTERS[:axes]
    _say(channel, ["HX", "ST", f"ST {letters}"])
    waited = 0.0
    asked = "|".join(f"_BG{letter}" for letter in letters)
    while _say(channel, [f"MG {asked}{{F1.0}}"]) != b" 0\r\n:" and waited < SETTLE:
        channel.wait(ASK_AGAIN)
        waited += ASK_AGAIN
    channel.send(_EMPTY.encode("ascii"))
    _prompts(channel, 2)
    for line in _packed(fresh()):
        _say(channel, line)


def _await_answer(dial: Dial) -> None:
    """Wait until a controller answers after a reset, at most `SETTLE`."""
    waited = 0.0
    while waited < SETTLE:
        channel = dial()
        try:
            if _say(channel, ["NO"]) == b":":
                return
            channel.wait(ASK_AGAIN)
        finally:
            channel.close()
        waited += ASK_AGAIN


def _packed(commands: tuple[str, ...]) -> Iterator[list[str]]:
    """Yield commands packed into lines."""
    line: list[str] = []
    for command in commands:
        if len(";".join([*line, command])) > LINE_LIMIT:
            yield line
            line = []
        line.append(command)
    yield line


def _say(channel: ControllerChannel, commands: list[str]) -> bytes:
    """Send commands in one line and return the bytes received up to their last prompt."""
    channel.send(f"{';'.join(commands)}\r".encode("ascii"))
    return _prompts(channel, len(commands))


def _prompts(channel: ControllerChannel, count: int) -> bytes:
    received = b""
    while sum(map(received.count, _PROMPTS)) < count:
        more = channel.receive()
        if not more:
            break
        received += more
    return received
