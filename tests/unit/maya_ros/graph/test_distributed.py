"""/task passed on to the deciding node: it ends here as it ends there."""

from __future__ import annotations

import asyncio

import pytest

from maya_ros.graph.bus import Bus
from maya_ros.graph.conversions import primitive_to_message
from maya_ros.graph.distributed import robot_layer, robot_layer_seen
from maya_ros.graph.outcome import error_of, failure, success
from maya_ros.graph.protocol import Feedback, GoalRefused, GoalResult, GoalStatus, Message
from maya_ros.graph.servers.forwarding import INNER, tasks_forwarded
from maya_ros.graph.table import MAYA_COMMAND, TASK
from maya_un.errors import Busy, Cancelled, FollowingError, MayaError, NodeGone, NotConnected, Stopped
from maya_un.robot.primitives.home import Home
from tests.calm import CALM
from tests.graphs import controller_node
from tests.virtual_time import elapse

HOME = {"task": primitive_to_message(Home())}


async def handed_on(ending: MayaError | GoalRefused | None) -> tuple[GoalResult, list[Message]]:
    bus, heard = Bus(), list[Message]()

    async def act(_goal: Message, feedback: Feedback) -> Message:
        if isinstance(ending, GoalRefused):
            raise ending
        feedback({"phase": "home", "progress": 0.5})
        if ending is not None:
            raise ending
        return success()

    bus.node("robot_controller").act(INNER, TASK.type, act)
    async with tasks_forwarded(bus.node("primitive_server")):
        return await bus.node("process_controller").do(TASK.name, TASK.type, HOME, heard.append), heard


@pytest.mark.parametrize(
    ("ending", "outcome", "code"),
    [
        (None, GoalStatus.SUCCEEDED, ""),
        (FollowingError(axis="b"), GoalStatus.ABORTED, "2302"),
        (Stopped(), GoalStatus.PREEMPTED, "2201"),
        (GoalRefused(failure(Busy(doing="task"))), GoalStatus.REJECTED, "2104"),
    ],
)
async def test_it_ends_as_it_ended_there(
    ending: MayaError | GoalRefused | None, outcome: GoalStatus, code: str
) -> None:
    ended, heard = await handed_on(ending)
    assert (ended.outcome, ended.result["code"]) == (outcome, code)
    assert [message["phase"] for message in heard] == ([] if isinstance(ending, GoalRefused) else ["home"])


async def test_task_without_a_deciding_node_reports_it_gone() -> None:
    bus = Bus()
    async with tasks_forwarded(bus.node("primitive_server")):
        ended = await bus.node("process_controller").do(TASK.name, TASK.type, HOME)
        assert ended.outcome is GoalStatus.ABORTED
        assert isinstance(error_of(ended.result), NodeGone)
        assert ended.result["message"].startswith("robot_controller has ended, so")


async def test_missing_nodes_of_the_robot_layer_are_listed() -> None:
    bus = Bus()
    deciding = bus.node("robot_controller")
    with robot_layer_seen(bus.node("process_controller")) as missing:
        assert [error.details["node"] for error in missing()] == ["robot_controller", "primitive_server"]
        async with robot_layer(deciding, CALM), tasks_forwarded(bus.node("primitive_server")):
            assert missing() == []
            deciding.close()
            assert [error.details["node"] for error in missing()] == ["robot_controller"]


async def test_a_cancel_goes_through_and_waits_for_rest() -> None:
    bus, rested = Bus(), list[float]()

    async def act(_goal: Message, feedback: Feedback) -> Message:
        feedback({"phase": "home"})
        try:
            await elapse(60.0)
        except asyncio.CancelledError:
            await elapse(2.0)
            rested.append(asyncio.get_running_loop().time())
            raise
        return success()

    bus.node("robot_controller").act(INNER, TASK.type, act)
    async with tasks_forwarded(bus.node("primitive_server")):
        client = bus.node("process_controller")
        request = asyncio.ensure_future(client.do(TASK.name, TASK.type, HOME))
        await elapse(1.0)
        request.cancel()
        await asyncio.wait({request})
    assert rested == [3.0]


async def test_robot_layer_refuses_until_the_controller_layer_is_there() -> None:
    bus = Bus()
    somebody = bus.node("somebody")
    async with robot_layer(bus.node("robot_controller"), CALM) as controller:
        answer = await somebody.call(MAYA_COMMAND.name, HOME, MAYA_COMMAND.type)
        assert isinstance(error_of(answer), NotConnected)
        async with controller_node(bus, homed=True):
            await controller.connected()
            teleop = {"task": {"command": "can_teleop"}}
            await elapse(0.5)
            assert (await somebody.call(MAYA_COMMAND.name, teleop, MAYA_COMMAND.type))["success"]


async def test_running_command_is_at_rest_when_the_robot_layer_ends() -> None:
    bus = Bus()
    async with controller_node(bus) as low:
        async with robot_layer(bus.node("robot_controller"), CALM) as controller:
            await controller.connected()
            request = asyncio.ensure_future(bus.node("somebody").do(INNER, TASK.type, HOME))
            await elapse(20.0)
            assert low.rig.controller.state.moving
        assert not low.rig.controller.state.moving
        ended = await request
        assert (ended.outcome, ended.result["code"]) == (GoalStatus.PREEMPTED, str(Cancelled.code))
