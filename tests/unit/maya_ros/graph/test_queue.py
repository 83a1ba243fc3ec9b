"""The queue behind its server: jobs of primitives, through the gate, and stop_queue."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_ros.graph.diagnostics import DiagnosticLevel
from maya_ros.graph.servers.process import GraphQueue, job_of
from maya_un.assembly.stack import ProcessAssembly, process_layer
from maya_un.config import Config
from maya_un.errors import InvalidJob
from maya_un.process.spec.tasks import expand
from maya_un.robot.primitives import Primitive
from maya_un.robot.primitives.approach import Approach
from maya_un.robot.primitives.can_teleop import CanTeleop
from maya_un.robot.primitives.gripper import Gripper
from maya_un.robot.primitives.home import Home
from maya_un.robot.primitives.line import Line
from maya_un.robot.primitives.move import MoveJoints
from maya_un.robot.primitives.pick import Pick
from maya_un.robot.primitives.place import Place
from maya_un.robot.robot import MayaRobot
from maya_un.schema.jobs import QueueMode, TaskState
from maya_un.values import Joints, Point
from tests.fakes import FakeController
from tests.virtual_time import elapse

CUBE, TRAY = Point(0.5, 1.1, 0.4), Point(1.1, 0.5, 0.4)
NUMBERS = st.floats(-10.0, 10.0)
PRIMITIVES = st.one_of(
    st.builds(Approach, st.builds(Point, NUMBERS, NUMBERS, NUMBERS)),
    st.builds(Pick, st.builds(Point, NUMBERS, NUMBERS, NUMBERS)),
    st.builds(Place, st.builds(Point, NUMBERS, NUMBERS, NUMBERS)),
    st.builds(Line, st.builds(Point, NUMBERS, NUMBERS, NUMBERS)),
    st.builds(MoveJoints, st.builds(Joints, NUMBERS, NUMBERS, NUMBERS)),
    st.builds(Gripper, st.booleans()),
    st.just(Home()),
)


@given(st.lists(PRIMITIVES, min_size=1, max_size=8))
def test_job_of_primitives_is_converted_to_these_primitives(primitives: list[Primitive]) -> None:
    assert [task.action for task in expand(job_of(primitives), 0.4).tasks] == primitives


def test_query_is_not_a_job() -> None:
    with pytest.raises(InvalidJob, match=r"tasks\.1"):
        job_of([Home(), CanTeleop()])


@asynccontextmanager
async def queue_server(controller: FakeController) -> AsyncIterator[tuple[ProcessAssembly, GraphQueue]]:
    robot = MayaRobot(controller, controller.config)
    async with process_layer(robot, controller, Config()) as layer:
        yield layer, GraphQueue(layer.gate.call, layer.service.queue.view, controller)


async def test_appended_job_runs_in_its_turn_for_the_graph() -> None:
    controller = FakeController()
    async with queue_server(controller) as (layer, queue):
        await queue.append([Pick(CUBE), Place(TRAY)], queue.stops)
        await queue.append([Home()], queue.stops)
        reports = [await layer.process.result(number) for number in (1, 2)]
        assert [report.state for report in reports] == [TaskState.DONE, TaskState.DONE]
        assert [line.owner for line in layer.process.views.lines()] == ["ros", "ros"]
        assert controller.names()[-1] == "home"


async def test_job_that_was_sent_before_a_stop_waits() -> None:
    controller = FakeController()
    async with queue_server(controller) as (layer, queue):
        before = queue.stops
        controller.stops += 1
        await queue.append([Home()], before)
        assert (layer.process.views.mode, layer.process.running) == (QueueMode.PAUSED, None)
        await layer.service.queue.resume()
        assert (await layer.process.result(1)).state is TaskState.DONE


async def test_the_end_of_everything_stops_and_empties() -> None:
    controller = FakeController()
    async with queue_server(controller) as (layer, queue):
        await queue.append([Home()], queue.stops)
        await queue.append([Pick(CUBE)], queue.stops)
        await elapse(5.0)
        assert queue.status().level is DiagnosticLevel.OK
        await queue.end_all()
        states = [(await layer.process.result(number)).state for number in (1, 2)]
        assert states == [TaskState.CANCELLED, TaskState.CANCELLED]
        await queue.append([Home()], queue.stops)
        assert (await layer.process.result(3)).state is TaskState.DONE


async def test_status_shows_whether_the_queue_runs() -> None:
    controller = FakeController()
    async with queue_server(controller) as (layer, queue):
        await layer.process.scheduler.pause("ana", now=False)
        status = queue.status()
        assert status.level is DiagnosticLevel.WARN
        assert "paused" in status.message
