"""After any input in any order the twin answers, stays consistent, and never raises or hangs.

A session is one controller and a few hundred deeds; a failing one is cut down to the deeds it needs and printed.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from math import isfinite
from random import Random
from types import FrameType
from typing import NamedTuple

import pytest

from dmc41x3.language.codes import ERROR_TEXTS
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.network import COUNT, Handle
from dmc41x3.twin.plant import BenchPlant
from dmc41x3.twin.unit import MOST_VARIABLES
from dmc41x3.wire.framing import LineSplitter
from tests import random_commands
from tests.campaign import Campaign

SHARDS = 10
"""In so many parts the campaign runs, each with a time limit of its own."""

DEEDS = 400
"""Deeds of one session."""

BATCH = 50
"""After so many deeds the controller is looked over."""

BOUND = 10.0
"""The most CPU time that one batch may take [s]; the slowest right one takes about a second."""

TRIALS = 300
"""Number of retries of a failing session with some actions left out."""

TALKATIVE = {"TC", "MG", "QR", "QU", "UL", "LS", "LL", "LV", "LA", "TZ", "ID", "TH", "DL", "QD", "RS", "IH"}
"""Commands with arbitrary output, or that end the conversation; prompts are counted in sessions without them."""


class Deed(NamedTuple):
    """One thing done to a controller: `what`, on which of its connections, with what."""

    what: str
    link: int = 0
    data: bytes = b""
    value: float = 0.0


class Hang(Exception):
    """A batch took more CPU time than a right one ever does."""


@contextmanager
def bounded() -> Iterator[None]:
    """Raise `Hang` in the block when it has used `BOUND` of CPU time."""

    def over(signum: int, frame: FrameType | None) -> None:
        raise Hang(f"more than {BOUND:g} s")

    before = signal.signal(signal.SIGPROF, over)
    signal.setitimer(signal.ITIMER_PROF, BOUND)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


class Session:
    """One controller under fire."""

    def __init__(self, axes: int) -> None:
        self.plant = BenchPlant(axes)
        self.machine = VirtualDmc(self.plant, axes=axes)
        self.now = 0.0
        self.links: list[Handle | None] = [self.machine.connect()]

    def do(self, deed: Deed) -> None:
        """Do one deed and look at its answer."""
        match deed.what:
            case "send":
                self._send(deed.link, deed.data)
            case "wait":
                self.now += deed.value
                self.machine.advance(self.now)
            case "connect":
                self.links.append(self.machine.connect(("10.0.0.1", 5000)))
            case "drop":
                handle = self._handle(deed.link)
                if handle is not None:
                    self.machine.disconnect(handle)
            case "inputs":
                level = [bool(int(deed.value) >> bit & 1) for bit in range(3)]
                axis = deed.link % len(self.machine.unit.axes)
                self.plant.set_inputs(axis, forward=level[0], reverse=level[1], home=level[2])
                self.machine.look()
            case "hold":
                self.plant.hold(deed.link % len(self.machine.unit.axes))
            case "abort":
                self.machine.abort_input(bool(deed.value))
            case _:
                self.machine.amplifier_fault(int(deed.value))
        self.machine.take_messages()

    def _handle(self, link: int) -> Handle | None:
        handle = self.links[link % len(self.links)]
        return handle if handle is not None and handle.open else None

    def _send(self, link: int, data: bytes) -> None:
        handle = self._handle(link)
        if handle is None:
            self.links[link % len(self.links)] = handle = self.machine.connect()
        if handle is None:
            return
        commands = self._countable(handle, data)
        reply = self.machine.receive(handle, data, self.now)
        if commands is not None and handle.open and handle.download is None:
            answers = reply.count(b":") + reply.count(b"?")
            assert answers == commands, f"{commands} commands, {reply!r}"
        if handle.open and handle.download is None and reply:
            assert reply[-1:] in (b":", b"?"), reply

    @staticmethod
    def _countable(handle: Handle, data: bytes) -> int | None:
        """Return how many prompts `data` must yield, None where what is printed may hold prompts itself."""
        if handle.download is not None or not data.endswith(b"\r") or not handle.splitter.between_lines:
            return None
        texts = LineSplitter().feed(data)
        quiet = all(text[:2].isupper() and text[:2] not in TALKATIVE and "=" not in text for text in texts)
        return len(texts) if quiet else None

    def look_over(self) -> None:
        """Check everything that must hold whatever happened."""
        handle = self._ask()
        assert self._say(handle, "VF 10.4;LZ 1") == b"::"
        assert self._say(handle, "MG 1") == b" 1.0000\r\n:"
        self._look_at_axes(handle)
        self._look_at_memory(handle)
        self._look_at_handles()
        self.machine.disconnect(handle)

    def _ask(self) -> Handle:
        handle = self.machine.connect()
        if handle is None:
            first = next(handle for handle in self.machine.unit.handles if handle is not None)
            self.machine.disconnect(first)
            handle = self.machine.connect()
        assert handle is not None
        return handle

    def _say(self, handle: Handle, text: str) -> bytes:
        return self.machine.receive(handle, f"{text}\r".encode("ascii"), self.now)

    def _look_at_axes(self, handle: Handle) -> None:
        unit = self.machine.unit
        for axis in unit.axes:
            moving = self._say(handle, f"MG _BG{axis.letter}")
            assert moving == (b" 1.0000\r\n:" if axis.moving else b" 0.0000\r\n:"), (axis.letter, moving)
            places = (self.plant.position(axis.index), *axis.timeline.at(self.machine.now))
            assert all(map(isfinite, places)), (axis.letter, places)
            assert abs(axis.reference(self.machine.now)) < 1 << 40
        record = self._say(handle, "QR")
        assert len(record) == int.from_bytes(record[2:4], "little") + 1 == 83 + 36 * len(unit.axes)

    def _look_at_memory(self, handle: Handle) -> None:
        unit = self.machine.unit
        assert 0 <= len(unit.variables) <= MOST_VARIABLES
        assert unit.arrays.free >= 0
        assert unit.error_code == 0 or unit.error_code in ERROR_TEXTS
        assert all(0 <= plane.free(self.machine.now) <= 511 for plane in unit.core.planes.values())
        time = float(self._say(handle, "MG TIME")[:-3])
        assert time == unit.time

    def _look_at_handles(self) -> None:
        handles = self.machine.unit.handles
        taken = [handle for handle in handles if handle is not None]
        assert [handle.index for handle in taken] == sorted({handle.index for handle in taken})
        assert all(handle.open for handle in taken)
        assert handles.free + len(taken) == COUNT


def deeds(rng: Random) -> Iterator[Deed]:
    """Yield the deeds of one session."""
    for _ in range(DEEDS):
        yield _deed(rng)


def _deed(rng: Random) -> Deed:
    link, kind = rng.randrange(4), rng.random()
    if kind < 0.82:
        return Deed("send", link, _bytes(rng))
    if kind < 0.94:
        return Deed("wait", value=rng.choice((0.0, 0.001, 0.01, 0.01, 0.1, 0.1, 0.5, 2.0)))
    what = rng.choice(("connect", "drop", "inputs", "inputs", "hold", "abort", "amplifier"))
    return Deed(what, link, value=float(rng.choice((0, 0, 7, rng.randrange(8)))))


def _bytes(rng: Random) -> bytes:
    kind = rng.random()
    if kind < 0.6:
        return f"{random_commands.line(rng)}\r".encode("latin-1")
    if kind < 0.82:
        return f"{random_commands.mutated(rng, random_commands.line(rng))}\r".encode("latin-1")
    if kind < 0.88:
        return random_commands.blob(rng) + rng.choice((b"", b"\r"))
    if kind < 0.94:
        return random_commands.program(rng).encode("latin-1")
    return f"{random_commands.execution(rng)}\r".encode("ascii")


def play(axes: int, plan: list[Deed]) -> Exception | None:
    """Do all deeds to a new controller; return what went wrong."""
    try:
        session = Session(axes)
        for start in range(0, len(plan), BATCH):
            with bounded():
                for deed in plan[start : start + BATCH]:
                    session.do(deed)
                session.look_over()
    except Exception as error:  # noqa: BLE001 - whatever escapes is the finding
        return error
    return None


def shortened(axes: int, plan: list[Deed], like: Exception) -> list[Deed]:
    """Return fewer deeds that go wrong in the same way."""
    size, trials = len(plan) // 2, 0
    while size >= 1:
        start = 0
        while start < len(plan) and trials < TRIALS:
            fewer = plan[:start] + plan[start + size :]
            trials += 1
            if type(play(axes, fewer)) is type(like):
                plan = fewer
            else:
                start += size
        size //= 2
    return plan


def commands(plan: list[Deed]) -> int:
    """Return how many commands a session sends."""
    return sum(deed.data.count(b"\r") + deed.data.count(b";") for deed in plan)


@pytest.mark.parametrize("shard", range(SHARDS))
def test_nothing_that_is_sent_breaks_the_controller(campaign: Campaign, shard: int) -> None:
    size = campaign.size(ci=20_000 // SHARDS, long=2_000_000 // SHARDS)
    sent = case = 0
    while sent < size:
        rng = campaign.rng(case)
        axes = rng.randrange(1, 9)
        plan = list(deeds(rng))
        error = play(axes, plan)
        if error is not None:
            needed = "\n".join(map(repr, shortened(axes, plan, error)))
            pytest.fail(f"shard {shard}, case {case}, {axes} axes: {error!r} after\n{needed}")
        sent += commands(plan)
        case += 1
