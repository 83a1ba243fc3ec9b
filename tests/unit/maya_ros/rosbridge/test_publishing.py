"""Topics that clients publish on."""

from __future__ import annotations

import pytest

from maya_ros.graph.protocol import Feedback, GoalStatus, Message
from maya_ros.rosbridge.limits import TOPICS, UNDER_WAY
from tests.rosbridge_clients import DATE, ClientBus, Said, client_bus, settled
from tests.virtual_time import elapse

STRING = "std_msgs/String"


def received(one: ClientBus, topic: str = "/t", kind: str = STRING) -> list[Message]:
    messages: list[Message] = []
    one.robot.subscribe(topic, kind, messages.append)
    return messages


async def test_published_message_is_received_complete() -> None:
    async with client_bus() as one:
        talker, found = one.talker(), received(one, kind="maya_robot/MayaPrimitive")
        assert await talker.ask("advertise", topic="t", type="maya_robot/MayaPrimitive") == []
        assert await talker.ask("publish", topic="/t", msg={"command": "home", "target": {"x": 1}}) == []
        assert found == [{"command": "home", "target": {"x": 1.0, "y": 0.0, "z": 0.0}, "open": False}]


async def test_topic_of_known_type_needs_no_advertising() -> None:
    async with client_bus() as one:
        talker, found = one.talker(), received(one)
        talker.say("publish", topic="/t", msg={"data": "a"})
        talker.say("publish", topic="/t", msg={"data": "b"})
        assert await talker.told() == []
        assert [message["data"] for message in found] == ["a", "b"]


async def test_a_topic_of_the_table_is_known_before_anybody_is_there() -> None:
    async with client_bus() as one:
        assert await one.talker().ask("publish", topic="/stop_queue", msg={}) == []


async def test_a_topic_of_the_table_keeps_its_type() -> None:
    async with client_bus() as one:
        talker = one.talker()
        (told,) = await talker.ask("advertise", topic="/maya_event", type="std_msgs/Int8")
        assert (told["level"], told["code"]) == ("error", 4005)
        assert STRING in told["msg"]
        assert await talker.ask("advertise", topic="/maya_event", type=STRING) == []


@pytest.mark.parametrize(
    ("message", "code"),
    [
        ({"topic": "/t", "msg": {"data": 5}}, 4018),
        ({"topic": "/t", "msg": {"date": "x"}}, 4018),
        ({"topic": "/t", "msg": "x"}, 4005),
        ({"topic": "/unknown", "msg": {}}, 4019),
        ({"msg": {}}, 4005),
    ],
)
async def test_invalid_message_is_reported_and_not_delivered(message: Said, code: int) -> None:
    async with client_bus() as one:
        talker, found = one.talker(), received(one)
        (told,) = await talker.ask("publish", id="p1", **message)
        assert (told["op"], told["level"], told["id"], told["code"]) == ("status", "error", "p1", code)
        assert told["msg"].startswith(f"{code}: ")
        assert found == []


async def test_bytes_may_come_as_base64() -> None:
    async with client_bus() as one:
        talker, found = one.talker(), received(one, kind="maya_controller/RawSensorData")
        await talker.ask("publish", topic="/t", msg={"stop_code": "AQL/"})
        assert found[0]["stop_code"] == [1, 2, 255]


async def test_message_before_any_subscriber_keeps_its_time() -> None:
    async with client_bus() as one:
        talker = one.talker()
        await talker.ask("advertise", topic="/t", type="sensor_msgs/JointState")
        await talker.ask("publish", topic="/t", msg={})
        await elapse(0.5)
        found = received(one, kind="sensor_msgs/JointState")
        await elapse(0.5)
        assert [message["header"]["stamp"]["secs"] for message in found] == [DATE]


@pytest.mark.parametrize(
    "time", ["now", {"sec": int(DATE), "nanosec": 0}, {"sec": int(DATE), "nsec": 0}, {"secs": int(DATE)}]
)
async def test_a_time_is_the_word_now_or_the_names_of_either_ros(time: object) -> None:
    async with client_bus() as one:
        talker, found = one.talker(), received(one, kind="std_msgs/Time")
        await talker.ask("advertise", topic="/t", type="std_msgs/Time")
        await talker.ask("publish", topic="/t", msg={"data": time})
        assert found == [{"data": one.bus.now() if time == "now" else {"secs": int(DATE), "nsecs": 0}}]


async def test_a_header_without_a_time_is_stamped() -> None:
    async with client_bus() as one:
        talker, found = one.talker(), received(one, kind="sensor_msgs/JointState")
        await talker.ask("publish", topic="/t", msg={"name": ["a"]})
        await talker.ask("publish", topic="/t", msg={"header": {"stamp": {"secs": 7, "nsecs": 0}}})
        assert [message["header"]["stamp"] for message in found] == [one.bus.now(), {"secs": 7, "nsecs": 0}]


