"""Announcements follow writes; an unwritable job does not begin, and past changes are written later."""

from __future__ import annotations

import pytest

from maya_un.errors import Stopped, StorageFailed
from maya_un.events import JobAdvanced, QueueChanged, StepAdvanced, StorageChanged
from maya_un.process.queue.changes import RETRY
from maya_un.robot.primitives import Home
from maya_un.schema.jobs import PauseReason, QueueMode, TaskState
from tests.queues import Machine, QueueBench, job, submit_request
from tests.virtual_time import elapse

HOME = job("home", name="home")
LONG = 1000.0


async def kept(layer: QueueBench, number: int) -> tuple[str, list[str]]:
    """Return the states of a job and its steps in the journal."""
    found = await layer.journal.job(number)
    assert found is not None
    row, steps = found
    return row.state.value, [step.state.value for step in steps]


async def test_unwritable_job_is_refused() -> None:
    async with Machine().running() as layer:
        layer.journal.broken = "the disk is full"
        with pytest.raises(StorageFailed, match="the disk is full"):
            await layer.process.submit(HOME)
        assert layer.process.views.lines() == []
        assert layer.told(JobAdvanced) == []
        layer.journal.broken = ""
        number = await layer.process.submit(HOME)
        assert (await layer.process.result(number)).state is TaskState.DONE


async def test_no_step_begins_that_cannot_be_written_and_the_end_of_the_last_is_written_later() -> None:
    async with Machine().running() as layer:
        process = layer.process
        await process.submit(job("home", "home"))
        await process.submit(HOME)
        await layer.until(1, 1)
        layer.journal.broken = "the disk is full"
        await elapse(LONG)
        assert layer.controller.names() == ["home"]
        assert (process.views.mode, process.views.reason) == (QueueMode.PAUSED, "storage")
        assert [event.detail["state"] for event in layer.told(StepAdvanced)] == ["running"]
        assert [event.detail["state"] for event in layer.told(StorageChanged)] == ["failing"]
        assert await kept(layer, 1) == ("running", ["running"])
        with pytest.raises(StorageFailed):
            await process.scheduler.resume("ana")
        layer.journal.broken = ""
        await elapse(2 * RETRY)
        assert await kept(layer, 1) == ("paused", ["done"])
        assert [event.detail["state"] for event in layer.told(StorageChanged)] == ["failing", "working"]
        await elapse(LONG)
        assert layer.controller.names() == ["home"]
        await process.scheduler.resume("ana")
        assert (await process.result(2)).state is TaskState.DONE
        assert layer.states(1) == ["queued", "running", "paused", "running", "done"]


async def test_unwritten_end_of_a_job_is_announced_when_it_is_written() -> None:
    async with Machine().running() as layer:
        number = await layer.process.submit(HOME)
        await layer.until(1, 1)
        layer.journal.broken = "the disk is full"
        await elapse(100.0)
        assert layer.states(number) == ["queued", "running"]
        layer.journal.broken = ""
        report = await layer.process.result(number)
        assert report.state is TaskState.DONE
        assert await kept(layer, number) == ("done", ["done"])
        await elapse(1.0)
        assert layer.process.views.mode is QueueMode.RUNNING


async def test_job_whose_start_cannot_be_written_does_not_begin() -> None:
    async with Machine().running() as layer:
        with layer.process.scheduler.aside("jog"):
            await layer.process.submit(HOME)
            layer.journal.broken = "the file may only be read"
        await elapse(LONG)
        assert layer.controller.calls == []
        assert layer.process.views.line(1).state is TaskState.QUEUED
        layer.journal.broken = ""
        await layer.process.scheduler.resume("ana")
        assert (await layer.process.result(1)).state is TaskState.DONE


async def test_immediate_command_that_cannot_begin_does_not_retry_for_ever() -> None:
    async with Machine().running() as layer:
        await layer.process.scheduler.pause("ana", now=False)
        await layer.process.submit(HOME)
        command = await layer.process.command(Home())
        await layer.process.command(Home())
        layer.journal.broken = "the disk is full"
        await elapse(LONG)
        assert layer.process.views.line(command + 1).state is TaskState.QUEUED
        assert layer.controller.names() == ["home"]
        layer.journal.broken = ""


@pytest.mark.parametrize("command", ["hold", "move", "change", "cancel", "clear"])
async def test_change_is_applied_when_it_is_written_or_not_at_all(command: str) -> None:
    async with Machine().running() as layer:
        process = layer.process
        await process.scheduler.pause("ana", now=False)
        for _ in range(2):
            await process.submit(HOME)
        before = process.views.view()
        layer.journal.broken = "the disk is full"
        commands = {
            "hold": lambda: process.hold(2),
            "move": lambda: process.move_to(2, last=False),
            "change": lambda: process.change(2, {"notes": "x"}),
            "cancel": lambda: process.cancel(2),
            "clear": process.clear,
        }
        with pytest.raises(StorageFailed):
            await commands[command]()
        assert process.views.view() == before
        layer.journal.broken = ""


async def test_unwritable_pause_still_holds() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(job("home", "home"))
        await layer.until(1, 1)
        layer.journal.broken = "the disk is full"
        with pytest.raises(StorageFailed):
            await layer.process.scheduler.pause("ana", now=False)
        layer.journal.broken = ""
        await elapse(LONG)
        assert layer.controller.names() == ["home"]
        assert (layer.process.views.mode, layer.process.views.reason) == (QueueMode.PAUSED, "asked")
        assert layer.told(QueueChanged)[0].detail["by"] == "ana"


async def test_everything_announced_was_in_the_journal_before() -> None:
    machine = Machine()
    async with machine.running() as layer:
        machine.journal.slow = 0.5
        layer.check_announcements()
        await layer.process.submit(job("home", "home"))
        await layer.process.submit(job({"place": "tray"}))
        await layer.process.submit(HOME, submit_request(depends_on=(2,)))
        await layer.process.result(2)
        told = [event for kind in (JobAdvanced, StepAdvanced) for event in layer.told(kind)]
        assert len(told) == 3 + 4 + 3 + 1 + 2
        assert await kept(layer, 1) == ("done", ["done", "done"])
        assert await kept(layer, 3) == ("held", [])


async def test_pause_during_another_write_is_still_announced() -> None:
    machine = Machine()
    async with machine.running() as layer:
        machine.journal.slow = 1.0
        await layer.process.submit(job("home", "home"))
        await layer.process.submit(HOME)
        layer.process.scheduler.halt(Stopped())
        await elapse(0.5)
        layer.process.scheduler.pause_by_itself(PauseReason.FAULT)
        await elapse(LONG)
        assert [event.detail["reason"] for event in layer.told(QueueChanged)] == ["stop"]
        kept_now = await layer.journal.unfinished()
        assert (kept_now.queue.paused, kept_now.queue.reason) == (True, "stop")


async def test_cancel_is_answered_at_rest_even_when_it_cannot_be_written() -> None:
    async with Machine().running() as layer:
        process = layer.process
        await process.submit(job("home", "home"))
        await layer.until(1, 1)
        layer.journal.broken = "the disk is full"
        with pytest.raises(StorageFailed, match="the disk is full"):
            await process.cancel(1)
        assert process.running is None
        assert layer.controller.state.moving is False
        layer.journal.broken = ""
        await elapse(2 * RETRY)
        assert await kept(layer, 1) == ("cancelled", ["cancelled"])
        assert (await process.result(1)).state is TaskState.CANCELLED
