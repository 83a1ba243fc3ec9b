"""Messages from clients of the stream, and their answers."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from math import nan
from pathlib import Path
from typing import Any

import pytest
from websockets.frames import Frame, Opcode

from maya_un.errors import InvalidRequest, Unreachable
from maya_un.http.stream import messages
from maya_un.http.stream.messages import (
    ReplayStart,
    content,
    decoded,
    error_frame,
    event_frame,
    kind_of,
    plain_frame,
    state_frame,
    subscription,
    topic_frame,
)
from maya_un.http.stream.topics import QUEUE, TOPICS
from maya_un.schema.robot import EventMessage
from tests.streaming import REST
from tests.unit.http.frames import texts


def message_of(frame: bytes) -> dict[str, Any]:
    """Return the message of one frame."""
    (text,) = texts(frame)
    message: dict[str, Any] = json.loads(text)
    return message


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("[]", "body"),
        ("{", "body"),
        ("{}", "type"),
        ('{"type": "jump"}', "type"),
        ('{"type": ["ping"]}', "type"),
        ('{"type": "ping", "state": null}', "state"),
        (b"\xff\xfe", "body"),
    ],
)
def test_invalid_message_is_refused_by_key(text: str | bytes, key: str) -> None:
    with pytest.raises(InvalidRequest) as refused:
        kind_of(decoded(text))
    assert refused.value.details["key"] == key


@pytest.mark.parametrize(
    ("message", "key"),
    [
        ({"state": {"rate": 0.05}}, "state.rate"),
        ({"state": {"rate": 101}}, "state.rate"),
        ({"state": {"rate": 10**400}}, "state.rate"),
        ({"state": {"rate": nan}}, "state.rate"),
        ({"state": {"rate": True}}, "state.rate"),
        ({"state": {"rate": "10"}}, "state.rate"),
        ({"state": {"hertz": 10}}, "state.hertz"),
        ({"state": 10}, "state"),
        ({"events": []}, "events"),
        ({"events": {"since": -1}}, "events.since"),
        ({"events": {"since": 1.5}}, "events.since"),
        ({"events": {"run": 0}}, "events.run"),
        ({"queue": 1}, "queue"),
    ],
)
def test_invalid_command_is_refused_by_key(message: dict[str, Any], key: str) -> None:
    with pytest.raises(InvalidRequest) as refused:
        subscription({"type": "subscribe", **message})
    assert refused.value.details["key"] == key


def test_subscription_names_its_changes() -> None:
    wanted = subscription({"type": "subscribe", "state": {"rate": 30}, "events": {"since": 4, "run": 2}})
    assert (wanted.named, wanted.rate, wanted.past) == ({"state", "events"}, 30.0, ReplayStart(4, 2))
    assert subscription({"type": "subscribe", "state": {}}).rate == 10.0
    assert subscription({"type": "subscribe", "events": {}}).past == ReplayStart(None, None)
    ended = subscription({"type": "subscribe", "state": None, "events": None, "queue": False})
    assert (ended.named, ended.rate, ended.past) == ({"state", "events", "queue"}, None, None)
    assert ended.topics == frozenset()
    assert subscription({"type": "subscribe", "queue": True}).topics == {QUEUE}


def test_states_differ_by_content_not_by_time() -> None:
    assert content(REST) == content(replace(REST, time=9.0))
    assert content(REST) != content(replace(REST, gripper_closed=True))


def test_every_message_has_a_type() -> None:
    event = EventMessage(7, 1.5, "phase", 0, {"name": "down"})
    assert message_of(state_frame(3, REST))["state"]["mode"] == "idle"
    assert message_of(event_frame(3, event)) == {
        "type": "event",
        "run": 3,
        "event": {"seq": 7, "time": 1.5, "kind": "phase", "code": 0, "detail": {"name": "down"}},
    }
    assert message_of(topic_frame("queue", {"mode": "paused"})) == {"type": "queue", "queue": {"mode": "paused"}}
    assert message_of(plain_frame("pong", {"type": "ping", "id": 5})) == {"type": "pong", "id": 5}


def test_error_has_code_words_details_and_the_id_of_its_request() -> None:
    error = Unreachable(target="(0, 0)", reason="too near", nearest="none", excess=float("nan"))
    told = message_of(error_frame(error, "es", {"id": "a"}))
    assert told["type"] == "error"
    assert (told["id"], told["code"], told["message"]) == ("a", 2101, error.text("es"))
    assert told["details"] == {"target": "(0, 0)", "reason": "too near", "nearest": "none", "excess": "nan"}


@pytest.mark.parametrize("length", [0, 1, 125, 126, 65_535, 65_536, 200_000])
def test_frames_are_those_of_the_standard(length: int) -> None:
    text = "é".encode() * (length // 2) + b"x" * (length % 2)
    frame = plain_frame("x", filler=text.decode())
    (payload,) = texts(frame)
    assert frame == Frame(Opcode.TEXT, payload).serialize(mask=False)


def test_the_reference_names_every_message_and_key() -> None:
    page = (Path(__file__).resolve().parents[3] / "docs" / "reference" / "websocket.md").read_text(encoding="utf-8")
    for kind, keys in messages._KEYS.items():
        assert f'{{"type": "{kind}"' in page
        assert [key for key in keys if f'"{key}": ' not in page] == []
    source = "".join(path.read_text(encoding="utf-8") for path in Path(messages.__file__).parent.glob("*.py"))
    told = set(re.findall(r'plain_frame\("(\w+)"', source)) | set(re.findall(r'"type":"(\w+)"', source))
    assert {"hello", "subscribed", "state", "event", "restart", "pong", "renewed", "response", "error"} == told
    assert [kind for kind in told | TOPICS.keys() if f'{{"type": "{kind}"' not in page] == []
