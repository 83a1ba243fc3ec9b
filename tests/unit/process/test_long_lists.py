"""Long lists are made a slice at a time: other users of the loop wait for one slice, not for the list."""

from __future__ import annotations

import asyncio

from maya_un.process.journal.protocol import Filter
from maya_un.process.queue.report import SLICE, Slices
from maya_un.schema.jobs import PauseReason, TaskState
from tests.queues import Machine, job, submit_request
from tests.virtual_time import elapse

STEPS = 10 * SLICE


class Turns:
    """Counts the turns of the loop while the block runs."""

    count = 0

    async def __aenter__(self) -> Turns:
        self._task = asyncio.ensure_future(self._go())
        return self

    async def __aexit__(self, *_: object) -> None:
        self._task.cancel()
        await asyncio.wait({self._task})

    async def _go(self) -> None:
        while True:
            self.count += 1
            await asyncio.sleep(0)


async def test_slices_of_two_readers_leave_a_turn_between_any_two() -> None:
    slices, made = Slices(), list[int]()
    async with Turns() as turns:
        at: list[tuple[int, int]] = []

        def make(number: int) -> int:
            at.append((turns.count, number // SLICE))
            made.append(number)
            return number

        two = await asyncio.gather(slices.each(make, range(STEPS)), slices.each(make, range(STEPS, 2 * STEPS)))
    assert two == [list(range(STEPS)), list(range(STEPS, 2 * STEPS))]
    assert made == list(range(2 * STEPS))
    assert len({turn for turn, _ in at}) == len(set(at)) == 2 * STEPS // SLICE


async def test_report_of_a_long_job_leaves_the_loop_to_others() -> None:
    async with Machine().running() as layer:
        layer.process.scheduler.pause_by_itself(PauseReason.ASKED)
        number = await layer.process.submit(job({"gripper": "open"}, repeat=STEPS), submit_request(held=True))
        async with Turns() as turns:
            before = turns.count
            report = await layer.process.views.report(number)
            assert turns.count - before >= STEPS // SLICE
        assert len(report.steps) == STEPS


async def test_report_of_a_running_job_counts_every_change_of_a_step() -> None:
    async with Machine().running() as layer:
        number = await layer.process.submit(job("home", {"gripper": "open"}, repeat=5), submit_request())
        await layer.until(number, 4)
        report = await layer.process.views.report(number)
        done = sum(step.state is TaskState.DONE for step in report.steps)
        assert (report.line.done, done) == (3, 3)
        item = layer.process.scheduler.running
        assert item is not None and item.record is not None
        assert [step.row.index for step in item.record.remaining] == list(range(4, 11))
        await elapse(600.0)
        assert (await layer.process.views.report(number)).line.done == 10


async def test_page_of_many_waiting_jobs_reads_no_single_job() -> None:
    machine = Machine()
    async with machine.running() as layer:
        for _ in range(300):
            await layer.process.submit(job("home"), submit_request(held=True))
        statements: list[str] = []
        machine.journal.trace(statements.append)
        lines = await layer.process.views.page(Filter(limit=1000))
        machine.journal.trace(None)
    assert [line.position for line in reversed(lines)] == list(range(1, 301))
    assert len(statements) == 1
