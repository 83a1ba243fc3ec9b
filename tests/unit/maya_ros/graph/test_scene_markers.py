"""Scene around the robot: its workspace, zones, parts and path, at their positions."""

from __future__ import annotations

from math import atan2, hypot

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from maya_ros.graph import types
from maya_ros.graph.markers import (
    PART_HEIGHT,
    MarkerShape,
    part_markers,
    way_markers,
    way_of,
    workspace_markers,
    zone_markers,
)
from maya_ros.graph.protocol import Message
from maya_un.config import Config
from maya_un.kinematics import Mechanism
from maya_un.kinematics.zones import Box, Cylinder, HalfSpace
from maya_un.motion import Path
from maya_un.values import Joints, Point
from tests.strategies import WORKSPACE, reachable_joints

MECHANISM = Mechanism.of(Config())


def checked(markers: list[Message]) -> list[Message]:
    """Return markers once the message that holds them was found to be one that ROS takes."""
    array = types.conform("visualization_msgs/MarkerArray", {"markers": markers})
    assert types.serialize("visualization_msgs/MarkerArray", array)
    return markers


def places(marker: Message) -> np.ndarray:
    return np.array([[point[axis] for axis in "xyz"] for point in marker["points"]])


def test_the_skin_of_the_workspace_is_made_of_triangles_between_both_ends_of_the_boom() -> None:
    skin, edges = checked(list(workspace_markers(WORKSPACE)))
    assert skin["type"] == MarkerShape.TRIANGLES
    assert edges["type"] == MarkerShape.LINE_LIST
    assert len(skin["points"]) % 3 == 0
    assert len(edges["points"]) % 2 == 0
    for marker in (skin, edges):
        x, y, z = places(marker).T
        angles = np.arctan2(x, y)
        assert (angles.min(), angles.max()) == pytest.approx(WORKSPACE.boom, abs=1e-3)
        assert z.min() == pytest.approx(0.10, abs=0.01)
        assert 2.05 < z.max() < 2.071


def test_workspace_message_is_small() -> None:
    array = types.conform("visualization_msgs/MarkerArray", {"markers": list(workspace_markers(WORKSPACE))})
    assert len(types.serialize("visualization_msgs/MarkerArray", array)) < 100_000


def test_zones_are_at_their_positions() -> None:
    box = Box("box", Point(0.1, 0.2, 0.0), Point(0.5, 1.0, 0.6))
    post = Cylinder("post", 1.0, 0.5, 0.1, 0.2, 0.8)
    one, two = checked(list(zone_markers([box, post], 2.3)))
    assert (one["type"], one["scale"]) == (MarkerShape.CUBE, pytest.approx({"x": 0.4, "y": 0.8, "z": 0.6}))
    assert one["pose"]["position"] == pytest.approx({"x": 0.3, "y": 0.6, "z": 0.3})
    assert (two["type"], two["scale"]) == (MarkerShape.CYLINDER, pytest.approx({"x": 0.2, "y": 0.2, "z": 0.6}))
    assert two["pose"]["position"] == {"x": 1.0, "y": 0.5, "z": 0.5}


@given(normal=st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda way: hypot(*way) > 1e-3))
@example((1.9e-6, 1.1e-6, -1.0))
@example((0.0, 0.0, -1.0))
def test_plate_of_a_half_space_is_normal_to_its_normal(normal: tuple[float, float, float]) -> None:
    (plate,) = zone_markers([HalfSpace("wall", Point(0.0, 1.0, 0.0), Point(*normal))], 2.3)
    x, y, z, w = (plate["pose"]["orientation"][part] for part in "xyzw")
    assert hypot(x, y, z, w) == pytest.approx(1.0)
    across = np.array((2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)))
    assert across == pytest.approx(np.array(normal) / hypot(*normal), abs=1e-5)


def test_parts_are_on_stands_and_a_carried_one_is_in_the_gripper() -> None:
    parts = {"bolt": Point(0.3, 1.0, 0.4), "nut": Point(0.5, 0.9, 0.4)}
    resting = checked(list(part_markers(parts, None, 0.0)))
    assert [one["ns"] for one in resting] == ["parts", "stands", "parts", "stands"]
    stand = resting[1]
    assert stand["scale"]["z"] == pytest.approx(0.4 - 0.5 * PART_HEIGHT)
    assert stand["pose"]["position"]["z"] == pytest.approx(0.5 * stand["scale"]["z"])
    carried = checked(list(part_markers(parts, "nut", 0.01)))
    assert [one["ns"] for one in carried] == ["parts", "stands", "parts"]
    nut = carried[-1]
    assert (nut["header"]["frame_id"], nut["frame_locked"]) == ("gripper", True)
    assert nut["pose"]["position"] == {"x": 0.0, "y": 0.0, "z": 0.01}


def test_a_part_that_lies_flat_on_the_table_has_no_stand() -> None:
    assert [one["ns"] for one in part_markers({"disc": Point(0.3, 1.0, 0.05)}, None, 0.0)] == ["parts"]


@given(start=reachable_joints(), end=reachable_joints())
def test_a_way_in_joint_space_goes_from_its_start_to_its_end(start: Joints, end: Joints) -> None:
    way = way_of((start, end), MECHANISM)
    assert way[0] == pytest.approx(MECHANISM.fk(start))
    assert way[-1] == pytest.approx(MECHANISM.fk(end))


def test_a_straight_way_is_straight_and_a_swing_keeps_its_distance() -> None:
    line = np.array(way_of(Path.line(Point(0.5, 1.2, 0.4), Point(1.1, 0.6, 0.9)), MECHANISM))
    assert line == pytest.approx(np.linspace(line[0], line[-1], len(line)), abs=1e-9)
    for x, y, _ in way_of(Path.swing((0.2, 1.0, 0.5), (1.4, 1.0, 0.5)), MECHANISM):
        assert hypot(x, y) == pytest.approx(1.0)
        assert 0.2 <= atan2(x, y) <= 1.4


def test_path_is_drawn_with_its_end_and_removed_without_one() -> None:
    way = way_of(Path.line(Point(0.5, 1.2, 0.4), Point(1.1, 0.6, 0.9)), MECHANISM)
    strip, end = checked(list(way_markers(way)))
    assert len(strip["points"]) == len(way)
    assert end["pose"]["position"] == pytest.approx({"x": 1.1, "y": 0.6, "z": 0.9})
    assert list(way_markers(())) == []
