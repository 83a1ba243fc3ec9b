"""A graph within one process: subscribers, servers, and the end of nodes."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from maya_ros.graph.bus import Bus
from maya_ros.graph.protocol import Feedback, GoalResult, GoalStatus, Graph, Message, NodeInfo
from maya_un.errors import Busy, InvalidMessage, NodeGone, ServiceFailed, UnknownInterface
from tests.virtual_time import elapse

POINT = "geometry_msgs/Point"
STRING = "std_msgs/String"
MOVE = "maya_controller/Move"
ORIGIN = {"x": 0.0, "y": 0.0, "z": 0.0}
DONE = {"success": True, "code": "", "message": ""}


async def acknowledge(_: Message) -> Message:
    return {"success": True}


async def forever(_: Message, feedback: Feedback) -> Message:
    feedback({})
    await asyncio.Event().wait()
    return DONE


async def test_a_node_is_a_graph() -> None:
    graph: Graph = Bus().node("one")
    assert await graph.directory.topics() == {}


async def test_subscribers_get_messages_completed_and_in_order() -> None:
    bus, heard, other = Bus(), list[Message](), list[Message]()
    publisher = bus.node("speaker").advertise("/point", POINT)
    bus.node("one").subscribe("/point", POINT, heard.append)
    bus.node("two").subscribe("point/", "", other.append)  # the topic already has this type
    for x in range(3):
        publisher.publish({"x": x})
    assert heard == []  # nobody is called while somebody publishes
    await elapse(0.0)
    assert heard == other == [{**ORIGIN, "x": float(x)} for x in range(3)]
    assert publisher.readers == 2


async def test_late_subscriber_gets_latched_messages_only() -> None:
    bus, heard = Bus(), list[Message]()
    latched = bus.node("one").advertise("/a", STRING, latch=True)
    plain = bus.node("one").advertise("/b", STRING)
    for publisher in (latched, plain):
        publisher.publish({"data": "old"})
        publisher.publish({"data": "new"})
    node = bus.node("late")
    node.subscribe("/a", STRING, heard.append)
    node.subscribe("/b", STRING, heard.append)
    await elapse(0.0)
    assert heard == [{"data": "new"}]
    latched.close()
    node.subscribe("/a", STRING, heard.append)
    await elapse(0.0)
    assert heard == [{"data": "new"}]


async def test_of_a_full_queue_the_oldest_are_dropped() -> None:
    bus, short, long = Bus(), list[Message](), list[Message]()
    publisher = bus.node("one").advertise("/a", STRING)
    bus.node("two").subscribe("/a", STRING, short.append, queue_size=2)
    bus.node("two").subscribe("/a", STRING, long.append, queue_size=0)
    for number in range(500):
        publisher.publish({"data": str(number)})
    await elapse(0.0)
    assert [message["data"] for message in short] == ["498", "499"]
    assert len(long) == 500


async def test_cancelled_subscription_gets_nothing_more() -> None:
    bus, heard = Bus(), list[Message]()
    publisher = bus.node("one").advertise("/a", STRING)
    subscription = bus.node("two").subscribe("/a", STRING, heard.append)
    publisher.publish({"data": "x"})
    subscription.close()
    subscription.close()
    publisher.close()
    publisher.close()
    publisher.publish({"data": "y"})
    await elapse(0.0)
    assert heard == []
    assert await bus.directory.topics() == {}


async def test_subscription_can_be_cancelled_from_its_callback() -> None:
    bus, heard = Bus(), list[Message]()
    publisher = bus.node("one").advertise("/a", STRING)

    def once(message: Message) -> None:
        heard.append(message)
        subscription.close()

    subscription = bus.node("two").subscribe("/a", STRING, once)
    publisher.publish({"data": "1"})
    publisher.publish({"data": "2"})
    await elapse(0.0)
    assert heard == [{"data": "1"}]


async def test_one_that_cannot_cope_keeps_nothing_from_the_others() -> None:
    bus, heard, told = Bus(), list[Message](), list[dict[str, Any]]()
    asyncio.get_running_loop().set_exception_handler(lambda _, context: told.append(context))
    publisher = bus.node("one").advertise("/a", STRING)
    bus.node("bad").subscribe("/a", STRING, lambda message: heard.append(message["nothing"]))
    bus.node("good").subscribe("/a", STRING, heard.append)
    publisher.publish({"data": "1"})
    publisher.publish({"data": "2"})
    await elapse(0.0)
    assert heard == [{"data": "1"}, {"data": "2"}]
    assert [type(one["exception"]) for one in told] == [KeyError, KeyError]


async def test_invalid_message_is_not_delivered() -> None:
    bus, heard = Bus(), list[Message]()
    publisher = bus.node("one").advertise("/a", STRING, latch=True)
    bus.node("two").subscribe("/a", STRING, heard.append)
    with pytest.raises(InvalidMessage):
        publisher.publish({"data": 1})
    await elapse(0.0)
    assert heard == []


async def test_a_topic_has_one_type() -> None:
    node = Bus().node("one")
    node.advertise("/a", STRING)
    with pytest.raises(InvalidMessage, match="carries std_msgs/String"):
        node.subscribe("/a", POINT, lambda _: None)
    with pytest.raises(UnknownInterface):
        node.subscribe("/b", "", lambda _: None)
    with pytest.raises(UnknownInterface):
        node.advertise("/b", "none/Such")


async def test_headers_are_stamped_by_the_clock_of_the_graph() -> None:
    bus, heard = Bus(lambda: 12.5), list[Message]()
    node = bus.node("one")
    publisher = node.advertise("/j", "sensor_msgs/JointState")
    node.subscribe("/j", "", heard.append)
    publisher.publish({})
    await elapse(0.0)
    assert heard[0]["header"]["stamp"] == {"secs": 12, "nsecs": 500_000_000}


async def test_publishers_and_subscribers_are_known() -> None:
    bus = Bus()
    one, two = bus.node("one"), bus.node("two")
    one.advertise("/a", STRING)
    subscription = two.subscribe("/a", STRING, lambda _: None)
    one.serve("/s", "std_srvs/Trigger", acknowledge)
    two.act("/move", MOVE, forever)
    assert subscription.writers == {"/one"}
    assert (await bus.directory.topics())["/move/goal"] == "maya_controller/MoveActionGoal"
    assert await bus.directory.services() == {"/s": "std_srvs/Trigger"}
    nodes = await bus.directory.nodes()
    assert nodes["/one"] == NodeInfo(("/a",), (), ("/s",))
    assert nodes["/two"] == NodeInfo(
        ("/move/feedback", "/move/result", "/move/status"), ("/a", "/move/cancel", "/move/goal"), ()
    )
    one.close()
    assert subscription.writers == frozenset()
    assert "/one" not in await bus.directory.nodes()
    assert await bus.directory.services() == {}


# Services.


async def test_a_service_answers() -> None:
    bus = Bus()
    bus.node("one").serve("/s", "std_srvs/SetBool", acknowledge)
    answer = await bus.node("two").call("s", {"data": True}, "std_srvs/SetBool")
    assert answer == {"success": True, "message": ""}


async def test_known_value_is_answered_at_once() -> None:
    bus = Bus()

    def quick(request: Message) -> Message | None:
        return {"message": "quick"} if request["data"] else None

    bus.node("one").serve("/s", "std_srvs/SetBool", acknowledge, quick)
    assert (await bus.node("two").call("/s", {"data": True}))["message"] == "quick"
    assert (await bus.node("two").call("/s", {"data": False}))["success"]


async def test_a_service_that_fails_says_why() -> None:
    bus = Bus()

    async def fail(_: Message) -> Message:
        raise Busy(doing="home")

    bus.node("one").serve("/s", "std_srvs/Trigger", fail)
    with pytest.raises(ServiceFailed, match="home"):
        await bus.node("two").call("/s", {})


@pytest.mark.parametrize(
    ("name", "request_", "kind", "error"),
    [
        ("/t", {}, "", UnknownInterface),
        ("/s", {"data": 1}, "", InvalidMessage),
        ("/s", {"dat": True}, "", InvalidMessage),
        ("/s", {}, "std_srvs/Trigger", InvalidMessage),
    ],
)
async def test_a_call_that_makes_no_sense_is_refused(
    name: str, request_: Message, kind: str, error: type[Exception]
) -> None:
    bus = Bus()
    bus.node("one").serve("/s", "std_srvs/SetBool", acknowledge)
    with pytest.raises(error):
        await bus.node("two").call(name, request_, kind)


async def test_closing_node_cancels_its_answers_and_waits_for_their_end() -> None:
    bus, ended = Bus(), list[float]()

    async def slow(_: Message) -> Message:
        try:
            await elapse(100.0)
        finally:
            await elapse(2.0)
            ended.append(asyncio.get_running_loop().time())
        return {}

    bus.node("one").serve("/s", "std_srvs/Trigger", slow)
    task = asyncio.ensure_future(bus.node("two").call("/s", {}))
    await elapse(1.0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert ended == [pytest.approx(3.0)]


async def test_call_fails_when_its_server_closes() -> None:
    bus = Bus()

    async def slow(_: Message) -> Message:
        await elapse(100.0)
        return {}

    server = bus.node("one")
    server.serve("/s", "std_srvs/Trigger", slow)
    task = asyncio.ensure_future(bus.node("two").call("/s", {}))
    await elapse(1.0)
    server.close()
    with pytest.raises(ServiceFailed, match="no longer answers"):
        await task
    with pytest.raises(UnknownInterface):
        await bus.node("two").call("/s", {})


# Actions.


async def test_a_goal_is_carried_out_with_its_feedback() -> None:
    bus, heard = Bus(), list[Message]()

    async def act(goal: Message, feedback: Feedback) -> Message:
        feedback({"a": goal["a"]})
        await elapse(1.0)
        return DONE

    bus.node("one").act("/move", MOVE, act)
    ended = await bus.node("two").do("/move", MOVE, {"a": 2.0}, heard.append)
    assert ended == GoalResult(GoalStatus.SUCCEEDED, DONE)
    assert heard == [{"a": 2.0, "b": 0.0, "c": 0.0, "progress": 0.0}]
    assert set(await bus.directory.topics()) == {
        f"/move/{part}" for part in ("goal", "cancel", "status", "feedback", "result")
    }


async def test_clients_get_results_of_their_own_goals_only() -> None:
    bus = Bus()

    async def act(goal: Message, _: Feedback) -> Message:
        await elapse(goal["a"])
        return {**DONE, "message": str(goal["a"])}

    bus.node("one").act("/move", MOVE, act)
    clients = [bus.node("same"), bus.node("same")]
    ends = await asyncio.gather(*(client.do("/move", MOVE, {"a": float(n)}) for n, client in enumerate(clients)))
    assert [end.result["message"] for end in ends] == ["0.0", "1.0"]


async def test_closing_client_cancels_its_goal_and_waits_for_the_end() -> None:
    bus = Bus()

    async def act(_: Message, feedback: Feedback) -> Message:
        feedback({})
        try:
            await elapse(100.0)
        except asyncio.CancelledError:
            await elapse(3.0)
            raise
        return DONE

    bus.node("one").act("/move", MOVE, act)
    task = asyncio.ensure_future(bus.node("two").do("/move", MOVE, {}))
    await elapse(1.0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert asyncio.get_running_loop().time() == pytest.approx(4.0, abs=0.1)


async def test_missing_server_is_reported_at_once() -> None:
    bus = Bus()
    with pytest.raises(NodeGone):
        await bus.node("two").do("/move", MOVE, {})


async def test_of_a_server_that_died_the_goal_is_lost() -> None:
    bus = Bus()
    server = bus.node("one")
    server.act("/move", MOVE, forever)
    task = asyncio.ensure_future(bus.node("two").do("/move", MOVE, {}))
    await elapse(1.0)
    server.close()
    server.close()
    assert await task == GoalResult(GoalStatus.LOST, {})


async def test_closing_server_still_delivers_the_result() -> None:
    bus = Bus()
    server = bus.node("one").act("/move", MOVE, forever)
    task = asyncio.ensure_future(bus.node("two").do("/move", MOVE, {}))
    await elapse(1.0)
    server.close()
    ended = await task
    assert (ended.outcome, ended.result["code"]) == (GoalStatus.PREEMPTED, "2202")


async def test_a_client_that_died_waits_for_nothing() -> None:
    bus = Bus()
    bus.node("one").act("/move", MOVE, forever)
    client = bus.node("two")
    task = asyncio.ensure_future(client.do("/move", MOVE, {}))
    await elapse(1.0)
    client.close()
    assert (await task).outcome is GoalStatus.LOST
    await elapse(1.0)
    assert not bus.actions["/move"].server.busy


async def test_a_goal_that_does_not_fit_is_refused_here() -> None:
    bus = Bus()
    bus.node("one").act("/move", MOVE, forever)
    with pytest.raises(InvalidMessage):
        await bus.node("two").do("/move", MOVE, {"a": "x"})
    assert "/two" in await bus.directory.nodes()
    assert bus.topics.find("/move/goal") is not None
    assert not bus.actions["/move"].server.goals
