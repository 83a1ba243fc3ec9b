"""Subscriptions of clients: content, rate, form, and slow readers."""

from __future__ import annotations

import base64
import json
import struct
from typing import Any

import pytest

from maya_ros.graph.types import default, serialize
from maya_ros.rosbridge import outgoing
from maya_ros.rosbridge.limits import REQUESTS, TOPICS, WAITING
from tests.rosbridge_clients import DATE, BusClient, ClientBus, Said, client_bus, settled
from tests.virtual_time import elapse

STRING = "std_msgs/String"


def data_of(said: list[Said]) -> list[Any]:
    return [message["msg"]["data"] for message in said if message["op"] == "publish"]


class Source:
    """Publishes numbers as texts on /t."""

    def __init__(self, one: ClientBus, *, latch: bool = False) -> None:
        self._publisher = one.robot.advertise("/t", STRING, latch=latch)
        self._count = 0

    def tell(self, times: int = 1, text: str = "") -> None:
        for _ in range(times):
            self._publisher.publish({"data": f"{self._count}{text}"})
            self._count += 1


async def test_client_gets_a_topic_under_the_name_that_it_used() -> None:
    async with client_bus() as one:
        source, first, other = Source(one), one.talker(), one.talker()
        first.say("subscribe", topic="/t", type=STRING)
        other.say("subscribe", topic="t")
        await settled()
        source.tell()
        assert await first.told() == [{"op": "publish", "topic": "/t", "msg": {"data": "0"}}]
        assert await other.told() == [{"op": "publish", "topic": "t", "msg": {"data": "0"}}]


async def test_unsubscribed_client_gets_nothing() -> None:
    async with client_bus() as one:
        source, talker = Source(one), one.talker()
        await talker.ask("subscribe", topic="/t", type=STRING, id="a")
        await talker.ask("subscribe", topic="/t", type=STRING, id="b")
        talker.say("unsubscribe", topic="/t", id="a")
        source.tell()
        assert data_of(await talker.told()) == ["0"]
        talker.say("unsubscribe", topic="/t", id="b")
        source.tell()
        assert data_of(await talker.told()) == []


async def test_unsubscribing_without_an_id_ends_all_subscriptions_of_the_topic() -> None:
    async with client_bus() as one:
        source, talker = Source(one), one.talker()
        for name in ("a", "b"):
            await talker.ask("subscribe", topic="/t", type=STRING, id=name)
        talker.say("unsubscribe", topic="/t")
        source.tell()
        assert data_of(await talker.told()) == []


async def test_client_that_leaves_gets_nothing_and_is_unsubscribed() -> None:
    async with client_bus() as one:
        source, talker = Source(one), one.talker()
        await talker.ask("subscribe", topic="/t", type=STRING)
        await one.leave(talker)
        source.tell()
        assert await talker.told() == []
        assert (await one.bus.directory.nodes()).get("/rosbridge") is None


@pytest.mark.parametrize(
    ("message", "code"),
    [
        ({"topic": "/unknown"}, 4019),
        ({"topic": "/t", "type": "std_msgs/Float64"}, 4005),
        ({"topic": "/t", "type": "no_msgs/Thing"}, 4005),
        ({"topic": "/new", "type": "no_msgs/Thing"}, 4019),
        ({"topic": "no name"}, 4005),
        ({}, 4005),
        ({"topic": "/t", "throttle_rate": -1}, 4005),
        ({"topic": "/t", "queue_length": "many"}, 4005),
        ({"topic": "/t", "fragment_size": 1}, 4005),
        ({"topic": "/t", "compression": "zip"}, 4005),
    ],
)
async def test_impossible_subscription_is_reported_and_leaves_nothing(message: Said, code: int) -> None:
    async with client_bus() as one:
        source, talker = Source(one), one.talker()
        told = await talker.ask("subscribe", id="s", **message)
        assert [(status["op"], status["level"], status["id"], status["code"]) for status in told] == [
            ("status", "error", "s", code)
        ]
        source.tell()
        assert await talker.told() == []
        assert one.bus.topics.find("/new") is None


async def test_a_second_subscription_of_another_type_is_refused_and_the_first_goes_on() -> None:
    async with client_bus() as one:
        source, talker = Source(one), one.talker()
        await talker.ask("subscribe", topic="/t", type=STRING)
        assert (await talker.ask("subscribe", topic="/t", type="std_msgs/Empty", id="2"))[0]["code"] == 4005
        source.tell()
        assert data_of(await talker.told()) == ["0"]


