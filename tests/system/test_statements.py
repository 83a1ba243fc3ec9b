"""The statements of jobs on the twin, in virtual time, through the service: waits, speeds, channels, questions."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from maya_un.assembly.stack import Stack, stack
from maya_un.config import Config
from maya_un.errors import AnswerNeeded, InvalidJob, InvalidValue, NotFound
from maya_un.events import InputAwaited, OutputCleared, OutputSet, QuestionAnswered, StepAdvanced
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.schema.jobs import JobReport, TaskState
from maya_un.values import Mode, Point
from tests.virtual_time import elapse

CHANNELS = Config.model_validate(
    {
        "controller": {
            "outputs": [3, 5],
            "output_names": ["", "", "vacuum", "", "lamp"],
            "input_names": ["", "", "part"],
        }
    }
)
CUBE = Point(0.50, 1.10, 0.40)
LINE = [0.45, 1.05, 0.70]
PART = 3


@asynccontextmanager
async def robot(*, live: bool = False, journal: SqliteJournal | None = None) -> AsyncIterator[Stack]:
    """Run a stack on the twin with two outputs for jobs and names for channels."""
    async with stack(CHANNELS, parts={"cube": CUBE}, live=live, journal=journal) as running:
        yield running


async def begun(running: Stack, step: int, job: int = 1) -> None:
    """Wait until a step runs."""
    async for event in running.controller.events.follow():
        if isinstance(event, StepAdvanced) and (event.job, event.index, event.state) == (job, step, "running"):
            return


async def submitted(running: Stack, *steps: Any, **more: Any) -> int:
    """Submit a job."""
    return (await running.service.submit({"steps": list(steps), **more})).id


async def done(running: Stack, *steps: Any, **more: Any) -> JobReport:
    """Run a job to its end."""
    return await running.service.wait(await submitted(running, *steps, **more))


def switch_input(running: Stack, *, on: bool) -> None:
    """Set the level of the input of the tests on the twin."""
    assert running.twin is not None
    running.twin.controller.machine.unit.inputs[PART - 1] = on
    running.twin.controller.machine.look()


def outputs(running: Stack) -> list[tuple[int, bool]]:
    """Return the switched outputs so far."""
    events = running.controller.events.since(0)
    return [
        (event.number, isinstance(event, OutputSet)) for event in events if isinstance(event, OutputSet | OutputCleared)
    ]


def states(report: JobReport) -> list[str]:
    """Return the states of the steps."""
    return [step.state.value for step in report.steps]


async def test_wait_takes_its_time_and_counts_in_the_prediction() -> None:
    async with robot() as running:
        report = await done(running, {"wait": "1.5 min"}, {"wait": 2})
        assert report.state is TaskState.DONE
        assert [step.step for step in report.steps] == ["wait 90 s", "wait 2 s"]
        assert report.predicted == pytest.approx(92.0)
        assert report.duration == pytest.approx(92.0, abs=0.1)


async def test_stop_ends_a_wait_at_once_and_the_job_with_it() -> None:
    async with robot() as running:
        job = await submitted(running, {"wait": "1 h"}, {"set": {"output": "vacuum", "to": True}})
        await begun(running, 1)
        await elapse(5.0)
        await running.service.stop()
        report = await running.service.wait(job)
        assert (report.state, report.code) == (TaskState.CANCELLED, 2201)
        assert report.duration == pytest.approx(5.0, abs=0.2)
        assert states(report) == ["cancelled", "skipped"]
        assert outputs(running) == []


async def test_stop_of_the_controller_alone_ends_a_wait() -> None:
    async with robot() as running:
        job = await submitted(running, {"wait": "1 h"})
        await begun(running, 1)
        await running.controller.stop()
        assert (await running.service.wait(job)).code == 2201


async def test_a_stop_names_the_job_that_it_ends() -> None:
    async with robot() as running:
        assert (await running.service.stop()).job is None
        job = await submitted(running, {"ask": "Ready?"})
        await begun(running, 1)
        report = await running.service.stop()
        assert (report.was_moving, report.job) == (False, job)
        assert (await running.service.wait(job)).code == 2201


@pytest.mark.parametrize("statement", [{"wait": "1 h"}, {"wait_for": {"input": PART, "is": "off"}}, {"ask": "Ready?"}])
async def test_cancel_ends_every_wait_at_once(statement: dict[str, Any]) -> None:
    async with robot() as running:
        job = await submitted(running, statement)
        await begun(running, 1)
        await elapse(3.0)
        report = await running.service.cancel(job)
        assert report.state is TaskState.CANCELLED
        assert report.duration == pytest.approx(3.0, abs=0.2)
        assert running.service.queue.view().question is None


async def test_a_fault_ends_a_wait_and_pauses_the_queue() -> None:
    async with robot(live=True) as running:
        job = await submitted(running, {"wait": "1 h"})
        await submitted(running, {"wait": 1})
        await begun(running, 1, job)
        assert running.twin is not None
        running.twin.faults.inject("abort_input", {}, None)
        report = await running.service.wait(job)
        assert report.state is TaskState.FAILED
        assert running.service.queue.view().reason == "fault"


@pytest.mark.parametrize(("live", "whole"), [(True, True), (False, True), (False, False)])
async def test_a_pause_holds_the_clock_of_a_wait(*, live: bool, whole: bool) -> None:
    async with robot(live=live) as running:
        job = await submitted(running, {"wait": 3}, {"set": {"output": 3, "to": "on"}})
        await begun(running, 1)
        await elapse(1.0)
        await (running.service.queue.pause(when="now") if whole else running.service.pause())
        await elapse(5.0)
        assert outputs(running) == []
        assert running.service.queue.view().running is not None
        await (running.service.queue.resume() if whole else running.service.resume())
        report = await running.service.wait(job)
        assert report.state is TaskState.DONE
        assert report.steps[0].duration == pytest.approx(8.0, abs=0.3)


async def test_the_queue_pauses_after_a_wait_and_goes_step_by_step() -> None:
    async with robot() as running:
        job = await submitted(running, {"wait": 10}, {"wait": 10}, {"wait": 10})
        await begun(running, 1)
        await running.service.queue.pause()
        await elapse(100.0)
        assert states(await running.service.job(job)) == ["done", "queued", "queued"]
        await running.service.queue.step()
        await elapse(100.0)
        assert states(await running.service.job(job)) == ["done", "done", "queued"]
        await running.service.queue.resume()
        assert states(await running.service.wait(job)) == ["done"] * 3


async def test_again_from_a_step_skips_the_wait_before() -> None:
    async with robot() as running:
        await done(running, {"wait": 10}, {"wait": 20})
        again = await running.service.queue.again(1, from_step=2)
        report = await running.service.wait(again.id)
        assert states(report) == ["skipped", "done"]
        assert report.duration == pytest.approx(20.0, abs=0.1)


async def test_a_restart_interrupts_a_wait_and_moves_nothing(tmp_path: Path) -> None:
    journal = await SqliteJournal.open(tmp_path / "maya.db")
    async with robot(journal=journal) as running:
        await submitted(running, {"wait": 100}, {"set": {"output": "lamp", "to": "on"}})
        await begun(running, 1)
        await elapse(30.0)
    await journal.close()
    journal = await SqliteJournal.open(tmp_path / "maya.db")
    async with robot(journal=journal) as running:
        await elapse(1000.0)
        recovery = running.service.queue.view().recovery
        assert recovery is not None
        assert (recovery.index, recovery.step) == (1, "wait 100 s")
        assert not any(choice.needs_answer for choice in recovery.choices)
        assert outputs(running) == []
        await running.service.queue.recover("resume")
        report = await running.service.wait(1)
        assert states(report) == ["done", "done"]
        assert report.steps[0].duration == pytest.approx(130.0, abs=0.5)
        assert outputs(running) == [(5, True)]
    await journal.close()


async def test_speed_of_a_step_slows_this_step_alone_as_predicted() -> None:
    async with robot() as running:
        await done(running, "home")
        report = await done(
            running,
            {"approach": LINE},
            {"approach": list(CUBE), "speed": "25 %"},
            {"approach": LINE},
            {"approach": list(CUBE)},
        )
        assert report.state is TaskState.DONE
        slow, fast = report.steps[1], report.steps[3]
        assert slow.step.endswith("at 25%")
        assert slow.duration is not None and fast.duration is not None
        assert slow.duration > 1.5 * fast.duration
        for step in report.steps:
            assert step.duration == pytest.approx(step.predicted, abs=0.3)


async def test_speed_of_a_step_multiplies_with_the_override_and_ends_with_a_stop() -> None:
    async with robot() as running:
        await done(running, "home")
        await done(running, {"approach": LINE})
        await running.service.speed(0.5)
        report = await done(running, {"approach": list(CUBE), "speed": 0.5}, {"approach": LINE})
        slow = report.steps[0]
        assert slow.predicted is not None and slow.duration is not None
        assert slow.duration > 1.6 * slow.predicted
        job = await submitted(running, {"approach": list(CUBE), "speed": 0.1})
        await begun(running, 1, job)
        await elapse(2.0)
        await running.service.stop()
        await running.service.wait(job)
        assert running.controller.state.override == 0.5
        await running.service.speed(1.0)
        report = await done(running, {"approach": LINE})
        assert report.steps[0].duration == pytest.approx(report.steps[0].predicted, abs=0.3)


async def test_set_switches_only_configured_outputs_by_number_and_by_name() -> None:
    async with robot() as running:
        report = await done(
            running,
            {"set": {"output": "vacuum", "to": "on"}},
            {"set": {"output": 5, "to": True}},
            {"set": {"output": "vacuum", "to": "off"}},
        )
        assert report.state is TaskState.DONE
        assert outputs(running) == [(3, True), (5, True), (3, False)]
        signals = running.controller.signals()
        assert signals is not None
        assert (signals.outputs[2], signals.outputs[4]) == (False, True)


@pytest.mark.parametrize(
    ("step", "key"),
    [
        ({"set": {"output": 2, "to": "on"}}, "steps.1.set.output"),
        ({"set": {"output": "pump", "to": "on"}}, "steps.1.set.output"),
        ({"wait_for": {"input": "pump", "is": "on"}}, "steps.1.wait_for.input"),
    ],
)
async def test_a_job_with_an_unknown_channel_is_refused_on_submission(step: dict[str, Any], key: str) -> None:
    async with robot() as running:
        with pytest.raises(InvalidJob) as refused:
            await submitted(running, {"wait": 1}, step)
        assert refused.value.details["key"] == key
        assert running.service.queue.view().running is None


@pytest.mark.parametrize("live", [True, False])
async def test_wait_for_goes_on_when_the_input_changes(*, live: bool) -> None:
    async with robot(live=live) as running:
        switch_input(running, on=False)
        await elapse(1.0)
        job = await submitted(running, {"wait_for": {"input": "part", "is": "on", "within": "1 min"}})
        await begun(running, 1)
        await elapse(7.0)
        switch_input(running, on=True)
        report = await running.service.wait(job)
        assert report.state is TaskState.DONE
        assert report.duration == pytest.approx(7.0, abs=0.2)
        waits = [event for event in running.controller.events.since(0) if isinstance(event, InputAwaited)]
        assert [(event.input, event.state) for event in waits] == [(PART, "on")]
        assert report.remarks == ("step 1: the wait for input part counts as no time",)


async def test_wait_for_fails_when_its_time_is_over_and_a_pause_does_not_count() -> None:
    async with robot() as running:
        job = await submitted(
            running, {"wait_for": {"input": PART, "is": False, "within": 20}}, {"set": {"output": 3, "to": "on"}}
        )
        await begun(running, 1)
        await elapse(10.0)
        await running.service.queue.pause(when="now")
        switch_input(running, on=False)
        await elapse(30.0)
        switch_input(running, on=True)
        assert running.controller.state.mode is Mode.PAUSED
        await elapse(30.0)
        await running.service.queue.resume()
        report = await running.service.wait(job)
        assert (report.state, report.code) == (TaskState.FAILED, 4024)
        assert report.duration == pytest.approx(80.0, abs=0.3)
        assert outputs(running) == []


async def test_the_error_of_an_input_names_it_as_the_job_does() -> None:
    async with robot() as running:
        by_name = await done(running, {"wait_for": {"input": "part", "is": "off", "within": 10}})
        assert by_name.message.startswith("Input part (3) was not off within 10.0 s.")
        by_number = await done(running, {"wait_for": {"input": PART, "is": "off", "within": 10}})
        assert by_number.message.startswith("Input 3 was not off within 10.0 s.")


async def test_a_failed_wait_for_an_input_is_repeated_by_retries() -> None:
    async with robot() as running:
        from maya_un.process.journal.protocol import JobOptions

        job = await running.service.submit(
            {"steps": [{"wait_for": {"input": PART, "is": "off", "within": 10}}]}, options=JobOptions(retries=1)
        )
        await begun(running, 1, job.id)
        await elapse(15.0)
        switch_input(running, on=False)
        assert (await running.service.wait(job.id)).state is TaskState.DONE


async def test_a_question_is_shown_answered_and_stored() -> None:
    async with robot() as running:
        job = await submitted(
            running, {"ask": {"question": "Is the tray full?", "choices": ["yes", "no"]}}, {"wait": 1}
        )
        await begun(running, 1)
        await elapse(50.0)
        question = running.service.queue.view().question
        assert question is not None
        assert (await running.service.status()).question == question
        assert (question.job, question.index, question.question, question.choices, question.open) == (
            job,
            1,
            "Is the tray full?",
            ("yes", "no"),
            True,
        )
        with pytest.raises(InvalidValue):
            await running.service.queue.answer("perhaps")
        for other in ((job + 1, 1), (job, 2)):
            with pytest.raises(NotFound):
                await running.service.queue.answer("yes", *other)
        view = await running.service.queue.answer("yes", question.job, question.index)
        assert view.question is None
        with pytest.raises(NotFound):
            await running.service.queue.answer("yes")
        report = await running.service.wait(job)
        assert (report.state, report.steps[0].phase) == (TaskState.DONE, "yes")
        assert [
            event.answer for event in running.controller.events.since(0) if isinstance(event, QuestionAnswered)
        ] == ["yes"]


async def test_an_answer_that_comes_twice_is_not_taken_for_the_next_question() -> None:
    async with robot() as running:
        job = await submitted(running, {"ask": "Is the table clear?"}, {"ask": "Is your hand out of the gripper?"})
        await begun(running, 1)
        read = running.service.queue.view().question
        assert read is not None
        await running.service.queue.answer("continue", read.job, read.index)
        await begun(running, 2)
        with pytest.raises(NotFound):
            await running.service.queue.answer("continue", read.job, read.index)
        asked = running.service.queue.view().question
        assert asked is not None
        assert (asked.index, asked.question) == (2, "Is your hand out of the gripper?")
        await running.service.queue.answer("cancel", asked.job, asked.index)
        await running.service.wait(job)


async def test_the_answer_cancel_ends_the_job() -> None:
    async with robot() as running:
        job = await submitted(running, {"ask": "Go on?"}, {"set": {"output": 3, "to": "on"}})
        await begun(running, 1)
        await elapse(1.0)
        await running.service.queue.answer("cancel")
        report = await running.service.wait(job)
        assert (report.state, states(report)) == (TaskState.CANCELLED, ["cancelled", "skipped"])
        assert outputs(running) == []


async def test_an_answer_in_a_pause_takes_effect_after_it() -> None:
    async with robot() as running:
        job = await submitted(running, {"ask": "Go on?"}, {"set": {"output": 3, "to": "on"}})
        await begun(running, 1)
        await running.service.queue.pause(when="now")
        await running.service.queue.answer("continue")
        await elapse(50.0)
        assert outputs(running) == []
        await running.service.queue.resume()
        assert (await running.service.wait(job)).state is TaskState.DONE


async def test_two_answers_at_once_count_as_one() -> None:
    async with robot() as running:
        job = await submitted(running, {"ask": {"question": "Which?", "choices": ["a", "b"]}})
        await begun(running, 1)
        await elapse(1.0)
        outcomes = await asyncio.gather(*map(running.service.queue.answer, ["a", "b"]), return_exceptions=True)
        assert [isinstance(one, NotFound) for one in outcomes] == [False, True]
        assert (await running.service.wait(job)).steps[0].phase == "a"


async def test_an_unanswered_question_survives_a_restart(tmp_path: Path) -> None:
    journal = await SqliteJournal.open(tmp_path / "maya.db")
    async with robot(journal=journal) as running:
        await submitted(running, {"ask": "Is the tray full?"}, {"wait": 1})
        await begun(running, 1)
        await elapse(30.0)
    await journal.close()
    journal = await SqliteJournal.open(tmp_path / "maya.db")
    async with robot(journal=journal) as running:
        question = running.service.queue.view().question
        assert question is not None
        assert (question.question, question.open) == ("Is the tray full?", False)
        with pytest.raises(NotFound):
            await running.service.queue.answer("continue")
        with pytest.raises(AnswerNeeded):
            await running.service.queue.resume()
        await running.service.queue.recover("resume")
        await begun(running, 1)
        await elapse(1.0)
        question = running.service.queue.view().question
        assert question is not None
        assert question.open
        await running.service.queue.answer("continue")
        assert (await running.service.wait(1)).state is TaskState.DONE
    await journal.close()
