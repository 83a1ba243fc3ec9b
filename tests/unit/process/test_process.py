from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest

from maya_un.errors import EndNotReached, Faulted, LinkLost, NotConnected, NotFound, Stopped, UnknownName
from maya_un.events import JobAdvanced, StepAdvanced
from maya_un.process.process import Process
from maya_un.process.queue import entries as module
from maya_un.process.spec.job import Job
from maya_un.robot.primitives import Home, Pick
from maya_un.robot.robot import MayaRobot
from maya_un.schema.jobs import JobReport, QueueMode, TaskState
from maya_un.values import Mode, Point
from tests.fakes import FakeController, state_of
from tests.virtual_time import elapse

CUBE = {"cube": [0.50, 1.10]}
TRAY = {"tray": [1.10, 0.50]}
PICK_AND_PLACE = ({"pick": "cube"}, {"place": "tray"})


def job(*steps: Any, name: str = "job", repeat: int = 1) -> Job:
    return Job.parse({"name": name, "parts": CUBE, "places": TRAY, "steps": list(steps), "repeat": repeat})


@asynccontextmanager
async def running(*, homed: bool = True) -> AsyncIterator[tuple[FakeController, Process]]:
    controller = FakeController(homed=homed)
    process = Process(MayaRobot(controller, controller.config), controller, controller.config)
    try:
        yield controller, process
    finally:
        await process.close()


def states(report: JobReport) -> list[str]:
    return [report.state.value, *(step.state.value for step in report.steps)]


async def test_a_job_runs_step_by_step_and_is_reported() -> None:
    async with running() as (controller, process):
        report = await process.result(await process.submit(job(*PICK_AND_PLACE)))
        assert states(report) == ["done", "done", "done"]
        assert report.code == 0
        assert report.lowest == pytest.approx(0.40, abs=1e-5)
        assert report.parts == {"cube": Point(1.10, 0.50, 0.40)}
        last = report.steps[-1]
        assert last.end_counts == controller.state.counts
        assert last.end_point == controller.state.point


@pytest.mark.parametrize(("step", "place"), [(1, None), (2, None), (3, Point(1.10, 0.50, 0.40)), (4, None)])
async def test_cancelled_job_reports_its_placed_parts(step: int, place: Point | None) -> None:
    async with running() as (controller, process):
        number = await process.submit(job(*PICK_AND_PLACE, {"approach": [0.50, 1.10]}, {"pick": "cube"}))
        async for event in controller.events.follow():
            if isinstance(event, StepAdvanced) and (event.detail["index"], event.detail["state"]) == (step, "running"):
                break
        await elapse(0.1)
        report = await process.cancel(number)
        assert states(report) == ["cancelled", *["done"] * (step - 1), "cancelled", *["skipped"] * (4 - step)]
        assert report.parts == {"cube": place}


async def test_a_refused_job_has_put_nothing_anywhere() -> None:
    async with running() as (_, process):
        report = await process.result(await process.submit(job(*PICK_AND_PLACE, {"approach": [5.0, 5.0]})))
        assert (report.state.value, report.parts) == ("failed", {"cube": None})


async def test_prediction_equals_the_measured_time() -> None:
    async with running() as (_, process):
        report = await process.result(await process.submit(job(*PICK_AND_PLACE, repeat=3)))
        assert [step.predicted for step in report.steps] == pytest.approx([step.duration for step in report.steps])
        assert report.predicted == pytest.approx(report.duration)


async def test_a_homing_is_not_predicted() -> None:
    async with running(homed=False) as (_, process):
        report = await process.result(await process.submit(job("home", *PICK_AND_PLACE)))
        assert states(report) == ["done"] * 4
        assert [step.predicted is None for step in report.steps] == [True, False, False]


async def test_jobs_run_in_the_order_they_came() -> None:
    async with running() as (controller, process):
        numbers = [await process.submit(job({"approach": place}, name=place)) for place in ("cube", "tray", "cube")]
        assert [line.state.value for line in process.views.lines()] == ["running", "queued", "queued"]
        assert [line.position for line in process.views.lines()] == [None, 1, 2]
        assert process.running == numbers[0]
        await process.result(numbers[-1])
        assert process.running is None
        told = [event.detail for event in controller.events.since(0) if isinstance(event, JobAdvanced)]
        order = [(detail["job"], detail["state"]) for detail in told if detail["state"] != "queued"]
        assert order == [(n, state) for n in numbers for state in ("running", "done")]


