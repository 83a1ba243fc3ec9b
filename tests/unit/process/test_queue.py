"""The queue as people use it: order, holds, dependencies, pauses, steps, retries, leases, keys."""

from __future__ import annotations

import asyncio

import pytest

from maya_un.errors import (
    Busy,
    InvalidJob,
    InvalidRequest,
    InvalidValue,
    KeyReused,
    NotFound,
    PathRefused,
    Stopped,
    WrongState,
)
from maya_un.events import JobAdvanced, QueueChanged, StepAdvanced
from maya_un.process.queue import runner
from maya_un.robot.primitives import Gripper, Home
from maya_un.schema.choices import OnFailure
from maya_un.schema.jobs import PauseReason, QueueMode, TaskState
from tests.queues import PICK_AND_PLACE, Machine, QueueBench, job, submit_request
from tests.virtual_time import elapse

HOME = job("home", name="home")
LONG = 1000.0


async def order_of(layer: QueueBench) -> list[int]:
    """Let everything run and return the order in which jobs began."""
    await elapse(LONG)
    return [int(str(e.detail["job"])) for e in layer.told(JobAdvanced) if e.detail["state"] == "running"]


async def test_the_greater_priority_goes_first_and_equals_in_the_order_they_came() -> None:
    async with Machine().running() as layer:
        for priority in (0, 0, 5, -5, 5, 0):
            await layer.process.submit(HOME, submit_request(priority=priority))
        assert [line.position for line in layer.process.views.lines()] == [None, 3, 1, 5, 2, 4]
        assert await order_of(layer) == [1, 3, 5, 2, 6, 4]


async def test_a_held_job_lets_the_others_pass_until_it_is_released() -> None:
    async with Machine().running() as layer:
        process = layer.process
        for held in (False, True, False):
            await process.submit(HOME, submit_request(held=held))
        assert await order_of(layer) == [1, 3]
        await process.release(2, "ben")
        assert await order_of(layer) == [1, 3, 2]
        with pytest.raises(WrongState, match="done"):
            await process.hold(2)


async def test_a_job_is_put_aside_and_taken_up_again() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(HOME)
        await layer.process.submit(HOME)
        await layer.process.hold(2)
        await layer.process.hold(2)
        assert layer.process.views.line(2).state is TaskState.HELD
        assert await order_of(layer) == [1]
        await layer.process.release(2, "ana")
        assert layer.states(2)[:3] == ["queued", "held", "queued"]
        assert await order_of(layer) == [1, 2]


async def test_jobs_are_moved() -> None:
    async with Machine().running() as layer:
        process = layer.process
        for _ in range(5):
            await process.submit(HOME)
        await process.move_to(4, last=False)
        await process.move(2, 5, behind=True)
        await process.move_to(3, last=True)
        await process.submit(HOME)
        assert await order_of(layer) == [1, 4, 5, 2, 3, 6]
        with pytest.raises(WrongState):
            await process.move(1, 2, behind=True)
        with pytest.raises(NotFound):
            await process.move_to(99, last=True)


async def test_a_job_waits_for_those_on_which_it_depends() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(HOME)
        await layer.process.submit(HOME, submit_request(held=True))
        await layer.process.submit(HOME, submit_request(depends_on=(1, 2)))
        await layer.process.submit(HOME)
        assert await order_of(layer) == [1, 4]
        assert layer.process.views.line(3).state is TaskState.QUEUED
        await layer.process.release(2, "ana")
        assert await order_of(layer) == [1, 4, 2, 3]


@pytest.mark.parametrize("before", [True, False])
async def test_dependent_of_a_failed_job_is_held_with_the_reason(before: bool) -> None:
    async with Machine().running() as layer:
        process = layer.process
        bad = await process.submit(job({"place": "tray"}))
        if not before:
            await elapse(1.0)
        second = await process.submit(HOME, submit_request(depends_on=(bad,)))
        await elapse(LONG)
        line = process.views.line(second)
        assert (line.state, line.code) == (TaskState.HELD, 4017)
        assert "job 1" in line.message.lower()
        await process.release(second, "ana")
        assert (await process.result(second)).state is TaskState.DONE
        assert process.views.line(second).message == ""


async def test_only_jobs_that_exist_can_be_depended_on() -> None:
    async with Machine().running() as layer:
        with pytest.raises(InvalidValue, match="no such job"):
            await layer.process.submit(HOME, submit_request(depends_on=(7,)))
        for _ in range(3):
            await layer.process.submit(HOME, submit_request(held=True))
        await layer.process.change(2, {"depends_on": [1]})
        await layer.process.change(3, {"depends_on": [2]})
        with pytest.raises(InvalidValue, match="wait for itself"):
            await layer.process.change(1, {"depends_on": [3]})


