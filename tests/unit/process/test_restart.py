"""After the program was killed or ended: interrupted work is shown, and nothing moves before a person has chosen."""

from __future__ import annotations

import pytest

from maya_un.errors import (
    AnswerNeeded,
    GripperEmpty,
    GripperNotEmpty,
    InvalidValue,
    NotFound,
    NotHomed,
    WorkerFailed,
    WrongState,
)
from maya_un.process.computation import JobComputer
from maya_un.robot.primitives import Home
from maya_un.schema.jobs import QueueMode, TaskState
from tests.queues import PICK_AND_PLACE, Machine, QueueBench, job, submit_request
from tests.virtual_time import elapse

HOME = job("home", name="home")
LONG = 1000.0


async def killed_at(step: int, after: float = 0.1, *, machine: Machine | None = None) -> Machine:
    """Return a machine whose program was killed in a step of the first of two jobs."""
    machine = machine or Machine()
    layer = await machine.started()
    await layer.process.submit(job(*PICK_AND_PLACE, {"approach": "cube"}))
    await layer.process.submit(HOME)
    await layer.until(1, step)
    await elapse(after)
    await machine.kill(layer)
    return machine


async def test_nothing_moves_after_a_restart() -> None:
    machine = await killed_at(1)
    async with machine.running() as layer:
        await elapse(LONG)
        assert layer.controller.calls == []
        view = layer.process.views.view()
        assert (view.mode, view.reason) == (QueueMode.PAUSED, "restart")
        assert [(line.id, line.state) for line in view.waiting] == [
            (1, TaskState.INTERRUPTED),
            (2, TaskState.QUEUED),
        ]
        assert view.recovery is not None
        assert (view.recovery.job, view.recovery.index, view.recovery.step) == (1, 1, "pick cube")
        assert view.recovery.state == layer.controller.state
        report = await layer.process.views.report(1)
        assert [step.state.value for step in report.steps] == ["interrupted", "queued", "queued"]


async def test_finished_steps_are_known_without_a_worker_too(monkeypatch: pytest.MonkeyPatch) -> None:
    async def failed(*_: object, **__: object) -> None:
        raise WorkerFailed(reason="no memory")

    machine = await killed_at(2)
    monkeypatch.setattr(JobComputer, "expanded", failed)
    async with machine.running() as layer:
        monkeypatch.undo()
        report = await layer.process.views.report(1)
        assert [step.state.value for step in report.steps] == ["done", "interrupted", "queued"]


async def test_the_phase_that_was_under_way_is_known() -> None:
    machine = await killed_at(1, after=10.0)
    async with machine.running() as layer:
        recovery = layer.process.views.view().recovery
        assert recovery is not None
        assert recovery.phase in {"approach", "down"}


async def test_a_queue_in_which_a_restart_left_something_is_not_resumed_unasked() -> None:
    machine = await killed_at(1)
    async with machine.running() as layer:
        for command in (layer.process.scheduler.resume, layer.process.scheduler.step):
            with pytest.raises(AnswerNeeded, match="What should happen to the interrupted job"):
                await command("ana")
        await elapse(LONG)
        assert layer.controller.calls == []


async def recover(
    layer: QueueBench, choice: str, *, holding: bool | None = None, resume_queue: bool = True
) -> list[str]:
    """Choose, let everything run, and return the states of the first job's steps."""
    await layer.process.recover(choice, holding, resume_queue=resume_queue, by="ana")
    await elapse(LONG)
    return [step.state.value for step in (await layer.process.views.report(1)).steps]


async def test_a_decision_about_another_job_is_refused() -> None:
    machine = await killed_at(1)
    async with machine.running() as layer:
        with pytest.raises(NotFound, match="interrupted job 2"):
            await layer.process.recover("abort", None, resume_queue=False, by="ana", job=2)
        assert layer.process.views.view().recovery is not None
        await layer.process.recover("abort", None, resume_queue=False, by="ana", job=1)
        assert layer.process.views.view().recovery is None


@pytest.mark.parametrize("choice", ["resume", "redo"])
async def test_a_pick_that_did_not_take_the_part_is_done_again(choice: str) -> None:
    machine = await killed_at(1)
    async with machine.running() as layer:
        assert await recover(layer, choice) == ["done"] * 3
        assert layer.process.views.line(2).state is TaskState.DONE
        assert layer.states(1) == ["interrupted", "queued", "running", "done"]