async def test_messages_are_no_more_frequent_than_the_throttle() -> None:
    async with client_bus() as one:
        source, talker = Source(one), one.talker()
        await talker.ask("subscribe", topic="/t", type=STRING, throttle_rate=125)
        for _ in range(40):
            source.tell()
            await elapse(1 / 64)
        assert data_of(await talker.told()) == ["0", "8", "16", "24", "32"]


async def test_with_a_queue_the_newest_wait_for_the_throttle_and_older_ones_are_dropped() -> None:
    async with client_bus() as one:
        source, talker = Source(one), one.talker()
        await talker.ask("subscribe", topic="/t", type=STRING, throttle_rate=100, queue_length=3)
        source.tell(10)
        assert data_of(await talker.told()) == ["0"]
        times: list[str] = []
        for _ in range(5):
            await elapse(0.1)
            times += data_of(await talker.told())
        assert times == ["7", "8", "9"]


async def test_of_several_subscriptions_the_least_throttle_and_queue_count() -> None:
    async with client_bus() as one:
        source, talker = Source(one), one.talker()
        await talker.ask("subscribe", topic="/t", type=STRING, id="slow", throttle_rate=1000, queue_length=5)
        await talker.ask("subscribe", topic="/t", type=STRING, id="fast", throttle_rate=100)
        source.tell(3)
        await elapse(0.1)
        source.tell(2)
        assert data_of(await talker.told()) == ["0", "3"]
        await talker.ask("unsubscribe", topic="/t", id="fast")
        source.tell(2)
        assert data_of(await talker.told()) == []
        await elapse(1.0)
        assert data_of(await talker.told()) == ["5"]


async def test_late_subscriber_of_a_latched_topic_gets_its_last_message() -> None:
    async with client_bus() as one:
        source, talker = Source(one, latch=True), one.talker()
        source.tell(3)
        await settled()
        assert data_of(await talker.ask("subscribe", topic="/t", type=STRING)) == ["2"]


async def test_second_subscription_of_one_client_gets_the_latched_message() -> None:
    async with client_bus() as one:
        events, talker = one.robot.advertise("/maya_event", STRING, latch=True), one.talker()
        events.publish({"data": "homed {}"})
        assert data_of(await talker.ask("subscribe", topic="/maya_event", id="a")) == ["homed {}"]
        assert data_of(await talker.ask("subscribe", topic="/maya_event", id="b")) == ["homed {}"]
        assert data_of(await talker.ask("subscribe", topic="/maya_event", id="b")) == [], "that is no new one"


async def test_message_is_encoded_once_for_all_subscribers_of_a_form() -> None:
    async with client_bus() as one:
        source, talkers = Source(one), [one.talker() for _ in range(5)]
        sent: list[bytes] = []
        for talker in talkers:
            talker.mouth.write = sent.append  # type: ignore[method-assign]
            talker.say("subscribe", topic="/t", type=STRING)
        await settled()
        source.tell()
        await settled()
        assert len(sent) == 5
        assert all(frames is sent[0] for frames in sent)


async def test_long_messages_are_fragmented_at_the_smallest_size() -> None:
    async with client_bus() as one:
        source, talker = Source(one), one.talker()
        await talker.ask("subscribe", topic="/t", type=STRING, id="a", fragment_size=500)
        await talker.ask("subscribe", topic="/t", type=STRING, id="b", fragment_size=40)
        source.tell(text="x" * 100)
        told = await talker.told()
        assert {message["op"] for message in told} == {"fragment"}
        assert max(len(message["data"]) for message in told) == 40
        whole = json.loads("".join(message["data"] for message in told))
        assert whole == {"op": "publish", "topic": "/t", "msg": {"data": "0" + "x" * 100}}


async def test_picture_may_be_requested_whole_or_in_fragments() -> None:
    async with client_bus() as one:
        source, talker = Source(one), one.talker()
        await talker.ask("subscribe", topic="/t", type=STRING, compression="png")
        source.tell(text="x" * 500)
        (told,) = await talker.told()
        assert told["op"] == "png"
        assert json.loads(outgoing.decoded(told["data"], 10_000))["msg"] == {"data": "0" + "x" * 500}
        await talker.ask("subscribe", topic="/t", type=STRING, id="small", fragment_size=50)
        source.tell(text="y" * 500)
        pieces = await talker.told()
        picture = json.loads("".join(message["data"] for message in pieces))
        assert json.loads(outgoing.decoded(picture["data"], 10_000))["msg"] == {"data": "1" + "y" * 500}


