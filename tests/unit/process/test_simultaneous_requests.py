"""Requests at the very instant in which a job begins, pauses or ends."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress

import pytest

from maya_un.errors import RequestError, Stopped
from maya_un.events import JobAdvanced
from maya_un.schema.jobs import QueueMode, TaskState
from tests.queues import Machine, QueueBench, job, submit_request
from tests.virtual_time import elapse

HOME = job("home", name="home")
LONG = 1000.0


@pytest.mark.parametrize("stepwise", [False, True])
@pytest.mark.parametrize("tenths", range(0, 40, 3))
async def test_every_step_is_done_once_despite_holds_at_any_instant(tenths: int, stepwise: bool) -> None:
    async with Machine().running() as layer:
        layer.journal.slow = 0.4
        turns = layer.process.scheduler
        await layer.process.submit(job("home", "home"), submit_request(stepwise=stepwise))
        await elapse(0.1 * tenths)
        notes = [asyncio.create_task(layer.process.change(1, {"notes": str(n)})) for n in range(2)]
        commands = [turns.pause_motion, turns.resume_motion, turns.pause_motion, turns.resume_motion]
        said = [asyncio.create_task(command()) for command in commands]
        await asyncio.gather(*notes, *said, return_exceptions=True)
        for _ in range(3):
            await elapse(LONG)
            with suppress(RequestError):
                await turns.resume("ana")
        assert layer.process.views.line(1).state is TaskState.DONE
        assert layer.controller.names().count("home") == 2
        assert [step.state for step in layer.journal.now(1)[1]] == [TaskState.DONE, TaskState.DONE]


async def test_a_job_that_is_made_to_wait_as_it_is_about_to_begin_waits() -> None:
    async with Machine().running() as layer:
        for _ in range(2):
            await layer.process.submit(HOME, submit_request(held=True))
        layer.journal.slow = 0.5
        slow = asyncio.create_task(layer.process.change(2, {"notes": "slow"}))
        releasing = asyncio.create_task(layer.process.release(1, "ana"))
        changing = asyncio.create_task(layer.process.change(1, {"depends_on": [2]}))
        await asyncio.gather(slow, releasing, changing)
        await elapse(LONG)
        assert layer.process.views.line(1).state is TaskState.QUEUED
        assert layer.controller.calls == []


async def test_delayed_immediate_command_blocks_nothing() -> None:
    async with Machine().running() as layer:
        await layer.process.scheduler.pause("ana", now=False)
        await layer.process.submit(HOME, submit_request(held=True))
        layer.journal.slow = 0.5
        slow = asyncio.create_task(layer.process.change(1, {"notes": "slow"}))
        number = await layer.process.command({"command": "home"})
        await asyncio.gather(slow, layer.process.change(number, {"depends_on": [1]}), return_exceptions=True)
        await elapse(LONG)
        assert layer.process.views.line(number).state in {TaskState.QUEUED, TaskState.DONE}


async def paused_queue(layer: QueueBench) -> Awaitable[object]:
    """Return the resumption of a queue in which a job waits."""
    await layer.process.scheduler.pause("ana", now=False)
    await layer.process.submit(HOME)
    return layer.process.scheduler.resume("ana")


async def held_job(layer: QueueBench) -> Awaitable[object]:
    """Return the release of a held job."""
    await layer.process.submit(HOME, submit_request(held=True))
    return layer.process.release(1, "ana")


async def dependent_job(layer: QueueBench) -> Awaitable[object]:
    """Return the change of a job that then waits for no other one."""
    await layer.process.submit(HOME, submit_request(held=True))
    await layer.process.submit(HOME, submit_request(depends_on=(1,)))
    return layer.process.change(2, {"depends_on": []})


async def interrupted_job(layer: QueueBench) -> Awaitable[object]:
    """Return the decision to resume a job that the end of the program has interrupted."""
    return layer.process.recover("resume", None, resume_queue=True, by="ana")


@pytest.mark.parametrize("delay", [0.0, 0.2])
@pytest.mark.parametrize("prepared", [paused_queue, held_job, dependent_job, interrupted_job])
async def test_a_stop_pauses_the_queue_although_a_request_lets_a_job_begin(
    prepared: Callable[[QueueBench], Awaitable[Awaitable[object]]], delay: float
) -> None:
    machine = Machine()
    if prepared is interrupted_job:
        async with machine.running() as layer:
            await layer.process.submit(HOME)
            await elapse(1.0)
    async with machine.running() as layer:
        request = asyncio.ensure_future(await prepared(layer))
        layer.journal.slow = 0.5
        asyncio.get_running_loop().call_later(delay, layer.process.scheduler.halt, Stopped())
        await request
        await elapse(LONG)
        assert layer.process.views.mode is QueueMode.PAUSED
        assert layer.controller.calls == []
        await layer.process.scheduler.resume("ana")
        await elapse(LONG)
        assert layer.controller.names() == ["home"]


async def test_a_stop_ends_a_step_that_waits_for_a_slow_disk() -> None:
    async with Machine().running() as layer:
        await layer.process.scheduler.pause("ana", now=False)
        await layer.process.submit(HOME)
        layer.journal.slow = 0.5
        slow = asyncio.create_task(layer.process.change(1, {"notes": "slow"}))
        await elapse(0.1)
        step = asyncio.create_task(layer.process.scheduler.step("ana"))
        await elapse(0.1)
        layer.process.scheduler.halt(Stopped())
        with pytest.raises(Stopped):
            await step
        await slow
        await elapse(LONG)
        assert layer.controller.calls == []


@pytest.mark.parametrize(("why", "paused"), [("expired", True), ("ana was removed", True), ("released", False)])
async def test_lost_driver_prevents_further_starts(why: str, paused: bool) -> None:
    async with Machine().running() as layer:
        layer.lease.take("ana", "test", patience=1e5)
        await layer.process.submit(job("home", "home"))
        await elapse(1.0)
        layer.lease.drop("ana", why)
        await elapse(LONG)
        view = layer.process.views.view()
        assert (view.reason == "driver") is paused
        assert (layer.process.views.line(1).state is TaskState.DONE) is not paused


async def test_a_stop_ends_the_check_of_a_long_job_at_once() -> None:
    async with Machine().running() as layer:
        number = await layer.process.submit(job({"gripper": "open"}, repeat=1000), submit_request())
        async for event in layer.controller.events.follow():
            if isinstance(event, JobAdvanced) and event.detail["state"] == "running":
                break
        layer.process.scheduler.halt(Stopped())
        report = await layer.process.result(number)
        assert (report.state, report.code) == (TaskState.CANCELLED, Stopped.code)
        assert {step.predicted for step in report.steps} == {None}
        assert layer.controller.calls == []
        await layer.process.scheduler.resume("ana")
        again = await layer.process.submit(job({"gripper": "open"}), submit_request())
        assert (await layer.process.result(again)).state is TaskState.DONE