async def test_pick_whose_part_is_in_the_gripper_counts_as_done() -> None:
    machine = await killed_at(1)
    machine.closed = True
    async with machine.running() as layer:
        recovery = layer.process.views.view().recovery
        assert recovery is not None
        assert recovery.holding is None
        with pytest.raises(AnswerNeeded):
            await recover(layer, "resume")
        assert await recover(layer, "resume", holding=True) == ["done"] * 3
        assert layer.controller.names()[:2] == ["follow", "gripper"]


async def test_a_closed_gripper_that_a_person_sees_empty_is_opened_for_the_pick() -> None:
    machine = await killed_at(1)
    machine.closed = True
    async with machine.running() as layer:
        assert await recover(layer, "resume", holding=False) == ["done"] * 3
        assert layer.controller.calls[0] == ("gripper", True)


async def test_redoing_a_pick_with_the_part_in_the_gripper_is_refused_and_still_asked() -> None:
    machine = await killed_at(1)
    machine.closed = True
    async with machine.running() as layer:
        with pytest.raises(GripperNotEmpty):
            await recover(layer, "redo", holding=True)
        assert layer.process.views.view().recovery is not None
        assert layer.controller.calls == []


async def test_place_is_never_assumed_done_silently() -> None:
    machine = await killed_at(2)
    machine.closed = False
    async with machine.running() as layer:
        with pytest.raises(AnswerNeeded):
            await recover(layer, "resume")
        with pytest.raises(GripperEmpty):
            await recover(layer, "redo")
        with pytest.raises(InvalidValue, match="open"):
            await recover(layer, "redo", holding=True)
        assert await recover(layer, "resume", holding=False) == ["done"] * 3
        assert layer.controller.names() == ["follow", "home"]


async def test_a_place_with_the_part_still_in_the_gripper_is_done_again() -> None:
    machine = await killed_at(2)
    async with machine.running() as layer:
        assert layer.controller.state.gripper_closed
        assert await recover(layer, "resume", holding=True) == ["done"] * 3


async def test_a_step_is_left_out() -> None:
    machine = await killed_at(2)
    machine.closed = False
    async with machine.running() as layer:
        assert await recover(layer, "skip") == ["done", "skipped", "done"]
        assert (await layer.process.views.report(1)).parts == {"cube": None}


async def test_an_aborted_job_lets_the_queue_wait() -> None:
    machine = await killed_at(2)
    async with machine.running() as layer:
        assert await recover(layer, "abort") == ["done", "cancelled", "skipped"]
        assert layer.process.views.line(1).state is TaskState.CANCELLED
        assert layer.process.views.line(2).state is TaskState.QUEUED
        assert layer.process.views.mode is QueueMode.PAUSED
        with pytest.raises(NotFound):
            await recover(layer, "abort")


async def test_a_choice_without_going_on_leaves_the_queue_paused() -> None:
    machine = await killed_at(1)
    async with machine.running() as layer:
        assert await recover(layer, "redo", resume_queue=False) == ["queued"] * 3
        assert [line.id for line in layer.process.views.view().waiting] == [1, 2]
        await layer.process.scheduler.resume("ana")
        await elapse(LONG)
        assert layer.process.views.line(1).state is TaskState.DONE


async def test_robot_that_is_not_homed_is_homed_first_by_a_command() -> None:
    machine = await killed_at(1)
    machine.homed = False
    async with machine.running() as layer:
        with pytest.raises(NotHomed):
            await recover(layer, "redo")
        assert (await layer.process.result(await layer.process.command(Home()))).state is TaskState.DONE
        assert await recover(layer, "redo") == ["done"] * 3


async def test_paused_queue_keeps_its_own_reason() -> None:
    machine = Machine()
    async with machine.running() as layer:
        await layer.process.scheduler.pause("ben", now=False)
        await layer.process.submit(HOME)
    async with machine.running() as layer:
        await elapse(LONG)
        view = layer.process.views.view()
        assert (view.mode, view.reason, view.by) == (QueueMode.PAUSED, "asked", "ben")
        assert view.recovery is None


async def test_an_empty_queue_runs_after_a_restart() -> None:
    machine = Machine()
    async with machine.running() as layer:
        await layer.process.result(await layer.process.submit(HOME))
    async with machine.running() as layer:
        assert layer.process.views.mode is QueueMode.RUNNING
        assert await layer.process.submit(HOME) == 2
        assert (await layer.process.views.report(1)).state is TaskState.DONE
        assert [step.step for step in (await layer.process.views.report(1)).steps] == ["home"]


