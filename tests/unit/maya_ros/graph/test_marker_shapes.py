"""Single markers: their ROS messages, colours between two, and their deletion."""

from __future__ import annotations

import pytest

from maya_ros.graph import types
from maya_ros.graph.markers import Colour, MarkerShape, Quaternion, blended, facing, marker, removed
from maya_un.values import Point

GREEN, RED = Colour(0.0, 1.0, 0.0), Colour(1.0, 0.0, 0.0, 0.5)


def test_a_marker_says_every_field_that_ros_has() -> None:
    made = marker("parts", MarkerShape.CUBE, RED, (0.1, 0.2, 0.3), number=4, place=Point(1.0, 2.0, 3.0))
    assert set(made) == set(types.fields("visualization_msgs/Marker"))
    assert types.conform("visualization_msgs/Marker", made) == made
    assert made["pose"]["orientation"] == {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}


def test_only_markers_in_a_moving_frame_are_locked_to_it() -> None:
    assert marker("parts", MarkerShape.CUBE, RED, (0.1, 0.1, 0.1), frame="gripper")["frame_locked"]
    assert not marker("parts", MarkerShape.CUBE, RED, (0.1, 0.1, 0.1))["frame_locked"]


def test_deleting_marker_has_only_its_name() -> None:
    gone = removed(
        marker("path", MarkerShape.LINE_STRIP, RED, (0.1, 0.0, 0.0), number=7, points=[Point(0.0, 0.0, 0.0)])
    )
    assert (gone["ns"], gone["id"], gone["action"], gone["points"]) == ("path", 7, 2, [])


@pytest.mark.parametrize(
    ("share", "colour"), [(-1.0, GREEN), (0.0, GREEN), (0.5, Colour(0.5, 0.5, 0.0, 0.75)), (1.0, RED), (9.0, RED)]
)
def test_between_two_colours_there_is_one_for_every_share(share: float, colour: Colour) -> None:
    assert blended(GREEN, RED, share) == pytest.approx(colour)


def test_straight_down_is_half_a_turn() -> None:
    assert facing((0.0, 0.0, 2.0)) == pytest.approx(Quaternion(0.0, 0.0, 0.0, 1.0))
    assert facing((0.0, 0.0, -2.0)) == Quaternion(1.0, 0.0, 0.0, 0.0)
