"""The step after the running one: which it is on a fake controller, and its path with a worker."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from math import dist

import pytest

from maya_un.assembly.staff import staffed
from maya_un.config import Config
from maya_un.config.model import parse_zone
from maya_un.errors import Unreachable
from maya_un.events import Event, StepAdvanced
from maya_un.kinematics.zones import zone_of
from maya_un.process.process import Process
from maya_un.process.queue.ahead import POINTS
from maya_un.robot.primitives import Approach, Gripper, Pick
from maya_un.robot.robot import MayaRobot
from maya_un.schema.robot import NextStep
from maya_un.values import Point
from maya_un.workers import WorkerSet
from tests.fakes import FakeController
from tests.queues import PICK_AND_PLACE, Machine, job
from tests.virtual_time import elapse

CUBE, TRAY = Point(0.50, 1.10, 0.40), Point(1.10, 0.50, 0.40)


async def seen_at(steps: tuple[object, ...], process: Process, controller: FakeController) -> list[NextStep | None]:
    """Run a job; return the next step at the beginning of each step, and after the end."""
    found: list[NextStep | None] = []

    def hear(event: Event) -> None:
        if isinstance(event, StepAdvanced) and event.state == "running":
            found.append(process.ahead.look())

    controller.events.heard_by(hear)
    await process.result(await process.submit(job(*steps)))
    return [*found, process.ahead.look()]


async def test_next_step_follows_the_running_one() -> None:
    async with Machine(homed=False).running() as layer:
        steps = ("home", *PICK_AND_PLACE, {"gripper": "close"}, {"move": [0.4, 1.5, 1.5]})
        assert await seen_at(steps, layer.process, layer.controller) == [
            NextStep(1, 2, "pick cube", "pick", (0.5, 1.1, 0.4)),
            NextStep(1, 3, "place tray", "place", (1.1, 0.5, 0.4)),
            NextStep(1, 4, "gripper close", "gripper", target=False),
            NextStep(1, 5, "move 0.4 1.5 1.5", "move", (0.4, 1.5, 1.5)),
            None,
            None,
        ]


async def test_without_a_job_there_is_no_next_step() -> None:
    async with Machine().running() as layer:
        assert layer.process.ahead.look() is None


@pytest.fixture(scope="module")
def staff() -> Iterator[WorkerSet]:
    with staffed(Config()) as workers:
        yield workers


@asynccontextmanager
async def planned(staff: WorkerSet) -> AsyncIterator[tuple[FakeController, Process]]:
    controller = FakeController()
    process = Process(MayaRobot(controller, controller.config), controller, controller.config, staff=staff)
    try:
        yield controller, process
    finally:
        await process.close()


async def path_of(process: Process, index: int) -> NextStep:
    """Look at the next step until its path is known."""
    while True:
        step = process.ahead.look()
        if step is not None and step.step == index and step.points:
            return step
        await elapse(0.05)


async def test_path_of_the_next_step_begins_where_the_running_one_ends(staff: WorkerSet) -> None:
    async with planned(staff) as (controller, process):
        number = await process.submit(job(*PICK_AND_PLACE))
        step = await path_of(process, 2)
        robot = MayaRobot(controller, controller.config)
        end = robot.preview(Pick(CUBE), robot.pose).end
        assert end.joints is not None
        assert dist(step.points[0], controller.mechanism.fk(end.joints)) < 1e-4
        assert any(dist(point, TRAY) < 1e-4 for point in step.points)
        assert 10 <= len(step.points) <= POINTS
        assert process.ahead.look() is step
        await process.cancel(number)


async def test_step_that_moves_nothing_has_no_path(staff: WorkerSet) -> None:
    async with planned(staff) as (controller, process):
        pose = MayaRobot(controller, controller.config).pose
        assert 7 <= len(await process.computer.path_ahead([Pick(CUBE)], pose, 9)) <= 9
        assert await process.computer.path_ahead([Pick(CUBE), Gripper(open=True)], pose, 9) == ()


async def test_step_that_would_be_refused_has_no_path(staff: WorkerSet) -> None:
    async with planned(staff) as (controller, process):
        begun = asyncio.Event()
        controller.events.heard_by(lambda event: begun.set() if isinstance(event, StepAdvanced) else None)
        number = await process.submit(job({"pick": "cube"}, {"approach": "tray"}))
        await begun.wait()
        box = {"name": "lid", "kind": "box", "low": [1.0, 0.4, 0.0], "high": [1.2, 0.6, 0.6]}
        controller.set_zones([zone_of(parse_zone(box))])
        assert process.ahead.look() == NextStep(1, 2, "approach tray", "approach", (1.1, 0.5, 0.4))
        with pytest.raises(Unreachable):
            await process.computer.path_ahead([Approach(TRAY)], MayaRobot(controller, controller.config).pose, 9)
        assert process.ahead.look() == NextStep(1, 2, "approach tray", "approach", (1.1, 0.5, 0.4))
        await process.cancel(number)