async def test_after_a_pause_no_step_begins_before_resume() -> None:
    async with Machine().running() as layer:
        process = layer.process
        await process.submit(job(*PICK_AND_PLACE))
        await process.submit(HOME)
        await elapse(1.0)
        await process.scheduler.pause("ben", now=False)
        assert process.views.mode is QueueMode.PAUSING
        await elapse(LONG)
        view = process.views.view()
        assert (view.mode, view.reason, view.by) == (QueueMode.PAUSED, "asked", "ben")
        assert [(line.id, line.state, line.done) for line in view.waiting] == [
            (1, TaskState.PAUSED, 1),
            (2, TaskState.QUEUED, 0),
        ]
        assert "home" not in layer.controller.names()
        await process.scheduler.resume("ana")
        assert (await process.result(2)).state is TaskState.DONE
        assert layer.states(1) == ["queued", "running", "paused", "running", "done"]
        told = [(e.detail["state"], e.detail["by"]) for e in layer.told(QueueChanged)]
        assert told == [("paused", "ben"), ("running", "ana")]


async def test_a_pause_now_holds_the_motion_too() -> None:
    async with Machine().running() as layer:
        process = layer.process
        await process.submit(job(*PICK_AND_PLACE))
        await elapse(1.0)
        await process.scheduler.pause("ben", now=True)
        assert ("pause", True) in layer.controller.calls
        assert process.views.line(1).state is TaskState.PAUSED
        await process.scheduler.resume("ben")
        assert ("resume", None) in layer.controller.calls
        assert layer.states(1) == ["queued", "running", "paused", "running"]
        assert (await process.result(1)).state is TaskState.DONE


async def test_a_motion_pause_is_seen_in_the_job_and_a_job_that_ends_in_it_follows_the_table() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(job({"approach": "cube"}))
        await elapse(1.0)
        await layer.process.scheduler.pause_motion()
        assert layer.process.views.line(1).state is TaskState.PAUSED
        await layer.process.result(1)  # the fake goes on all the same
        assert layer.states(1) == ["queued", "running", "paused", "running", "done"]


async def test_one_step_at_a_time() -> None:
    async with Machine().running() as layer:
        process = layer.process
        await process.scheduler.pause("ana", now=False)
        await process.submit(job("home", *PICK_AND_PLACE))
        await process.submit(HOME)
        for done in (1, 2):
            await process.scheduler.step("ana")
            await elapse(LONG)
            assert (process.views.line(1).state, process.views.line(1).done) == (TaskState.PAUSED, done)
        await process.scheduler.step("ana")
        await elapse(LONG)
        assert process.views.line(1).state is TaskState.DONE
        assert process.views.line(2).state is TaskState.QUEUED
        await process.scheduler.step("ana")
        await elapse(LONG)
        assert process.views.line(2).state is TaskState.DONE
        await process.scheduler.step("ana")
        await process.submit(HOME)
        await elapse(LONG)
        assert process.views.line(3).state is TaskState.QUEUED


async def test_a_step_of_a_queue_that_runs_is_its_last() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(job("home", "home"))
        await elapse(1.0)
        await layer.process.scheduler.step("ana")
        await elapse(LONG)
        assert (layer.process.views.line(1).done, layer.process.views.reason) == (1, "step")


async def test_a_stepwise_job_pauses_after_every_step() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(job("home", "home"), submit_request(stepwise=True))
        await elapse(LONG)
        assert (layer.process.views.mode, layer.process.views.reason) == (QueueMode.PAUSED, "step")
        assert layer.process.views.line(1).done == 1
        await layer.process.scheduler.resume("ana")
        assert (await layer.process.result(1)).state is TaskState.DONE


async def test_command_runs_at_once_while_the_queue_is_paused() -> None:
    async with Machine().running() as layer:
        process = layer.process
        await process.scheduler.pause("ana", now=False)
        await process.submit(job(*PICK_AND_PLACE))
        report = await process.result(await process.command(Home()))
        assert report.state is TaskState.DONE
        queued = await process.command(Home(), submit_request(notes="later"))
        await elapse(LONG)
        assert process.views.line(queued).state is TaskState.QUEUED
        assert process.views.line(1).state is TaskState.QUEUED


