"""The queue of a whole stack on a file: ended in the middle of a job, started again, and carried on by a person."""

from __future__ import annotations

from pathlib import Path

import pytest

from maya_un.assembly.stack import Stack, stack
from maya_un.config import Config
from maya_un.errors import AnswerNeeded, NotHomed
from maya_un.events import StepAdvanced
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.schema.jobs import QueueMode, TaskState
from maya_un.values import Point
from tests.virtual_time import elapse

CUBE, TRAY = Point(0.50, 1.10, 0.40), Point(1.10, 0.50, 0.40)
JOB = {"name": "carry", "steps": ["home", {"pick": list(CUBE)}, {"place": list(TRAY)}]}


async def reached(robot: Stack, step: int, state: str) -> None:
    """Wait until a step of the first job is in a state."""
    async for event in robot.controller.events.follow():
        if isinstance(event, StepAdvanced) and (event.detail["index"], event.detail["state"]) == (step, state):
            return


async def test_a_job_that_was_cut_short_is_carried_on_after_a_restart(tmp_path: Path) -> None:
    journal = await SqliteJournal.open(tmp_path / "maya.db")
    async with stack(Config(), parts={"cube": CUBE}, live=False, journal=journal) as robot:
        await robot.service.submit(JOB)
        await robot.service.submit({"steps": ["home"]})
        await reached(robot, 2, "running")
        await elapse(10.0)
    count = len(robot.controller.events)
    await journal.close()

    journal = await SqliteJournal.open(tmp_path / "maya.db")
    async with stack(Config(), parts={"cube": CUBE}, live=False, journal=journal) as robot:
        service = robot.service
        await elapse(1000.0)
        view = service.queue.view()
        assert (view.mode, view.reason) == (QueueMode.PAUSED, "restart")
        assert view.recovery is not None
        assert (view.recovery.index, view.recovery.state.homed) == (2, False)
        with pytest.raises((NotHomed, AnswerNeeded)):
            await service.queue.recover("redo", False)
        assert (await service.command({"command": "home"})).state is TaskState.DONE
        await service.queue.recover("redo", False)
        report = await service.wait(1)
        assert [step.state.value for step in report.steps] == ["done"] * 3
        assert (await service.wait(2)).state is TaskState.DONE
        assert robot.twin is not None
        assert robot.twin.mechanics.parts["cube"] == pytest.approx(TRAY, abs=1e-3)
        assert robot.controller.events.run == 2
        before = await service.history.events(1, 0, limit=1000)
        assert [event.seq for event in before] == list(range(1, len(before) + 1))
        assert len(before) >= count - 1  # the last event may come while the file is closed
    await journal.close()


async def test_stop_of_the_twin_pauses_waiting_jobs_and_resume_continues() -> None:
    async with stack(Config(), parts={"cube": CUBE}, live=False) as robot:
        await robot.service.submit({"steps": ["home"]})
        await robot.service.submit({"steps": [{"pick": list(CUBE)}, {"place": list(TRAY)}]})
        await elapse(5.0)
        await robot.service.stop()
        assert (await robot.service.wait(1)).code == 2201
        rest = robot.controller.state.counts
        await elapse(1000.0)
        assert robot.controller.state.counts == pytest.approx(rest, abs=2)
        assert (await robot.service.command({"command": "home"})).state is TaskState.DONE
        await robot.service.queue.resume()
        assert (await robot.service.wait(2)).state is TaskState.DONE
