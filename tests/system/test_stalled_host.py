"""A host that hangs while a motion is under way, judged by the mechanics' record and the judge's own formulas.

While it hangs it neither sends nor hears anything, and the controller's clock goes on. For most of the guard's time
that changes nothing at all, neither the way nor when what is where; for longer the guard stops the axes, on the way.
In neither case does anything jump, or does the controller wait for segments: a motion is loaded whole before it begins.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from random import Random

import numpy as np

from dmc41x3.loops import run_virtual
from dmc41x3.wire.transport import Transport
from maya_un.config import Config, Units
from maya_un.config.files import parse
from maya_un.controller.controller import GalilController
from maya_un.controller.planner import MOST_SEGMENTS
from maya_un.errors import HostSilent
from maya_un.motion.path import Path
from maya_un.testing import Rig
from maya_un.values import Joints, Point
from tests.campaign import Campaign
from tests.homing_mark import take_over
from tests.judge.mechanism import Floats, places
from tests.judge.paths import Cut, Way, deviations, drawn
from tests.judge.trajectory import PARTS, Trajectory
from tests.machines import Machine, twin_of
from tests.virtual_time import elapse

MACHINE = Machine.of(parse({"controller": {"timeout": 10.0}}))
"""The manual's; its host waits for a reply longer than any stall here."""

PER_UNIT = np.array(Units.of(MACHINE.config).per_unit)
HERE = Joints(0.5, 1.5, 1.5)
GUARD_TIME = Config().safety.guard_time
LATEST = 0.010
"""The guard may take so much longer than its time until the axes brake [s]."""
LAG = 0.1
BRAKING = 0.5
"""Over so long no axis brakes harder on the way than in a stop by itself [s]."""
REST = 1.5
"""A stop takes less than this [s]."""
OFF_THE_WAY = 2e-4
"""Allowed effect of the chords, and of whole counts of the boom, on a path [m]."""


class Hanging:
    """A transport to a host that hangs at times: delayed bytes pass afterwards in both directions."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport
        self._held: list[bytes] = []
        self._awake = asyncio.Event()
        self._awake.set()

    @property
    def peer(self) -> str:
        return self._transport.peer

    async def read(self) -> bytes:
        data = await self._transport.read()
        await self._awake.wait()
        return data

    def write(self, data: bytes) -> None:
        if self._awake.is_set():
            self._transport.write(data)
        else:
            self._held.append(data)

    async def close(self) -> None:
        self._awake.set()
        await self._transport.close()

    async def hang(self, seconds: float) -> None:
        self._awake.clear()
        await elapse(seconds)
        self._awake.set()
        held, self._held = self._held, []
        for data in held:
            self._transport.write(data)


@dataclass(frozen=True, slots=True)
class Stallable:
    """A live rig whose host can be made to hang; `lines` holds its connections."""

    bench: Rig
    lines: list[Hanging] = field(default_factory=list[Hanging])

    async def hang(self, seconds: float) -> None:
        """Have all of the host's connections hang for so long [s]."""
        await asyncio.gather(*(line.hang(seconds) for line in self.lines))


@asynccontextmanager
async def stallable() -> AsyncIterator[Stallable]:
    """Give a live rig that stands at `HERE`, homed, with a guard in its controller."""
    virtual, mechanics = twin_of(MACHINE, HERE)
    lines: list[Hanging] = []

    async def dial() -> Transport:
        lines.append(Hanging(virtual.loopback()))
        return lines[-1]

    controller = GalilController(dial, "twin", MACHINE.config, live=True)
    bench = Rig(controller, virtual, mechanics)
    controller.tap(lambda way, data: bench.sent.extend(data) if way == "tx" else None)
    await controller.open()
    try:
        await take_over(controller, virtual, HERE, MACHINE.truth)
        yield Stallable(bench, lines)
    finally:
        await controller.close()
        await virtual.close()


def drawn_path(rng: Random) -> Path:
    """Return a way of some ten to thirty seconds from `HERE` on."""
    x, y, z = places(MACHINE.frame, np.array([HERE]))[0].tolist()
    middle = Point(rng.uniform(0.8, 1.2), rng.uniform(0.6, 0.9), rng.uniform(0.7, 1.2))
    end = Point(rng.uniform(1.2, 1.4), rng.uniform(0.2, 0.5), rng.uniform(0.6, 1.3))
    match rng.choice(("line", "corner", "joints")):
        case "line":
            return Path.line(Point(x, y, z), end)
        case "corner":
            return Path.line(Point(x, y, z), middle, end, blend=rng.uniform(0.05, 0.2))
        case _:
            return Path.joints(HERE, Joints(rng.uniform(0.7, 1.3), rng.uniform(1.2, 1.7), rng.uniform(1.3, 1.8)))