async def test_strongest_requested_compression_is_used() -> None:
    async with client_bus() as one:
        source, talker = Source(one), one.talker()
        for compression in ("none", "cbor-raw", "cbor", "png"):
            await talker.ask("subscribe", topic="/t", type=STRING, id=compression, compression=compression)
        source.tell()
        await settled()
        ((kind, content),) = talker.mouth.frames
        assert kind == 2
        assert content.endswith(b"bytes" + b"\x45" + serialize(STRING, {"data": "0"}))
        assert struct.pack(">I", int(DATE)) in content, "and when it was heard"


async def test_in_cbor_arrays_of_numbers_are_packed_and_bytes_are_bytes() -> None:
    async with client_bus() as one:
        kind, talker = "maya_controller/RawSensorData", one.talker()
        publisher = one.robot.advertise("/raw", kind)
        await talker.ask("subscribe", topic="/raw", compression="cbor")
        publisher.publish({**default(kind), "position": [1, -2, 3], "stop_code": [1, 2, 255]})
        await settled()
        ((opcode, content),) = talker.mouth.frames
        assert opcode == 2
        assert b"position\xd8\x4f\x58\x18" + struct.pack("<3q", 1, -2, 3) in content
        assert b"stop_code\x43\x01\x02\xff" in content


async def test_json_has_bytes_as_base64_and_non_finite_numbers_as_null() -> None:
    async with client_bus() as one:
        kind, talker = "maya_controller/RawSensorData", one.talker()
        publisher = one.robot.advertise("/raw", kind)
        await talker.ask("subscribe", topic="/raw")
        publisher.publish({**default(kind), "stop_code": [1, 2, 255], "velocity": [1.5, float("nan"), float("inf")]})
        ((told),) = [message["msg"] for message in await talker.told()]
        assert told["stop_code"] == base64.b64encode(b"\x01\x02\xff").decode()
        assert told["velocity"] == [1.5, None, None]
        assert told["position"] == [0, 0, 0]


async def test_client_that_does_not_read_keeps_the_newest_and_slows_no_other() -> None:
    async with client_bus() as one:
        source, slow, well = Source(one), one.talker(), one.talker()
        for talker in (slow, well):
            await talker.ask("subscribe", topic="/t", type=STRING)
        slow.mouth.full = True
        for _ in range(3 * WAITING):
            source.tell()
            await settled()
        assert data_of(await well.told()) == [str(number) for number in range(3 * WAITING)]
        assert slow.mouth.frames == []
        slow.mouth.take_more()
        assert data_of(slow.mouth.taken()) == [str(number) for number in range(2 * WAITING, 3 * WAITING)]
        source.tell()
        assert data_of(await slow.told()) == [str(3 * WAITING)]


async def test_requested_queue_length_is_kept() -> None:
    async with client_bus() as one:
        source, slow = Source(one), one.talker()
        await slow.ask("subscribe", topic="/t", type=STRING, queue_length=2)
        slow.mouth.full = True
        for _ in range(9):
            source.tell()
            await settled()
        slow.mouth.take_more()
        assert data_of(slow.mouth.taken()) == ["7", "8"]


async def test_a_client_has_only_so_many_topics_and_subscriptions() -> None:
    async with client_bus() as one:
        talker = one.talker()
        for number in range(TOPICS):
            talker.say("subscribe", topic=f"/t{number}", type=STRING)
        assert await talker.told() == []
        assert (await talker.ask("subscribe", topic="/more", type=STRING))[0]["code"] == 4005
        for number in range(REQUESTS):
            talker.say("subscribe", topic="/t0", type=STRING, id=f"{number}")
        assert [status["code"] for status in await talker.told()] == [4005]


async def _level(talker: BusClient, level: str) -> list[Said]:
    return await talker.ask("set_level", level=level)


async def test_successes_are_reported_at_the_level_that_asks_for_them() -> None:
    async with client_bus() as one:
        talker = one.talker()
        assert await _level(talker, "info") == []
        (told,) = await talker.ask("subscribe", topic="/t", type=STRING, id="s")
        assert (told["op"], told["level"], told["id"]) == ("status", "info", "s")
        await _level(talker, "warning")
        assert await talker.ask("unsubscribe", topic="/t", id="s") == []
        (told,) = await talker.ask("unsubscribe", topic="/t", id="s")
        assert told["level"] == "warning"
        await _level(talker, "none")
        assert await talker.ask("subscribe", topic="///") == []
        assert (await talker.ask("unsubscribe", topic="/t")) == []