async def test_a_queue_that_ran_empty_starts_again() -> None:
    async with running() as (_, process):
        await process.result(await process.submit(job("home")))
        assert (await process.result(await process.submit(job("home")))).id == 2


async def test_a_job_is_refused_whole_before_its_first_step() -> None:
    async with running() as (controller, process):
        report = await process.result(await process.submit(job(*PICK_AND_PLACE, {"approach": [3.0, 3.0]}, "home")))
        assert states(report) == ["failed", "skipped", "skipped", "failed", "skipped"]
        assert (report.lowest, report.highest) == (None, None)
        assert (report.code, report.steps[2].code) == (2101, 2101)
        assert controller.calls == []


@pytest.mark.parametrize(
    ("steps", "code"),
    [([{"pick": "cube"}, {"pick": "tray"}], 3001), ([{"place": "tray"}], 3002), ([{"move": [0.0, 0.6, 0.6]}], 2101)],
)
async def test_later_refusal_is_found_at_submission(steps: list[Any], code: int) -> None:
    async with running() as (controller, process):
        report = await process.result(await process.submit(job(*steps)))
        assert (report.state.value, report.code) == ("failed", code)
        assert controller.calls == []


async def test_a_refused_job_does_not_hold_up_the_next() -> None:
    async with running() as (_, process):
        bad = await process.submit(job({"place": "tray"}))
        good = await process.submit(job("home"))
        assert (await process.result(bad)).state.value == "failed"
        assert (await process.result(good)).state.value == "done"


async def test_motion_before_homing_is_refused() -> None:
    async with running(homed=False) as (controller, process):
        assert (await process.result(await process.submit(job(*PICK_AND_PLACE)))).code == 2103
        assert controller.calls == []


@pytest.mark.parametrize("error", [LinkLost(address="x", reason="y"), EndNotReached(axis="b", distance="1 mm")])
async def test_a_fault_fails_the_job_and_pauses_the_queue(error: LinkLost | EndNotReached) -> None:
    async with running() as (controller, process):
        controller.fail_at = {3: error}
        first, second = await process.submit(job(*PICK_AND_PLACE)), await process.submit(job("home"))
        assert states(await process.result(first)) == ["failed", "failed", "skipped"]
        await elapse(100.0)
        assert process.views.line(second).state is TaskState.QUEUED
        assert (process.views.mode, process.views.reason) == (QueueMode.PAUSED, "fault")
        assert len(controller.calls) == 3


async def test_a_stop_cancels_the_job_and_pauses_the_queue() -> None:
    async with running() as (controller, process):
        first, second = await process.submit(job(*PICK_AND_PLACE)), await process.submit(job("home"))
        await elapse(5.0)
        await controller.stop()
        report = await process.result(first)
        assert (states(report), report.code) == (["cancelled", "cancelled", "skipped"], Stopped.code)
        await elapse(100.0)
        assert (process.views.mode, process.views.reason) == (QueueMode.PAUSED, "stop")
        assert "home" not in controller.names()
        await process.scheduler.resume("ana")
        assert (await process.result(second)).state is TaskState.DONE


async def test_an_empty_queue_is_not_paused_by_a_stop() -> None:
    async with running() as (controller, process):
        first = await process.submit(job(*PICK_AND_PLACE))
        await elapse(5.0)
        process.scheduler.halt(Stopped())
        await controller.stop()
        await process.result(first)
        assert process.views.mode is QueueMode.RUNNING
        assert (await process.result(await process.submit(job("home")))).state is TaskState.DONE


async def test_after_a_halt_no_further_step_begins() -> None:
    async with running() as (controller, process):
        number = await process.submit(job("home", "home"))
        await elapse(1.0)
        process.scheduler.halt(Stopped())
        assert states(await process.result(number)) == ["cancelled", "done", "skipped"]
        assert controller.names() == ["home"]