async def _gone(path: Path, stalls: Random | None, longest: float) -> tuple[Trajectory, BaseException | None]:
    """Go along a path, with a host that hangs at instants that `stalls` draws, up to `longest` [s] each time."""
    async with stallable() as robot:
        bench = robot.bench
        await elapse(LAG)
        bench.virtual.sync()
        mark = bench.mechanics.now
        motion = asyncio.create_task(bench.controller.follow(path))
        while stalls is not None and not motion.done():
            await asyncio.wait({motion}, timeout=stalls.uniform(0.1, 3.0))
            await robot.hang(longest)
        await asyncio.wait({motion})
        await elapse(LAG)
        bench.virtual.sync()
        _assert_loaded_whole(bytes(bench.sent))
        assert not bench.mechanics.record.drops
        return Trajectory.of(bench.mechanics.record.trace, mark), motion.exception()


def _assert_loaded_whole(sent: bytes) -> None:
    """The last motion's segments, and their end, were all there before it began; none came later."""
    commands = sent.decode("ascii").replace(";", "\r").split("\r")
    begun = len(commands) - 1 - commands[::-1].index("BGS")
    loaded = [command for command in commands[:begun] if command.startswith("LI ")]
    assert 0 < len(loaded) <= MOST_SEGMENTS
    assert "LE" in commands[:begun]
    assert not [command for command in commands[begun:] if command.startswith("LI ")]


def _off(path: Path, trajectory: Trajectory) -> Floats:
    """Return how far the gripper is from the way at every place of a trajectory [m]."""
    way = Way(path.space.value, path.waypoints, tuple(Cut(*blend) for blend in path.blends))
    line = places(MACHINE.frame, drawn(MACHINE.frame, way, 2_000))
    return deviations(places(MACHINE.frame, trajectory.joints), line)


def test_short_stall_changes_neither_the_path_nor_the_time(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=3, long=200)):
        rng = campaign.rng(case)
        path = drawn_path(rng)
        undisturbed, error = run_virtual(_gone(path, None, 0.0))
        assert error is None
        stalled, error = run_virtual(_gone(path, rng, 0.9 * GUARD_TIME))
        assert error is None, f"case {case}: {error}"
        (begun, over), (began, ended) = undisturbed.moving(), stalled.moving()
        assert abs((ended - began) - (over - begun)) < 1e-6, f"case {case}"
        times = np.linspace(0.0, over - begun, 500)
        apart = np.abs(stalled.at(began + times) - undisturbed.at(begun + times))
        assert apart.max() < 2e-5, f"case {case}: {apart.max(axis=0)}"
        assert _off(path, stalled).max() < OFF_THE_WAY


def test_a_long_stall_ends_on_the_way(campaign: Campaign) -> None:
    stopped = 0
    for case in range(campaign.size(ci=6, long=200)):
        rng = campaign.rng(case)
        path = drawn_path(rng)
        trajectory, error = run_virtual(_gone(path, rng, 2.0))
        assert error is None or isinstance(error, HostSilent), f"case {case}: {error}"
        stopped += error is not None
        assert _off(path, trajectory).max() < OFF_THE_WAY, f"case {case}"
        over = trajectory.speeds() / MACHINE.rates.speed - 1.0
        assert over.max() < 1e-4, f"case {case}"
        # One deceleration serves the whole way: an axis may brake harder for a moment than by itself; nothing jumps.
        for window, most in ((BRAKING, 1.05), (LAG, 2.0)):
            rounding = 2.0 / PER_UNIT * PARTS / window**2
            harder = trajectory.mean_accelerations(window) - most * _stop_rates() - rounding
            assert harder.max() <= 0.0, f"case {case}: {harder} over {window} s"
    assert stopped > 0


def _stop_rates() -> Floats:
    axes = MACHINE.config.axes
    return np.array([axes[index].stop_deceleration_counts for index in range(3)]) / PER_UNIT


def test_watchdog_stops_within_its_time_and_the_robot_stays_there() -> None:
    async def trial() -> tuple[Trajectory, float, BaseException | None]:
        async with stallable() as robot:
            bench = robot.bench
            motion = asyncio.create_task(bench.controller.follow(Path.joints(HERE, Joints(1.3, 1.2, 1.8))))
            await elapse(8.0)
            bench.virtual.sync()
            hung = bench.mechanics.now
            await robot.hang(2.0)
            await asyncio.wait({motion})
            await elapse(5.0)
            bench.virtual.sync()
            return Trajectory.of(bench.mechanics.record.trace), hung, motion.exception()

    trajectory, hung, error = run_virtual(trial())
    assert isinstance(error, HostSilent)
    _, ended = trajectory.moving()
    assert hung < ended <= hung + GUARD_TIME + LATEST + LAG + REST
    before = trajectory.at(np.array([hung, hung + 0.9 * GUARD_TIME]))
    assert np.abs(before[1] - before[0]).max() > 0.01
    assert (trajectory.at(np.array([ended, ended + 5.0])).std(axis=0) == 0.0).all()
