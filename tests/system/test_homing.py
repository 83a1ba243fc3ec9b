"""Homing campaigns on random machines from random starts, judged by the mechanics' own record.

The bounds are those of errata, "Homing, in numbers": no stall, tension at most 6 loads, slack at most 0.25 m,
the gripper above the parts, or only rising where it starts lower.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from itertools import product
from random import Random

import pytest

from dmc41x3.loops import run_virtual
from maya_un.assembly.controller import machine_of
from maya_un.config import Config
from maya_un.config.files import parse
from maya_un.controller.homing import homed_pose
from maya_un.errors import Busy, MachineError, NotConnected, Stopped, WiringContradictsCn
from maya_un.machine.truth import PARTS, StartPose, Statics, TrueConstants, legal_start
from maya_un.testing import Rig, rig
from maya_un.values import Mode
from tests.campaign import Campaign
from tests.machines import keys_of_machine
from tests.virtual_time import elapse

COUNT = 1e-6
"""One count of a line [m]."""

USUAL = TrueConstants()
"""The manual's machine."""


SHORT_ENDS = ("both", "minimum")
"""Arrangements of the switches of a line with which it homes alone."""


def with_switches(config: Config, a: str, b: str, c: str) -> Config:
    """Return a configuration with other switches."""
    axes = zip("abc", (a, b, c), strict=True)
    keys = {name: getattr(config.axes, name).model_copy(update={"switches": fitted}) for name, fitted in axes}
    return config.model_copy(update={"axes": config.axes.model_copy(update=keys)})


def drawn_config(rng: Random) -> Config:
    """Draw the controller's own registers: ER, and the polarity of the limit inputs."""
    keys = {
        "wiring": {"limit_active_level": rng.choice((-1, 1))},
        "axes": {
            "a": {"error_limit_counts": rng.randint(371, 1500)},
            "b": {"error_limit_counts": rng.randint(4000, 16384)},
            "c": {"error_limit_counts": rng.randint(4000, 16384)},
        },
    }
    return parse(keys)


def wired(truth: TrueConstants, config: Config) -> TrueConstants:
    """Return the machine with switches wired as configured."""
    return truth.with_wiring(active_high=config.wiring.limit_active_level == 1)


def assert_within_bounds(rig: Rig, start: StartPose) -> None:
    """Let the mechanics judge the whole time since power-up."""
    record, truth = rig.mechanics.record, rig.mechanics.truth
    parts = PARTS * min(1.0, Statics.of(truth).top / Statics.of(USUAL).top)
    assert record.stall_time == 0.0, f"stalled for {record.stall_time} s from {start}"
    assert record.peak_tension <= 6.0, f"{record.peak_tension} loads from {start}"
    assert record.peak_slack <= 0.25, f"{record.peak_slack} m slack from {start}"
    assert record.lowest >= min(parts, record.start_height) - COUNT, f"down to {record.lowest} m from {start}"


def assert_homed(rig: Rig, config: Config) -> None:
    """The robot reports that it is homed, and its counts agree with the true lengths to the datum's margin.

    The margin is 4 counts of axis a and 20 counts of a line.
    """
    per_unit, state = rig.mechanics.truth.scale, rig.controller.state
    assert state.homed
    assert state.mode is Mode.IDLE
    assert state.joints is not None
    a, b, c = rig.mechanics.true_joints()
    assert abs(state.joints.a - a) * per_unit[0] < 4.3
    assert abs(state.joints.b - b) * per_unit[1] < 20.0
    assert abs(state.joints.c - c) * per_unit[2] < 20.0
    assert all(abs(x - y) < 1e-3 for x, y in zip(state.joints, homed_pose(config), strict=True))


async def _home(truth: TrueConstants, start: StartPose, config: Config) -> None:
    async with rig(config, truth=truth, start=start) as bench:
        await bench.controller.home()
        assert_homed(bench, config)
        assert_within_bounds(bench, start)


def test_homes_from_random_legal_starts(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=4, long=300)):
        rng = campaign.rng(case)
        run_virtual(_home(TrueConstants(), legal_start(rng, TrueConstants()), Config()))


def test_homes_machines_of_unknown_geometry(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=4, long=300)):
        rng = campaign.rng(case)
        config = drawn_config(rng)
        truth = wired(TrueConstants.drawn(rng), config)
        run_virtual(_home(truth, legal_start(rng, truth), config))


def test_homes_machines_of_other_sizes(campaign: Campaign) -> None:
    """Size, strokes, scales, speeds, letters of the axes, polarity of the switches: all as in the configuration."""
    for case in range(campaign.size(ci=4, long=300)):
        rng = campaign.rng(case)
        config = other_size(rng)
        truth = machine_of(config)
        run_virtual(_home(truth, legal_start(rng, truth), config))


