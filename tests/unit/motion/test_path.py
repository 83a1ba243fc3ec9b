"""Paths as curves: valid input, positions of their pieces, cut corners."""

from __future__ import annotations

from math import atan2, inf, nan

import numpy as np
import pytest

from maya_un.config import Config
from maya_un.errors import InvalidValue, TrajectoryRefused
from maya_un.kinematics import Mechanism
from maya_un.motion import Blend, Path, Space
from maya_un.motion.path import Waypoint, from_joints, to_joints
from maya_un.values import Joints, Point

MAYA = Mechanism.of(Config())
START, CORNER, BEYOND = Point(0.0, 0.0, 0.0), Point(1.0, 0.0, 0.0), Point(1.0, 1.0, 0.0)


def at(path: Path, parameter: float) -> Waypoint:
    x, y, z = path.pieces.at(np.array([parameter]))[0].tolist()
    return x, y, z


@pytest.mark.parametrize("waypoints", [(), ((0.0, 1.0, 1.0),)])
def test_a_path_leads_somewhere(waypoints: tuple[Waypoint, ...]) -> None:
    with pytest.raises(TrajectoryRefused, match="start and an end"):
        Path(Space.JOINT, waypoints)


@pytest.mark.parametrize("value", [nan, inf, -inf, 1e308, -10000.1])
def test_invalid_coordinate_is_refused(value: float) -> None:
    with pytest.raises(InvalidValue, match="between -10000 and 10000"):
        Path.line(START, Point(0.0, value, 0.0))


@pytest.mark.parametrize(
    "blends",
    [
        (Blend(0.1, 0.1),) * 2,
        (Blend(-0.1, 0.1),),
        (Blend(0.1, inf),),
        (Blend(0.1, 0.1, 0.0),),
        (Blend(0.1, 0.1, 1.0, 1.1),),
    ],
)
def test_blends_that_do_not_fit_are_refused(blends: tuple[Blend, ...]) -> None:
    with pytest.raises(InvalidValue, match="blends"):
        Path(Space.CARTESIAN, (START, CORNER, BEYOND), blends)


def test_without_blends_every_waypoint_is_a_sharp_corner() -> None:
    pieces = Path.line(START, CORNER, BEYOND).pieces
    assert pieces.straight == (True, True)
    assert pieces.sharp == (True, True, True)
    assert pieces.vias == (1.0,)


def test_an_even_blend_is_one_parabola() -> None:
    # 0.2 before the corner until 0.2 behind it; in the middle a quarter of either is left, 0.05.
    path = Path.line(START, CORNER, BEYOND, blend=0.2)
    assert path.pieces.straight == (True, False, True)
    assert path.pieces.sharp == (True, False, False, True)
    assert path.pieces.vias == (1.5,)
    assert at(path, 1.0) == pytest.approx((0.8, 0.0, 0.0))
    assert at(path, 1.5) == pytest.approx((0.95, 0.05, 0.0))
    assert at(path, 2.0) == pytest.approx((1.0, 0.2, 0.0))


def test_a_corner_with_shares_slows_down_late_and_speeds_up_early() -> None:
    # At half time the leg before begins to slow down and the one behind is at its speed: a ramp is half as long as the
    # same time at full speed, so that a third of 0.3 is left of the one and gone of the other.
    path = Path(Space.CARTESIAN, (START, CORNER, BEYOND), (Blend(0.3, 0.3, 0.5, 0.5),))
    assert path.pieces.straight == (True, False, False, True)
    assert at(path, 2.0) == pytest.approx((1.0 - 0.1, 0.1, 0.0))


def test_the_pieces_join_without_a_bend() -> None:
    path = Path(Space.CARTESIAN, (START, CORNER, BEYOND), (Blend(0.3, 0.2, 0.4, 0.7),))
    pieces = path.pieces
    arriving = pieces.last[:-1] - pieces.control[:-1]
    leaving = pieces.control[1:] - pieces.first[1:]
    assert pieces.last[:-1] == pytest.approx(pieces.first[1:])
    assert np.cross(arriving, leaving) == pytest.approx(0.0, abs=1e-12)


def test_blends_that_meet_share_the_leg_between_them() -> None:
    # 0.8 and 0.8 are wanted of 1: half of it is left to each, and the one leg between is gone.
    path = Path.line(START, CORNER, BEYOND, Point(2.0, 1.0, 0.0), blend=0.8)
    assert path.pieces.straight == (True, False, False, True)
    assert at(path, 1.0) == pytest.approx((0.5, 0.0, 0.0))
    assert at(path, 2.0) == pytest.approx((1.0, 0.5, 0.0))
    assert at(path, 3.0) == pytest.approx((1.5, 1.0, 0.0))


def test_a_turn_of_the_boom_counts_at_its_radius() -> None:
    # 1 rad at d = 2 is 2 m: of a blend of 0.5 m a quarter of the angle.
    path = Path.swing((0.0, 2.0, 0.5), (1.0, 2.0, 0.5), (1.0, 2.0, 1.5), blend=0.5)
    assert at(path, 1.0) == pytest.approx((0.75, 2.0, 0.5))
    assert at(path, 2.0) == pytest.approx((1.0, 2.0, 1.0))


@pytest.mark.parametrize("space", Space)
def test_coordinates_of_every_space_lead_back_to_the_joints(space: Space) -> None:
    joints = Joints(0.7, 1.5, 1.4)
    back = to_joints(space, MAYA, np.array([from_joints(space, MAYA, joints)]))[0]
    assert back.tolist() == pytest.approx(joints, abs=1e-12)


@pytest.mark.parametrize("space", [Space.CARTESIAN, Space.CYLINDRICAL])
def test_above_the_anchors_there_are_no_lengths(space: Space) -> None:
    joints = to_joints(space, MAYA, np.array([(0.5, 1.2, MAYA.reach_down + 0.01)]))[0]
    assert np.isnan(joints[1:]).all()


def test_ends_and_waypoints_are_given_as_joints() -> None:
    places = [Point(0.4, 1.1, 0.5), Point(0.8, 0.9, 0.6), Point(1.1, 0.4, 0.4)]
    for path in (Path.line(*places), Path.swing(*((atan2(x, y), (x * x + y * y) ** 0.5, z) for x, y, z in places))):
        vias = path.vias(MAYA)
        assert (path.start(MAYA), path.end(MAYA)) == (vias[0], vias[-1])
        assert [MAYA.fk(via) for via in vias] == [pytest.approx(place) for place in places]


def test_path_can_begin_slightly_off_its_start() -> None:
    path = Path.line(Point(0.4, 1.1, 0.5), Point(0.8, 0.9, 0.6))
    here = path.start(MAYA)._replace(a=0.351)
    moved = path.begun_at(MAYA, here)
    assert moved.start(MAYA) == pytest.approx(here)
    assert moved.waypoints[1:] == path.waypoints[1:]
