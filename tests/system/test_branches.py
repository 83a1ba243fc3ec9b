"""The `if` of jobs on the twin, in virtual time: the branch that is taken, the check of both, restarts, predictions."""

from __future__ import annotations

from pathlib import Path
from random import Random
from typing import Any

import pytest

from maya_un.errors import AnswerNeeded, InvalidJob, InvalidValue
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.schema.jobs import TaskState
from tests.system.test_statements import CUBE, PART, begun, done, outputs, robot, states, submitted, switch_input
from tests.virtual_time import elapse

TRAY = [1.10, 0.50]
IS_ON = {"input": "part", "is": "on"}


def branch(condition: Any, then: list[Any], otherwise: list[Any] | None = None) -> dict[str, Any]:
    """Return an `if`."""
    return {"if": condition, "then": then, **({} if otherwise is None else {"else": otherwise})}


@pytest.mark.parametrize("on", [True, False])
@pytest.mark.parametrize("live", [True, False])
async def test_an_input_chooses_the_branch_and_the_other_is_skipped(*, on: bool, live: bool) -> None:
    async with robot(live=live) as running:
        switch_input(running, on=on)
        await elapse(0.5)
        report = await done(
            running, branch(IS_ON, [{"wait": 1}, {"set": {"output": 3, "to": "on"}}], [{"wait": 2}]), {"wait": 3}
        )
        assert report.state is TaskState.DONE
        assert states(report) == [
            "done",
            *(["done", "done", "skipped"] if on else ["skipped", "skipped", "done"]),
            "done",
        ]
        assert report.steps[0].phase == ("then" if on else "else")
        assert report.predicted == pytest.approx(4.0 if on else 5.0)
        assert report.duration == pytest.approx(report.predicted, abs=0.1)


@pytest.mark.parametrize("on", [True, False])
async def test_a_preview_shows_both_branches_and_counts_the_expected_one(*, on: bool) -> None:
    async with robot() as running:
        await done(running, "home")
        switch_input(running, on=on)
        await running.controller.input(PART)
        steps = [
            branch(IS_ON, [{"wait": 10}, {"approach": TRAY}], [{"approach": list(CUBE)}]),
            {"approach": [0.8, 0.8]},
        ]
        preview = await running.service.preview({"steps": steps})
        assert preview.refusal is None
        assert [step.expected for step in preview.steps] == [True, on, on, not on, True]
        assert preview.steps[0].phases[0].name == ("then" if on else "else")
        report = await done(running, *steps)
        assert report.predicted == pytest.approx(preview.duration)
        assert report.duration == pytest.approx(preview.duration, rel=0.02)


@pytest.mark.parametrize("on", [True, False])
async def test_a_branch_that_cannot_be_done_refuses_the_job_although_it_is_not_taken(*, on: bool) -> None:
    async with robot() as running:
        await done(running, "home")
        switch_input(running, on=not on)
        away = [{"line": [5, 5]}]
        report = await done(running, branch(IS_ON, away if on else [{"wait": 1}], [{"wait": 1}] if on else away))
        assert report.state is TaskState.FAILED
        assert states(report).count("failed") == 1
        assert states(report)[1 if on else 2] == "failed"


async def test_a_step_after_branches_is_checked_from_the_end_of_each() -> None:
    async with robot() as running:
        await done(running, "home", {"gripper": "open"})
        switch_input(running, on=False)
        report = await done(running, branch(IS_ON, [{"gripper": "close"}]), {"pick": list(CUBE)})
        assert report.state is TaskState.FAILED
        assert states(report) == ["skipped", "skipped", "failed"]
        report = await done(running, branch(IS_ON, [{"wait": 1}]), {"pick": list(CUBE)})
        assert report.state is TaskState.DONE


async def test_a_part_is_unknown_after_branches_that_differ() -> None:
    async with robot() as running:
        parts = {"parts": {"cube": list(CUBE)}, "places": {"tray": TRAY}}
        carry = branch(IS_ON, [{"pick": "cube"}, {"place": "tray"}], [{"wait": 1}])
        with pytest.raises(InvalidJob) as refused:
            await submitted(running, "home", carry, {"pick": "cube"}, **parts)
        assert refused.value.details["key"] == "steps.2.pick"
        await done(running, "home", carry, **parts)


@pytest.mark.parametrize(("answer", "output"), [("yes", 3), ("no", 5)])
async def test_an_answer_chooses_the_branch(answer: str, output: int) -> None:
    async with robot() as running:
        job = await submitted(
            running,
            {"ask": {"question": "Full?", "choices": [True, False]}},
            branch({"answer": True}, [{"set": {"output": 3, "to": "on"}}], [{"set": {"output": "lamp", "to": "on"}}]),
        )
        await begun(running, 1, job)
        await elapse(1.0)
        await running.service.queue.answer(answer)
        assert (await running.service.wait(job)).state is TaskState.DONE
        assert outputs(running) == [(output, True)]


@pytest.mark.parametrize("stopped", [True, False])
async def test_pause_and_stop_in_a_branch(*, stopped: bool) -> None:
    async with robot() as running:
        job = await submitted(running, branch(IS_ON, [{"wait": 10}, {"wait": 10}], [{"wait": 1}]), {"wait": 1})
        await begun(running, 2, job)
        await running.service.queue.pause()
        await elapse(50.0)
        assert states(await running.service.job(job)) == ["done", "done", "queued", "skipped", "queued"]
        switch_input(running, on=False)
        await running.service.queue.resume()
        await begun(running, 3, job)
        if stopped:
            await running.service.stop()
        report = await running.service.wait(job)
        ends = ["cancelled", "skipped", "skipped"] if stopped else ["done", "skipped", "done"]
        assert states(report) == ["done", "done", *ends]