@pytest.mark.parametrize("stamp", [None, {}])
async def test_publish_header_with_empty_stamp_gets_time_of_now(stamp: object) -> None:
    async with client_bus() as one:
        talker, found = one.talker(), received(one, kind="sensor_msgs/JointState")
        assert await talker.ask("publish", topic="/t", msg={"header": {"stamp": stamp, "frame_id": "f"}}) == []
        assert found[0]["header"] == {"seq": 0, "stamp": one.bus.now(), "frame_id": "f"}


async def test_latched_message_waits_for_late_subscribers() -> None:
    async with client_bus() as one:
        talker = one.talker()
        await talker.ask("advertise", topic="/t", type=STRING, latch=True)
        await talker.ask("publish", topic="/t", msg={"data": "a"})
        found = received(one)
        await settled()
        assert found == [{"data": "a"}]


async def test_message_on_a_new_topic_waits_for_the_first_subscriber() -> None:
    async with client_bus() as one:
        talker = one.talker()
        await talker.ask("advertise", topic="/t", type=STRING)
        for text in ("a", "b"):
            await talker.ask("publish", topic="/t", msg={"data": text})
        assert [status["code"] for status in await talker.ask("publish", topic="/t", msg={"data": 5})] == [4018]
        found = received(one)
        await talker.ask("publish", topic="/t", msg={"data": "c"})
        await elapse(0.1)
        assert [message["data"] for message in found] == ["a", "b", "c"]


async def test_later_messages_wait_for_no_subscriber() -> None:
    async with client_bus() as one:
        talker = one.talker()
        await talker.ask("advertise", topic="/t", type=STRING)
        await talker.ask("publish", topic="/t", msg={"data": "a"})
        await elapse(1.1)
        await talker.ask("publish", topic="/t", msg={"data": "b"})
        found = received(one)
        await talker.ask("publish", topic="/t", msg={"data": "c"})
        assert [message["data"] for message in found] == ["c"]


async def test_a_topic_is_given_back_when_every_advertisement_of_it_is() -> None:
    async with client_bus() as one:
        talker = one.talker()
        for name in ("a", "b"):
            await talker.ask("advertise", topic="/t", type=STRING, id=name)
        await talker.ask("unadvertise", topic="/t", id="a")
        assert one.bus.topics.find("/t") is not None
        await talker.ask("unadvertise", topic="/t", id="b")
        assert one.bus.topics.find("/t") is None
        await talker.ask("set_level", level="warning")
        assert (await talker.ask("unadvertise", topic="/t", id="b"))[0]["level"] == "warning"


@pytest.mark.parametrize(
    ("message", "code"),
    [
        ({"topic": "/t"}, 4005),
        ({"topic": "/t", "type": "std_msgs/Nothing"}, 4019),
        ({"topic": "/t", "type": "nothing"}, 4005),
        ({"topic": "/t", "type": STRING, "latch": "yes"}, 4005),
        ({"topic": "/known", "type": STRING}, 4005),
    ],
)
async def test_impossible_advertisement_is_reported(message: Said, code: int) -> None:
    async with client_bus() as one:
        one.robot.advertise("/known", "std_msgs/Float64")
        assert [status["code"] for status in await one.talker().ask("advertise", **message)] == [code]


async def test_a_client_publishes_on_so_many_topics_only() -> None:
    async with client_bus() as one:
        talker = one.talker()
        for number in range(TOPICS + 1):
            talker.say("advertise", topic=f"/t{number}", type=STRING)
        assert [status["code"] for status in await talker.told()] == [4005]


class Acting:
    """Serves /task: a goal is carried out until it is cancelled."""

    def __init__(self, one: ClientBus) -> None:
        self.begun: list[Message] = []
        self.cancelled = 0
        one.robot.act("/task", "maya_robot/Task", self.act)

    async def act(self, goal: Message, feedback: Feedback) -> Message:
        self.begun.append(goal)
        feedback({"phase": "waiting"})
        try:
            await _for_ever()
        finally:
            self.cancelled += 1
        return {}


async def _for_ever() -> None:
    from asyncio import Event

    await Event().wait()


GOAL = {"goal_id": {"id": "g1"}, "goal": {"task": {"command": "home"}}}


async def test_a_goal_sent_as_a_topic_is_cancelled_when_its_client_goes() -> None:
    async with client_bus() as one:
        acting, talker = Acting(one), one.talker()
        await talker.ask("subscribe", topic="/task/result", type="maya_robot/TaskActionResult")
        await talker.ask("publish", topic="/task/goal", msg=GOAL)
        assert len(acting.begun) == 1
        await one.leave(talker)
        await settled()
        assert acting.cancelled == 1


async def test_goal_goes_on_when_its_client_does_not_wait_for_the_result() -> None:
    async with client_bus() as one:
        acting, talker = Acting(one), one.talker()
        await talker.ask("publish", topic="/task/goal", msg=GOAL)
        await one.leave(talker)
        await settled()
        assert (len(acting.begun), acting.cancelled) == (1, 0)


