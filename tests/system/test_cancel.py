"""Jobs cancelled at random instants, judged by the mechanics: at rest, on the path, the gripper as it was."""

from __future__ import annotations

from math import cos, dist, sin
from random import Random

import pytest

from maya_un.assembly.stack import Stack, stack
from maya_un.config import Config
from maya_un.process.spec.job import Job
from maya_un.robot.primitives import Gripper, Home, Place
from maya_un.schema.jobs import JobReport
from maya_un.values import Mode, Point
from tests.campaign import Campaign
from tests.virtual_time import elapse

START = Point(0.45, 1.20, 0.40)
CAPTURE = 0.015
"""A gripper closes on a part that is at most this far away [m]."""

LAG = 3e-4
"""Remaining lag of the axes when the reference has come to rest [m]."""


def drawn_place(rng: Random) -> Point:
    """Draw a place where a part can stand."""
    a, d = rng.uniform(0.05, 2.0), rng.uniform(0.85, 1.7)
    return Point(d * sin(a), d * cos(a), 0.40)


def cube(maya: Stack) -> Point:
    """Return where the cube really is."""
    assert maya.twin is not None
    maya.twin.controller.sync()
    return Point(*maya.twin.mechanics.parts["cube"])


def gripper(maya: Stack) -> Point:
    """Return where the gripper really is."""
    assert maya.twin is not None
    maya.twin.controller.sync()
    return Point(*maya.twin.mechanics.gripper_point())


async def cancelled_after(maya: Stack, steps: list[dict[str, list[float]]], instant: float) -> JobReport:
    accepted = await maya.service.submit(Job.parse({"steps": steps}))
    await elapse(instant)
    return await maya.service.cancel(accepted.id)


async def assert_at_rest(maya: Stack) -> None:
    here = gripper(maya)
    await elapse(30.0)
    assert dist(gripper(maya), here) < LAG
    assert maya.controller.state.mode is Mode.IDLE
    assert not maya.controller.state.moving


async def tidy_up(maya: Stack, place: Point) -> None:
    """Put down what the gripper holds, or just open it where nothing is known to be in it."""
    request = Place(place) if maya.robot.holding else Gripper(open=True)
    report = await maya.service.command(request)
    assert report.state == "done", report.message


@pytest.mark.system
async def test_cancelled_at_random_instants(campaign: Campaign) -> None:
    rng = campaign.rng()
    async with stack(Config(), parts={"cube": START}, live=False) as maya:
        assert maya.twin is not None
        assert (await maya.service.command(Home())).state == "done"
        mark = maya.twin.mechanics.record.mark()
        for _ in range(campaign.size(ci=20, long=300)):
            goal = drawn_place(rng)
            steps = [{"pick": list(cube(maya)[:2])}, {"place": list(goal[:2])}]
            report = await cancelled_after(maya, steps, rng.uniform(0.0, 150.0))
            assert report.state in {"cancelled", "done"}
            await assert_at_rest(maya)
            if maya.robot.holding:
                assert dist(cube(maya), gripper(maya)) < CAPTURE
            elif maya.robot.holding is False:
                assert cube(maya).z == pytest.approx(0.40, abs=1e-4)
            await tidy_up(maya, goal)
        window = maya.twin.mechanics.record.since(mark)
        assert window.stalled == (0.0, 0.0, 0.0)
        assert window.lowest >= 0.40 - 1e-4
