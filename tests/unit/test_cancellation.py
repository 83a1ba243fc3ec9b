"""Waiting for work that moves the robot: many cancels, one end."""

from __future__ import annotations

import asyncio

import pytest

from maya_un.cancellation import cancel_once, run_to_end, run_to_rest
from maya_un.errors import Busy
from tests.campaign import Campaign
from tests.virtual_time import elapse

BRAKING = 0.5
"""The work here comes to rest so long after its cancel [s]."""


class Motion:
    """Work that takes time, and time to come to rest; counts the cancels that reach it."""

    def __init__(self) -> None:
        self.cancels = 0
        self.rested: float | None = None

    async def run(self, duration: float = 10.0) -> str:
        try:
            await elapse(duration)
        except asyncio.CancelledError:
            self.cancels += 1
            await elapse(BRAKING)
            raise
        finally:
            self.rested = asyncio.get_running_loop().time()
        return "there"


async def test_run_to_rest_cancelled_often_cancels_the_work_once_and_waits(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=50, long=2000)):
        rng, motion = campaign.rng(case), Motion()
        waiting = asyncio.ensure_future(run_to_rest(motion.run()))
        await elapse(rng.uniform(0.01, 9.0))
        began = asyncio.get_running_loop().time()
        for _ in range(rng.randint(2, 6)):
            waiting.cancel()
            await elapse(rng.choice((0.0, rng.uniform(0.0, 0.2))))
        await asyncio.wait({waiting})
        assert waiting.cancelled()
        assert motion.cancels == 1
        assert motion.rested == pytest.approx(max(began + BRAKING, motion.rested or 0.0))


async def test_run_to_rest_of_work_that_is_cancelled_already_does_not_cancel_it_again() -> None:
    motion = Motion()
    task = asyncio.ensure_future(motion.run())
    waiting = asyncio.ensure_future(run_to_rest(task))
    await elapse(1.0)
    cancel_once(task)
    await elapse(0.1)
    waiting.cancel()
    await asyncio.wait({waiting})
    assert (waiting.cancelled(), motion.cancels, motion.rested) == (True, 1, 1.5)


async def test_run_to_rest_raises_the_error_of_the_work() -> None:
    async def refused() -> None:
        raise Busy(doing="job 1")

    with pytest.raises(Busy):
        await run_to_rest(refused())


async def test_run_to_rest_uses_the_given_cancel_once() -> None:
    asked, ended = list[str](), asyncio.get_running_loop().create_future()
    waiting = asyncio.ensure_future(run_to_rest(ended, lambda: asked.append("cancel")))
    for _ in range(3):
        await elapse(0.1)
        waiting.cancel()
    await elapse(0.1)
    assert (asked, waiting.done()) == (["cancel"], False)
    ended.set_result(None)
    await asyncio.wait({waiting})
    assert waiting.cancelled()


async def test_run_to_end_cancelled_often_lets_the_work_finish_first() -> None:
    motion = Motion()
    waiting = asyncio.ensure_future(run_to_end(motion.run(2.0)))
    for _ in range(3):
        await elapse(0.1)
        waiting.cancel()
    await asyncio.wait({waiting})
    assert (waiting.cancelled(), motion.cancels, motion.rested) == (True, 0, 2.0)


async def test_run_to_end_raises_the_error_of_the_work_before_the_cancel() -> None:
    async def failing() -> None:
        await elapse(1.0)
        raise Busy(doing="job 1")

    waiting = asyncio.ensure_future(run_to_end(failing()))
    await elapse(0.5)
    waiting.cancel()
    with pytest.raises(Busy):
        await waiting
