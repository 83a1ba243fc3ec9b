"""The link cut at random instants of a job: one event, nothing but what was sent, nothing by itself afterwards."""

from __future__ import annotations

from dmc41x3.loops import run_virtual
from maya_un.assembly.stack import Stack, stack
from maya_un.config import Config
from maya_un.errors import Busy
from maya_un.events import Disconnected, FaultEntered, LimitHit
from maya_un.process.spec.job import Job
from maya_un.values import Mode, Point
from tests.campaign import Campaign
from tests.virtual_time import elapse

PART = Point(0.45, 1.20, 0.40)
JOB = Job.parse(
    {
        "name": "pick and place",
        "parts": {"cube": list(PART)},
        "places": {"tray": [1.15, 0.60, 0.40]},
        "steps": ["home", {"pick": "cube"}, {"place": "tray"}],
    }
)
ABOUT = 620.0
"""The job takes about this long from power-up [s]."""


def _planned(robot: Stack) -> list[float]:
    """Return where the references will end, in motor counts."""
    assert robot.twin is not None
    return [timeline.at(timeline.end)[0] for timeline in robot.twin.mechanics.timelines]


def _positions(robot: Stack) -> list[float]:
    assert robot.twin is not None
    robot.twin.controller.sync()
    return [robot.twin.mechanics.position(axis) for axis in range(3)]


async def _cut_during_job(seed: int, instant: float) -> None:
    async with stack(Config(), seed=seed, parts={"cube": PART}, live=False) as robot:
        assert robot.twin is not None
        sent = bytearray()
        robot.controller.tap(lambda direction, data: sent.extend(data if direction == "tx" else b""))
        await robot.service.submit(JOB)
        await elapse(instant)
        here, ends = _positions(robot), _planned(robot)
        seen = len(robot.controller.events)
        robot.twin.controller.cut()
        sent.clear()
        await elapse(120.0)
        rest = _positions(robot)
        for start, end, now in zip(here, ends, rest, strict=True):
            assert min(start, end) - 1000.0 <= now <= max(start, end) + 1000.0
        await elapse(300.0)
        assert _positions(robot) == rest
        lost = [event for event in robot.controller.events.since(seen) if isinstance(event, Disconnected)]
        assert [event.code for event in lost] == [1001]
        assert not [
            event for event in robot.controller.events.since(seen) if isinstance(event, FaultEntered | LimitHit)
        ]
        assert b"BG" not in sent
        assert robot.controller.state.mode is Mode.FAULT
        await _recover(robot)
        assert robot.controller.state.mode in {Mode.IDLE, Mode.NOT_HOMED}
        assert _positions(robot) == rest


async def _recover(robot: Stack) -> None:
    while True:
        try:
            return await robot.service.recover()
        except Busy:
            await elapse(1.0)


def test_cut_at_random_instants_of_a_job(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=12, long=200)):
        rng = campaign.rng(case)
        run_virtual(_cut_during_job(rng.randrange(2**31), rng.uniform(0.0, ABOUT)))
