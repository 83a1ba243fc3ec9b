"""Limits of jerk on the twin: motion follows the plan, a stop stays on the path, the axes rise gently."""

from __future__ import annotations

import asyncio
from math import dist
from random import Random

import numpy as np
import pytest

from dmc41x3.loops import run_virtual
from maya_un.config import Config
from maya_un.errors import PathRefused, Stopped, Unreachable
from maya_un.motion import Path
from maya_un.testing import rig
from maya_un.values import Joints, Point
from tests.campaign import Campaign
from tests.judge.trajectory import Trajectory
from tests.machines import Machine, homed
from tests.strategies import configuration
from tests.virtual_time import elapse

START = Joints(0.5, 1.5, 1.5)
JERK = {"a": 1024, "b": 5120, "c": 5120}


def gentle() -> Config:
    """Return the manual's machine with limits of jerk: a second to its accelerations."""
    axes = Config().axes
    limited = {name: getattr(axes, name).model_copy(update={"jerk_counts": jerk}) for name, jerk in JERK.items()}
    return configuration(axes=limited)


def drawn(rng: Random, config: Config) -> Joints:
    """Draw joints anywhere in the strokes, reachable or not."""
    a, b, c = (rng.uniform(axis.minimum, axis.maximum) for axis in (config.axes.a, config.axes.b, config.axes.c))
    return Joints(a, b, c)


async def _predictions(rng: Random, moves: int) -> int:
    config, done = gentle(), 0
    loop = asyncio.get_running_loop()
    async with rig(config) as bench:
        await bench.controller.home()
        for _ in range(moves):
            here = bench.controller.state.joints
            assert here is not None
            target, speed = drawn(rng, config), rng.uniform(0.05, 1.0)
            try:
                there = bench.controller.mechanism.fk(target)
                path = rng.choice((Path.joints(here, target), Path.line(bench.controller.mechanism.fk(here), there)))
                preview = bench.controller.preview(path, speed=speed)
            except (Unreachable, PathRefused):
                continue
            began = loop.time()
            await bench.controller.follow(path, speed=speed)
            assert loop.time() - began == pytest.approx(preview.duration, rel=1e-3)
            done += 1
    return done


def test_motion_agrees_with_the_prediction(campaign: Campaign) -> None:
    cases = campaign.size(ci=3, long=40)
    assert sum(run_virtual(_predictions(campaign.rng(case), 20)) for case in range(cases)) >= 2 * cases


async def test_a_stop_keeps_to_the_line() -> None:
    async with homed(Machine.of(gentle()), START) as bench:
        one = bench.controller.mechanism.fk(START)
        two = Point(0.3, 1.4, 0.9)
        move = asyncio.create_task(bench.controller.follow(Path.line(one, two)))
        await elapse(9.0)
        await bench.controller.stop()
        with pytest.raises(Stopped):
            await move
        joints = bench.controller.state.joints
        assert joints is not None
        here = bench.controller.mechanism.fk(joints)
        assert dist(one, here) + dist(here, two) == pytest.approx(dist(one, two), abs=1e-4)
        assert dist(one, here) > 0.1


async def test_the_axes_rise_gently() -> None:
    """A line goes J t³/6 in the first second, and is at J t²/2 then; 5120 t would be twice as fast."""
    async with homed(Machine.of(gentle()), START) as bench:
        await bench.controller.move(START._replace(b=1.1))
        seen = Trajectory.of(bench.mechanics.record.trace)
    begun, _ = seen.moving()
    places = (START.b - seen.at(begun + np.array([0.9, 1.0, 1.1]))[:, 1]) * 1e6
    assert places[1] == pytest.approx(5120 / 6, rel=0.2)
    assert (places[2] - places[0]) / 0.2 == pytest.approx(5120 / 2, rel=0.15)