async def test_a_restart_goes_on_in_the_same_branch(tmp_path: Path) -> None:
    journal = await SqliteJournal.open(tmp_path / "maya.db")
    async with robot(journal=journal) as running:
        await submitted(
            running,
            {"ask": {"question": "Full?", "choices": ["yes", "no"]}},
            branch(IS_ON, [{"wait": 100}, branch({"answer": "no"}, [{"wait": 7}])], [{"wait": 1}]),
        )
        await begun(running, 1)
        await elapse(1.0)
        await running.service.queue.answer("no")
        await begun(running, 3)
        await elapse(10.0)
    await journal.close()
    journal = await SqliteJournal.open(tmp_path / "maya.db")
    async with robot(journal=journal) as running:
        switch_input(running, on=False)
        await elapse(100.0)
        assert states(await running.service.job(1)) == ["done", "done", "interrupted", "queued", "queued", "skipped"]
        with pytest.raises(AnswerNeeded):
            await running.service.queue.resume()
        await running.service.queue.recover("resume")
        report = await running.service.wait(1)
        assert states(report) == ["done"] * 5 + ["skipped"]
    await journal.close()


async def test_again_begins_within_a_branch_with_the_earlier_answer() -> None:
    async with robot() as running:
        steps = (
            {"ask": {"question": "Full?", "choices": ["yes", "no"]}},
            branch(
                {"answer": "no"},
                [{"wait_for": {"input": PART, "is": "off", "within": 5}}, branch({"answer": "no"}, [{"wait": 2}])],
                [{"set": {"output": 3, "to": "on"}}],
            ),
            {"wait": 1},
        )
        job = await submitted(running, *steps)
        await begun(running, 1, job)
        await elapse(1.0)
        await running.service.queue.answer("no")
        assert (await running.service.wait(job)).code == 4024
        switch_input(running, on=False)
        again = await running.service.queue.again(job)
        report = await running.service.wait(again.id)
        assert report.state is TaskState.DONE
        assert states(report) == ["skipped", "skipped", "done", "done", "done", "skipped", "done"]
        assert outputs(running) == []
        cancelled = await submitted(running, *steps, name="never answered")
        await begun(running, 1, cancelled)
        await running.service.cancel(cancelled)
        with pytest.raises(InvalidValue):
            await running.service.queue.again(cancelled, from_step=2)


async def test_an_interrupted_question_on_which_a_branch_depends_cannot_be_skipped(tmp_path: Path) -> None:
    journal = await SqliteJournal.open(tmp_path / "maya.db")
    async with robot(journal=journal) as running:
        await submitted(
            running, {"ask": {"question": "Full?", "choices": ["yes", "no"]}}, branch({"answer": "no"}, [{"wait": 7}])
        )
        await begun(running, 1)
    await journal.close()
    journal = await SqliteJournal.open(tmp_path / "maya.db")
    async with robot(journal=journal) as running:
        recovery = running.service.queue.view().recovery
        assert recovery is not None
        assert [choice.name for choice in recovery.choices] == ["resume", "redo", "abort"]
    await journal.close()


def drawn(rng: Random, depth: int = 0) -> list[Any]:
    """Return random steps: waits, branches and loops."""
    steps: list[Any] = []
    for _ in range(rng.randint(1, 3)):
        kind = rng.random()
        if depth < 3 and kind < 0.4:
            condition = {"input": rng.randint(1, 8), "is": rng.choice(["on", "off"])}
            steps.append(branch(condition, drawn(rng, depth + 1), rng.choice([None, drawn(rng, depth + 1)])))
        elif depth == 0 and kind < 0.6:
            steps.append({"for_each": "row", "do": drawn(rng, 2)})
        else:
            steps.append({"wait": rng.randint(1, 9)})
    return steps


@pytest.mark.parametrize("seed", range(12))
async def test_a_random_job_of_branches_takes_the_predicted_time(seed: int) -> None:
    rng = Random(seed)
    async with robot() as running:
        assert running.twin is not None
        inputs = running.twin.controller.machine.unit.inputs
        inputs[:] = [rng.random() < 0.5 for _ in inputs]
        running.twin.controller.machine.look()
        await running.controller.input(1)
        pallets = {"row": {"corners": [[0.3, 1.0], [0.5, 1.0]], "rows": 1, "columns": 2}}
        steps = drawn(rng)
        preview = await running.service.preview({"steps": steps, "pallets": pallets})
        report = await done(running, *steps, pallets=pallets)
        assert report.state is TaskState.DONE
        assert report.predicted == pytest.approx(preview.duration)
        assert report.duration == pytest.approx(preview.duration, abs=0.2)
        expected = {step.index for step in preview.steps if step.expected}
        assert {step.index for step in report.steps if step.state is TaskState.DONE} == expected
        waits = sum(
            float(step.step.split()[1]) for step in report.steps if step.index in expected and "wait" in step.step
        )
        assert report.duration == pytest.approx(waits, abs=0.2)
