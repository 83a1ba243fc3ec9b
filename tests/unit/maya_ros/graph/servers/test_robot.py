"""The robot layer behind its server, on a fake controller, in virtual time."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, replace

import pytest

from maya_ros.graph.bus import Bus, BusNode
from maya_ros.graph.conversions import primitive_to_message
from maya_ros.graph.distributed import DistributedLayers
from maya_ros.graph.protocol import GoalStatus, Message
from maya_ros.graph.servers.robot import RobotServer, why_not
from maya_un.config import Config
from maya_un.errors import Busy, Faulted, MayaError, NotConnected, NotHomed
from maya_un.robot.primitives import Primitive
from maya_un.robot.primitives.can_teleop import CanTeleop
from maya_un.robot.primitives.gripper import Gripper
from maya_un.robot.primitives.home import Home
from maya_un.robot.primitives.line import Line
from maya_un.robot.primitives.move import MoveJoints
from maya_un.robot.primitives.pick import Pick
from maya_un.robot.robot import MayaRobot
from maya_un.values import Joints, Mode, Notice, Point
from tests.fakes import FakeController, state_of
from tests.virtual_time import elapse

CUBE = Point(0.5, 1.1, 0.4)
DONE = {"success": True, "code": "", "message": ""}
TASK = "maya_robot/Task"


@dataclass
class Behind:
    controller: FakeController
    robot: MayaRobot
    bus: Bus
    client: BusNode

    async def command(self, primitive: Primitive | Message) -> Message:
        task = primitive if isinstance(primitive, dict) else primitive_to_message(primitive)
        return await self.client.call("/maya_command", {"task": task}, "maya_robot/MayaCommand")

    async def task(self, primitive: Primitive) -> tuple[GoalStatus, str]:
        ended = await self.client.do("/task", TASK, {"task": primitive_to_message(primitive)})
        return ended.outcome, str(ended.result.get("code"))

    def names(self) -> list[str]:
        return self.controller.names()


@asynccontextmanager
async def behind(*, homed: bool = True) -> AsyncIterator[Behind]:
    controller = FakeController(homed=homed)
    robot = MayaRobot(controller, controller.config)
    bus = Bus()
    async with RobotServer(DistributedLayers(robot, controller)).open(bus.node("robot_controller")):
        yield Behind(controller, robot, bus, bus.node("somebody"))


async def test_pick_by_action_reports_its_phases() -> None:
    async with behind() as robot:
        heard = list[Message]()
        ended = await robot.client.do("/task", TASK, {"task": primitive_to_message(Pick(CUBE))}, heard.append)
        assert ended.result == DONE
        phases = list(dict.fromkeys(message["phase"] for message in heard))
        assert phases == ["approach", "open", "down", "close", "up"] or len(phases) >= 4
        assert robot.robot.holding
        assert heard[0]["position"] != {"x": 0.0, "y": 0.0, "z": 0.0}


async def test_every_command_goes_by_service_and_answers_when_it_is_done() -> None:
    async with behind(homed=False) as robot:
        for primitive in (Home(), Pick(CUBE), Line(Point(0.5, 1.1, 0.6)), MoveJoints(Joints(0.5, 1.5, 1.3))):
            assert await robot.command(primitive) == DONE
            assert robot.robot.running is None
        assert await robot.command(Gripper(open=True)) == DONE
        assert not robot.controller.state.gripper_closed


async def test_can_teleop_answers_at_once_and_says_why_not() -> None:
    async with behind(homed=False) as robot:
        refused = await robot.command(CanTeleop())
        assert (refused["success"], refused["code"]) == (False, "2103")
        await robot.command(Home())
        assert await robot.command(CanTeleop()) == DONE
        moving = asyncio.ensure_future(robot.task(Pick(CUBE)))
        await elapse(1.0)
        now = asyncio.get_running_loop().time()
        assert (await robot.command(CanTeleop()))["code"] == "2104"
        assert asyncio.get_running_loop().time() == now
        assert await moving == (GoalStatus.SUCCEEDED, "")
        assert await robot.command(CanTeleop()) == DONE


@pytest.mark.parametrize(
    ("mode", "error"),
    [
        (Mode.DISCONNECTED, NotConnected),
        (Mode.FAULT, Faulted),
        (Mode.NOT_HOMED, NotHomed),
        (Mode.MOVING, Busy),
        (Mode.HOMING, Busy),
        (Mode.PAUSED, Busy),
        (Mode.IDLE, None),
    ],
)
def test_reason_against_a_command_is_given(mode: Mode, error: type[MayaError] | None) -> None:
    homed = state_of(Joints(0.0, 1.5, 1.3))
    state = replace(homed, mode=mode, fault=Notice(2301, "a limit") if mode is Mode.FAULT else None)
    found = why_not(state, can_teleop=mode is Mode.IDLE)
    assert (None if found is None else type(found)) is error
    assert isinstance(why_not(homed, can_teleop=True, doing="task"), Busy)


async def test_second_command_is_refused_and_the_first_unharmed() -> None:
    async with behind() as robot:
        first = asyncio.ensure_future(robot.task(Pick(CUBE)))
        await elapse(0.5)
        assert await robot.task(Home()) == (GoalStatus.REJECTED, "2104")
        assert (await robot.command(Home()))["code"] == "2104"
        assert await first == (GoalStatus.SUCCEEDED, "")
        assert "home" not in robot.names()


async def test_a_cancel_stops_it_and_the_robot_is_free_again() -> None:
    async with behind() as robot:
        task = asyncio.ensure_future(robot.task(Pick(CUBE)))
        await elapse(1.0)
        robot.client.advertise("/task/cancel", "actionlib_msgs/GoalID").publish({})
        assert await task == (GoalStatus.PREEMPTED, "2202")
        assert await robot.command(CanTeleop()) == DONE


async def test_impossible_command_is_rejected_with_its_code() -> None:
    async with behind() as robot:
        assert await robot.task(Pick(Point(3.0, 3.0, 0.4))) == (GoalStatus.REJECTED, "2101")
        assert await robot.task(Pick(Point(1e308, -1e308, 1e308))) == (GoalStatus.REJECTED, "4001")
        assert (await robot.command({"command": "dance"}))["code"] == "4003"
        assert (await robot.command({"command": "pick", "target": {"x": None}}))["code"] == "4001"
        assert robot.names() == []


async def test_command_on_the_topic_runs_and_its_refusal_is_logged_and_published(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async with behind() as robot:
        heard = list[Message]()
        robot.client.subscribe("/diagnostics", "diagnostic_msgs/DiagnosticArray", heard.append)
        request = robot.client.advertise("/maya_move", "maya_robot/MayaPrimitive")
        request.publish(primitive_to_message(Pick(CUBE)))
        await elapse(0.5)
        with caplog.at_level(logging.WARNING):
            request.publish(primitive_to_message(Home()))
            await elapse(1.5)
        assert "2104" in caplog.text
        values = {value["key"]: value["value"] for value in heard[-1]["status"][0]["values"]}
        assert values["last refused"].startswith("home: 2104 ")
        await elapse(60.0)
        assert robot.robot.holding
        request.publish(primitive_to_message(Gripper(open=True)))
        await elapse(5.0)
        values = {value["key"]: value["value"] for value in heard[-1]["status"][0]["values"]}
        assert values["last refused"] == ""


async def test_diagnostics_before_homing_say_that_the_robot_is_not_homed() -> None:
    async with behind(homed=False) as robot:
        heard = list[Message]()
        robot.client.subscribe("/diagnostics", "diagnostic_msgs/DiagnosticArray", heard.append)
        await elapse(1.5)
        assert heard[-1]["status"][0]["message"].startswith("2103 ")


async def test_closing_server_stops_the_running_command() -> None:
    controller = FakeController()
    robot = MayaRobot(controller, Config())
    bus = Bus()
    client = bus.node("somebody")
    async with RobotServer(DistributedLayers(robot, controller)).open(bus.node("robot_controller")):
        task = asyncio.ensure_future(client.do("/task", TASK, {"task": primitive_to_message(Pick(CUBE))}))
        await elapse(1.0)
    assert (await task).outcome is GoalStatus.PREEMPTED
    assert robot.running is None
    assert await bus.directory.services() == {}


async def test_the_task_may_have_another_name() -> None:
    controller = FakeController()
    server = RobotServer(DistributedLayers(MayaRobot(controller, Config()), controller))
    bus = Bus()
    async with server.task(bus.node("robot_controller"), "/robot_controller/task"):
        client = bus.node("primitive_server")
        assert (await client.do("/robot_controller/task", TASK, {"task": {"command": "home"}})).result == DONE
