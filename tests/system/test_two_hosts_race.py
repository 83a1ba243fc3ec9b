"""Two hosts race for one controller while they are killed, and put to sleep, at random instants.

The wire of the twin and its mechanics decide: a writer owns the controller in that instant, a token changes hands at
rest, the motion of a dead host ends within the watchdog's time, nothing stalls and nothing drops.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import re
import select
import signal
import threading
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkServerProcess
from random import Random
from time import monotonic
from typing import Final, TypeVar

import pytest

from dmc41x3.language.numbers import SCALE
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.wire.server import VirtualController
from maya_un.config import Config, Units
from maya_un.errors import (
    ControllerMoves,
    ControllerOwned,
    EndedUnanswered,
    HostSilent,
    LinkLost,
    LinkTimeout,
    OwnerErased,
    OwnershipLost,
)
from maya_un.machine.mechanics import MayaMechanics
from maya_un.machine.truth import StartPose
from tests.campaign import Campaign
from tests.system.processes import Wire
from tests.system.racing_host import PLACES, host

T = TypeVar("T")

GUARD_TIME = Config().safety.guard_time
BRAKING = 1.5
"""A stop takes less than this [s]."""

RACES = 4
"""Number of races that share the kills; they may run beside each other."""

PATIENCE = 60.0
"""A host sends a message within this time, however busy the machine is [s]."""

PHASES: Final = {"connect": 0.06, "own": 0.06, "move": 1.5, "grip": 0.5, "leave": 0.03}
"""Longest delay of a kill after the host's message [s]."""

STARVED = {
    error.code
    for error in (
        HostSilent,
        LinkLost,
        LinkTimeout,
        EndedUnanswered,
        OwnershipLost,
        OwnerErased,
        ControllerMoves,
        ControllerOwned,
    )
}
"""Possible errors of a host that was asleep, or had no processor for half a second.

A new owner closes the connection of the former one by its handle. If that host is dead, a connection that has just
begun may have this handle: it ends, answered or not.
"""

_QUESTIONS = ("MG", "QR", "TC", "WH", "UL", "\x12", "ZAB=(", "ZAB=_", "maya", "OB", "IH", "ST")
"""Begin what changes nothing of another's: questions, conditional writes, the fence, a stop."""

_ACTS = ("BG", "SH", "MO", "SB", "CB", "DP", "JG", "PR", "PA", "IP", "LI", "XQ")
"""Begin what moves, or changes an output or a position. Nobody but the owner sends them, in no instant.

A register may be on its way from the former owner when the token changes. The new one closes that connection, then it
writes every register.
"""

_BEAT = re.compile(r"mayabeat=\(_ZAB=(\d+)\)")


@dataclass
class Judge:
    """Sees every byte as the controller does."""

    virtual: VirtualController
    mechanics: MayaMechanics
    complaints: list[str] = field(default_factory=list[str])
    changes: int = 0
    begun: int = 0
    _tokens: dict[str, float] = field(default_factory=dict[str, float])
    _rest: dict[str, str] = field(default_factory=dict[str, str])
    _last: float = 0.0
    _configured: float = 0.0

    def see(self, letter: str, way: str, data: bytes) -> None:
        """Take a piece of the wire before the controller executes it."""
        if way != "rx":
            return
        owner = self.owner
        if owner != self._last:
            self.changes += 1
            if owner and self._last and self.moving:
                self.complaints.append(f"the token changed hands while axes moved, at {self.virtual.machine.now}")
            self._last = owner
        text = data.decode("ascii", "replace")
        if text.startswith("\x12\x16"):
            self._rest.pop(letter, None)
            self._tokens.pop(letter, None)
        *whole, self._rest[letter] = re.split("[\r;]", self._rest.get(letter, "") + text)
        for command in whole:
            self._weigh(letter, command, owner)

    def _weigh(self, letter: str, command: str, owner: float) -> None:
        if (found := _BEAT.match(command)) is not None:
            self._tokens[letter] = float(found[1])
        if not command or command.startswith(_QUESTIONS):
            return
        if self._tokens.get(letter) == owner:
            self._configured = owner
        elif owner == self._configured or command.startswith(_ACTS):
            self.complaints.append(f"{letter} said {command!r} while {owner} owned the controller")
        self.begun += command == "BGS"

    @property
    def owner(self) -> float:
        """The token in the controller."""
        return float(self.virtual.machine.unit.axes[1].registers["ZA"])

    @property
    def moving(self) -> bool:
        """Whether an axis moves."""
        machine = self.virtual.machine
        return machine.unit.core.planes["S"].running or any(axis.motion is not None for axis in machine.unit.axes)

    async def rest(self) -> float | None:
        """Return since when the axes rest [s, of the controller], None while they move."""
        if self.moving:
            return None
        return max(line.pieces[-1].t for line in self.mechanics.timelines if line.pieces)

    async def now(self) -> tuple[float, int]:
        """Return the time of the controller [s], and the process that owns it, 0 where none does."""
        machine = self.virtual.machine
        return machine.now, machine.unit.variables.get("mayapid", 0) // SCALE if self.owner else 0


