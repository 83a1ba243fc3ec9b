"""The cuts of paths into chords, worked by hand."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from maya_un.config import Config, Units
from maya_un.kinematics import Mechanism
from maya_un.motion import Knots, Limits, Path, lay
from maya_un.motion.move import divided, fastest, straight
from maya_un.values import Joints, Point

CONFIG = Config()
UNITS = Units.of(CONFIG)
LIMITS = Limits.of(CONFIG)
MAYA = Mechanism.of(CONFIG)
HERE = Joints(0.5, 1.5, 1.7)
PASSING = Path.line(Point(0.3, 1.2, 0.5), Point(1.2, 0.3, 0.5))
"""A line past the axis: the boom turns by 62 degrees, the lines go in and out."""


def laid(path: Path, coarseness: float = 1.0) -> Knots:
    return lay(path, MAYA, UNITS, LIMITS, coarseness)


def shifted(a: int = 0, b: int = 0, c: int = 0) -> Joints:
    at = UNITS.to_counts(HERE)
    return UNITS.to_joints((at[0] + a, at[1] + b, at[2] + c))


def test_joints_joined_by_lines_need_no_knots_between() -> None:
    knots = laid(Path.joints(HERE, shifted(a=300), shifted(a=300, b=400)))
    assert np.diff(knots.counts, axis=0).tolist() == [[300, 0, 0], [0, 400, 0]]
    assert knots.sharp.tolist() == [True, True, True]
    assert knots.vias == (300.0,)


def test_places_within_a_count_are_one_and_stay_a_corner() -> None:
    knots = straight(UNITS, [HERE, shifted(b=100), shifted(b=100), shifted(b=100, c=50)])
    assert np.diff(knots.counts, axis=0).tolist() == [[0, 100, 0], [0, 0, 50]]
    assert knots.sharp.tolist() == [True, True, True]
    assert knots.vias == (100.0, 100.0)


def test_standing_still_is_one_knot() -> None:
    assert len(laid(Path.joints(HERE, HERE)).counts) == 1


def test_a_short_rise_is_one_chord_and_a_long_way_in_many() -> None:
    assert len(laid(Path.line(Point(0.4, 1.1, 0.4), Point(0.4, 1.1, 0.5))).counts) == 2
    assert len(laid(Path.line(Point(0.3, 0.9, 0.5), Point(0.3, 1.7, 0.5))).counts) > 20


def test_a_joint_leg_between_blends_is_one_chord() -> None:
    path = Path.joints(HERE, shifted(b=400_000), shifted(b=400_000, c=-400_000), blend=0.05)
    knots = laid(path)
    begins = UNITS.to_counts(HERE)
    assert (knots.counts[1] - begins).tolist() == [0, 350_000, 0]
    assert (knots.counts[-1] - knots.counts[-2]).tolist() == [0, 0, -350_000]


def test_coarser_knots_are_fewer_and_as_near_to_the_line() -> None:
    fine, coarse = laid(PASSING), laid(PASSING, 4.0)
    assert len(coarse.counts) < 0.7 * len(fine.counts)
    assert coarse.counts[[0, -1]].tolist() == fine.counts[[0, -1]].tolist()
    middles = 0.5 * (coarse.counts[1:] + coarse.counts[:-1]) / UNITS.per_unit
    x, y, z = np.array([MAYA.fk(Joints(*middle)) for middle in middles.tolist()]).T
    assert np.abs(x + y - 1.5).max() / sqrt(2.0) < 1e-4
    assert np.abs(z - 0.5).max() < 1e-4


def test_inner_knots_are_at_whole_counts_of_the_boom() -> None:
    boom = laid(PASSING).exact[1:-1, 0]
    off = np.abs(boom - np.rint(boom))
    assert np.mean(off < 0.02) > 0.95  # not by chance: that would leave one in twenty-five


def test_waypoint_is_described_as_the_way_to_it() -> None:
    points = Point(0.4, 1.1, 0.5), Point(0.5, 1.2, 0.6), Point(0.6, 1.2, 0.5)
    knots = laid(Path.line(*points))
    corner = UNITS.to_counts(MAYA.ik(points[1]))
    at = knots.counts.tolist().index(list(corner))
    assert knots.vias == pytest.approx([np.sqrt((np.diff(knots.counts[: at + 1], axis=0) ** 2).sum(axis=1)).sum()])
    assert knots.sharp.tolist() == [knot in (0, at, len(knots.counts) - 1) for knot in range(len(knots.counts))]


def test_long_chords_are_divided_evenly() -> None:
    knots = divided(straight(UNITS, [HERE, shifted(b=30_000, c=40_000), shifted(b=30_000, c=45_000)]), 20_000.0)
    assert np.diff(knots.counts, axis=0).tolist() == [
        [0, 10_000, 13_333],
        [0, 10_000, 13_334],
        [0, 10_000, 13_333],
        [0, 0, 5000],
    ]
    assert knots.sharp.tolist() == [True, False, False, True, True]
    assert knots.vias == (50_000.0,)


def test_straight_on_the_slew_speeds_decide() -> None:
    directions = np.array([(1.0, 0.0, 0.0), (0.0, 0.6, -0.8), (0.6, 0.8, 0.0)]).T
    speeds = fastest(directions, np.zeros((3, 3)), LIMITS)
    assert speeds.tolist() == pytest.approx([1000.0, 45_000.0 / 0.8, 1000.0 / 0.6])


def test_in_a_bend_the_accelerations_decide() -> None:
    # Along b, bending towards c: v² κ may be what c can do, 5120 counts/s².
    turn = np.array([(0.0, 0.0, 1e-4)]).T
    bent = fastest(np.array([(0.0, 1.0, 0.0)]).T, turn, LIMITS)
    assert bent.tolist() == pytest.approx([sqrt(5120.0 / 1e-4)])
    # If both go alike and one bends away from the other, they share it: v² κ/√2 ≤ (5120 + 5120)/√2.
    shared = fastest(np.array([(0.0, 1.0, 1.0)]).T / sqrt(2.0), turn, LIMITS)
    assert shared.tolist() == pytest.approx([sqrt(10_240.0 / 1e-4)])
