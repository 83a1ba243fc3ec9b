"""Very many jobs that only wait: they stay in the journal, and all that people do with them works all the same."""

from __future__ import annotations

import asyncio
import gc
import tracemalloc

import pytest

from maya_un.events import JobAdvanced
from maya_un.process.journal.protocol import JobOptions, JobRow, RequestOwner
from maya_un.process.queue.entries import AT_HAND, QueueEntry
from maya_un.schema.jobs import TaskState
from tests.queues import Machine, job, submit_request
from tests.virtual_time import elapse

MANY = 2000
BYTES_EACH = 40
"""Most memory of a job that only waits [bytes], 4 MB for 100 000; whole in memory it took some 3000."""

HOME = job("home", name="home")
FAR = MANY - 3


def row(number: int, **fields: object) -> JobRow:
    body = {"name": f"job {number}", "steps": [{"pick": [0.5, 1.1]}, {"place": [1.1, 0.5]}]}
    options = fields.pop("options", JobOptions())
    assert isinstance(options, JobOptions)
    owner = RequestOwner(("ana", "root")[number % 2], "cli")
    state = TaskState.HELD if number % 10 == 0 else TaskState.QUEUED
    return JobRow(number, f"job {number}", body, options, owner, state, float(number), "2026-11-22T08:00:00Z", 2)


async def full(count: int = MANY, *rows: JobRow) -> Machine:
    """Return a machine in whose journal jobs wait from before."""
    machine = Machine()
    await machine.journal.add(*(row(number) for number in range(1, count + 1)), *rows)
    return machine


def whole(kind: type) -> int:
    """Return how many objects of a kind there are."""
    gc.collect()
    return sum(isinstance(one, kind) for one in gc.get_objects())


async def test_start_with_many_waiting_jobs_keeps_few_of_them_in_memory() -> None:
    machine = await full()
    gc.collect()
    before = whole(QueueEntry)
    async with machine.running() as layer:
        await elapse(1.0)
        assert whole(QueueEntry) - before <= AT_HAND
        assert layer.process.views.view().counts == {"queued": MANY - MANY // 10, "held": MANY // 10}


async def grown(count: int) -> int:
    """Return how much memory a start takes with so many jobs waiting [bytes]."""
    machine = await full(count)
    gc.collect()
    tracemalloc.start()
    try:
        async with machine.running():
            gc.collect()
            return tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()


async def test_memory_of_a_waiting_job_is_its_place() -> None:
    few = await grown(MANY)
    assert (await grown(10 * MANY) - few) / (9 * MANY) < BYTES_EACH


async def test_clear_of_many_waiting_jobs_is_one_write_and_reports_every_end() -> None:
    machine = await full()
    written: list[str] = []
    async with machine.running() as layer:
        machine.journal._connection.set_trace_callback(written.append)
        await layer.process.clear()
        machine.journal._connection.set_trace_callback(None)
        assert sum(said.startswith("COMMIT") for said in written) <= 3
        assert layer.process.views.view().counts == {}
        assert machine.journal.now(FAR)[0].state is TaskState.CANCELLED
        await elapse(10.0)
        ended = [event.detail["job"] for event in layer.told(JobAdvanced) if event.detail["state"] == "cancelled"]
        assert sorted(ended, key=str) == sorted(range(1, MANY + 1), key=str)
        assert {event.detail["owner"] for event in layer.told(JobAdvanced)} == {"ana", "root"}


async def test_clear_that_cannot_be_written_ends_nothing() -> None:
    machine = await full()
    async with machine.running() as layer:
        machine.journal.broken = "the disk is full"
        with pytest.raises(Exception, match="the disk is full"):
            await layer.process.clear()
        assert layer.process.views.line(FAR).state is TaskState.QUEUED
        machine.journal.broken = ""
        await layer.process.clear()
        assert layer.process.views.view().counts == {}


async def test_close_reports_every_end_before_it_returns() -> None:
    machine = await full()
    async with machine.running() as layer:
        await layer.process.clear()
    assert sum(event.detail["state"] == "cancelled" for event in layer.told(JobAdvanced)) == MANY


async def test_a_job_far_behind_is_held_released_moved_changed_and_cancelled() -> None:
    async with (await full()).running() as layer:
        process = layer.process
        await process.hold(FAR)
        assert process.views.line(FAR).state is TaskState.HELD
        await process.release(FAR, "ana")
        await process.change(FAR, {"notes": "with care"})
        assert process.views.line(FAR).notes == "with care"
        await process.move_to(FAR, last=False)
        assert process.views.line(FAR).position == 1
        await process.move(FAR, MANY - 1, behind=True)
        assert process.views.line(FAR).position == MANY - 1
        assert (await process.cancel(FAR)).state is TaskState.CANCELLED
        assert FAR not in [line.id for line in process.views.lines() if line.state is TaskState.QUEUED]
        assert len(process.views.lines()) == MANY


async def test_waiter_for_a_job_far_behind_learns_of_its_end() -> None:
    async with (await full()).running() as layer:
        waiting = [asyncio.ensure_future(layer.process.result(FAR)) for _ in range(3)]
        await elapse(1.0)
        await layer.process.clear()
        assert {(await one).state for one in waiting} == {TaskState.CANCELLED}


async def test_ended_job_ends_its_dependents() -> None:
    dependent = row(MANY + 1, options=JobOptions(depends_on=(FAR,)))
    async with (await full(MANY, dependent)).running() as layer:
        await layer.process.cancel(FAR)
        assert layer.process.views.line(MANY + 1).state is TaskState.HELD
        await layer.process.clear()
        assert layer.process.views.view().counts == {}


async def test_jobs_begin_in_order_though_they_were_left_in_the_journal() -> None:
    machine = await full(5 * AT_HAND)
    async with machine.running() as layer:
        await layer.process.scheduler.resume("ana")
        await elapse(30.0)
        begun = [event.detail["job"] for event in layer.told(JobAdvanced) if event.detail["state"] == "running"]
        assert begun == [number for number in range(1, 1000) if number % 10][: len(begun)]
        assert begun


async def test_jobs_submitted_behind_many_stay_in_the_journal() -> None:
    machine = await full(2 * AT_HAND)
    async with machine.running() as layer:
        await elapse(1.0)
        before = whole(QueueEntry)
        numbers = [await layer.process.submit(HOME, submit_request()) for _ in range(50)]
        assert whole(QueueEntry) - before <= 2
        assert [layer.process.views.line(number).state for number in numbers] == [TaskState.QUEUED] * 50


async def test_all_of_an_owner_become_proposals_also_far_behind() -> None:
    async with (await full()).running() as layer:
        layer.process.owner_ended("ana")
        await elapse(10.0)
        lines = layer.process.views.lines()
        assert {(line.owner, line.proposal) for line in lines} == {("ana", True), ("root", False)}
