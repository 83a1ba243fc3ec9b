"""Primitives cross the graph and come out the same."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_ros.graph.conversions import primitive_from_message, primitive_to_message
from maya_un.errors import InvalidValue, UnknownName
from maya_un.robot.primitives import Primitive
from maya_un.robot.primitives.approach import Approach
from maya_un.robot.primitives.can_teleop import CanTeleop
from maya_un.robot.primitives.gripper import Gripper
from maya_un.robot.primitives.home import Home
from maya_un.robot.primitives.line import Line
from maya_un.robot.primitives.move import MoveJoints
from maya_un.robot.primitives.pick import Pick
from maya_un.robot.primitives.place import Place
from maya_un.values import Joints, Point

NUMBERS = [st.floats(-10.0, 10.0)] * 3
POINTS = st.builds(Point, *NUMBERS)
JOINTS = st.builds(Joints, *NUMBERS)
PRIMITIVES = st.one_of(
    st.builds(Approach, POINTS),
    st.builds(Pick, POINTS),
    st.builds(Place, POINTS),
    st.builds(Line, POINTS),
    st.builds(MoveJoints, JOINTS),
    st.builds(Gripper, st.booleans()),
    st.just(Home()),
    st.just(CanTeleop()),
)


@given(PRIMITIVES)
def test_primitive_is_unchanged_after_conversion(primitive: Primitive) -> None:
    assert primitive_from_message(primitive_to_message(primitive)) == primitive


def test_move_has_its_joints_where_others_have_their_target() -> None:
    message = primitive_to_message(MoveJoints(Joints(0.1, 1.5, 1.3)))
    assert message == {"command": "move", "target": {"x": 0.1, "y": 1.5, "z": 1.3}, "open": False}


@pytest.mark.parametrize(
    ("message", "error"),
    [
        ({"command": "dance", "target": {}}, UnknownName),
        ({"command": "", "target": {}}, UnknownName),
        ({"command": "move", "target": {"x": 0.0, "y": float("inf"), "z": 1.0}}, InvalidValue),
        ({"command": "pick", "target": {"x": float("nan"), "y": 1.0, "z": 1.0}}, InvalidValue),
    ],
)
def test_invalid_primitive_is_refused_with_its_code(message: dict[str, object], error: type[Exception]) -> None:
    with pytest.raises(error):
        primitive_from_message(message)
