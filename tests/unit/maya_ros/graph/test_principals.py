"""The principal of a command goes with each message, despite other messages in between."""

from __future__ import annotations

import asyncio
from pathlib import Path

from maya_ros.graph.bus import Bus, BusNode
from maya_ros.graph.permissions import caller
from maya_ros.graph.protocol import Feedback, Message
from maya_ros.graph.servers.steps import TaskServer
from maya_ros.graph.table import TASK
from maya_un.service.access.operations import ROS, Caller, Role
from maya_un.steps.store import StepStore
from tests.virtual_time import turn

ANN, BOB = Caller("ann", Role.OPERATOR), Caller("bob", Role.VIEWER)
STRING = "std_msgs/String"


def seats(bus: Bus) -> tuple[BusNode, BusNode]:
    """Return the nodes of two who take part for themselves."""
    return bus.node("rosbridge", lambda: ANN), bus.node("rosbridge", lambda: BOB)


async def settled() -> None:
    for _ in range(50):
        await turn()


async def test_message_keeps_its_publisher_when_older_ones_are_dropped() -> None:
    bus, heard = Bus(), list[tuple[str, str]]()
    ann, bob = seats(bus)
    robot = bus.node("robot")
    robot.subscribe("/t", STRING, lambda message: heard.append((message["data"], caller().name)), queue_size=1)
    for node, name in ((ann, "ann"), (bob, "bob"), (ann, "ann"), (bob, "bob")):
        node.advertise("/t", STRING).publish({"data": name})
    await settled()
    assert heard == [("bob", "bob")]
    robot.advertise("/t", STRING).publish({"data": "nobody's"})
    await settled()
    assert heard[-1] == ("nobody's", ROS.name)


async def test_latched_message_keeps_its_publisher_for_late_subscribers() -> None:
    bus, heard = Bus(), list[str]()
    ann, bob = seats(bus)
    ann.advertise("/t", STRING, latch=True).publish({"data": "x"})
    bob.subscribe("/t", STRING, lambda _: heard.append(caller().name))
    await settled()
    assert heard == ["ann"]


async def test_rights_are_those_of_the_instant_at_which_it_was_published() -> None:
    bus, heard, now = Bus(), list[Role](), [ANN]
    node = bus.node("rosbridge", lambda: now[0])
    bus.node("robot").subscribe("/t", STRING, lambda _: heard.append(caller().role))
    publisher = node.advertise("/t", STRING)
    publisher.publish({})
    now[0] = BOB
    publisher.publish({})
    await settled()
    assert heard == [Role.OPERATOR, Role.VIEWER]


async def test_service_runs_for_its_caller() -> None:
    bus = Bus()
    ann, bob = seats(bus)

    async def answer(_: Message) -> Message:
        await turn()
        return {"success": True, "message": caller().name}

    bus.node("robot").serve("/s", "std_srvs/Trigger", answer)
    answers = await asyncio.gather(*(node.call("/s", {}) for node in (ann, bob, ann)))
    assert [one["message"] for one in answers] == ["ann", "bob", "ann"]
    assert caller() == ROS


async def test_action_runs_for_the_sender_of_the_goal() -> None:
    bus, acted = Bus(), list[str]()
    ann, bob = seats(bus)

    async def act(_: Message, feedback: Feedback) -> Message:
        feedback({})
        await turn()
        acted.append(caller().name)
        return {"success": True}

    bus.node("robot").act(TASK.name, TASK.type, act)
    await asyncio.gather(*(node.do(TASK.name, TASK.type, {}) for node in (bob, ann)))
    assert acted == ["bob", "ann"]


async def test_step_runs_for_its_requester_through_another_node(tmp_path: Path) -> None:
    bus, acted = Bus(), list[str]()
    ann, _ = seats(bus)

    async def act(_: Message, feedback: Feedback) -> Message:
        feedback({})
        acted.append(caller().name)
        return {"success": True}

    bus.node("robot").act(TASK.name, TASK.type, act)
    store = await StepStore.open(tmp_path / "steps.db")
    try:
        async with TaskServer(store, lambda: "today").open(bus.node("firebase_bridge")):
            ann.advertise("/step_command", STRING).publish({"data": '{"id": "1", "command": "home"}'})
            while not acted:
                await turn()
    finally:
        await store.close()
    assert acted == ["ann"]
