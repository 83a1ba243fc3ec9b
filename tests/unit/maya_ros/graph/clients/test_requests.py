"""Commands over a graph end as on the server: with the same error, or at rest."""

from __future__ import annotations

import asyncio

import pytest

from maya_ros.graph.bus import Bus
from maya_ros.graph.outcome import call_service, failure, run_action, success, trigger_failure
from maya_ros.graph.protocol import Act, Feedback, GoalRefused, Message
from maya_ros.graph.table import HOME, STOP
from maya_un.errors import Busy, FollowingError, MayaError, NodeGone, ServiceFailed, Stopped
from tests.virtual_time import elapse


async def homed_by(act: Act) -> Message:
    bus = Bus()
    bus.node("hw_simulator").act(HOME.name, HOME.type, act)
    return await run_action(bus.node("robot_controller"), HOME, {})


async def test_success_returns_the_result() -> None:
    async def act(_goal: Message, _feedback: Feedback) -> Message:
        return success()

    assert await homed_by(act) == success()


@pytest.mark.parametrize("error", [FollowingError(axis="b"), Stopped(), Busy(doing="move")])
async def test_remote_error_is_raised_here(error: MayaError) -> None:
    async def fails(_goal: Message, feedback: Feedback) -> Message:
        feedback({"phase": "begun"})
        raise error

    async def refuses(_goal: Message, _feedback: Feedback) -> Message:
        raise GoalRefused(failure(error))

    async def tells(_goal: Message, _feedback: Feedback) -> Message:
        return failure(error)

    for act in (fails, refuses, tells):
        with pytest.raises(type(error)) as raised:
            await homed_by(act)
        assert str(raised.value) == str(error)


async def test_unknown_error_code_is_a_failed_service() -> None:
    async def act(_goal: Message, _feedback: Feedback) -> Message:
        return {"success": False, "code": "7777", "message": "of another version"}

    with pytest.raises(ServiceFailed, match="of another version"):
        await homed_by(act)


async def test_call_without_a_server_reports_the_node_gone() -> None:
    node = Bus().node("robot_controller")
    with pytest.raises(NodeGone, match=HOME.sources[0]):
        await run_action(node, HOME, {})
    with pytest.raises(NodeGone, match=STOP.sources[0]):
        await call_service(node, STOP, {})


async def test_a_server_that_dies_in_the_middle_is_gone() -> None:
    bus = Bus()
    server = bus.node("hw_simulator")

    async def act(_goal: Message, feedback: Feedback) -> Message:
        feedback({"phase": "begun"})
        await elapse(60.0)
        return success()

    server.act(HOME.name, HOME.type, act)
    request = asyncio.ensure_future(run_action(bus.node("robot_controller"), HOME, {}))
    await elapse(1.0)
    server.close()
    with pytest.raises(NodeGone):
        await request


async def test_a_service_says_its_error_too() -> None:
    bus = Bus()

    async def answer(_: Message) -> Message:
        return trigger_failure(FollowingError(axis="b"))

    bus.node("hw_simulator").serve(STOP.name, STOP.type, answer)
    with pytest.raises(FollowingError) as raised:
        await call_service(bus.node("robot_controller"), STOP, {})
    assert str(raised.value) == str(FollowingError(axis="b"))


async def test_a_second_cancel_does_not_leave_before_the_robot_is_at_rest() -> None:
    bus, rests = Bus(), list[float]()

    async def act(_goal: Message, feedback: Feedback) -> Message:
        feedback({"phase": "begun"})
        try:
            await elapse(60.0)
        except asyncio.CancelledError:
            await elapse(2.0)
            rests.append(asyncio.get_running_loop().time())
            raise
        return success()

    bus.node("hw_simulator").act(HOME.name, HOME.type, act)
    request = asyncio.ensure_future(run_action(bus.node("robot_controller"), HOME, {}))
    await elapse(1.0)
    request.cancel()
    await elapse(0.5)
    request.cancel()
    await asyncio.wait({request})
    assert request.cancelled()
    assert rests == [3.0]
