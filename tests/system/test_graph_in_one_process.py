"""The whole graph of `maya up` on a bus, in virtual time: every way to a pick-and-place, and its end at any instant."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, field
from random import Random

import pytest

from maya_ros.graph.bus import Bus, BusNode
from maya_ros.graph.conversions import path_to_message, primitive_to_message
from maya_ros.graph.events import ReportedEvent, read
from maya_ros.graph.protocol import GoalStatus, Message
from maya_ros.graph.servers.controller import ControllerServer
from maya_ros.graph.servers.process import GraphQueue, ProcessServer
from maya_ros.graph.servers.robot import RobotServer
from maya_ros.rosbridge.thread_proxy import ControllerProxy, RobotProxy, echoed
from maya_un.assembly.stack import Stack, stack
from maya_un.config import Config
from maya_un.http.bridge import Bridge
from maya_un.robot.primitives.pick import Pick
from maya_un.robot.primitives.place import Place
from maya_un.schema.jobs import QueueMode
from maya_un.service.access.operations import ROS
from maya_un.values import Mode, Point
from tests.campaign import Campaign
from tests.graphs import timer_of
from tests.homing_mark import stand_homed
from tests.virtual_time import elapse, turn

pytestmark = pytest.mark.system

CUBE, TRAY = Point(0.50, 1.10, 0.40), Point(1.10, 0.50, 0.40)
PICK, PLACE, HOME = primitive_to_message(Pick(CUBE)), primitive_to_message(Place(TRAY)), {"command": "home"}
LONGEST = 120.0
"""Pick and place of a homed robot have ended by then [s]."""

PATIENT = 1000.0


@dataclass
class GraphStack:
    """All layers behind their servers, and a client on the other side."""

    stack: Stack
    bus: Bus
    client: BusNode
    told: list[ReportedEvent] = field(default_factory=list[ReportedEvent])

    def publish(self, topic: str, kind: str, message: Message) -> None:
        publisher = self.client.advertise(topic, kind)
        publisher.publish(message)
        publisher.close()

    async def do(self, task: Message) -> None:
        ended = await self.client.do("/task", "maya_robot/Task", {"task": task})
        assert (ended.outcome, ended.result["code"]) == (GoalStatus.SUCCEEDED, "")

    async def call(self, task: Message) -> None:
        answer = await self.client.call("/maya_command", {"task": task}, "maya_robot/MayaCommand")
        assert answer == {"success": True, "code": "", "message": ""}

    def moved(self) -> bool:
        """Whether the part stands on the tray, by the mechanics, and nothing ever fell."""
        assert self.stack.twin is not None
        mechanics = self.stack.twin.mechanics
        x, y, _ = mechanics.parts["cube"]
        assert not mechanics.record.whole.drops
        return abs(x - TRAY.x) < 0.002 and abs(y - TRAY.y) < 0.002

    async def until(self, seen: Callable[[], bool]) -> None:
        """Wait until something is so."""
        began = asyncio.get_running_loop().time()
        while not seen():
            assert asyncio.get_running_loop().time() < began + PATIENT
            await elapse(0.1)

    async def stands_still(self) -> None:
        """See that nothing moves."""
        assert self.stack.twin is not None
        before = self.stack.twin.mechanics.true_joints()
        await elapse(20.0)
        assert self.stack.twin.mechanics.true_joints() == pytest.approx(before, abs=2e-5)


@asynccontextmanager
async def graph_stack(*, homed: bool = True) -> AsyncIterator[GraphStack]:
    async with AsyncExitStack() as held:
        layers = await held.enter_async_context(stack(Config(), live=False, parts={"cube": CUBE}))
        if homed:
            await stand_homed(layers)
        bus = Bus()
        bridge = Bridge(asyncio.get_running_loop(), layers.service, gate=layers.gate)
        echo = await held.enter_async_context(echoed(bridge, 1.0))
        queue = GraphQueue(bridge.carry, lambda: echo.view, layers.controller)
        servers = (
            ("hw_simulator", ControllerServer(ControllerProxy(layers, bridge, echo), timer_of(layers.controller))),
            ("robot_controller", RobotServer(RobotProxy(layers, bridge, echo))),
            ("process_controller", ProcessServer(queue)),
        )
        for name, server in servers:
            await held.enter_async_context(server.open(bus.node(name)))
        seen = GraphStack(layers, bus, bus.node("somebody"))
        seen.client.subscribe("/maya_event", "std_msgs/String", lambda event: seen.told.append(read(event["data"])))
        await elapse(0.1)
        yield seen


async def by_task(robot: GraphStack) -> None:
    await robot.do(PICK)
    await robot.do(PLACE)


async def by_command(robot: GraphStack) -> None:
    await robot.call(PICK)
    await robot.call(PLACE)


async def by_move(robot: GraphStack) -> None:
    robot.publish("/maya_move", "maya_robot/MayaPrimitive", PICK)
    await robot.until(lambda: robot.stack.robot.holding is True)
    await robot.until(lambda: robot.stack.service.direct.doing == "")
    await elapse(0.1)
    if robot.told[-1].word == "stopped":
        return
    robot.publish("/maya_move", "maya_robot/MayaPrimitive", PLACE)


async def by_send_task(robot: GraphStack) -> None:
    robot.publish("/send_task", "maya_robot/MayaPrimitive", PICK)
    robot.publish("/send_task", "maya_robot/MayaPrimitive", PLACE)


async def by_start_queue(robot: GraphStack) -> None:
    robot.publish("/start_queue", "maya_process/ProcessQueue", {"tasks": [PICK, PLACE]})


WAYS = {
    "/task": by_task,
    "/maya_command": by_command,
    "/maya_move": by_move,
    "/send_task": by_send_task,
    "/start_queue": by_start_queue,
}


@pytest.mark.parametrize("way", WAYS)
async def test_every_way_moves_the_part(way: str) -> None:
    async with graph_stack() as robot:
        await WAYS[way](robot)
        await robot.until(robot.moved)
        await robot.until(lambda: robot.stack.robot.holding is False)


async def by_move_action(robot: GraphStack) -> None:
    await robot.client.do("/move", "maya_controller/Move", {"a": 0.5, "b": 1.2, "c": 1.5})


async def by_follow(robot: GraphStack) -> None:
    await robot.client.do("/controller/follow", "maya_controller/Follow", {"trajectory": slow_path(robot)})


async def by_path_topic(robot: GraphStack) -> None:
    robot.publish("/controller/command", "trajectory_msgs/JointTrajectory", slow_path(robot))


def slow_path(robot: GraphStack) -> Message:
    """Return a path of 20 s."""
    joints = robot.stack.controller.state.joints
    assert joints is not None
    return path_to_message([joints, joints._replace(a=joints.a + 0.3)], 20.0)


MOTIONS = {**WAYS, "/move": by_move_action, "/controller/follow": by_follow, "/controller/command": by_path_topic}


@pytest.mark.parametrize("turns", range(6))
@pytest.mark.parametrize("way", MOTIONS)
async def test_nothing_begins_that_was_sent_before_a_stop(way: str, turns: int) -> None:
    async with graph_stack() as robot:
        begun = asyncio.ensure_future(MOTIONS[way](robot))
        for _ in range(1 + turns):
            await turn()
        assert (await robot.client.call("/controller/stop", {}))["success"]
        await elapse(3.0)
        assert (robot.stack.service.direct.doing, robot.stack.process.running) == ("", None)
        begun.cancel()
        await asyncio.gather(begun, return_exceptions=True)


def homing(robot: GraphStack) -> Awaitable[None]:
    async def requested() -> None:
        robot.publish("/maya_move", "maya_robot/MayaPrimitive", HOME)

    return requested()


@pytest.mark.parametrize("way", [*WAYS, "homing"])
async def test_stop_queue_at_any_instant_leaves_a_usable_stack(way: str, campaign: Campaign) -> None:
    for case in range(campaign.size(ci=2, long=100)):
        rng = campaign.rng(case)
        async with graph_stack(homed=way != "homing") as robot:
            begun = asyncio.ensure_future(WAYS.get(way, homing)(robot))
            await elapse(_instant(rng))
            robot.publish("/stop_queue", "std_msgs/Empty", {})
            await elapse(3.0)
            begun.cancel()
            await asyncio.gather(begun, return_exceptions=True)
            await robot.until(lambda robot=robot: robot.told[-1].standing.mode in (Mode.IDLE, Mode.NOT_HOMED))
            await robot.stands_still()
            await _finishes(robot)


def _instant(rng: Random) -> float:
    return rng.uniform(0.0, LONGEST)


async def _finishes(robot: GraphStack) -> None:
    """Have the robot do what is left, as a person would after whatever happened."""
    assert robot.stack.process.views.mode is QueueMode.RUNNING
    if robot.moved() and not robot.stack.robot.holding:
        return
    if not robot.stack.controller.state.homed:
        await robot.do(HOME)
    if not robot.stack.robot.holding:
        await robot.call({"command": "gripper", "open": True})
        await robot.do(PICK)
    await robot.do(PLACE)
    assert robot.moved()


async def test_driver_with_the_lease_is_not_bypassed() -> None:
    async with graph_stack() as robot:
        robot.stack.lease.take("ana", "http")
        ended = await robot.client.do("/task", "maya_robot/Task", {"task": PICK})
        assert (ended.outcome, ended.result["code"]) == (GoalStatus.REJECTED, "4103")
        ended = await robot.client.do("/home", "maya_controller/Home", {})
        assert (ended.outcome, ended.result["code"]) == (GoalStatus.REJECTED, "4103")
        answer = await robot.client.call("/controller/stop", {})
        assert answer["success"]  # which needs no lease
        assert robot.stack.lease.holder is not None
        assert robot.stack.lease.holder.name != ROS.name


async def test_command_on_the_graph_is_refused_and_the_running_job_unharmed() -> None:
    async with graph_stack() as robot:
        robot.publish("/start_queue", "maya_process/ProcessQueue", {"tasks": [PICK, PLACE]})
        await elapse(2.0)
        for name, kind, goal in (
            ("/task", "maya_robot/Task", {"task": HOME}),
            ("/home", "maya_controller/Home", {}),
            ("/move", "maya_controller/Move", {"b": 1.5, "c": 1.3}),
        ):
            ended = await robot.client.do(name, kind, goal)
            assert (ended.outcome, ended.result["code"]) == (GoalStatus.REJECTED, "2104"), name
        await robot.until(robot.moved)
