"""Announcements follow writes; an unwritable job does not begin, and past changes are written later."""

from __future__ import annotations

import pytest

from maya_un.errors import Stopped, StorageFailed
from maya_un.events import JobAdvanced, QueueChanged, StepAdvanced, StorageChanged
from maya_un.process.queue.changes import RETRY
from maya_un.robot.primitives import Home
from maya_un.schema.jobs import QueueMode, TaskState
from tests.queues import Machine, QueueBench, job, submit_request
from tests.virtual_time import elapse

HOME = job("home", name="home")
LONG = 1000.0


async def kept(floor: QueueBench, number: int) -> tuple[str, list[str]]:
    """Return the states of a job and its steps in the journal."""
    found = await floor.journal.job(number)
    assert found is not None
    row, steps = found
    return row.state.value, [step.state.value for step in steps]


async def test_unwritable_job_is_refused() -> None:
    async with Machine().running() as floor:
        floor.journal.broken = "the disk is full"
        with pytest.raises(StorageFailed, match="the disk is full"):
            await floor.process.submit(HOME)
        assert floor.process.shown.lines() == []
        assert floor.told(JobAdvanced) == []
        floor.journal.broken = ""
        number = await floor.process.submit(HOME)
        assert (await floor.process.result(number)).state is TaskState.DONE


async def test_no_step_begins_that_cannot_be_written_and_the_end_of_the_last_is_written_later() -> None:
    async with Machine().running() as floor:
        process = floor.process
        await process.submit(job("home", "home"))
        await process.submit(HOME)
        await floor.until(1, 1)
        floor.journal.broken = "the disk is full"
        await elapse(LONG)
        assert floor.controller.names() == ["home"]
        assert (process.shown.mode, process.shown.reason) == (QueueMode.PAUSED, "storage")
        assert [event.detail["state"] for event in floor.told(StepAdvanced)] == ["running"]
        assert [event.detail["state"] for event in floor.told(StorageChanged)] == ["failing"]
        assert await kept(floor, 1) == ("running", ["running"])
        with pytest.raises(StorageFailed):
            await process.turns.resume("ana")
        floor.journal.broken = ""
        await elapse(2 * RETRY)
        assert await kept(floor, 1) == ("paused", ["done"])
        assert [event.detail["state"] for event in floor.told(StorageChanged)] == ["failing", "working"]
        await elapse(LONG)
        assert floor.controller.names() == ["home"]
        await process.turns.resume("ana")
        assert (await process.result(2)).state is TaskState.DONE
        assert floor.states(1) == ["queued", "running", "paused", "running", "done"]


async def test_unwritten_end_of_a_job_is_announced_when_it_is_written() -> None:
    async with Machine().running() as floor:
        number = await floor.process.submit(HOME)
        await floor.until(1, 1)
        floor.journal.broken = "the disk is full"
        await elapse(100.0)
        assert floor.states(number) == ["queued", "running"]
        floor.journal.broken = ""
        report = await floor.process.result(number)
        assert report.state is TaskState.DONE
        assert await kept(floor, number) == ("done", ["done"])
        await elapse(1.0)
        assert floor.process.shown.mode is QueueMode.RUNNING


async def test_job_whose_start_cannot_be_written_does_not_begin() -> None:
    async with Machine().running() as floor:
        await floor.process.submit(HOME, submit_request(held=True))
        await floor.process.release(1, "ana")
        floor.journal.broken = "the file may only be read"
        await elapse(LONG)
        assert floor.controller.calls == []
        assert floor.process.shown.line(1).state is TaskState.QUEUED
        floor.journal.broken = ""
        await floor.process.turns.resume("ana")
        assert (await floor.process.result(1)).state is TaskState.DONE


async def test_immediate_command_that_cannot_begin_does_not_retry_for_ever() -> None:
    async with Machine().running() as floor:
        await floor.process.turns.pause("ana", now=False)
        await floor.process.submit(HOME)
        wish = await floor.process.wish(Home())
        await floor.process.wish(Home())
        floor.journal.broken = "the disk is full"
        await elapse(LONG)
        assert floor.process.shown.line(wish + 1).state is TaskState.QUEUED
        assert floor.controller.names() == ["home"]
        floor.journal.broken = ""


@pytest.mark.parametrize("wish", ["hold", "move", "change", "cancel", "clear"])
async def test_change_is_applied_when_it_is_written_or_not_at_all(wish: str) -> None:
    async with Machine().running() as floor:
        process = floor.process
        await process.turns.pause("ana", now=False)
        for _ in range(2):
            await process.submit(HOME)
        before = process.shown.view()
        floor.journal.broken = "the disk is full"
        wishes = {
            "hold": lambda: process.hold(2),
            "move": lambda: process.move_to(2, last=False),
            "change": lambda: process.change(2, {"notes": "x"}),
            "cancel": lambda: process.cancel(2),
            "clear": process.clear,
        }
        with pytest.raises(StorageFailed):
            await wishes[wish]()
        assert process.shown.view() == before
        floor.journal.broken = ""


async def test_unwritable_pause_still_holds() -> None:
    async with Machine().running() as floor:
        await floor.process.submit(job("home", "home"))
        await floor.until(1, 1)
        floor.journal.broken = "the disk is full"
        with pytest.raises(StorageFailed):
            await floor.process.turns.pause("ana", now=False)
        floor.journal.broken = ""
        await elapse(LONG)
        assert floor.controller.names() == ["home"]
        assert (floor.process.shown.mode, floor.process.shown.reason) == (QueueMode.PAUSED, "asked")
        assert floor.told(QueueChanged)[0].detail["by"] == "ana"


async def test_everything_announced_was_in_the_journal_before() -> None:
    machine = Machine()
    async with machine.running() as floor:
        machine.journal.slow = 0.5
        floor.check_announcements()
        await floor.process.submit(job("home", "home"))
        await floor.process.submit(job({"place": "tray"}))
        await floor.process.submit(HOME, submit_request(depends_on=(2,)))
        await floor.process.result(2)
        told = [event for kind in (JobAdvanced, StepAdvanced) for event in floor.told(kind)]
        assert len(told) == 3 + 4 + 3 + 1 + 2
        assert await kept(floor, 1) == ("done", ["done", "done"])
        assert await kept(floor, 3) == ("held", [])


async def test_pause_during_another_write_is_still_announced() -> None:
    machine = Machine()
    async with machine.running() as floor:
        machine.journal.slow = 1.0
        await floor.process.submit(job("home", "home"))
        await floor.process.submit(HOME)
        floor.process.turns.halt(Stopped())
        await elapse(0.5)
        floor.process.turns.pause_by_itself("fault")
        await elapse(LONG)
        assert [event.detail["reason"] for event in floor.told(QueueChanged)] == ["stop"]
        kept_now = await floor.journal.unfinished()
        assert (kept_now.queue.paused, kept_now.queue.reason) == (True, "stop")


async def test_cancel_is_answered_at_rest_even_when_it_cannot_be_written() -> None:
    async with Machine().running() as floor:
        process = floor.process
        await process.submit(job("home", "home"))
        await floor.until(1, 1)
        floor.journal.broken = "the disk is full"
        with pytest.raises(StorageFailed, match="the disk is full"):
            await process.cancel(1)
        assert process.running is None
        assert floor.controller.state.moving is False
        floor.journal.broken = ""
        await elapse(2 * RETRY)
        assert await kept(floor, 1) == ("cancelled", ["cancelled"])
        assert (await process.result(1)).state is TaskState.CANCELLED