class Box:
    """A twin on TCP, in real time, in a thread of its own, and its judge."""

    def __init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever)
        self._thread.start()
        self.judge, self.address = self.ask(self._serve())

    async def _serve(self) -> tuple[Judge, str]:
        mechanics = MayaMechanics(start=StartPose(*PLACES[0]))
        virtual = VirtualController(VirtualDmc(mechanics))
        judge = Judge(virtual, mechanics)
        virtual.tap = judge.see
        name, port = await virtual.serve()
        return judge, f"{name}:{port}"

    def ask(self, work: Coroutine[None, None, T]) -> T:
        """Have something done in the twin's thread, and return its result."""
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(PATIENCE)

    def rested(self) -> float:
        """Wait until the axes rest, and return since when [s, of the controller]."""
        while (since := self.ask(self.judge.rest())) is None:
            pass_time(0.005)
        return since

    def close(self) -> None:
        """End the twin and its thread."""
        self.ask(self.judge.virtual.close())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()


@contextmanager
def served() -> Iterator[Box]:
    """Serve a twin that bears the mark of a homing while the block runs."""
    box = Box()
    try:
        with Wire(box.address) as wire:
            a, b, c = Units.of(Config()).to_counts(PLACES[0])
            for command in (f"DP {a},{b},{c}", "mayaendb=2260000", "mayaendc=2300000", "ZAA=7", "mayahome=7"):
                wire.say(command)
        box.judge.complaints.clear()
        yield box
    finally:
        box.close()


class Racer:
    """A host as a separate process, restarted after every kill."""

    def __init__(self, name: str, address: str) -> None:
        self._name = name
        self._address = address
        self._lives = 0
        self.heard: list[str] = []
        self._begin()

    def _begin(self) -> None:
        context = multiprocessing.get_context("forkserver")
        self.pipe, theirs = context.Pipe(duplex=False)
        self._lives += 1
        seed = f"{self._name} {self._lives}"
        self.process: ForkServerProcess = context.Process(target=host, args=(self._address, seed, theirs))
        self.process.start()
        theirs.close()

    def hear(self) -> str:
        """Return the next word."""
        word = str(self.pipe.recv())
        self.heard.append(word)
        return word

    def send(self, kind: signal.Signals) -> None:
        """Send a signal."""
        assert self.process.pid is not None
        os.kill(self.process.pid, kind)

    def kill(self) -> None:
        """End it where it is."""
        self.process.kill()
        self.process.join()
        self.process.close()
        self.pipe.close()

    def again(self) -> None:
        """Kill it, and restart it."""
        self.kill()
        self._begin()


def next_at(racers: list[Racer], phase: str) -> Racer:
    """Return the first racer that announces this action."""
    pipes: dict[object, Racer] = {racer.pipe: racer for racer in racers}
    end = monotonic() + PATIENCE
    while True:
        ready = wait([racer.pipe for racer in racers], max(end - monotonic(), 0.0))
        assert ready, f"nobody ever was to {phase}; last words: {[racer.heard[-12:] for racer in racers]}"
        for pipe in ready:
            assert isinstance(pipe, Connection)
            if pipes[pipe].hear() == phase:
                return pipes[pipe]


def pass_time(seconds: float) -> None:
    select.select([], [], [], seconds)


@pytest.mark.waits("about 3 s: two kills within 1.5 s each, and 1 s until a killed owner counts as dead")
@pytest.mark.system
@pytest.mark.parametrize("race", range(RACES))
def test_two_hosts_that_are_killed_at_random_never_own_the_controller_together(campaign: Campaign, race: int) -> None:
    multiprocessing.get_context("forkserver").set_forkserver_preload(["tests.system.racing_host"])
    rng, kills = campaign.rng(race), campaign.size(ci=2, long=200 // RACES)
    latest = 0.0
    with served() as box:
        racers = [Racer(f"{campaign.seed} {race} {number}", box.address) for number in range(2)]
        try:
            for _ in range(kills):
                latest = max(latest, _round(rng, box, racers))
            next_at(racers, "move")  # and the survivors still work
        finally:
            for racer in racers:
                racer.kill()
        box.rested()
        record = box.judge.mechanics.record
        assert box.judge.complaints == []
        assert box.judge.changes >= kills // 2
        assert box.judge.begun >= kills // 8
        assert latest <= GUARD_TIME + BRAKING
        assert (record.whole.stall_time, record.drops) == (0.0, ())
        assert record.whole.tension <= 2.0
        met = {word for racer in racers for word in racer.heard if word.startswith("error")}
        assert {word for word in met if int(word.split()[1]) not in STARVED} == set()
        changes, begun = box.judge.changes, box.judge.begun
        print(f"{kills} kills, {changes} changes of the token, {begun} motions, at rest after {latest:.2f} s at most")


def _round(rng: Random, box: Box, racers: list[Racer]) -> float:
    """Kill a racer at a random instant; return how long the axes moved on behind that [s]."""
    phase = rng.choice(("connect", "own", "move", "move", "move", "grip", "leave"))
    victim = next_at(racers, phase)
    pass_time(rng.uniform(0.0, PHASES[phase]))
    if rng.random() < 0.25:
        _sleep(rng, racers, victim)
    victim.send(signal.SIGKILL)
    died, owner = box.ask(box.judge.now())
    number = victim.process.pid
    victim.again()
    return max(0.0, box.rested() - died) if owner == number else 0.0


def _sleep(rng: Random, racers: list[Racer], victim: Racer) -> None:
    """Have a racer sleep, as a laptop does, and wake up behind a change of the owner, or before it."""
    victim.send(signal.SIGSTOP)
    try:
        if rng.random() < 0.5:
            next_at([racer for racer in racers if racer is not victim], "own")
        else:
            pass_time(rng.uniform(0.3, 2.0))
    finally:
        victim.send(signal.SIGCONT)
    pass_time(rng.uniform(0.0, 0.3))
