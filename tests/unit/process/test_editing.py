"""Simultaneous changes of the queue by several people, and dependent jobs that change with others."""

from __future__ import annotations

import asyncio

import pytest

from maya_un.errors import InvalidJob, InvalidValue
from maya_un.schema.jobs import TaskState
from tests.queues import Machine, QueueBench, job, submit_request
from tests.virtual_time import elapse

HOME = job("home", name="home")


def kept(floor: QueueBench, *numbers: int) -> list[TaskState]:
    """Return the states of jobs in the journal."""
    return [floor.journal.now(number)[0].state for number in numbers]


@pytest.mark.parametrize("priority", [-3, 0, 3])
async def test_dependent_jobs_are_cleared_in_any_order(priority: int) -> None:
    async with Machine().running() as floor:
        await floor.process.submit(HOME, submit_request(held=True))
        await floor.process.submit(HOME, submit_request(depends_on=(1,), priority=priority))
        await floor.process.submit(HOME, submit_request(depends_on=(1, 2), priority=2 * priority))
        await floor.process.clear()
        assert kept(floor, 1, 2, 3) == [TaskState.CANCELLED] * 3
        assert floor.states(2) == ["queued", "cancelled"]
        assert await floor.process.submit(HOME) == 4
        assert (await floor.process.result(4)).state is TaskState.DONE


async def test_a_long_chain_is_cleared_and_stays_cleared_after_a_restart() -> None:
    machine, count = Machine(), 450
    async with machine.running() as floor:
        await floor.process.submit(HOME, submit_request(held=True))
        for number in range(1, count):
            await floor.process.submit(HOME, submit_request(depends_on=(number,), priority=number % 7))
        await floor.process.clear()
        assert set(kept(floor, *range(1, count + 1))) == {TaskState.CANCELLED}
    async with machine.running() as floor:
        assert (await floor.journal.unfinished()).jobs == ()


async def test_cancelling_the_first_of_a_chain_holds_the_next_only() -> None:
    async with Machine().running() as floor:
        await floor.process.submit(HOME, submit_request(held=True))
        await floor.process.submit(HOME, submit_request(depends_on=(1,)))
        await floor.process.submit(HOME, submit_request(depends_on=(2,)))
        await floor.process.cancel(1)
        assert kept(floor, 1, 2, 3) == [TaskState.CANCELLED, TaskState.HELD, TaskState.QUEUED]


async def test_two_editors_of_one_job_keep_both_changes() -> None:
    async with Machine().running() as floor:
        await floor.process.submit(HOME, submit_request(held=True))
        floor.journal.slow = 0.1
        await asyncio.gather(
            floor.process.change(1, {"priority": 5}),
            floor.process.change(1, {"notes": "before the visit"}),
            floor.process.change(1, {"retries": 2}),
        )
        options = floor.journal.now(1)[0].options
        assert (options.priority, options.notes, options.retries) == (5, "before the visit", 2)


async def test_mutual_dependencies_are_refused_once() -> None:
    async with Machine().running() as floor:
        for _ in range(2):
            await floor.process.submit(HOME, submit_request(held=True))
        floor.journal.slow = 0.1
        answers = await asyncio.gather(
            floor.process.change(1, {"depends_on": [2]}),
            floor.process.change(2, {"depends_on": [1]}),
            return_exceptions=True,
        )
        assert answers[0] is None
        assert isinstance(answers[1], InvalidValue)
        await floor.process.release(1, "ana")
        await floor.process.release(2, "ana")
        await elapse(1000.0)
        assert kept(floor, 1, 2) == [TaskState.DONE, TaskState.DONE]


async def test_steps_that_begin_while_a_change_waits_for_its_turn_stay_as_they_are() -> None:
    async with Machine().running() as floor:
        await floor.process.submit(job("home", "home"), submit_request(stepwise=True))
        await elapse(1000.0)
        floor.journal.slow = 0.5
        note = asyncio.create_task(floor.process.change(1, {"notes": "slow"}))
        await elapse(0.1)
        with pytest.raises(InvalidJob, match="1 have begun"):
            await floor.process.change(1, {"job": {"steps": [{"gripper": "open"}, "home"]}})
        await note
        assert len(floor.journal.now(1)[0].body["steps"]) == 2


@pytest.mark.parametrize("last", [True, False])
async def test_job_moved_to_an_end_is_there_however_others_move(last: bool) -> None:
    async with Machine().running() as floor:
        for _ in range(3):
            await floor.process.submit(HOME, submit_request(held=True))
        floor.journal.slow = 0.1
        end = 3 if last else 1
        await asyncio.gather(floor.process.cancel(end), floor.process.move_to(2, last=last))
        waiting = [1, 2] if last else [2, 3]
        places = [(floor.journal.now(number)[0].position, number) for number in waiting]
        assert [number for _, number in sorted(places)][-1 if last else 0] == 2
