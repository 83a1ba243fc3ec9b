"""A waiting job is predicted from the end of the one before it, and again only after a change."""

from __future__ import annotations

import asyncio

import pytest

from maya_un.errors import GripperNotEmpty
from maya_un.events import HomingBegun, HomingDone
from maya_un.schema.jobs import JobLine
from tests.queues import Machine, QueueBench, job, submit_request
from tests.virtual_time import elapse

MOVE = job({"approach": "cube"}, {"approach": "tray"})
BACK = job({"approach": "tray"}, {"approach": "cube"})


async def waiting(layer: QueueBench) -> list[JobLine]:
    """Let the forecast do its work, and return what waits."""
    await elapse(0.0)
    for _ in range(40):
        await elapse(0.0)
    return list(layer.process.views.view().waiting)


async def test_every_job_is_predicted_from_the_end_of_the_one_before() -> None:
    async with Machine().running() as layer:
        await layer.process.scheduler.pause("ana", now=False)
        for one in (MOVE, MOVE, BACK):
            await layer.process.submit(one)
        first, second, third = [line.predicted or 0.0 for line in await waiting(layer)]
        assert first != pytest.approx(second)  # the first comes from where homing ended
        assert third < second  # it begins at the tray, where the second ends
        await layer.process.scheduler.resume("ana")
        took = [(await layer.process.result(number)).duration for number in (1, 2, 3)]
        assert took == pytest.approx([first, second, third])


async def test_unchanged_prediction_is_not_computed_again() -> None:
    async with Machine().running() as layer:
        await layer.process.scheduler.pause("ana", now=False)
        for one in (MOVE, BACK, MOVE):
            await layer.process.submit(one)
        await waiting(layer)
        before = layer.controller.previews
        await layer.process.change(2, {"notes": "as before"})
        await layer.process.submit(job("home"), submit_request(held=True))
        await waiting(layer)
        assert layer.controller.previews == before


async def test_job_that_would_be_refused_is_not_predicted_nor_its_successors() -> None:
    async with Machine().running() as layer:
        await layer.process.scheduler.pause("ana", now=False)
        for one in (MOVE, job({"approach": [5.0, 5.0]}), MOVE):
            await layer.process.submit(one)
        lines = await waiting(layer)
        assert [line.predicted is None for line in lines] == [False, True, False]
        await layer.process.scheduler.resume("ana")
        await elapse(1.0)
        view = layer.process.views.view()
        assert view.running is not None
        assert view.running.eta is not None
        assert [line.eta for line in view.waiting] == [None, None]


async def test_a_long_job_is_predicted_too() -> None:
    async with Machine().running() as layer:
        await layer.process.scheduler.pause("ana", now=False)
        await layer.process.submit(job({"approach": "cube"}, {"approach": "tray"}, repeat=150))
        await elapse(1.0)
        (line,) = layer.process.views.view().waiting
        assert line.predicted is not None
        await layer.process.scheduler.resume("ana")
        report = await layer.process.result(1)
        assert report.duration == pytest.approx(line.predicted)


async def test_a_slower_robot_is_later() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(MOVE)
        await layer.process.submit(MOVE)
        await elapse(1.0)
        full = layer.process.views.view().waiting[0].eta
        await layer.controller.override(0.5)
        half = layer.process.views.view().waiting[0].eta
        assert full is not None
        assert half == pytest.approx(2.0 * full)


async def test_end_of_a_slow_job_stays_where_it_is() -> None:
    async with Machine().running() as layer:
        await layer.controller.override(0.1)
        began = asyncio.get_running_loop().time()
        await layer.process.submit(MOVE)
        await elapse(1.0)
        ends: list[float] = []
        for _ in range(4):
            view = layer.process.views.view()
            assert view.running is not None
            ends.append(asyncio.get_running_loop().time() - began + (view.running.eta or 0.0))
            await elapse(10.0)
        report = await layer.process.result(1)
        assert ends == pytest.approx([report.duration] * len(ends))


async def test_homing_is_as_long_at_any_speed() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(MOVE)
        await elapse(1.0)
        full = await with_homing(layer)
        await layer.controller.override(0.1)
        assert await with_homing(layer) == pytest.approx(full)


async def test_held_jobs_and_their_dependents_do_not_count() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(MOVE)
        await layer.process.submit(BACK, submit_request(held=True))
        await layer.process.submit(MOVE, submit_request(depends_on=(2,)))
        await layer.process.submit(BACK)
        await elapse(1.0)
        view = layer.process.views.view()
        assert view.running is not None
        lines = {line.id: line for line in view.waiting}
        assert [lines[number].eta is None for number in (2, 3, 4)] == [True, True, False]
        assert lines[4].eta == pytest.approx((view.running.eta or 0.0) + (lines[4].predicted or 0.0))
        assert None not in {lines[2].predicted, lines[4].predicted}
        await layer.process.release(2, "ana")
        await elapse(1.0)
        etas = {line.id: line.eta or 0.0 for line in layer.process.views.view().waiting}
        assert 0.0 < etas[2] < etas[3] < etas[4]


async def test_job_that_waits_for_a_later_one_comes_after_it() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(MOVE)
        await layer.process.submit(BACK)
        await layer.process.submit(MOVE)
        await layer.process.change(2, {"depends_on": [3]})
        await elapse(1.0)
        etas = {line.id: line.eta or 0.0 for line in layer.process.views.view().waiting}
        assert 0.0 < etas[3] < etas[2]


async def test_homing_is_estimated_by_a_bound_and_then_by_the_last_one() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(MOVE)
        await elapse(1.0)
        assert not layer.process.views.view().estimated
        bound = await with_homing(layer)
        assert 200.0 < bound < 400.0
        layer.controller.events.emit(HomingBegun())
        await elapse(7.0)
        layer.controller.events.emit(HomingDone())
        assert await with_homing(layer) == pytest.approx(7.0)


async def with_homing(layer: QueueBench) -> float:
    """Return what a homing that is queued now is estimated at [s]."""
    number = await layer.process.submit(job("home"))
    await elapse(0.5)
    view = layer.process.views.view()
    assert view.estimated
    etas = {line.id: line.eta or 0.0 for line in view.waiting}
    await layer.process.cancel(number)
    assert view.running is not None
    return etas[number] - (view.running.eta or 0.0)


async def test_waiting_job_shows_the_error_with_which_it_would_fail_as_things_are() -> None:
    async with Machine().running() as layer:
        await layer.process.scheduler.pause("ana", now=False)
        await layer.process.submit(job({"pick": "cube"}, {"place": "tray"}))
        (line,) = await waiting(layer)
        assert (line.obstacle, line.predicted is None) == (None, False)
        await layer.controller.gripper(open_=False)
        (line,) = await waiting(layer)
        assert line.obstacle is not None
        assert line.obstacle.code == GripperNotEmpty.code
        assert line.predicted is None
        await layer.controller.gripper(open_=True)
        (line,) = await waiting(layer)
        assert line.obstacle is None


async def test_job_behind_one_that_closes_the_gripper_shows_it() -> None:
    async with Machine().running() as layer:
        await layer.process.scheduler.pause("ana", now=False)
        for one in (job({"pick": "cube"}), job({"pick": "cube"})):
            await layer.process.submit(one)
        first, second = await waiting(layer)
        assert first.obstacle is None
        assert second.obstacle is not None
        assert second.obstacle.code == GripperNotEmpty.code
