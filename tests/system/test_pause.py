"""Jobs that people slow down, pause and resume at random instants end as jobs that nobody touched."""

from __future__ import annotations

from random import Random

import pytest

from dmc41x3.loops import run_virtual
from maya_un.assembly.stack import Stack, stack
from maya_un.config import Config
from maya_un.errors import CannotPause
from maya_un.process.spec.job import Job
from maya_un.schema.jobs import TaskState
from maya_un.values import Mode, Point
from tests.campaign import Campaign
from tests.virtual_time import elapse

PART, TRAY = Point(0.45, 1.20, 0.40), Point(1.15, 0.60, 0.40)
JOB = Job.parse(
    {
        "name": "pick and place",
        "parts": {"cube": list(PART)},
        "places": {"tray": list(TRAY)},
        "steps": ["home", {"pick": "cube"}, {"place": "tray"}],
    }
)


async def _touched(robot: Stack, number: int, rng: Random) -> None:
    """Change the pace at random instants until the job has ended."""
    while not (await robot.service.job(number)).state.ended:
        await elapse(rng.expovariate(0.1))
        if (await robot.service.job(number)).state.ended:
            return
        if rng.random() < 0.3:
            await robot.service.speed(rng.choice([0.2, 0.5, 1.0]))
            continue
        try:
            await robot.service.pause()
        except CannotPause:
            assert robot.controller.state.mode is Mode.HOMING
            continue
        await _stands(robot, rng.uniform(0.0, 60.0))
        await robot.service.resume()


async def _stands(robot: Stack, seconds: float) -> None:
    """See that a paused robot stands for so long, once it is at rest and its axes have caught up."""
    await elapse(1.5)
    begun = _positions(robot)
    await elapse(seconds)
    assert robot.controller.state.mode is Mode.PAUSED
    assert _positions(robot) == pytest.approx(begun, abs=20.0)


def _positions(robot: Stack) -> list[float]:
    """Return where the motors are by the mechanics' own record [counts]."""
    assert robot.twin is not None
    robot.twin.controller.sync()
    return [robot.twin.mechanics.position(axis) for axis in range(3)]


async def _trial(seed: int, rng: Random | None) -> tuple[list[float], Point]:
    """Return where a job leaves the motors and the part; with `rng` people change its pace."""
    async with stack(Config(), seed=seed, parts={"cube": PART}, live=False) as robot:
        assert robot.twin is not None
        accepted = await robot.service.submit(JOB)
        if rng is not None:
            await _touched(robot, accepted.id, rng)
        report = await robot.service.wait(accepted.id)
        assert report.state is TaskState.DONE, report.message
        record = robot.twin.mechanics.record
        assert record.peak_tension <= 6.0
        assert not record.drops
        return _positions(robot), Point(*record.parts["cube"])


def test_pauses_and_speeds_change_when_a_job_ends_and_nothing_else(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=3, long=100)):
        rng = campaign.rng(case)
        seed = rng.randrange(2**31)
        plain, touched = run_virtual(_trial(seed, None)), run_virtual(_trial(seed, rng))
        assert touched[0] == pytest.approx(plain[0], abs=2.0), f"case {case}"
        assert touched[1] == pytest.approx(plain[1], abs=1e-4), f"case {case}"
