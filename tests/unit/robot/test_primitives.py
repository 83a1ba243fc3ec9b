from __future__ import annotations

from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.errors import InvalidRequest, InvalidValue, MayaError, UnknownName
from maya_un.robot.primitives import (
    Approach,
    CanTeleop,
    Gripper,
    Home,
    MoveJoints,
    Pick,
    Place,
    Primitive,
    from_dict,
    to_dict,
)
from maya_un.values import FARTHEST, Joints, Point

numbers = st.floats(-10.0, 10.0)
points = st.builds(Point, numbers, numbers, numbers)
primitives: st.SearchStrategy[Primitive] = st.one_of(
    st.sampled_from((Home(), CanTeleop(), Gripper(True), Gripper(False))),
    st.builds(Pick, points),
    st.builds(Place, points),
    st.builds(Approach, points),
    st.builds(MoveJoints, st.builds(Joints, numbers, numbers, numbers)),
)


@given(primitives)
def test_written_primitive_is_read_back(primitive: Primitive) -> None:
    assert from_dict(to_dict(primitive), 0.4) == primitive


@given(
    st.sampled_from([("pick", "target"), ("place", "target"), ("approach", "target"), ("line", "target")])
    | st.just(("move", "joints")),
    st.tuples(*[st.sampled_from([1e308, -1e308, 1e-320, FARTHEST, 1e309]) | st.floats()] * 3),
)
def test_any_number_is_a_coordinate_or_refused_in_one_short_sentence(
    request: tuple[str, str], numbers: tuple[float, float, float]
) -> None:
    command, key = request
    data = {"command": command, key: list(numbers)}
    if all(abs(number) <= 10.0 for number in numbers):
        assert to_dict(from_dict(data, 0.4)) == data
    else:
        with pytest.raises(InvalidValue) as caught:
            from_dict(data, 0.4)
        assert len(str(caught.value)) < 120


def test_coordinates_and_joints_take_units() -> None:
    assert from_dict({"command": "pick", "target": ["500 mm", 1.1, "0.4 m"]}, 0.4) == Pick(Point(0.5, 1.1, 0.4))
    joints = {"a": "180 deg", "b": "1200 mm", "c": 1.5}
    assert from_dict({"command": "move", "joints": joints}, 0.4) == MoveJoints(Joints(pi, 1.2, 1.5))


@pytest.mark.parametrize(
    ("data", "right"),
    [
        (
            {"command": "pick", "target": [500, 1.1]},
            "target.0 = 500 is not valid: no robot reaches 500 m; for mm write 500 mm",
        ),
        ({"command": "move", "joints": [90, 1.2, 1.5]}, "no robot reaches 90 rad; for deg write 90 deg"),
        ({"command": "pick", "target": ["0.5", 1.1]}, "it must be a number of m, or a text like 30 mm"),
    ],
)
def test_a_value_in_another_unit_is_refused_with_its_right_form(data: dict[str, object], right: str) -> None:
    with pytest.raises(InvalidValue, match=right):
        from_dict(data, 0.4)


def test_a_target_without_height_is_at_the_grasp_height() -> None:
    assert from_dict({"command": "pick", "target": [0.5, 1.1]}, 0.4) == Pick(Point(0.5, 1.1, 0.4))


def test_coordinates_may_be_named() -> None:
    assert from_dict({"command": "place", "target": {"y": 1, "x": 2}}, 0.4) == Place(Point(2.0, 1.0, 0.4))
    named = {"command": "move", "joints": {"a": 0.1, "b": 1.2, "c": 1.5}}
    assert from_dict(named, 0.4) == MoveJoints(Joints(0.1, 1.2, 1.5))


@pytest.mark.parametrize(
    ("data", "error"),
    [
        (None, InvalidRequest),
        ("home", InvalidRequest),
        ({}, InvalidRequest),
        ({"command": "fly"}, UnknownName),
        ({"command": 7}, UnknownName),
        ({"command": ["home"]}, UnknownName),
        ({"command": "home", "target": [1, 1]}, InvalidRequest),
        ({"command": "pick"}, InvalidRequest),
        ({"command": "pick", "target": [1, 1], "speed": 2}, InvalidRequest),
        ({"command": "pick", "target": "cube"}, InvalidValue),
        ({"command": "pick", "target": [1]}, InvalidValue),
        ({"command": "pick", "target": [1, 2, 3, 4]}, InvalidValue),
        ({"command": "pick", "target": [1, float("nan"), 3]}, InvalidValue),
        ({"command": "pick", "target": [1, float("inf"), 3]}, InvalidValue),
        ({"command": "pick", "target": [10**400, 1, 3]}, InvalidValue),
        ({"command": "line", "target": [1, -1e308, 3]}, InvalidValue),
        ({"command": "move", "joints": [1, 2, 10001]}, InvalidValue),
        ({"command": "pick", "target": [True, 1, 3]}, InvalidValue),
        ({"command": "pick", "target": ["1", 1, 3]}, InvalidValue),
        ({"command": "pick", "target": {"x": 1}}, InvalidValue),
        ({"command": "pick", "target": {"x": 1, "y": 1, "w": 0}}, InvalidValue),
        ({"command": "gripper", "open": "yes"}, InvalidValue),
        ({"command": "gripper", "open": 1}, InvalidValue),
        ({"command": "move", "joints": [1, 2]}, InvalidValue),
        ({"command": "move", "joints": {"a": 1, "b": 2}}, InvalidValue),
    ],
)
def test_bad_data_is_refused_in_one_short_sentence(data: object, error: type[MayaError]) -> None:
    with pytest.raises(error) as caught:
        from_dict(data, 0.4)
    assert len(str(caught.value)) < 200