async def test_immediate_command_does_not_survive_a_stop() -> None:
    async with Machine().running() as layer:
        process = layer.process
        await process.scheduler.pause("ana", now=False)
        await process.submit(HOME)
        first = await process.command(Home())
        second = await process.command(Home())
        await elapse(1.0)
        process.scheduler.halt(Stopped())
        await layer.controller.stop()
        assert (await process.result(first)).state is TaskState.CANCELLED
        await elapse(LONG)
        assert process.views.line(second).state is TaskState.QUEUED
        assert layer.controller.names().count("home") == 1


async def test_harmless_failure_is_retried() -> None:
    async with Machine().running() as layer:
        layer.controller.fail_at = {1: Busy(doing="x"), 2: Busy(doing="x")}
        report = await layer.process.result(await layer.process.submit(HOME, submit_request(retries=2)))
        assert report.state is TaskState.DONE
        assert layer.controller.names() == ["home"] * 3
        tried = [(e.detail.get("attempt"), e.code) for e in layer.told(StepAdvanced) if e.detail["state"] == "running"]
        assert tried == [(None, 0), (2, 2104), (3, 2104)]
        assert report.duration == pytest.approx(2 * 30.0 + 60.0 + 2 * runner.RETRY_AFTER)


async def test_a_stop_before_the_next_try_is_the_end_of_the_job() -> None:
    async with Machine().running() as layer:
        layer.controller.fail_at = {1: Busy(doing="x")}
        number = await layer.process.submit(HOME, submit_request(retries=2))
        await layer.until(1, 1)
        while not layer.controller.calls:
            await elapse(0.01)
        await elapse(30.0 + runner.RETRY_AFTER / 2)
        assert not any(event.code for event in layer.told(JobAdvanced))
        layer.process.scheduler.halt(Stopped())
        report = await layer.process.result(number)
        assert (report.state, report.code) == (TaskState.CANCELLED, Stopped.code)
        assert layer.controller.names() == ["home"]


@pytest.mark.parametrize("error", [Stopped(), PathRefused(target="y", reason="x")])
async def test_pick_is_never_retried_and_nothing_is_after_a_stop(error: Stopped | PathRefused) -> None:
    async with Machine().running() as layer:
        layer.controller.fail_at = {1: error}
        step = "home" if isinstance(error, Stopped) else {"pick": "cube"}
        report = await layer.process.result(await layer.process.submit(job(step), submit_request(retries=3)))
        assert report.code == error.code
        assert len(layer.controller.calls) == 1


@pytest.mark.parametrize(("policy", "mode"), [("continue", "running"), ("pause", "paused")])
async def test_queue_obeys_requests_after_a_refusal(policy: str, mode: str) -> None:
    async with Machine().running() as layer:
        await layer.process.scheduler.pause("ana", now=False)
        await layer.process.submit(job({"place": "tray"}), submit_request(on_failure=OnFailure(policy)))
        await layer.process.submit(HOME)
        await layer.process.scheduler.resume("ana")
        await elapse(1.0)
        assert layer.process.views.mode.value == mode
        await elapse(LONG)
        assert (layer.process.views.line(2).state is TaskState.DONE) is (mode == "running")


async def test_a_job_is_done_again_from_the_step_that_was_not_done() -> None:
    async with Machine().running() as layer:
        process = layer.process
        layer.controller.fail_at = {2: PathRefused(target="y", reason="x")}
        first = await process.submit(job("home", *PICK_AND_PLACE, "home"))
        assert [step.state.value for step in (await process.result(first)).steps] == [
            "done",
            "failed",
            "skipped",
            "skipped",
        ]
        again = await process.again(first, submit_request("ben"))
        report = await process.result(again)
        assert [step.state.value for step in report.steps] == ["skipped", "done", "done", "done"]
        assert (report.line.owner, report.state) == ("ben", TaskState.DONE)
        once_more = await process.result(await process.again(again, submit_request(), 4))
        assert [step.state.value for step in once_more.steps] == ["skipped"] * 3 + ["done"]
        with pytest.raises(InvalidValue, match="1 to 4"):
            await process.again(again, submit_request(), 5)


