"""One client as a whole: order, wrapping, refusals; none of its messages does any harm."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_ros.graph.protocol import Message
from maya_ros.rosbridge import incoming, outgoing
from maya_ros.rosbridge.limits import AT_ONCE
from maya_un.http.log import log_path
from tests.rosbridge_clients import BusClient, Said, client_bus, settled
from tests.virtual_time import elapse

STRING = "std_msgs/String"


@pytest.fixture(autouse=True)
def own_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAYA_STATE_DIR", str(tmp_path))


def wrapped(text: str, *how: str) -> list[str]:
    """Return texts that carry a text: as a picture, in fragments, or one in the other."""
    for one in how:
        if one == "png":
            text = json.dumps({"op": "png", "data": outgoing.encoded(text)})
        elif one == "png in pieces":
            data = outgoing.encoded(text)
            half = len(data) // 2
            pieces = (data[:half], data[half:])
            return [
                json.dumps({"op": "png", "id": "p", "data": piece, "num": number, "total": 2})
                for number, piece in enumerate(pieces)
            ]
        else:
            return incoming.cut(text, 20, "f")
    return [text]


@pytest.mark.parametrize("how", [(), ("png",), ("fragment",), ("png", "fragment"), ("png in pieces",), ("png", "png")])
async def test_messages_arrive_whole_in_fragments_and_as_pictures(how: tuple[str, ...]) -> None:
    async with client_bus() as one:
        talker = one.talker()
        for text in wrapped(json.dumps({"op": "call_service", "service": "/rosapi/get_time", "id": "t"}), *how):
            talker.session.take(text)
        assert [message["id"] for message in await talker.told()] == ["t"]


async def test_a_message_is_wrapped_only_so_often() -> None:
    async with client_bus() as one:
        talker = one.talker()
        text = json.dumps({"op": "set_level", "level": "info"})
        for _ in range(5):
            (text,) = wrapped(text, "png")
        talker.session.take(text)
        assert [status["code"] for status in await talker.told()] == [4005]


async def test_operations_run_in_order_even_when_one_must_wait() -> None:
    async with client_bus() as one:
        one.robot.advertise("/t", STRING, latch=True).publish({"data": "a"})
        talker = one.talker()
        for _ in range(3):
            talker.say("subscribe", topic="/t")
            talker.say("unsubscribe", topic="/t")
        talker.say("subscribe", topic="/t")
        talker.say("publish", topic="/t", msg={"data": "b"})
        told = await talker.told()
        assert [message["msg"]["data"] for message in told] == ["a", "b"]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{}",
        "[]",
        '{"op": 5}',
        '{"op": "dance"}',
        '{"op": ["publish"]}',
        '{"op": null}',
        '{"receiver": "/x"}',
        "\x00",
    ],
)
async def test_invalid_operation_is_reported_and_the_session_goes_on(text: str) -> None:
    async with client_bus() as one:
        talker = one.talker()
        talker.session.take(text)
        (told,) = await talker.told()
        assert (told["op"], told["level"], told["code"]) == ("status", "error", 4005)
        assert (await talker.ask("call_service", service="/rosapi/get_time"))[0]["result"] is True


def asked(name: str) -> str:
    return json.dumps({"op": "call_service", "service": "/rosapi/get_time", "id": name})


@pytest.mark.parametrize(
    "texts",
    [
        [asked("a") + asked("b")],
        [asked("a") + "\n" + asked("b")],
        [asked("a")[:20], asked("a")[20:], asked("b")],
        [asked("a") + asked("b")[:30], asked("b")[30:]],
        [asked("a")[:5], asked("a")[5:50], asked("a")[50:] + asked("b")],
        ["rubbish " + asked("a"), asked("b")],
        [asked("a").encode() + asked("b").encode()],
    ],
)
async def test_several_messages_in_a_text_and_one_over_several_are_carried_out(texts: list[str | bytes]) -> None:
    async with client_bus() as one:
        talker = one.talker()
        talker.session.take(*texts)
        assert [message.get("id") for message in await talker.told()] == ["a", "b"]


async def test_an_incomplete_message_is_given_up_when_the_next_one_begins() -> None:
    async with client_bus() as one:
        talker = one.talker()
        talker.session.take(asked("lost")[:20], asked("b"))
        refused, answered = await talker.told()
        assert (refused["op"], refused["code"]) == ("status", 4005)
        assert answered["id"] == "b"


async def test_auth_while_no_users_are_kept_changes_nothing() -> None:
    async with client_bus() as one:
        talker = one.talker()
        assert await talker.ask("auth", mac="x", client="y", dest="z", rand="r", t=1, level="a", end=2) == []
        (told,) = await talker.ask("auth", mac="", client="y", dest="z", rand="r", t=1, level="a", end=2)
        assert (told["op"], told["code"]) == ("status", 4005)
        (told,) = await talker.ask("auth")
        assert (told["op"], told["code"]) == ("status", 4005)


async def test_sentences_are_in_the_language_of_the_client() -> None:
    async with client_bus() as one:
        talker = one.talker()
        talker.client._language = "es"
        (told,) = await talker.ask("subscribe", topic="/nothing")
        assert told["msg"].startswith("4019: No existe")


async def test_defect_is_one_sentence_and_written_to_the_log() -> None:
    async def broken(_: Message) -> Message:
        raise ZeroDivisionError("a defect")

    async with client_bus() as one:
        talker = one.talker()
        one.robot.serve("/s", "std_srvs/Trigger", broken)
        (told,) = await talker.ask("call_service", service="/s")
        assert told["values"].startswith("5999: ")
        assert "ZeroDivisionError" in log_path().read_text()


async def test_a_client_that_says_much_at_once_lets_others_have_their_turn() -> None:
    async with client_bus() as one:
        loud, other, heard = one.talker(), one.talker(), list[str]()
        one.robot.subscribe("/t", STRING, lambda message: heard.append(message["data"]), queue_size=0)
        await loud.ask("advertise", topic="/t", type=STRING)
        await other.ask("advertise", topic="/t", type=STRING)
        messages = [{"op": "publish", "topic": "/t", "msg": {"data": f"{number}"}} for number in range(10 * AT_ONCE)]
        loud.session.take(*map(json.dumps, messages))
        assert loud.session.busy
        other.say("publish", topic="/t", msg={"data": "other"})
        calm: list[bool] = []
        loud.session.on_calm = lambda: calm.append(True)
        for _ in range(10):
            await settled()
        assert [said for said in heard if said != "other"] == [f"{number}" for number in range(10 * AT_ONCE)]
        assert heard.index("other") <= AT_ONCE + 1
        assert calm == [True]
        assert not loud.session.busy


async def test_after_its_end_a_session_does_nothing() -> None:
    async with client_bus() as one:
        talker = one.talker()
        await talker.session.close()
        await talker.ask("advertise", topic="/t", type=STRING)
        await talker.ask("subscribe", topic="/t")
        assert one.bus.topics.find("/t") is None


NAMES = st.sampled_from(["/t", "t", "/task", "/s", "/maya_command", "/rosapi/topics", "/task/goal", "", "~x", "/é"])
KINDS = st.sampled_from([STRING, "maya_robot/Task", "std_srvs/SetBool", "std_msgs/msg/String", "no/Type", "x", ""])
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | NAMES | KINDS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5) | NAMES, inner, max_size=3),
    max_leaves=6,
)
OPS = [
    "advertise", "unadvertise", "publish", "subscribe", "unsubscribe", "call_service", "service_response",
    "advertise_service", "unadvertise_service", "fragment", "png", "set_level", "auth", "advertise_action",
    "unadvertise_action", "send_action_goal", "cancel_action_goal", "action_feedback", "action_result", "status",
]  # fmt: skip
KEYS: dict[str, st.SearchStrategy[Any]] = {
    "id": st.sampled_from(["a", "b", 1]) | JSON,
    "topic": NAMES | JSON,
    "service": NAMES | JSON,
    "action": NAMES | JSON,
    "type": KINDS | JSON,
    "action_type": KINDS | JSON,
    "msg": st.just({"data": "x"}) | JSON,
    "args": st.just({"data": True}) | JSON,
    "values": JSON,
    "data": st.text(max_size=10) | JSON,
    "num": st.integers(-1, 3) | JSON,
    "total": st.integers(-1, 3) | JSON,
    "compression": st.sampled_from(["none", "png", "cbor", "cbor-raw"]) | JSON,
    "throttle_rate": st.integers(-1, 100) | JSON,
    "queue_length": st.integers(-1, 5) | JSON,
    "fragment_size": st.integers(-1, 100) | JSON,
    "latch": st.booleans() | JSON,
    "feedback": st.booleans() | JSON,
    "result": st.booleans() | JSON,
    "status": st.integers(-1, 9) | JSON,
    "timeout": st.floats(-1.0, 1.0) | JSON,
    "level": st.sampled_from(["none", "error", "warning", "info"]) | JSON,
}
MESSAGES = st.builds(
    lambda op, fields: {"op": op, **fields},
    st.sampled_from(OPS) | JSON,
    st.fixed_dictionaries({}, optional=KEYS),
)
TEXTS = MESSAGES.map(json.dumps) | MESSAGES.map(json.dumps).flatmap(
    lambda text: st.integers(0, len(text)).map(lambda cut: text[:cut])
)


@given(st.lists(TEXTS, max_size=12))
async def test_nothing_that_a_client_says_harms_the_session_or_anybody_else(texts: list[str]) -> None:
    async with client_bus() as one:
        witness, talker = one.talker(), one.talker()
        one.robot.serve("/s", "std_srvs/SetBool", _yes)
        await witness.ask("subscribe", topic="/well", type=STRING)
        for text in texts:
            talker.session.take(text)
        await settled()
        assert all(status.get("code") != 5999 for status in talker.mouth.said), talker.mouth.said
        assert await is_well(talker)
        await one.leave(talker)
        one.robot.advertise("/well", STRING).publish({"data": "x"})
        assert {"op": "publish", "topic": "/well", "msg": {"data": "x"}} in await witness.told()
        assert (await one.bus.directory.services()).keys() == {"/s"}


async def _yes(_: Message) -> Message:
    return {"success": True}


async def is_well(talker: BusClient) -> bool:
    """Tell whether a client is still answered."""
    told: list[Said] = []
    for _ in range(5):
        told = await talker.ask("call_service", service="/rosapi/get_time", id="well?")
        if told:
            break
        await elapse(1.0)
    return any(message.get("id") == "well?" for message in told)


async def test_error_at_the_end_of_a_client_leaves_nothing_open(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> None:
        raise ZeroDivisionError

    async with client_bus() as one:
        talker, news = one.talker(), one.robot.advertise("/news", "std_msgs/String")
        await talker.ask("subscribe", topic="/news", type="std_msgs/String")
        assert news.readers == 1
        monkeypatch.setattr(talker.session._publishing, "close", fail)
        with pytest.raises(ZeroDivisionError):
            await talker.session.close()
        assert news.readers == 0
        monkeypatch.undo()


async def test_messages_after_the_end_of_the_session_are_dropped() -> None:
    async with client_bus() as one:
        talker = one.talker()
        await one.leave(talker)
        talker.say("set_level", level="info")
        assert not talker.session._inbox
