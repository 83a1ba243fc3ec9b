"""Distances to zones by hand and by brute force, and that nothing travels farther than its bound."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, hypot, pi, sin, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.kinematics import Box, Cylinder, Floats, HalfSpace, Zone
from maya_un.kinematics.zones import ACCURACY, clearances, corners, travel_bound, travel_bounds, written, zone_of
from maya_un.values import Joints, Point
from tests.strategies import WORKSPACE, reachable_joints

MAYA = WORKSPACE.mechanism
ROUNDING = 1e-12

TOWER = Box("tower", Point(-0.1, 1.2, 0.0), Point(0.1, 1.4, 0.5), margin=0.0)
MAST = Cylinder("mast", 0.0, 1.3, 0.1, 0.0, 0.5, margin=0.0)
SHELF = HalfSpace("shelf", Point(0.0, 0.0, 1.9), Point(0.0, 0.0, -2.0), margin=0.0)


def at(x: float, y: float, z: float) -> Joints:
    return MAYA.ik(Point(x, y, z))


@pytest.mark.parametrize(
    ("zone", "joints", "distance"),
    [
        # The gripper 0.4 above the middle of the top.
        (TOWER, at(0.0, 1.3, 0.9), 0.4),
        (MAST, at(0.0, 1.3, 0.9), 0.4),
        # 0.3 beside a wall, 0.1 below the top: the way is level.
        (TOWER, at(0.4, 1.3, 0.4), 0.3),
        (MAST, at(0.4, 1.3, 0.4), 0.3),
        # 0.3 beside and 0.4 above the edge: a 3-4-5 triangle.
        (TOWER, at(0.4, 1.3, 0.9), 0.5),
        (MAST, at(0.4, 1.3, 0.9), 0.5),
        # 0.03 inside of the nearest face.
        (TOWER, at(0.07, 1.3, 0.3), -0.03),
        (MAST, at(0.0, 1.23, 0.3), -0.03),
        # The gripper at 0.9, the meeting point 0.2 above: 0.8 below the zone.
        (SHELF, at(0.5, 1.2, 0.9), 0.8),
    ],
)
def test_the_distance_of_the_gripper_worked_by_hand(zone: Zone, joints: Joints, distance: float) -> None:
    assert zone.clearance(MAYA, joints) == pytest.approx(distance, abs=ACCURACY)


def test_the_margin_is_used_up_before_the_zone_is_touched() -> None:
    wide = Box("wide", TOWER.low, TOWER.high, margin=0.45)
    assert wide.clearance(MAYA, at(0.0, 1.3, 0.9)) == pytest.approx(-0.05, abs=ACCURACY)


def test_by_default_lines_stay_out_of_solids_and_may_pass_planes() -> None:
    assert (Box("", TOWER.low, TOWER.high).lines, Cylinder("", 0, 1, 1, 0, 1).lines) == (True, True)
    assert not HalfSpace("", Point(0, 0, 0), Point(0, 0, 1)).lines
    assert (TOWER.lines, Box("", TOWER.low, TOWER.high).margin) == (True, 0.05)


def test_line_may_be_hit_between_its_ends() -> None:
    # Boom along +y, meeting point 1 m below the middle: the outer line rises at 45°, through y = 1.8 at z = 1.85.
    joints = Joints(0.0, sqrt(2.0), sqrt(2.0))
    low, high = Point(-0.1, 1.8, 1.55), Point(0.1, 1.9, 1.75)
    beneath = Box("beneath", low, high, margin=0.0)
    # The nearest corner is (y, z) = (1.8, 1.75), 0.1 below the line: 0.1/√2 across.
    assert beneath.clearance(MAYA, joints) == pytest.approx(0.1 / sqrt(2.0), abs=ACCURACY)
    assert Box("", low, high, margin=0.0, lines=False).clearance(MAYA, joints) == pytest.approx(
        hypot(0.5, 0.2), abs=ACCURACY
    )


def test_a_plane_that_lines_stay_out_of_is_above_the_boom() -> None:
    joints = at(0.5, 1.2, 0.9)
    below = HalfSpace("", Point(0.0, 0.0, 2.5), Point(0.0, 0.0, -1.0), margin=0.0, lines=True)
    assert below.clearance(MAYA, joints) == pytest.approx(0.15)


def test_corners_are_the_gripper_and_the_anchors() -> None:
    gripper, meeting, inner, outer = corners(MAYA, np.array([[pi / 2, sqrt(2.0), sqrt(2.0)]]))[:, :, 0].T
    assert gripper == pytest.approx((1.3, 0.0, 1.15))
    assert meeting == pytest.approx((1.3, 0.0, 1.35))
    assert inner == pytest.approx((0.3, 0.0, 2.35))
    assert outer == pytest.approx((2.3, 0.0, 2.35))


NUMBERS = st.floats(-2.5, 2.5)
HEIGHTS = st.floats(0.0, 2.6)
SIZES = st.floats(0.01, 1.5)


@st.composite
def boxes(draw: st.DrawFn) -> Box:
    low = Point(draw(NUMBERS), draw(NUMBERS), draw(HEIGHTS))
    high = Point(*(corner + draw(SIZES) for corner in low))
    return Box("box", low, high, draw(st.floats(0.0, 0.2)), draw(st.booleans()))


@st.composite
def cylinders(draw: st.DrawFn) -> Cylinder:
    low = draw(HEIGHTS)
    place = draw(NUMBERS), draw(NUMBERS), draw(SIZES), low, low + draw(SIZES)
    return Cylinder("cylinder", *place, draw(st.floats(0.0, 0.2)), draw(st.booleans()))


@st.composite
def half_spaces(draw: st.DrawFn) -> HalfSpace:
    normal = draw(st.tuples(NUMBERS, NUMBERS, NUMBERS).filter(lambda found: hypot(*found) > 0.1))
    point = Point(draw(NUMBERS), draw(NUMBERS), draw(HEIGHTS))
    return HalfSpace("plane", point, Point(*normal), draw(st.floats(0.0, 0.2)), draw(st.booleans()))


def zones() -> st.SearchStrategy[Zone]:
    return boxes() | cylinders() | half_spaces()


def brute_distance(zone: Zone, place: Sequence[float]) -> float:
    """The signed distance of one place, by the definition of the solid."""
    x, y, z = place
    match zone:
        case Box():
            beyond = [max(low - at, at - high) for low, at, high in zip(zone.low, place, zone.high, strict=True)]
        case Cylinder():
            beyond = [hypot(x - zone.x, y - zone.y) - zone.radius, max(zone.low - z, z - zone.high)]
        case HalfSpace():
            length = hypot(*zone.normal)
            return sum((at - p) * n / length for at, p, n in zip(place, zone.point, zone.normal, strict=True))
        case _:
            raise AssertionError(zone)
    outside = hypot(*(max(0.0, one) for one in beyond))
    return outside if outside > 0.0 else max(beyond)


def brute_clearance(zone: Zone, joints: Joints, samples: int = 200) -> float:
    """The least distance of so many places on every straight piece, less the margin."""
    x, y, z = MAYA.fk(joints)
    meeting = (x, y, z + MAYA.drop)
    pieces = [((x, y, z), meeting)]
    if zone.lines:
        for radius in (MAYA.delta, MAYA.length):
            pieces.append((meeting, (radius * sin(joints.a), radius * cos(joints.a), MAYA.height)))
    places = [
        [one + (other - one) * share / samples for one, other in zip(start, end, strict=True)]
        for start, end in pieces
        for share in range(samples + 1)
    ]
    return min(brute_distance(zone, place) for place in places) - zone.margin


@given(zones(), reachable_joints())
def test_clearance_agrees_with_sampling(zone: Zone, joints: Joints) -> None:
    sampled = brute_clearance(zone, joints)
    spacing = 2.4 / 200
    assert sampled - 0.5 * spacing - ACCURACY <= zone.clearance(MAYA, joints) <= sampled + ROUNDING


@given(zones(), st.lists(reachable_joints(), min_size=1, max_size=4))
def test_many_at_once_are_one_at_a_time(zone: Zone, joints: list[Joints]) -> None:
    at_once = clearances([zone, TOWER], MAYA, np.array(joints))
    assert at_once[:, 0] == pytest.approx([zone.clearance(MAYA, one) for one in joints], abs=1e-9)
    assert at_once[:, 1] == pytest.approx([TOWER.clearance(MAYA, one) for one in joints], abs=1e-9)


@given(zones(), reachable_joints(), st.floats(-0.1, 1.0))
def test_rough_clearance_is_exact_below_the_limit(zone: Zone, joints: Joints, enough: float) -> None:
    exact = zone.clearance(MAYA, joints)
    rough = zone.clearances_between(corners(MAYA, np.array([joints])), enough)[0]
    assert min(exact, enough) - ROUNDING <= rough <= exact + ROUNDING if exact > enough else rough == exact


@given(zones(), reachable_joints(), reachable_joints())
def test_no_clearance_changes_by_more_than_the_travel(zone: Zone, start: Joints, end: Joints) -> None:
    change = abs(zone.clearance(MAYA, start) - zone.clearance(MAYA, end))
    assert change <= travel_bound(MAYA, start, end) + ACCURACY


def way(joints: Floats, samples: int) -> float:
    """The longest way that gripper, meeting point or an anchor goes along a chord, as a chain of short steps."""
    shares = np.linspace(0.0, 1.0, samples + 1)[:, None]
    places = corners(MAYA, joints[0] + shares * (joints[1] - joints[0]))
    return float(np.sqrt((np.diff(places, axis=2) ** 2).sum(axis=0)).sum(axis=1).max())


@given(reachable_joints(), reachable_joints())
def test_nothing_travels_farther_than_its_bound(start: Joints, end: Joints) -> None:
    assert way(np.array([start, end]), 200) <= travel_bound(MAYA, start, end) + ROUNDING


@given(reachable_joints(), reachable_joints(), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_a_share_of_a_chord_has_its_share_of_the_bound(start: Joints, end: Joints, one: float, other: float) -> None:
    chord = np.array([start, end])
    part = np.array([chord[0] + share * (chord[1] - chord[0]) for share in (one, other)])
    assert way(part, 50) <= abs(one - other) * travel_bound(MAYA, start, end) + 1e-9


def test_the_bound_is_tight_for_short_chords() -> None:
    joints = np.random.default_rng(3).uniform((0.0, 1.2, 1.2), (2.0, 2.2, 2.2), (500, 3))
    ends = joints + np.random.default_rng(4).uniform(-0.01, 0.01, (500, 3))
    bounds = travel_bounds(MAYA, joints, ends)
    ways = [way(np.array(chord), 20) for chord in zip(joints, ends, strict=True)]
    assert np.all(bounds >= ways)
    assert np.quantile(bounds / ways, 0.9) < 1.05


def test_turning_alone_moves_the_outer_anchor_most() -> None:
    assert travel_bound(MAYA, Joints(0.2, 1.5, 1.5), Joints(0.7, 1.5, 1.5)) == pytest.approx(2.30 * 0.5)


def test_lines_that_might_be_straight_on_the_way_have_no_bound() -> None:
    assert travel_bound(MAYA, Joints(0.0, 1.1, 1.1), Joints(0.0, 0.9, 0.9)) == np.inf


@given(zones())
def test_a_zone_that_is_written_and_read_is_the_same(zone: Zone) -> None:
    assert zone_of(written(zone)) == zone