@pytest.mark.parametrize("instant", [0.0, 1e-9, 5.0, 22.5, 30.0, 50.0])
async def test_cancelling_a_running_job_stops_it_and_starts_the_next(instant: float) -> None:
    async with running() as (controller, process):
        first, second = await process.submit(job(*PICK_AND_PLACE)), await process.submit(job("home"))
        await elapse(instant)
        report = await process.cancel(first)
        assert report.state.value == "cancelled"
        assert report.code == 2202
        assert (await process.result(second)).state.value == "done"
        assert controller.names()[-1] == "home"


async def test_cancelling_twice_still_waits_for_the_robot_to_rest() -> None:
    async with running() as (controller, process):
        number = await process.submit(job({"approach": "cube"}))
        await elapse(1.0)
        first = asyncio.create_task(process.cancel(number))
        await elapse(0.2)
        await process.cancel(number)
        assert states(await first) == ["cancelled", "cancelled"]
        assert controller.names()[-1] == "at rest"


async def test_cancelling_at_once_ends_a_job_that_never_began() -> None:
    async with running() as (controller, process):
        first, second = await process.submit(job("home")), await process.submit(job("home"))
        assert states(await process.cancel(second)) == ["cancelled", "skipped"]
        assert (await process.cancel(first)).state.value == "cancelled"
        assert controller.names() == ["home", "at rest"]


async def test_cancelling_an_ended_job_changes_nothing() -> None:
    async with running() as (_, process):
        number = await process.submit(job("home"))
        done = await process.result(number)
        assert await process.cancel(number) == done


async def test_nothing_is_queued_while_nothing_can_run() -> None:
    async with running() as (controller, process):
        controller.break_down(EndNotReached(axis="b", distance="1 mm"))
        with pytest.raises(Faulted):
            await process.submit(job("home"))
        controller.state = state_of(None, mode=Mode.DISCONNECTED)
        with pytest.raises(NotConnected):
            await process.command(Home())
        assert process.views.lines() == []


async def test_unknown_names_and_numbers_are_refused() -> None:
    async with running() as (_, process):
        with pytest.raises(UnknownName):
            await process.submit(job({"pick": "sphere"}))
        with pytest.raises(NotFound):
            await process.views.report(1)


async def test_command_is_a_job_of_one_step() -> None:
    async with running() as (_, process):
        report = await process.result(await process.command(Pick(Point(0.5, 1.1, 0.4))))
        assert (report.name, [step.step for step in report.steps]) == ("pick", ["pick 0.5 1.1 0.4"])


async def test_closing_cancels_everything() -> None:
    async with running() as (controller, process):
        numbers = [await process.submit(job("home")) for _ in range(3)]
        await elapse(1.0)
        await process.close()
        assert [(await process.views.report(number)).state.value for number in numbers] == ["cancelled"] * 3
        assert controller.names()[-1] == "at rest"


async def test_a_defect_of_ours_ends_the_job_with_a_report(monkeypatch: pytest.MonkeyPatch) -> None:
    async with running() as (controller, process):
        defects: list[Any] = []
        asyncio.get_running_loop().set_exception_handler(lambda _, context: defects.append(context["exception"]))

        async def broken(open_: bool) -> None:
            raise ZeroDivisionError(open_)

        monkeypatch.setattr(controller, "gripper", broken)
        first, second = await process.submit(job("home", {"gripper": "open"})), await process.submit(job("home"))
        assert states(await process.result(first)) == ["failed", "done", "failed"]
        assert (process.views.line(second).state.value, process.views.reason) == ("queued", "fault")
        await elapse(0.0)
        assert [type(defect) for defect in defects] == [ZeroDivisionError]


async def test_the_oldest_ended_job_is_forgotten_when_there_are_too_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "REMEMBERED", 3)
    async with running() as (_, process):
        for _ in range(5):
            await process.result(await process.submit(job("home")))
        assert [line.id for line in process.views.lines()] == [3, 4, 5]


async def test_steps_are_events_with_their_code() -> None:
    async with running() as (controller, process):
        controller.fail_at = {1: EndNotReached(axis="b", distance="1 mm")}
        await process.result(await process.submit(job(*PICK_AND_PLACE)))
        told = [event for event in controller.events.since(0) if isinstance(event, StepAdvanced)]
        assert [(event.detail["state"], event.code) for event in told] == [("running", 0), ("failed", 2308)]