def test_homes_with_every_arrangement_of_switches_that_needs_no_person(campaign: Campaign) -> None:
    """Axis a has a switch at either end, and a line needs none at its long end; other ends are unknown by 3 %."""
    for case, fitted in enumerate(product(("both", "minimum", "maximum"), SHORT_ENDS, SHORT_ENDS)):
        for start in range(campaign.size(ci=1, long=100)):
            rng = campaign.rng(1000 * case + start)
            sizes = other_size(rng) if start % 2 else drawn_config(rng)
            config = with_switches(sizes, *fitted)
            truth = machine_of(config)
            if not start % 2:
                drawn = wired(TrueConstants.drawn(rng), config)
                boom = truth.switches[0] if fitted[0] == "maximum" else drawn.switches[0]  # the datum is exact
                truth = replace(drawn, switches=(boom, *drawn.switches[1:]), fitted=truth.fitted)
            run_virtual(_home(truth, legal_start(rng, truth), config))


def test_machine_of_the_default_configuration_is_that_of_the_manual() -> None:
    assert machine_of(Config()) == USUAL


def other_size(rng: Random) -> Config:
    """Draw the configuration of a machine of another size, with axes and switches that are wired otherwise."""
    keys = keys_of_machine(rng)
    for name, letter in zip("abc", rng.sample("ABC", 3), strict=True):
        keys["axes"][name]["letter"] = letter
    return parse({**keys, "wiring": {"limit_active_level": rng.choice((-1, 1))}})


def _everything(truth: TrueConstants, config: Config, rng: Random) -> TrueConstants:
    return truth.with_wiring(active_high=config.wiring.limit_active_level == -1)


def _one_axis(truth: TrueConstants, config: Config, rng: Random) -> TrueConstants:
    return wired(truth, config).with_wiring(config.wiring.limit_active_level == -1, axis=rng.randrange(3))


def _one_switch(truth: TrueConstants, config: Config, rng: Random) -> TrueConstants:
    return wired(truth, config).with_wiring(
        config.wiring.limit_active_level == -1, axis=rng.randrange(3), switch=rng.choice(("reverse", "forward"))
    )


async def _refused(truth: TrueConstants, sound: TrueConstants, start: StartPose, config: Config) -> None:
    async with rig(config, truth=truth, start=start) as bench:
        with pytest.raises(WiringContradictsCn) as refusal:
            await bench.controller.home()
        axis = "abc".index(str(refusal.value.details["axis"]))
        assert truth.active_high[axis] != sound.active_high[axis], f"{refusal.value} {start}"
        assert not bench.controller.state.homed


@pytest.mark.parametrize("fault", [_everything, _one_axis, _one_switch])
def test_refuses_wiring_that_contradicts_cn_by_name(
    fault: Callable[[TrueConstants, Config, Random], TrueConstants], campaign: Campaign
) -> None:
    for case in range(campaign.size(ci=5, long=100)):
        rng = campaign.rng(case)
        config = drawn_config(rng)
        truth = fault(TrueConstants.drawn(rng), config, rng)
        run_virtual(_refused(truth, wired(truth, config), legal_start(rng, truth), config))


async def _home_twice(truth: TrueConstants, start: StartPose, config: Config, rng: Random) -> None:
    async with rig(config, truth=truth, start=start) as bench:
        home = asyncio.create_task(bench.controller.home())
        await asyncio.wait({home}, timeout=rng.uniform(0.0, 270.0))
        await _interrupt(bench, home, rng)
        await bench.controller.home()
        assert_homed(bench, config)
        assert_within_bounds(bench, start)


def test_interrupted_homings_start_again(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=3, long=60)):
        rng = campaign.rng(case)
        config = drawn_config(rng)
        truth = wired(TrueConstants.drawn(rng), config)
        run_virtual(_home_twice(truth, legal_start(rng, truth), config, rng))


async def recovered(bench: Rig) -> None:
    """Wait until the controller answers again and its axes are at rest, then say recover."""
    while True:
        await elapse(1.0)
        with suppress(Busy, NotConnected):
            return await bench.controller.recover()


async def _interrupt(bench: Rig, home: asyncio.Task[None], rng: Random) -> None:
    """End a homing one way or another: a person's stop, its caller's cancel, or the link."""
    match rng.randrange(3):
        case 0:
            await bench.controller.stop()
        case 1:
            home.cancel()
        case _:
            bench.virtual.cut()
            await asyncio.wait({home})
            await recovered(bench)
    await asyncio.wait({home})
    if not home.cancelled():
        assert home.exception() is None or isinstance(home.exception(), Stopped | MachineError)
