"""Names, fields, texts and fragments of what clients say."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_ros.rosbridge import incoming
from maya_ros.rosbridge.incoming import Fields, FragmentCollector, Objects, decoded, resolved, type_of
from maya_ros.rosbridge.limits import FRAGMENT_PATIENCE, GATHERED, LONGEST_MESSAGE, LONGEST_SPLIT, MOST_FRAGMENTS
from maya_un.errors import InvalidRequest
from tests.rosbridge_clients import Said


@pytest.mark.parametrize(
    ("said", "whole"),
    [("maya_event", "/maya_event"), ("/task/goal", "/task/goal"), ("rosapi/topics", "/rosapi/topics")],
)
def test_a_name_is_whole_with_a_slash_before_it(said: str, whole: str) -> None:
    assert resolved(said, "topic") == whole


@pytest.mark.parametrize("said", ["", "/", "~private", "/9", "a b", "//a", "/a/", "ä", "/x" * 200, "/a\n"])
def test_invalid_graph_name_is_refused(said: str) -> None:
    with pytest.raises(InvalidRequest) as refused:
        resolved(said, "topic")
    assert refused.value.details["key"] == "topic"


def test_a_type_is_understood_in_the_newer_way_too() -> None:
    assert type_of("std_msgs/msg/String", "type") == type_of("std_msgs/String", "type") == "std_msgs/String"


@pytest.mark.parametrize("said", ["", "String", "/std_msgs/String", "a/b/c/d", "std_msgs/", "x" * 300])
def test_invalid_type_is_refused(said: str) -> None:
    with pytest.raises(InvalidRequest):
        type_of(said, "type")


def test_fields_that_are_there_and_right_are_given() -> None:
    fields = Fields({"id": "a", "n": 5, "f": True, "o": {"x": 1}, "list": [], "t": "topic", "null": None, "whole": 3.0})
    assert fields.id == "a"
    assert fields.whole("n", 0, 0, 10) == 5
    assert fields.whole("n", 0, 0, 4) == 4
    assert fields.whole("whole", 0, 0, 10) == 3
    assert fields.whole("none", 7, 0, 10) == 7
    assert fields.flag("f") is True
    assert fields.flag("null", default=False) is False
    assert fields.record("o") == {"x": 1}
    assert fields.record("list") == fields.record("null") == {}
    assert fields.name("t") == ("topic", "/topic")
    assert fields.one_of("null", ("a", "b"), "b") == "b"


@pytest.mark.parametrize(
    "wrong",
    [
        lambda fields: fields.text("n"),
        lambda fields: fields.text("missing"),
        lambda fields: fields.whole("t", 0, 0, 9),
        lambda fields: fields.whole("f", 0, 0, 9),
        lambda fields: fields.whole("n", 0, 6, 9),
        lambda fields: fields.flag("n"),
        lambda fields: fields.flag("missing"),
        lambda fields: fields.record("t"),
        lambda fields: fields.one_of("t", ("a", "b"), "b"),
        lambda fields: fields.kind("t"),
        lambda fields: Fields({"id": ["x"]}).id,
        lambda fields: Fields({"id": True}).id,
        lambda fields: Fields({"id": "x" * 2000}).id,
        lambda fields: Fields({"id": 2**70}).id,
    ],
)
def test_fields_that_are_not_as_they_should_be_are_refused(wrong: Any) -> None:
    with pytest.raises(InvalidRequest):
        wrong(Fields({"n": 5, "f": True, "t": "topic"}))


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "3", '"x"', "NaN", "[" * 100_000, '{"a": "\\ud800"}', b"\xff{}"],
)
def test_json_that_is_no_object_is_refused(text: str | bytes) -> None:
    with pytest.raises(InvalidRequest) as refused:
        decoded(text)
    assert refused.value.details["key"] == "message"


@pytest.mark.parametrize(("text", "value"), [("NaN", math.nan), ("Infinity", math.inf), ("-Infinity", -math.inf)])
def test_words_for_non_finite_numbers_are_understood(text: str, value: float) -> None:
    assert decoded(f'{{"a": {text}}}') == {"a": pytest.approx(value, nan_ok=True)}


@given(
    messages=st.lists(st.dictionaries(st.text(), st.text() | st.dictionaries(st.text(), st.integers())), max_size=4),
    between=st.text(alphabet=' \n"\\}]x'),
    size=st.integers(1, 40),
)
def test_objects_are_found_however_texts_cut_them(messages: list[Said], between: str, size: int) -> None:
    text = between.join(map(json.dumps, messages))
    objects = Objects()
    found = [one for begin in range(0, len(text), size) for one in objects.add(text[begin : begin + size])]
    assert [json.loads(one) for one in found] == messages
    assert not objects.incomplete


def test_objects_are_bounded_by_the_message_size() -> None:
    objects = Objects()
    assert objects.add('{"a": "') == []
    with pytest.raises(InvalidRequest):
        for _ in range(LONGEST_MESSAGE // LONGEST_SPLIT + 1):
            objects.add("x" * LONGEST_SPLIT)
    assert not objects.incomplete


def test_a_whole_character_in_two_halves_is_understood() -> None:
    assert decoded('{"a": "\\ud83e\\udd16"}') == {"a": "🤖"}


def test_short_message_is_not_fragmented() -> None:
    assert incoming.cut("0123456789", 10) == ["0123456789"]


def test_fragments_are_joined_in_any_order() -> None:
    text = json.dumps({"op": "publish", "msg": {"data": "ä🤖" * 50}}, ensure_ascii=False)
    pieces = [json.loads(piece) for piece in incoming.cut(text, 33, "m")]
    assert [piece["num"] for piece in pieces] == list(range(len(pieces)))
    assert {(piece["op"], piece["id"], piece["total"]) for piece in pieces} == {("fragment", "m", len(pieces))}
    gathering = FragmentCollector()
    *first, last = [gathering.add(Fields(piece), "fragment", 0.0) for piece in reversed(pieces)]
    assert set(first) == {None}
    assert last == text


def test_messages_in_fragments_do_not_mix() -> None:
    gathering = FragmentCollector()
    for name, data in (("a", "1"), ("b", "3")):
        assert gathering.add(piece(name, data, 0, 2), "fragment", 0.0) is None
    assert gathering.add(piece("b", "4", 1, 2), "fragment", 0.0) == "34"
    assert gathering.add(piece("a", "2", 1, 2), "fragment", 0.0) == "12"


def piece(name: object, data: object, number: object, total: object) -> Fields:
    return Fields({"id": name, "data": data, "num": number, "total": total})


@pytest.mark.parametrize(
    "wrong",
    [
        piece(None, "x", 0, 2),
        piece("a", 3, 0, 2),
        piece("a", "x", 2, 2),
        piece("a", "x", -1, 2),
        piece("a", "x", 0, 0),
        piece("a", "x", 0, 3),
        piece("a", "x", "0", 2),
        piece("a", "x", 0, MOST_FRAGMENTS + 1),
        piece("a", "x" * (LONGEST_MESSAGE + 1), 0, 2),
    ],
)
def test_a_fragment_that_does_not_fit_ends_its_message(wrong: Fields) -> None:
    gathering = FragmentCollector()
    gathering.add(piece("a", "1", 0, 2), "fragment", 0.0)
    with pytest.raises(InvalidRequest):
        gathering.add(wrong, "fragment", 0.0)


def test_incomplete_messages_are_limited_and_old_ones_forgotten() -> None:
    gathering = FragmentCollector()
    for number in range(GATHERED):
        gathering.add(piece(number, "1", 0, 2), "fragment", 0.0)
    with pytest.raises(InvalidRequest):
        gathering.add(piece("one more", "1", 0, 2), "fragment", FRAGMENT_PATIENCE)
    assert gathering.add(piece("one more", "1", 0, 2), "fragment", FRAGMENT_PATIENCE + 1.0) is None
    assert gathering.add(piece("one more", "2", 1, 2), "fragment", FRAGMENT_PATIENCE + 1.0) == "12"


def test_pieces_of_pictures_and_of_texts_do_not_make_one_message() -> None:
    gathering = FragmentCollector()
    gathering.add(piece("a", "1", 0, 2), "png", 0.0)
    with pytest.raises(InvalidRequest):
        gathering.add(piece("a", "2", 1, 2), "fragment", 0.0)