async def test_a_job_is_done_again_behind_the_branch_that_was_not_taken() -> None:
    steps = [{"if": {"input": 1, "is": "on"}, "then": ["home", "home"], "else": ["home", "home"]}, "home"]
    async with Machine().running() as layer:
        process, controller = layer.process, layer.controller
        controller.fail_at = {1: PathRefused(target="y", reason="x")}
        first = await process.submit(job(*steps))
        assert [step.state.value for step in (await process.result(first)).steps][1] == "failed"
        controller.fail_at = {len(controller.calls) + 3: PathRefused(target="y", reason="x")}
        again = await process.result(await process.again(first, submit_request()))
        assert [step.state.value for step in again.steps] == ["skipped", "done", "done", "skipped", "skipped", "failed"]
        last = await process.result(await process.again(again.id, submit_request()))
        assert [step.state.value for step in last.steps] == ["skipped"] * 5 + ["done"]


async def test_a_job_is_done_again_from_the_first_step_of_the_taken_branch_that_was_not_done() -> None:
    steps = [{"if": {"input": 1, "is": "on"}, "then": ["home"] * 3, "else": ["home"] * 2}, "home"]
    async with Machine().running() as layer:
        process = layer.process
        first = await process.submit(job(*steps))
        await layer.until(first, 2)
        await process.scheduler.pause("ana", now=False)
        await elapse(LONG)
        await process.cancel(first)
        states = [step.state.value for step in (await process.views.report(first)).steps]
        assert states == ["done", "done"] + ["skipped"] * 5
        await process.scheduler.resume("ana")
        again = await process.result(await process.again(first, submit_request()))
        states = [step.state.value for step in again.steps]
        assert states == ["skipped"] * 2 + ["done"] * 2 + ["skipped"] * 2 + ["done"]


async def test_a_repetition_that_its_check_refuses_is_continued_at_the_same_step() -> None:
    machine = Machine()
    async with machine.running() as layer:
        layer.controller.fail_at = {3: PathRefused(target="y", reason="x")}
        ways = [{"approach": [x, 1.6 - x, 0.8]} for x in (0.5, 1.1, 0.5)]
        first = await layer.process.submit(job("home", *ways))
        assert (await layer.process.result(first)).next_step == 3
    machine.homed = False
    async with machine.running() as layer:
        process = layer.process
        assert (await process.views.report(first)).next_step == 3
        refused = await process.result(await process.again(first, submit_request()))
        assert [step.state.value for step in refused.steps] == ["skipped", "skipped", "failed", "skipped"]
        assert (refused.next_step, refused.steps[2].duration) == (3, None)
        await process.result(await process.submit(HOME))
        last = await process.result(await process.again(refused.id, submit_request()))
        assert [step.state.value for step in last.steps] == ["skipped", "skipped", "done", "done"]
        assert last.next_step is None


async def test_unfinished_job_cannot_be_run_again() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(HOME, submit_request(held=True))
        with pytest.raises(WrongState, match="held"):
            await layer.process.again(1, submit_request())


async def test_the_same_key_runs_a_job_again_once() -> None:
    async with Machine().running() as layer:
        process = layer.process
        first = await process.submit(job("home", *PICK_AND_PLACE))
        await process.result(first)
        assert [await process.again(first, submit_request(key="k"), 2) for _ in range(2)] == [2, 2]
        assert await process.again(first, submit_request("ben", key="k"), 2) == 3
        with pytest.raises(KeyReused):
            await process.again(first, submit_request(key="k"), 3)
        with pytest.raises(KeyReused):
            await process.again(first, submit_request(key="k"), 1)


async def test_a_job_is_changed_while_it_waits() -> None:
    async with Machine().running() as layer:
        process = layer.process
        await process.submit(HOME)
        await process.submit(HOME)
        await process.submit(HOME)
        changes = {"priority": 3, "notes": "first", "job": {"name": "two", "steps": ["home", "home"]}}
        await process.change(3, changes)
        line = process.views.line(3)
        assert (line.position, line.notes, line.name, line.steps) == (1, "first", "two", 2)
        with pytest.raises(WrongState, match="running"):
            await process.change(1, {"notes": "late"})
        with pytest.raises(InvalidRequest, match="held"):
            await process.change(2, {"held": True})
        with pytest.raises(InvalidJob):
            await process.change(2, {"job": {"steps": []}})
        assert await order_of(layer) == [1, 3, 2]
        assert (await process.views.report(3)).line.done == 2


