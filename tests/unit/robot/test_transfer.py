from __future__ import annotations

from math import cos, hypot, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.config import Config
from maya_un.controller.planner import Planner
from maya_un.controller.protocol import Preview
from maya_un.errors import PathRefused, Unreachable
from maya_un.kinematics.mechanism import Floats, Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.motion.path import Path, Route, to_joints
from maya_un.robot.transfer import TOLERANCE, Transfer, TransferPlanner
from maya_un.values import Joints, Point
from tests.strategies import configuration

CONFIG = Config()
MECHANISM = Mechanism.of(CONFIG)
WORKSPACE = Workspace.of(CONFIG)
FLOOR = 0.50
SMOOTH = TransferPlanner(CONFIG, MECHANISM, smooth=True)
STOPPING = TransferPlanner(CONFIG, MECHANISM, smooth=False)


def at(a: float, d: float, z: float) -> Joints:
    """Return the joints at angle a [rad], distance d and height z [m]."""
    return WORKSPACE.require(Point(d * sin(a), d * cos(a), z))


def check(way: Route) -> Preview:
    """Check a way as the controller does."""
    return Planner(CONFIG, MECHANISM).preview(WORKSPACE, way, 1.0)


def places(path: Path) -> Floats:
    """Return points along a way, densely, (n, 3): the boom's angle, distance and height."""
    pieces = path.pieces
    points = MECHANISM.fk_many(to_joints(path.space, MECHANISM, pieces.at(np.linspace(0.0, len(pieces), 2001))))
    x, y, z = points.T
    return np.stack((np.arctan2(x, y), np.hypot(x, y), z), axis=1)


def crossed(start: Joints, goal: Joints, planner: TransferPlanner = SMOOTH) -> Transfer:
    return planner.plan(check, start, goal, FLOOR)


def test_at_one_height_above_the_floor_it_is_one_swing() -> None:
    found = crossed(at(0.2, 0.9, FLOOR), at(1.5, 1.7, FLOOR))
    assert len(found.path.waypoints) == 2
    assert found.arrival is None
    assert np.ptp(places(found.path)[:, 2]) < 1e-9


def test_below_the_floor_all_motion_is_straight_up_or_down() -> None:
    found = crossed(at(0.2, 1.0, 0.40), at(1.0, 1.3, 0.30))
    for angle, distance, height in places(found.path):
        above = (angle, distance) == pytest.approx((0.2, 1.0), abs=1e-9) or (angle, distance) == pytest.approx(
            (1.0, 1.3), abs=1e-9
        )
        assert above or height >= FLOOR - 1e-9


def test_the_via_is_above_the_target() -> None:
    found = crossed(at(0.2, 1.0, 0.40), at(1.0, 1.3, 0.30))
    assert found.arrival == 1
    assert found.path.waypoints[2][:2] == pytest.approx((1.0, 1.3))
    assert 0.0 < found.preview.vias[0] < found.preview.vias[1] < found.preview.duration


def test_a_corner_that_is_cut_saves_time_over_a_stop() -> None:
    start, goal = at(0.2, 1.0, 0.40), at(1.0, 1.05, 0.40)
    assert crossed(start, goal).preview.duration < 0.93 * crossed(start, goal, STOPPING).preview.duration


def test_with_stops_the_corners_are_sharp_and_on_the_floor() -> None:
    found = crossed(at(0.2, 1.0, 0.40), at(1.0, 1.3, 0.30), STOPPING)
    assert [waypoint[2] for waypoint in found.path.waypoints[1:3]] == pytest.approx([FLOOR, FLOOR])


def test_straight_above_the_target_there_is_no_corner() -> None:
    found = crossed(at(0.2, 1.0, 0.60), at(0.2, 1.0, 0.30))
    assert len(found.path.waypoints) == 2
    assert found.arrival is None


def test_near_the_ceiling_the_corners_are_tighter() -> None:
    low = Workspace.of(configuration(safety={"tension_limit": 1.2}))
    ceiling = low.mechanism.reach_down - low.section.depths(0.7)[0]  # type: ignore[index]
    start = low.require(Point(0.0, 1.0, ceiling - 0.13))
    goal = low.require(Point(sin(1.0), cos(1.0), ceiling - 0.13))
    planner = Planner(CONFIG, MECHANISM)
    found = SMOOTH.plan(lambda way: planner.preview(low, way, 1.0), start, goal, ceiling - 0.03)
    assert found.preview.highest <= ceiling + 1e-6


def test_over_an_obstacle_the_way_is_higher() -> None:
    def not_below(way: Route) -> Preview:
        preview = check(way)
        if preview.highest < 0.8:
            raise PathRefused(target="there", reason="something stands in the way")
        return preview

    found = SMOOTH.plan(not_below, at(0.2, 1.0, 0.40), at(1.0, 1.3, 0.40), FLOOR)
    assert found.preview.highest >= 0.8


def test_transfer_that_every_check_refuses_is_refused_with_its_first_reason() -> None:
    def never(way: Route) -> Preview:
        raise PathRefused(target="there", reason="the check says no")

    with pytest.raises(PathRefused, match="the check says no"):
        SMOOTH.plan(never, at(0.2, 1.0, FLOOR), at(0.9, 1.0, FLOOR), FLOOR)


def test_floor_above_the_anchors_is_refused() -> None:
    with pytest.raises((Unreachable, PathRefused)):
        SMOOTH.plan(check, at(0.2, 1.0, FLOOR), at(0.9, 1.0, FLOOR), 2.4)


angles = st.floats(0.0, 2 * pi / 3)
distances = st.floats(0.82, 1.72)
starts = st.sampled_from((FLOOR, 0.42, 0.7, 1.0))


@given(angles, distances, starts, angles, distances)
def test_no_transfer_is_low_except_straight_above_its_ends(
    a: float, d: float, z: float, to_a: float, to_d: float
) -> None:
    start, goal = at(a, d, z), at(to_a, to_d, 0.4)
    found = crossed(start, goal)
    way = places(found.path)
    low = way[way[:, 2] < FLOOR - TOLERANCE]
    ends = [np.abs(low[:, :2] - np.array(end)).max(axis=1) < 1e-6 for end in ((a, d), (to_a, to_d))]
    assert np.all(ends[0] | ends[1])
    assert hypot(*(MECHANISM.fk(found.preview.end)[:2])) == pytest.approx(to_d, abs=1e-5)