async def test_shutdown_interrupts_the_job_and_keeps_waiting_ones() -> None:
    machine = Machine()
    layer = await machine.started()
    await layer.process.submit(job("home", "home"))
    await layer.process.submit(HOME)
    await elapse(1.0)
    await layer.process.close()
    layer.lease.close()
    assert layer.controller.names() == ["home", "at rest"]
    assert [line.state.value for line in layer.process.views.lines()] == ["interrupted", "queued"]
    async with machine.running() as again:
        recovery = again.process.views.view().recovery
        assert recovery is not None
        assert (recovery.job, recovery.index) == (1, 1)


async def test_ending_the_program_after_the_step() -> None:
    machine = Machine()
    layer = await machine.started()
    await layer.process.submit(job("home", "home"))
    await elapse(1.0)
    await layer.process.close(finish=True)
    layer.lease.close()
    assert layer.controller.names() == ["home"]
    async with machine.running() as again:
        recovery = again.process.views.view().recovery
        assert recovery is not None
        assert (recovery.index, [choice.name for choice in recovery.choices]) == (0, ["resume", "abort"])
        assert await recover(again, "resume") == ["done", "done"]
        assert again.controller.names() == ["home"]


async def test_a_step_that_is_held_is_not_waited_for_at_the_end() -> None:
    machine = Machine()
    layer = await machine.started()
    await layer.process.submit(job({"approach": "cube"}))
    await elapse(1.0)
    await layer.process.scheduler.pause("ana", now=True)
    await layer.process.close(finish=True)
    layer.lease.close()
    assert layer.controller.names()[-1] == "at rest"
    assert layer.process.views.line(1).state is TaskState.INTERRUPTED


async def test_waiters_are_notified_when_the_program_ends() -> None:
    machine = Machine()
    async with machine.running() as layer:
        number = await layer.process.submit(HOME, submit_request(held=True))
        waiting = layer.process.result(number)
        await layer.process.close()
        assert (await waiting).state is TaskState.HELD


async def test_dependencies_and_holds_outlive_a_restart() -> None:
    machine = Machine()
    async with machine.running() as layer:
        await layer.process.scheduler.pause("ana", now=False)
        await layer.process.submit(HOME, submit_request(held=True))
        await layer.process.submit(HOME, submit_request(depends_on=(1,)))
        await layer.process.submit(HOME, submit_request(priority=7))
        await layer.process.hold(2)
    async with machine.running() as layer:
        await layer.process.scheduler.resume("ana")
        await layer.process.release(2, "ana")
        await elapse(LONG)
        assert [line.state.value for line in layer.process.views.lines()] == ["held", "queued", "done"]
        await layer.process.release(1, "ana")
        await elapse(LONG)
        assert [line.state.value for line in layer.process.views.lines()] == ["done"] * 3


async def test_two_jobs_may_wait_for_a_person_one_after_the_other() -> None:
    machine = Machine()
    layer = await machine.started()
    await layer.process.submit(job("home", "home"), submit_request(stepwise=True))
    await elapse(LONG)
    await layer.process.command(Home())
    await elapse(1.0)
    await machine.kill(layer)
    async with machine.running() as again:
        first = again.process.views.view().recovery
        assert first is not None
        await again.process.recover("resume", None, resume_queue=True, by="ana")
        second = again.process.views.view().recovery
        assert second is not None
        assert [(one.job, one.index) for one in (first, second)] == [(1, 0), (2, 1)]
        assert again.process.views.mode is QueueMode.PAUSED
        await again.process.recover("redo", None, resume_queue=True, by="ana")
        await elapse(LONG)
        await again.process.scheduler.resume("ana")  # the first pauses after its step
        await elapse(LONG)
        assert [line.state.value for line in again.process.views.lines()] == ["done", "done"]


async def test_an_interrupted_job_cannot_be_moved_but_cancelled() -> None:
    machine = await killed_at(2)
    async with machine.running() as layer:
        with pytest.raises(WrongState):
            await layer.process.move_to(1, last=True)
        report = await layer.process.cancel(1)
        assert [step.state.value for step in report.steps] == ["done", "cancelled", "skipped"]
        assert layer.process.views.view().recovery is None


async def test_the_rest_of_an_interrupted_job_is_replaced() -> None:
    machine = await killed_at(1)
    async with machine.running() as layer:
        await layer.process.change(1, {"job": {"parts": {"cube": [0.5, 1.1]}, "steps": [{"pick": "cube"}, "home"]}})
        assert await recover(layer, "redo") == ["done", "done"]
