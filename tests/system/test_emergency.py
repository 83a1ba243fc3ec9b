"""One axis fails at any instant of a fast move below the ceiling; the mechanics' own record decides the result."""

from __future__ import annotations

import asyncio
from math import cos, sin
from random import Random

from dmc41x3.loops import run_virtual
from maya_un.config import Config
from maya_un.config.files import parse
from maya_un.errors import MachineError
from maya_un.kinematics import Workspace
from maya_un.machine.truth import StartPose
from maya_un.motion.emergency import SLACK
from maya_un.motion.path import Path
from maya_un.testing import Rig, rig
from maya_un.values import Joints, Point
from tests.campaign import Campaign
from tests.virtual_time import elapse

CEILING = 2.048
"""A height just below where lines carry 5 loads, 2.0495 in the middle of the boom [m]."""


async def _homed_at(bench: Rig, here: Joints) -> None:
    """Leave the mark of a homing, as if the robot had been homed and brought `here` before."""
    a, b, c = bench.controller.units.to_counts(here)
    _say(bench, f"DP {a},{b},{c};mayaendb=2260000;mayaendc=2300000;ZAA=7;mayahome=7")
    await bench.controller.skip_home()


def _say(bench: Rig, command: str) -> None:
    machine = bench.virtual.machine
    handle = machine.connect()
    assert handle is not None
    machine.receive(handle, f"{command}\r".encode(), machine.now)
    machine.disconnect(handle)


def _fail(bench: Rig, letter: str) -> None:
    """Let the amplifier of one axis fail: with OE 0 the others do not mind."""
    _say(bench, ";".join(f"OE{other}={int(other == letter)}" for other in "ABC"))
    bench.virtual.faults.inject("amplifier_fault", {}, seconds=5.0)


def _way(rng: Random) -> Path:
    """Return a level way below the ceiling, from near one end of it to near the other."""
    begin = rng.uniform(0.2, 1.6)
    places = [(begin, 0.95), (begin + rng.uniform(0.0, 0.3), 1.65)]
    rng.shuffle(places)
    if rng.random() < 0.5:
        return Path.swing(*((a, d, CEILING) for a, d in places))
    return Path.line(*(Point(d * sin(a), d * cos(a), CEILING) for a, d in places))


async def _failure(config: Config, path: Path, letter: str, share: float) -> tuple[float, float]:
    """Let an axis fail at a share of a move's time; return the greatest tension [loads] and slack [m] from then on."""
    here = path.start(Workspace.of(config).mechanism)
    async with rig(config, start=StartPose(*here), live=True) as bench:
        await _homed_at(bench, here)
        move = asyncio.create_task(bench.controller.follow(path))
        await elapse(share * bench.controller.preview(path).duration)
        mark = bench.mechanics.record.mark()
        _fail(bench, letter)
        await elapse(8.0)
        assert isinstance(move.exception(), MachineError)
        window = bench.mechanics.record.since(mark)
        return window.tension, window.slack


def test_a_failed_axis_does_no_harm_whenever_it_fails(campaign: Campaign) -> None:
    config = Config()
    most = config.safety.tension_limit * config.safety.emergency_tension
    for number in range(campaign.size(ci=8, long=300)):
        rng = campaign.rng(number)
        tension, slack = run_virtual(_failure(config, _way(rng), rng.choice("ABC"), rng.uniform(0.1, 0.9)))
        assert tension <= most, number
        assert slack <= SLACK, number


def test_without_the_speed_limit_the_bounds_are_left() -> None:
    outward = Path.swing((0.3, 0.95, CEILING), (0.3, 1.65, CEILING))
    careless = parse({"safety": {"emergency_tension": 5.0}})
    tension, _ = run_virtual(_failure(careless, outward, "B", 0.5))
    assert tension > 6.0
    tension, _ = run_virtual(_failure(Config(), outward, "B", 0.5))
    assert tension <= 6.0
