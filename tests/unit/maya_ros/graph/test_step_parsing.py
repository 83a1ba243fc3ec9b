"""Step commands as text: understood and refused ones, and no other outcome."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.errors import InvalidMessage, InvalidRequest, InvalidValue, MayaError, UnknownName
from maya_un.robot.primitives.gripper import Gripper
from maya_un.robot.primitives.home import Home
from maya_un.robot.primitives.move import MoveJoints
from maya_un.robot.primitives.pick import Pick
from maya_un.steps.command import step_of
from maya_un.steps.text import StepEnd, content_of, id_of, read
from maya_un.values import Joints, Point

PLACE = {"x": 0.5, "y": 1.1, "z": 0.4}
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=8,
)
ANYTHING = st.fixed_dictionaries(
    {},
    optional={
        "id": JSON,
        "command": st.sampled_from(["pick", "place", "home", "gripper", "fly"]) | JSON,
        "args": st.fixed_dictionaries({}, optional={"x": JSON, "y": JSON, "z": JSON, "open": JSON, "w": JSON}) | JSON,
    },
)


def test_a_pick_is_read_with_its_place() -> None:
    step = step_of({"id": "7", "command": "pick", "args": PLACE}, "7")
    assert (step.id, step.primitive, step.warnings) == ("7", Pick(Point(0.5, 1.1, 0.4)), ())


def test_joints_are_read_by_their_names() -> None:
    step = step_of({"id": "7", "command": "move", "args": {"c": 1.6, "a": -0.5, "b": 1.1}}, "7")
    assert step.primitive == MoveJoints(Joints(-0.5, 1.1, 1.6))


def test_unneeded_key_is_ignored_and_reported() -> None:
    step = step_of({"command": "home", "args": {"w": 1.0, "speed": 3}}, "7")
    assert step.primitive == Home()
    assert step.warnings == ("args.w was ignored", "args.speed was ignored")


def test_ignored_arguments_make_no_other_content() -> None:
    with_more = step_of({"command": "pick", "args": {**PLACE, "w": 1.0}}, "7")
    as_whole_number = step_of({"command": "pick", "args": {"z": 0.4, "y": 1.1, "x": 0.5}}, "8")
    other = step_of({"command": "place", "args": PLACE}, "7")
    assert with_more.digest == as_whole_number.digest != other.digest


@pytest.mark.parametrize(
    ("data", "error", "says"),
    [
        ({}, InvalidRequest, "command"),
        ({"command": "fly"}, UnknownName, "pick"),
        ({"command": 3}, UnknownName, "3"),
        ({"command": "fly", "args": PLACE}, UnknownName, "fly"),
        ({"command": "pick"}, InvalidRequest, "args.x"),
        ({"command": "pick", "args": {"x": 1.0, "y": 1.0}}, InvalidRequest, "args.z"),
        ({"command": "pick", "args": [1.0, 1.0, 1.0]}, InvalidRequest, "args"),
        ({"command": "pick", "args": {**PLACE, "x": "1"}}, InvalidValue, "target.x"),
        ({"command": "pick", "args": {**PLACE, "x": True}}, InvalidValue, "target.x"),
        ({"command": "pick", "args": {**PLACE, "x": float("inf")}}, InvalidValue, "target.x"),
        ({"command": "gripper", "args": {"open": 1}}, InvalidValue, "open"),
        ({"command": "gripper", "args": {}}, InvalidRequest, "args.open"),
        ({"command": "move", "args": PLACE}, InvalidRequest, "args.a"),
    ],
)
def test_missing_or_wrong_key_is_named(data: dict[str, Any], error: type[MayaError], says: str) -> None:
    with pytest.raises(error, match=says):
        step_of(data, "7")


DEEP = '{"a": ' * 32 + "%s" + "}" * 32


@pytest.mark.parametrize(
    "text", ["", "pick", "[1]", '"pick"', "{", "[" * 100_000, "null", DEEP % "[0]", DEEP % '{"a": 0}']
)
def test_command_that_is_no_object_is_refused(text: str) -> None:
    with pytest.raises(InvalidMessage):
        read(text)


@pytest.mark.parametrize("id_", ["", 7, 7.0, True, [], "a\nb", "x" * 201, "\ud800"])
def test_an_id_is_short_printable_text(id_: object) -> None:
    with pytest.raises(InvalidRequest, match="id"):
        id_of({"id": id_})


def test_a_command_may_be_nested_as_deep_as_a_database_allows() -> None:
    assert "a" in read(DEEP % "0")


def test_content_is_the_job_of_the_robot() -> None:
    args = {"x": 1, "y": 0.5, "z": 0.4}
    same = {"id": "7", "deadline": "soon", "robot": "MAYA", "command": "pick", "args": {**args, "w": [1]}}
    assert content_of({"command": "pick", "args": args}) == content_of(same) == {"command": "pick", "args": args}


@given(ANYTHING)
def test_content_is_short_and_can_be_sent_to_every_database(data: dict[str, Any]) -> None:
    content = content_of(data)
    text = json.dumps(content, allow_nan=False)
    assert content_of(json.loads(text)) == content
    assert len(text) < 3000


def test_missing_id_is_none() -> None:
    assert id_of({"command": "home"}) is None
    assert id_of({"id": None}) is None


@given(ANYTHING)
def test_any_text_is_a_step_or_an_error_of_ours(data: dict[str, Any]) -> None:
    try:
        known = read(json.dumps(data))
        step = step_of(known, id_of(known) or "made")
    except MayaError as error:
        assert json.loads(StepEnd.refused(None, error, "now").text)["code"] == str(error.code)
    else:
        assert len(step.digest) == 64


def test_result_has_the_content_of_the_old_form() -> None:
    done = json.loads(StepEnd("7", None, None, "then", "now").text)
    failed = json.loads(StepEnd("7", "it was too far away", "2102", "then", "now", ("args.w was ignored",)).text)
    assert (done["success"], done["error"], done["code"]) == (True, None, None)
    assert (failed["success"], failed["error"], failed["code"]) == (False, "it was too far away", "2102")
    assert failed["warnings"] == ["args.w was ignored"]


def test_gripper_is_open_or_closed() -> None:
    assert step_of({"command": "gripper", "args": {"open": False}}, "7").primitive == Gripper(open=False)