async def test_waiting_steps_of_a_paused_job_are_replaced() -> None:
    async with Machine().running() as layer:
        process = layer.process
        steps = ["home", {"gripper": "open"}, "home"]
        await process.submit(job(*steps), submit_request(stepwise=True))
        await elapse(LONG)
        with pytest.raises(InvalidJob, match="steps up to 1 have begun"):
            await process.change(1, {"job": {"steps": [{"gripper": "open"}, "home"]}})
        await process.change(1, {"job": {"steps": ["home", {"gripper": "close"}]}, "stepwise": False})
        await process.scheduler.resume("ana")
        report = await process.result(1)
        assert [(step.step, step.state.value) for step in report.steps] == [("home", "done"), ("gripper close", "done")]


async def test_the_same_key_is_the_same_job() -> None:
    async with Machine().running() as layer:
        process = layer.process
        same = [await process.submit(HOME, submit_request(key="k")) for _ in range(3)]
        at_once = await asyncio.gather(*(process.submit(HOME, submit_request(key="l")) for _ in range(3)))
        assert (same, at_once) == ([1, 1, 1], [2, 2, 2])
        assert await process.submit(HOME, submit_request("ben", key="k")) == 3
        with pytest.raises(KeyReused):
            await process.submit(HOME, submit_request(key="k", priority=1))
        with pytest.raises(KeyReused):
            await process.submit(job("home", "home"), submit_request(key="k"))


async def test_only_a_caller_with_the_lease_may_begin() -> None:
    async with Machine().running() as layer:
        held = layer.lease.take("ben", "test", patience=1e5)
        await layer.process.submit(HOME, submit_request("ana"))
        await layer.process.submit(HOME, submit_request("ben"))
        assert await order_of(layer) == [2]
        layer.lease.release(held.id, "ben")
        assert await order_of(layer) == [2, 1]


async def test_owner_drives_while_his_job_runs_until_it_is_taken_over() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(job("home", "home"), submit_request("ana"))
        await layer.process.submit(HOME, submit_request("ana"))
        await elapse(1.0)
        holder = layer.lease.holder
        assert holder is not None
        assert (holder.name, holder.implicit) == ("ana", True)
        layer.lease.take("eva", "test", patience=1e5)
        assert (await layer.process.result(1)).state is TaskState.DONE
        await elapse(LONG)
        assert layer.process.views.line(2).state is TaskState.QUEUED


async def test_half_done_job_continues_under_another_driver() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(job("home", "home"), submit_request("ana", stepwise=True))
        await layer.process.submit(HOME, submit_request("eva"))
        await elapse(LONG)
        layer.lease.take("eva", "test", patience=1e5)
        await layer.process.scheduler.resume("eva")
        assert await order_of(layer) == [1, 1]
        assert layer.process.views.reason == "step"
        await layer.process.scheduler.resume("eva")
        assert await order_of(layer) == [1, 1, 2]


async def test_a_lost_driver_pauses_the_queue_after_the_step() -> None:
    async with Machine().running() as layer:
        layer.lease.take("ana", "test", patience=10.0)
        await layer.process.submit(job("home", "home"))
        await layer.process.submit(HOME)
        await layer.process.change(2, {"notes": "waits"})
        await elapse(LONG)
        assert (layer.process.views.mode, layer.process.views.reason) == (QueueMode.PAUSED, "driver")


async def test_clear_cancels_all_that_waits() -> None:
    async with Machine().running() as layer:
        process = layer.process
        for held in (False, False, True):
            await process.submit(HOME, submit_request(held=held))
        await process.clear()
        assert [line.state.value for line in process.views.lines()] == ["running", "cancelled", "cancelled"]
        assert (await process.result(1)).state is TaskState.DONE


async def test_automatic_pause_ends_with_its_cause() -> None:
    async with Machine().running() as layer:
        process = layer.process
        await process.submit(HOME)
        await process.submit(HOME)
        await elapse(1.0)
        process.scheduler.halt(Stopped())
        await layer.controller.stop()
        await process.result(1)
        assert process.views.mode is QueueMode.PAUSED
        await process.cancel(2)
        assert process.views.mode is QueueMode.RUNNING
        await process.scheduler.pause("ana", now=False)
        await process.submit(HOME)
        await process.clear()
        assert process.views.mode is QueueMode.PAUSED


async def test_pause_of_a_user_during_an_automatic_one_lasts_until_resume() -> None:
    async with Machine().running() as layer:
        process = layer.process
        await process.submit(HOME)
        await process.submit(HOME)
        process.scheduler.halt(Stopped())
        await process.result(1)
        assert process.views.reason == "stop"
        await process.scheduler.pause("ana", now=False)
        await process.clear()
        assert (process.views.mode, process.views.reason) == (QueueMode.PAUSED, "asked")
        process.scheduler.pause_by_itself(PauseReason.FAULT)
        assert process.views.reason == "asked"


