"""Requests at the very instant in which a job begins, pauses or ends."""

from __future__ import annotations

import asyncio
from contextlib import suppress

import pytest

from maya_un.errors import RequestError, Stopped
from maya_un.events import JobAdvanced
from maya_un.schema.jobs import TaskState
from tests.queues import Machine, job, submit_request
from tests.virtual_time import elapse

HOME = job("home", name="home")
LONG = 1000.0


@pytest.mark.parametrize("stepwise", [False, True])
@pytest.mark.parametrize("tenths", range(0, 40, 3))
async def test_every_step_is_done_once_despite_holds_at_any_instant(tenths: int, stepwise: bool) -> None:
    async with Machine().running() as floor:
        floor.journal.slow = 0.4
        turns = floor.process.turns
        await floor.process.submit(job("home", "home"), submit_request(stepwise=stepwise))
        await elapse(0.1 * tenths)
        notes = [asyncio.create_task(floor.process.change(1, {"notes": str(n)})) for n in range(2)]
        wishes = [turns.pause_motion, turns.resume_motion, turns.pause_motion, turns.resume_motion]
        said = [asyncio.create_task(wish()) for wish in wishes]
        await asyncio.gather(*notes, *said, return_exceptions=True)
        for _ in range(3):
            await elapse(LONG)
            with suppress(RequestError):
                await turns.resume("ana")
        assert floor.process.shown.line(1).state is TaskState.DONE
        assert floor.controller.names().count("home") == 2
        assert [step.state for step in floor.journal.now(1)[1]] == [TaskState.DONE, TaskState.DONE]


async def test_a_job_that_is_made_to_wait_as_it_is_about_to_begin_waits() -> None:
    async with Machine().running() as floor:
        for _ in range(2):
            await floor.process.submit(HOME, submit_request(held=True))
        floor.journal.slow = 0.5
        slow = asyncio.create_task(floor.process.change(2, {"notes": "slow"}))
        releasing = asyncio.create_task(floor.process.release(1, "ana"))
        changing = asyncio.create_task(floor.process.change(1, {"depends_on": [2]}))
        await asyncio.gather(slow, releasing, changing)
        await elapse(LONG)
        assert floor.process.shown.line(1).state is TaskState.QUEUED
        assert floor.controller.calls == []


async def test_delayed_immediate_command_blocks_nothing() -> None:
    async with Machine().running() as floor:
        await floor.process.turns.pause("ana", now=False)
        await floor.process.submit(HOME, submit_request(held=True))
        floor.journal.slow = 0.5
        slow = asyncio.create_task(floor.process.change(1, {"notes": "slow"}))
        number = await floor.process.wish({"command": "home"})
        await asyncio.gather(slow, floor.process.change(number, {"depends_on": [1]}), return_exceptions=True)
        await elapse(LONG)
        assert floor.process.shown.line(number).state in {TaskState.QUEUED, TaskState.DONE}


@pytest.mark.parametrize(("why", "paused"), [("expired", True), ("ana was removed", True), ("released", False)])
async def test_lost_driver_prevents_further_starts(why: str, paused: bool) -> None:
    async with Machine().running() as floor:
        floor.lease.take("ana", "test", patience=1e5)
        await floor.process.submit(job("home", "home"))
        await elapse(1.0)
        floor.lease.drop("ana", why)
        await elapse(LONG)
        view = floor.process.shown.view()
        assert (view.reason == "driver") is paused
        assert (floor.process.shown.line(1).state is TaskState.DONE) is not paused


async def test_a_stop_ends_the_check_of_a_long_job_at_once() -> None:
    async with Machine().running() as floor:
        number = await floor.process.submit(job({"gripper": "open"}, repeat=1000), submit_request())
        async for event in floor.controller.events.follow():
            if isinstance(event, JobAdvanced) and event.detail["state"] == "running":
                break
        floor.process.turns.halt(Stopped())
        report = await floor.process.result(number)
        assert (report.state, report.code) == (TaskState.CANCELLED, Stopped.code)
        assert {step.predicted for step in report.steps} == {None}
        assert floor.controller.calls == []
        await floor.process.turns.resume("ana")
        again = await floor.process.submit(job({"gripper": "open"}), submit_request())
        assert (await floor.process.result(again)).state is TaskState.DONE
