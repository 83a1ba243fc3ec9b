"""The robot layer across a graph, when it refuses, serves another client, or is missing."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, replace

import pytest

from maya_ros.graph.bus import Bus, BusNode
from maya_ros.graph.clients.controller import GraphController
from maya_ros.graph.clients.robot import GraphRobot
from maya_ros.graph.outcome import failure, success
from maya_ros.graph.protocol import Feedback, GoalRefused, Message
from maya_ros.graph.table import TASK
from maya_un.errors import Busy, MayaError, NodeGone, Stopped
from maya_un.events import FaultCleared, FaultEntered, PhaseBegun
from maya_un.robot.primitives.home import Home
from maya_un.robot.primitives.pick import Pick
from maya_un.values import Mode, Point
from tests.calm import CALM
from tests.virtual_time import elapse

CUBE = Point(0.50, 1.10, 0.40)


@dataclass
class ScriptedRobot:
    """A robot layer with scripted phases and ends of tasks, and a given time between them [s]."""

    phases: tuple[str, ...] = ()
    refusals: int = 0
    error: MayaError | None = None
    begun: int = 0

    async def act(self, _goal: Message, feedback: Feedback) -> Message:
        if self.refusals:
            self.refusals -= 1
            raise GoalRefused(failure(Busy(doing="task")))
        self.begun += 1
        for phase in self.phases:
            feedback({"phase": phase})
            feedback({"phase": phase, "progress": 0.5})
            await elapse(1.0)
        if self.error is not None:
            raise self.error
        return success()


@asynccontextmanager
async def robot_on(layer: ScriptedRobot) -> AsyncIterator[tuple[GraphRobot, GraphController, BusNode]]:
    bus = Bus()
    server, node = bus.node("primitive_server"), bus.node("process_controller")
    server.act(TASK.name, TASK.type, layer.act)
    async with GraphController.on(node, CALM) as controller:
        yield GraphRobot(node, controller, CALM), controller, server


async def test_every_phase_is_reported_once_and_is_an_event() -> None:
    async with robot_on(ScriptedRobot(("approach", "down"))) as (robot, controller, _):
        phases: list[str] = []
        await robot.run(Pick(CUBE), phases.append)
        told = [event for event in controller.events.since(0) if isinstance(event, PhaseBegun)]
        assert phases == [event.detail["name"] for event in told] == ["approach", "down"]
        assert {event.detail["primitive"] for event in told} == {"pick"}
        assert robot.running is None


async def test_command_refused_for_another_clients_task_waits_its_turn() -> None:
    layer = ScriptedRobot(("home",), refusals=5)
    async with robot_on(layer) as (robot, _, __):
        await robot.run(Home())
        assert (layer.refusals, layer.begun) == (0, 1)


async def test_command_that_waits_ends_at_a_fault_that_is_cleared_meanwhile(monkeypatch: pytest.MonkeyPatch) -> None:
    layer = ScriptedRobot(("home",), refusals=5)
    async with robot_on(layer) as (robot, controller, _):
        cleared = replace(controller.state, mode=Mode.IDLE)
        monkeypatch.setattr(GraphController, "state", property(lambda _: cleared))
        controller.events.emit(FaultEntered())
        task = asyncio.ensure_future(robot.run(Home()))
        await elapse(0.1)
        assert layer.refusals == 4
        controller.events.emit(FaultEntered())
        controller.events.emit(FaultCleared())
        with pytest.raises(Stopped):
            await task
        assert layer.begun == 0


async def test_waiting_command_can_be_cancelled() -> None:
    layer = ScriptedRobot(refusals=10_000)
    async with robot_on(layer) as (robot, _, __):
        request = asyncio.ensure_future(robot.run(Home()))
        await elapse(10.0)
        request.cancel()
        await asyncio.wait({request})
        assert request.cancelled()
        assert layer.begun == 0


async def test_busy_in_the_middle_is_an_error_and_nothing_is_repeated() -> None:
    layer = ScriptedRobot(("approach",), error=Busy(doing="move"))
    async with robot_on(layer) as (robot, _, __):
        with pytest.raises(Busy):
            await robot.run(Pick(CUBE))
        assert layer.begun == 1


async def test_second_command_from_here_is_refused() -> None:
    async with robot_on(ScriptedRobot(("home",))) as (robot, _, __):
        first = asyncio.ensure_future(robot.run(Home()))
        await elapse(0.5)
        assert robot.running == Home()
        with pytest.raises(Busy):
            await robot.run(Home())
        await first


async def test_missing_layer_is_reported_gone() -> None:
    async with robot_on(ScriptedRobot(("home",))) as (robot, _, server):
        request = asyncio.ensure_future(robot.run(Home()))
        await elapse(0.5)
        server.close()
        with pytest.raises(NodeGone):
            await request
        with pytest.raises(NodeGone, match="primitive_server"):
            await robot.run(Home())
        assert not robot.can_teleop