async def test_request_before_a_stop_does_not_begin_after_it() -> None:
    machine = Machine()
    async with machine.running() as layer:
        machine.journal.slow = 5.0
        submitting = asyncio.create_task(layer.process.submit(HOME))
        await elapse(1.0)
        layer.process.scheduler.halt(Stopped())
        assert await submitting == 1
        await elapse(LONG)
        assert (layer.process.views.line(1).state, layer.process.views.reason) == (TaskState.QUEUED, "stop")


@pytest.mark.parametrize("command", ["hold", "clear", "cancel", "pause"])
async def test_request_while_a_job_is_about_to_begin_is_obeyed(command: str) -> None:
    """The journal is slow: another change is being written, and both the beginning and the request wait behind it."""
    machine = Machine()
    async with machine.running() as layer:
        process = layer.process
        await process.submit(HOME, submit_request(held=True))
        await process.submit(HOME, submit_request(held=True))
        machine.journal.slow = 5.0
        first = asyncio.create_task(process.change(2, {"notes": "slow"}))
        await elapse(1.0)
        releasing = asyncio.create_task(process.release(1, "ana"))
        await elapse(1.0)
        commands = {
            "hold": lambda: process.hold(1),
            "clear": process.clear,
            "cancel": lambda: process.cancel(1),
            "pause": lambda: process.scheduler.pause("ana", now=False),
        }
        await commands[command]()
        await asyncio.gather(first, releasing)
        await elapse(LONG)
        state = process.views.line(1).state
        assert state in {"hold": [TaskState.HELD], "pause": [TaskState.QUEUED]}.get(command, [TaskState.CANCELLED])
        assert layer.controller.calls == []


async def test_job_held_between_selection_and_start_does_not_begin() -> None:
    machine = Machine()
    async with machine.running() as layer:
        process = layer.process
        await process.scheduler.pause("ana", now=False)
        await process.submit(HOME)
        await process.submit(HOME)
        machine.journal.slow = 5.0
        resuming = asyncio.create_task(process.scheduler.resume("ana"))
        await elapse(1.0)
        holding = asyncio.create_task(process.hold(1))
        await asyncio.gather(resuming, holding)
        await elapse(LONG)
        assert [line.state for line in process.views.lines()] == [TaskState.HELD, TaskState.DONE]
        assert layer.states(1)[-1] == "held"


async def test_job_is_submitted_when_its_caller_leaves_during_the_write() -> None:
    machine = Machine()
    async with machine.running() as layer:
        machine.journal.slow = 5.0
        submitting = asyncio.create_task(layer.process.submit(HOME))
        await elapse(1.0)
        submitting.cancel()
        await elapse(LONG)
        assert layer.process.views.line(1).state is TaskState.DONE


async def test_end_of_the_queue_is_predicted_from_the_end_of_each_job() -> None:
    async with Machine().running() as layer:
        process = layer.process
        for _ in range(3):
            await process.submit(job(*PICK_AND_PLACE, {"approach": "cube"}))
        await elapse(5.0)
        view = process.views.view()
        assert view.running is not None
        etas = [line.eta for line in (view.running, *view.waiting)]
        report = [await process.result(number) for number in (1, 2, 3)]
        took = [one.duration or 0.0 for one in report]
        assert etas == pytest.approx([took[0] - 5.0, sum(took[:2]) - 5.0, sum(took) - 5.0])
        assert view.finish_at == f"{sum(took):.3f}"


async def test_paused_queue_has_no_predicted_end() -> None:
    async with Machine().running() as layer:
        await layer.process.scheduler.pause("ana", now=False)
        await layer.process.submit(job(*PICK_AND_PLACE))
        await elapse(1.0)
        view = layer.process.views.view()
        assert (view.finish_at, view.waiting[0].eta) == (None, None)
        assert view.waiting[0].predicted is not None


async def test_command_keeps_its_text() -> None:
    async with Machine().running() as layer:
        number = await layer.process.command(Gripper(True), submit_request(held=True))
        assert await layer.process.views.body(number) == {"wish": {"command": "gripper", "open": True}}
        await layer.process.submit(HOME, submit_request(held=True))
        assert await layer.process.views.body(2) == {
            "name": "home",
            "parts": {"cube": [0.5, 1.1]},
            "places": {"tray": [1.1, 0.5]},
            "steps": [{"home": True}],
            "repeat": 1,
        }
