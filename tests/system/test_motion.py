"""Accepted paths, and the paths of stops at random instants, judged by the mechanics' own record."""

from __future__ import annotations

import asyncio
from random import Random

import pytest

from dmc41x3.loops import run_virtual
from maya_un.config import Config
from maya_un.errors import PathRefused, Stopped, Unreachable
from maya_un.events import MotionStopped
from maya_un.testing import Rig
from maya_un.values import Joints, Mode
from tests.campaign import Campaign
from tests.unit.controller.bench import homed
from tests.virtual_time import elapse

ROUNDING = 1e-5
"""Encoder counts, and the datum's margin [m]."""


def drawn_joints(rng: Random, config: Config) -> Joints:
    """Draw joints anywhere in the strokes, reachable or not."""
    a, b, c = (rng.uniform(axis.minimum, axis.maximum) for axis in (config.axes.a, config.axes.b, config.axes.c))
    return Joints(a, b, c)


def assert_inside(bench: Rig, mark: int, config: Config) -> None:
    """The mechanics saw nothing outside the workspace since `mark`."""
    window = bench.mechanics.record.since(mark)
    assert window.stall_time == 0.0
    assert window.slack <= ROUNDING
    assert window.tension <= config.safety.tension_limit * 1.001
    ends = (config.axes.a, config.axes.b, config.axes.c)
    for least, most, axis in zip(window.low, window.high, ends, strict=True):
        assert axis.minimum - ROUNDING * 10 <= least <= most <= axis.maximum + ROUNDING * 10


async def _moves_and_stops(rng: Random, moves: int) -> int:
    config = Config()
    accepted = 0
    async with homed(config) as bench:
        for _ in range(moves):
            mark = bench.mechanics.record.mark()
            target = drawn_joints(rng, config)
            move = asyncio.create_task(bench.controller.move(target))
            await asyncio.wait({move}, timeout=rng.uniform(0.0, 60.0))
            if not move.done():
                report = await bench.controller.stop()
                begun = asyncio.get_running_loop().time()
                await asyncio.wait({move})
                assert asyncio.get_running_loop().time() - begun <= report.duration + 0.2
            error = move.exception()
            assert error is None or isinstance(error, (Stopped, Unreachable, PathRefused))
            accepted += error is None or isinstance(error, Stopped)
            assert_inside(bench, mark, config)
    return accepted


def test_accepted_paths_and_their_stops_stay_inside(campaign: Campaign) -> None:
    runs = campaign.size(ci=5, long=100)
    accepted = sum(run_virtual(_moves_and_stops(campaign.rng(case), 40)) for case in range(runs))
    assert accepted >= 5 * runs


async def test_a_stop_keeps_to_the_line() -> None:
    async with homed() as bench:
        start = bench.controller.state.joints
        assert start is not None
        move = asyncio.create_task(bench.controller.move(Joints(1.0, 1.2, 1.9)))
        await elapse(9.0)
        report = await bench.controller.stop()
        with pytest.raises(Stopped):
            await move
        state = bench.controller.state
        assert state.joints is not None
        assert state.mode is Mode.IDLE
        shares = [(now - was) / (to - was) for was, now, to in zip(start, state.joints, (1.0, 1.2, 1.9), strict=True)]
        assert max(shares) - min(shares) < 2e-4
        assert 0.0 < report.duration < 1.5
        assert bench.controller.events.last is not None
        assert isinstance(bench.controller.events.last, MotionStopped)


async def test_motion_agrees_with_the_prediction() -> None:
    async with homed() as bench:
        here = bench.controller.state.joints
        assert here is not None
        target = Joints(1.2, 1.0, 1.8)
        preview = bench.controller.preview([here, target])
        loop = asyncio.get_running_loop()
        began = loop.time()
        await bench.controller.move(target)
        assert loop.time() - began == pytest.approx(preview.duration, rel=1e-3)
        there = bench.controller.state.joints
        assert there is not None
        assert max(abs(x - y) for x, y in zip(there, preview.end, strict=True)) < 2e-6


async def _predictions(rng: Random, moves: int) -> None:
    """The planner's closed form and the twin's own, written apart from each other, agree."""
    config = Config()
    loop = asyncio.get_running_loop()
    async with homed(config) as bench:
        for _ in range(moves):
            here, target = bench.controller.state.joints, drawn_joints(rng, config)
            assert here is not None
            speed = rng.uniform(0.05, 1.0)
            try:
                preview = bench.controller.preview([here, target], speed=speed)
            except (Unreachable, PathRefused):
                continue
            began = loop.time()
            await bench.controller.move(target, speed=speed)
            assert loop.time() - began == pytest.approx(preview.duration, rel=1e-6)


def test_motion_agrees_with_the_prediction_at_any_speed(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=3, long=50)):
        run_virtual(_predictions(campaign.rng(case), 30))