async def test_a_goal_is_cancelled_although_its_client_has_unadvertised_the_topic() -> None:
    async with client_bus() as one:
        acting, talker, cancels = Acting(one), one.talker(), received(one, "/task/cancel", "actionlib_msgs/GoalID")
        await talker.ask("subscribe", topic="/task/result", type="maya_robot/TaskActionResult")
        await talker.ask("publish", topic="/task/goal", msg=GOAL)
        await talker.ask("unadvertise", topic="/task/goal")
        assert (len(acting.begun), acting.cancelled) == (1, 0)
        await one.leave(talker)
        await settled()
        assert (acting.cancelled, [cancel["id"] for cancel in cancels]) == (1, ["g1"])


async def test_the_cancel_of_a_goal_is_advertised_with_it() -> None:
    """A server of ROS 1 needs time to connect: what is published before that is lost."""
    async with client_bus() as one:
        talker = one.talker()
        await talker.ask("advertise", topic="/task/goal", type="maya_robot/TaskActionGoal")
        assert "/task/cancel" not in one.bus.topics.kinds
        await talker.ask("publish", topic="/task/goal", msg=GOAL)
        assert one.bus.topics.kinds["/task/cancel"] == "actionlib_msgs/GoalID"
        await one.leave(talker)
        await settled()
        assert "/task/cancel" not in one.bus.topics.kinds


class Ending(Acting):
    """Serves /task: the goal "home" is carried out until it is cancelled, every other one ends at once."""

    async def act(self, goal: Message, feedback: Feedback) -> Message:
        if goal["task"]["command"] == "home":
            return await super().act(goal, feedback)
        feedback({"phase": "done"})
        return {}


@pytest.mark.parametrize("more", [1, UNDER_WAY + 1])
async def test_a_goal_is_cancelled_after_other_goals_that_have_ended(more: int) -> None:
    async with client_bus() as one:
        acting, talker, cancels = Ending(one), one.talker(), received(one, "/task/cancel", "actionlib_msgs/GoalID")
        await talker.ask("subscribe", topic="/task/result", type="maya_robot/TaskActionResult")
        await talker.ask("publish", topic="/task/goal", msg=GOAL)
        for number in range(more):
            other = {"goal_id": {"id": f"x{number}"}, "goal": {"task": {"command": "can_teleop"}}}
            await talker.ask("publish", topic="/task/goal", msg=other)
        assert (acting.cancelled, cancels) == (0, [])
        await one.leave(talker)
        await settled()
        assert (acting.cancelled, [cancel["id"] for cancel in cancels]) == (1, ["g1"])


@pytest.mark.parametrize("waits", [True, False])
async def test_the_oldest_of_too_many_goals_under_way_is_cancelled_if_its_client_waits(waits: bool) -> None:
    async with client_bus() as one:
        talker, cancels = one.talker(), received(one, "/task/cancel", "actionlib_msgs/GoalID")
        if waits:
            await talker.ask("subscribe", topic="/task/result", type="maya_robot/TaskActionResult")
        for number in range(UNDER_WAY + 1):
            talker.say("publish", topic="/task/goal", msg=GOAL | {"goal_id": {"id": f"g{number}"}})
        assert await talker.told() == []
        assert [cancel["id"] for cancel in cancels] == ["g0"][:waits]


async def test_an_invalid_goal_is_not_cancelled() -> None:
    async with client_bus() as one:
        talker, cancels = one.talker(), received(one, "/task/cancel", "actionlib_msgs/GoalID")
        await talker.ask("subscribe", topic="/task/result", type="maya_robot/TaskActionResult")
        for invalid in ({"goal_id": 5}, {"goal_id": {"id": 5}}, GOAL | {"goal": 5}):
            (told,) = await talker.ask("publish", topic="/task/goal", msg=invalid)
            assert told["code"] == 4018
        await one.leave(talker)
        await settled()
        assert cancels == []


async def test_actions_are_driven_by_their_topics_as_in_ros_1() -> None:
    async with client_bus() as one:
        Acting(one)
        talker = one.talker()
        for name, kind in (("result", "maya_robot/TaskActionResult"), ("feedback", "maya_robot/TaskActionFeedback")):
            await talker.ask("subscribe", topic=f"/task/{name}", type=kind)
        told = await talker.ask("publish", topic="/task/goal", msg=GOAL)
        assert [message["msg"]["feedback"]["phase"] for message in told] == ["waiting"]
        await talker.ask("advertise", topic="/task/cancel", type="actionlib_msgs/GoalID")
        told = await talker.ask("publish", topic="/task/cancel", msg={"id": "g1"})
        ((result),) = [message["msg"] for message in told if message["topic"] == "/task/result"]
        assert (result["status"]["status"], result["result"]["code"]) == (GoalStatus.PREEMPTED, "2202")
