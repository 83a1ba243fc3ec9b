from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import atan2, cos, hypot, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.config import Config
from maya_un.controller.protocol import Preview
from maya_un.errors import PathRefused, Unreachable
from maya_un.kinematics.mechanism import Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.motion.path import JointPath, between, check_path
from maya_un.robot.crossing import TOLERANCE, Way, cross, raised
from maya_un.values import Joints, Point

MECHANISM = Mechanism.of(Config())
WORKSPACE = Workspace.of(Config())
FLOOR = 0.50


def at(a: float, d: float, z: float) -> Joints:
    """Return the joints at angle a [rad], distance d and height z [m]."""
    return WORKSPACE.require(Point(d * sin(a), d * cos(a), z))


def check(way: Sequence[Joints]) -> Preview:
    """Check a way as the controller does; time does not matter here."""
    check_path(WORKSPACE, JointPath(tuple(way)))
    return Preview(duration=1.0, lowest=0.0, highest=0.0, end=way[-1])


def heights(way: Way) -> list[float]:
    """Return heights sampled along a way, independently of how its lowest point is computed."""
    sampled = [between(one, two, step / 50) for one, two in pairwise(way) for step in range(51)]
    return [MECHANISM.fk(joints).z for joints in (*way, *sampled)]


def test_turning_the_boom_alone_goes_straight() -> None:
    start, goal = at(0.2, 1.2, FLOOR), at(1.5, 1.2, FLOOR)
    assert cross(MECHANISM, check, start, goal, FLOOR)[0] == (start, goal)


def test_a_wide_crossing_goes_over_a_middle_that_is_raised_just_enough() -> None:
    start, goal = at(0.2, 0.9, FLOOR), at(0.2, 1.7, FLOOR)
    assert min(heights((start, goal))) == pytest.approx(0.465, abs=1e-3)
    way, _ = cross(MECHANISM, check, start, goal, FLOOR)
    assert len(way) == 3
    assert min(heights(way)) >= FLOOR - TOLERANCE
    assert max(heights(way)) < FLOOR + 0.06


def test_a_start_below_the_floor_rises_straight_up_first() -> None:
    start, goal = at(0.2, 1.0, 0.40), at(1.0, 1.1, FLOOR)
    way, _ = cross(MECHANISM, check, start, goal, FLOOR)
    x, y, z = MECHANISM.fk(way[1])
    assert (hypot(x, y), atan2(x, y)) == (pytest.approx(1.0), pytest.approx(0.2))
    assert z >= FLOOR - TOLERANCE


def test_a_goal_below_the_floor_is_reached_straight_down() -> None:
    start, goal = at(0.2, 1.0, FLOOR), at(1.0, 1.3, 0.30)
    way, _ = cross(MECHANISM, check, start, goal, FLOOR)
    x, y, z = MECHANISM.fk(way[-2])
    assert (hypot(x, y), atan2(x, y), z) == pytest.approx((1.3, 1.0, FLOOR))


def test_where_the_middle_is_refused_the_way_goes_at_one_height() -> None:
    def no_triples(way: Sequence[Joints]) -> Preview:
        if len(way) == 3:
            raise PathRefused(target="there", reason="because")
        return check(way)

    start, goal = at(0.2, 0.9, FLOOR), at(0.2, 1.7, FLOOR)
    way, _ = cross(MECHANISM, no_triples, start, goal, FLOOR)
    assert [round(MECHANISM.fk(point).z, 6) for point in way[1:3]] == [round(MECHANISM.fk(way[1]).z, 6)] * 2
    assert min(heights(way)) >= FLOOR - TOLERANCE


def test_what_the_check_refuses_every_time_is_refused_with_its_reason() -> None:
    def never(way: Sequence[Joints]) -> Preview:
        raise PathRefused(target="there", reason="the check says no")

    with pytest.raises(PathRefused, match="the check says no"):
        cross(MECHANISM, never, at(0.2, 1.0, FLOOR), at(0.9, 1.0, FLOOR), FLOOR)


def test_a_floor_above_the_anchors_is_unreachable() -> None:
    with pytest.raises(Unreachable):
        cross(MECHANISM, check, at(0.2, 1.0, FLOOR), at(0.9, 1.0, FLOOR), 2.4)


def test_raised_keeps_the_angle_to_the_last_bit() -> None:
    joints = at(1.234567, 1.1, 0.4)
    assert raised(MECHANISM, joints, 0.6).a == joints.a


angles = st.floats(0.0, 2 * pi / 3)
distances = st.floats(0.82, 1.72)
starts = st.sampled_from((FLOOR, 0.42, 0.7, 1.0))


@given(angles, distances, starts, angles, distances)
def test_no_crossing_between_reachable_places_comes_low(a: float, d: float, z: float, to_a: float, to_d: float) -> None:
    start = at(a, d, z)
    goal = at(to_a, to_d, FLOOR)
    way, _ = cross(MECHANISM, check, start, goal, FLOOR)
    assert (way[0], way[-1]) == (start, goal)
    crossing = way if z >= FLOOR else way[1:]
    assert min(heights(crossing)) >= FLOOR - 2 * TOLERANCE
