"""The judge's paths, verdicts and distances to lines, by hand."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from tests.judge.mechanism import Floats, Frame, joints_at, places, to_cylinder
from tests.judge.paths import Cut, Opinion, Space, Way, deviations, drawn, judged
from tests.judge.zones import Block

FRAME = Frame(2.35, 2.30, 0.30, 0.20, ((-0.5, 2.0 * pi / 3.0), (0.575, 2.260), (0.565, 2.300)), 5.0)
ENDS = ((0.0, 0.9, 1.5), (1.2, 0.9, 1.6), (1.2, 1.3, 1.0))
"""Fit as joints, as points, and as angle, radius, height."""


def in_space(space: Space, joints: Floats) -> Floats:
    if space == "joint":
        return joints
    points = places(FRAME, joints)
    return points if space == "cartesian" else to_cylinder(points)


@pytest.mark.parametrize("space", ["joint", "cartesian", "cylindrical"])
def test_legs_go_straight_through_every_waypoint_in_their_own_space(space: Space) -> None:
    path = in_space(space, drawn(FRAME, Way(space, ENDS), 2_000))
    assert len(path) in range(2_000, 2_003)
    via = int(np.abs(path - np.array(ENDS[1])).max(axis=1).argmin())
    assert np.abs(path[[0, via, -1]] - np.array(ENDS)).max() < 1e-12
    assert np.abs(path[: via + 1] - np.linspace(ENDS[0], ENDS[1], via + 1)).max() < 1e-12


@pytest.mark.parametrize("space", ["joint", "cartesian"])
def test_a_blend_leaves_the_corner_on_a_parabola(space: Space) -> None:
    """Half way the parabola is half way between its control point, the corner, and the middle of its ends."""
    way = Way(space, ((0.2, 1.0, 1.5), (0.6, 1.0, 1.5), (0.6, 1.3, 1.5)), (Cut(0.1, 0.1),))
    line, parabola, onward = way.pieces()
    assert line.points[2] == pytest.approx((0.5, 1.0, 1.5))
    assert onward.points[0] == pytest.approx((0.6, 1.1, 1.5))
    middle = in_space(space, way.joints(FRAME, parabola, np.array([0.5])))[0]
    assert middle == pytest.approx((0.575, 1.025, 1.5))


def test_cuts_that_do_not_fit_a_leg_are_made_smaller_and_arcs_count_at_their_radius() -> None:
    waypoints = ((0.0, 1.0, 1.0), (0.2, 1.0, 1.0), (0.2, 1.0, 1.3), (0.3, 1.4, 1.3))
    line, first, second, rest = Way("cylindrical", waypoints, (Cut(0.18, 0.2), Cut(0.4, 0.4))).pieces()
    # 0.2 and 0.4 want to share 0.3: both cuts shrink to a half.
    assert line.points[2] == pytest.approx((0.11, 1.0, 1.0))
    assert first.points[2] == pytest.approx((0.2, 1.0, 1.1))
    assert second.points[0] == pytest.approx((0.2, 1.0, 1.1))
    taken = 0.2 / (0.4**2 + 0.12**2) ** 0.5
    assert rest.points[0] == pytest.approx((0.2 + 0.1 * taken, 1.0 + 0.4 * taken, 1.3))


def test_a_leg_that_is_quick_to_start_leaves_the_corner_later() -> None:
    """At half time the leg behind, up to speed already, has gone a third of its 0.3 m; a quarter of 0.1 m is left."""
    waypoints = ((0.2, 1.0, 1.5), (0.6, 1.0, 1.5), (0.6, 1.4, 1.5))
    _, first, second, _ = Way("joint", waypoints, (Cut(0.1, 0.3, 1.0, 0.5),)).pieces()
    assert first.points[2] == pytest.approx((0.6 - 0.1 / 4.0, 1.0 + 0.3 / 3.0, 1.5))
    assert second.points[2] == pytest.approx((0.6, 1.3, 1.5))
    assert first.width == second.width


def test_the_parameter_goes_smoothly_through_a_blend() -> None:
    way = Way(
        "cylindrical",
        ((0.0, 1.0, 1.0), (0.2, 1.2, 1.0), (0.2, 1.0, 1.3), (0.3, 1.4, 1.3)),
        (Cut(0.1, 0.15, 0.7, 0.4), Cut(0.0, 0.0)),
    )
    pieces = way.pieces()
    assert [piece.sharp for piece in pieces] == [False, False, False, False, True, True]
    starts = [2.0 * (piece.points[1] - piece.points[0]) / piece.width for piece in pieces]
    ends = [2.0 * (piece.points[2] - piece.points[1]) / piece.width for piece in pieces]
    for before, behind in zip(ends[:4], starts[1:5], strict=True):
        assert before == pytest.approx(behind)


def test_reversing_path_has_no_corner_to_cut() -> None:
    way = Way("joint", ((0.2, 1.0, 1.5), (0.6, 1.0, 1.5), (0.3, 1.0, 1.52)), (Cut(0.1, 0.1),))
    assert [piece.sharp for piece in way.pieces()] == [True, True]


Places = tuple[tuple[float, float, float], ...]


def ahead(*spots: tuple[float, float]) -> Places:
    """Return the points at (radius, height) along +y."""
    return tuple((0.0, d, z) for d, z in spots)


def in_joints(points: Places) -> Places:
    return tuple((float(a), float(b), float(c)) for a, b, c in joints_at(FRAME, np.array(points)))


def test_a_straight_joint_path_between_good_places_may_be_outside() -> None:
    """Below the outer anchor line b changes less than line c: straight in joints, the way bulges outwards."""
    ends = ahead((2.299, 1.55), (2.299, 1.15))
    assert judged(FRAME, np.array(in_joints(ends))).opinion is Opinion.INSIDE
    straight = judged(FRAME, drawn(FRAME, Way("cartesian", ends)))
    assert (straight.opinion, straight.limit) == (Opinion.INSIDE, "outer")
    assert straight.margin == pytest.approx(0.001, abs=1e-9)
    bulging = judged(FRAME, drawn(FRAME, Way("joint", in_joints(ends))))
    assert (bulging.opinion, bulging.limit) == (Opinion.OUTSIDE, "outer")
    assert 0.4 < bulging.share < 0.6


def test_every_leg_is_looked_at_however_unlike_the_cuts_of_its_corners() -> None:
    cuts = (Cut(0.005, 0.15), Cut(0.009, 0.24))
    ends = ((1.0, 1.6, 1.5), (2.0, 1.4, 1.6), (1.1, 1.5, 0.8), (0.4, 1.8, 1.7))
    joints = drawn(FRAME, Way("joint", ends, cuts), 2_000)
    gaps = np.linalg.norm(np.diff(joints, axis=0), axis=1)
    assert gaps.max() < 2.0 * gaps.sum() / 2_000


def test_verdicts_name_the_limit_and_doubt_close_ones() -> None:
    verdict = judged(FRAME, drawn(FRAME, Way("cartesian", ahead((1.0, 1.3), (2.4, 1.3)))))
    assert (verdict.opinion, verdict.limit) == (Opinion.OUTSIDE, "outer")
    assert verdict.margin == pytest.approx(-0.1)
    verdict = judged(FRAME, drawn(FRAME, Way("cartesian", ahead((1.0, 1.3), (2.3 - 5e-7, 1.3)))))
    assert verdict.opinion is Opinion.UNDECIDED


def test_verdicts_name_the_zone() -> None:
    vice = Block("vice", 0.05, True, (-0.1, 1.4, 0.0), (0.1, 1.6, 1.5))
    assert judged(FRAME, joints_at(FRAME, np.array(ahead((1.0, 1.3)))), [vice]).opinion is Opinion.INSIDE
    verdict = judged(FRAME, drawn(FRAME, Way("cartesian", ahead((1.0, 1.3), (2.0, 1.3)))), [vice])
    assert (verdict.opinion, verdict.limit) == (Opinion.OUTSIDE, "vice")
    assert verdict.margin == pytest.approx(-0.15, abs=1e-6)


def test_distances_to_a_polyline() -> None:
    line = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)])
    points = np.array([(0.5, 0.2), (-0.3, 0.4), (1.2, 0.5), (0.9, 0.1), (1.3, 1.4)])
    assert deviations(points, line) == pytest.approx([0.2, 0.5, 0.2, 0.1, 0.5])


def test_long_piece_is_near_though_its_ends_are_not() -> None:
    crowd = np.column_stack((np.full(50, 0.5), np.linspace(0.1, 0.2, 50)))
    line = np.concatenate((crowd, [(0.0, 0.2), (0.0, 0.0), (1.0, 0.0)]))
    assert deviations(np.array([(0.5, 0.001)]), line) == pytest.approx([0.001])
