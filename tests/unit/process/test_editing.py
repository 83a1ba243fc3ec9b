"""Simultaneous changes of the queue by several people, and dependent jobs that change with others."""

from __future__ import annotations

import asyncio

import pytest

from maya_un.errors import InvalidJob, InvalidValue
from maya_un.schema.jobs import TaskState
from tests.queues import Machine, QueueBench, job, submit_request
from tests.virtual_time import elapse

HOME = job("home", name="home")


def kept(layer: QueueBench, *numbers: int) -> list[TaskState]:
    """Return the states of jobs in the journal."""
    return [layer.journal.now(number)[0].state for number in numbers]


@pytest.mark.parametrize("priority", [-3, 0, 3])
async def test_dependent_jobs_are_cleared_in_any_order(priority: int) -> None:
    async with Machine().running() as layer:
        await layer.process.submit(HOME, submit_request(held=True))
        await layer.process.submit(HOME, submit_request(depends_on=(1,), priority=priority))
        await layer.process.submit(HOME, submit_request(depends_on=(1, 2), priority=2 * priority))
        await layer.process.clear()
        assert kept(layer, 1, 2, 3) == [TaskState.CANCELLED] * 3
        assert layer.states(2) == ["queued", "cancelled"]
        assert await layer.process.submit(HOME) == 4
        assert (await layer.process.result(4)).state is TaskState.DONE


async def test_a_long_chain_is_cleared_and_stays_cleared_after_a_restart() -> None:
    machine, count = Machine(), 450
    async with machine.running() as layer:
        await layer.process.submit(HOME, submit_request(held=True))
        for number in range(1, count):
            await layer.process.submit(HOME, submit_request(depends_on=(number,), priority=number % 7))
        await layer.process.clear()
        assert set(kept(layer, *range(1, count + 1))) == {TaskState.CANCELLED}
    async with machine.running() as layer:
        assert (await layer.journal.unfinished()).jobs == ()


async def test_cancelling_the_first_of_a_chain_holds_the_next_only() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(HOME, submit_request(held=True))
        await layer.process.submit(HOME, submit_request(depends_on=(1,)))
        await layer.process.submit(HOME, submit_request(depends_on=(2,)))
        await layer.process.cancel(1)
        assert kept(layer, 1, 2, 3) == [TaskState.CANCELLED, TaskState.HELD, TaskState.QUEUED]


async def test_two_editors_of_one_job_keep_both_changes() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(HOME, submit_request(held=True))
        layer.journal.slow = 0.1
        await asyncio.gather(
            layer.process.change(1, {"priority": 5}),
            layer.process.change(1, {"notes": "before the visit"}),
            layer.process.change(1, {"retries": 2}),
        )
        options = layer.journal.now(1)[0].options
        assert (options.priority, options.notes, options.retries) == (5, "before the visit", 2)


async def test_mutual_dependencies_are_refused_once() -> None:
    async with Machine().running() as layer:
        for _ in range(2):
            await layer.process.submit(HOME, submit_request(held=True))
        layer.journal.slow = 0.1
        answers = await asyncio.gather(
            layer.process.change(1, {"depends_on": [2]}),
            layer.process.change(2, {"depends_on": [1]}),
            return_exceptions=True,
        )
        assert answers[0] is None
        assert isinstance(answers[1], InvalidValue)
        await layer.process.release(1, "ana")
        await layer.process.release(2, "ana")
        await elapse(1000.0)
        assert kept(layer, 1, 2) == [TaskState.DONE, TaskState.DONE]


async def test_steps_that_begin_while_a_change_waits_for_its_turn_stay_as_they_are() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(job("home", "home"), submit_request(stepwise=True))
        await elapse(1000.0)
        layer.journal.slow = 0.5
        note = asyncio.create_task(layer.process.change(1, {"notes": "slow"}))
        await elapse(0.1)
        with pytest.raises(InvalidJob, match="steps up to 1 have begun"):
            await layer.process.change(1, {"job": {"steps": [{"gripper": "open"}, "home"]}})
        await note
        assert len(layer.journal.now(1)[0].body["steps"]) == 2


@pytest.mark.parametrize("last", [True, False])
async def test_job_moved_to_an_end_is_there_however_others_move(last: bool) -> None:
    async with Machine().running() as layer:
        for _ in range(3):
            await layer.process.submit(HOME, submit_request(held=True))
        layer.journal.slow = 0.1
        end = 3 if last else 1
        await asyncio.gather(layer.process.cancel(end), layer.process.move_to(2, last=last))
        waiting = [1, 2] if last else [2, 3]
        places = [(layer.journal.now(number)[0].position, number) for number in waiting]
        assert [number for _, number in sorted(places)][-1 if last else 0] == 2
