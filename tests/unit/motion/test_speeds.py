"""The fastest way along chords, worked by hand and against an optimum found otherwise."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from maya_un.config import Config, Units
from maya_un.kinematics import Floats, Mechanism
from maya_un.motion import Limits, Path, lay, plan
from maya_un.motion.move import Knots, straight
from maya_un.motion.path import to_joints
from maya_un.motion.speeds import Budget, Chords, caps, knot_squares, peaks
from maya_un.values import Joints, Point
from tests.lower_bound import Rates, least_time

CONFIG = Config()
UNITS = Units.of(CONFIG)
LIMITS = Limits.of(CONFIG)
MAYA = Mechanism.of(CONFIG)
PER_UNIT = np.array(UNITS.per_unit)
FREE = 1e9
"""A controller that rises and falls as quickly as anybody asks."""


def through(*places: tuple[int, int, int], sharp: bool = False) -> Chords:
    """Return the chords through places in counts; the places between the ends are corners or not."""
    counts = np.array(places)
    corners = np.array([True, *[sharp] * (len(places) - 2), True])
    return Chords.of(Knots(counts, counts.astype(np.float64), corners, ()))


def squares(chords: Chords, scale: float = 1.0) -> Floats:
    return knot_squares(chords, Budget.of(chords, LIMITS, FREE, FREE), caps(chords, LIMITS, scale)[1])


def test_chords_have_lengths_directions_and_bends() -> None:
    chords = through((0, 0, 0), (0, 300, 400), (0, 300, 900))
    assert chords.lengths.tolist() == [500.0, 500.0]
    assert chords.directions.T.tolist() == [[0.0, 0.6, 0.8], [0.0, 0.0, 1.0]]
    assert chords.bends == pytest.approx(np.array([(0, 0, 0), (0.0, -0.6 / 500.0, 0.2 / 500.0), (0, 0, 0)]).T)


def test_a_corner_has_no_bend_and_is_passed_next_to_rest() -> None:
    # From b to c each of them jumps by the whole speed, which may be 2 % of 45 000.
    chords = through((0, 0, 0), (0, 100_000, 0), (0, 100_000, 100_000), sharp=True)
    assert not chords.bends.any()
    assert caps(chords, LIMITS, 1.0)[1].tolist() == pytest.approx([0.0, 900.0, 0.0])


def test_the_scale_slows_the_slew_speeds() -> None:
    within, at = caps(through((0, 0, 0), (0, 300, 400), (0, 600, 800)), LIMITS, 0.5)
    assert within.tolist() == pytest.approx([28_125.0, 28_125.0])
    assert at.tolist() == pytest.approx([0.0, 28_125.0, 0.0])


def test_straight_on_it_rises_and_falls_by_v_squared_is_2_a_s() -> None:
    found = squares(through((0, 0, 0), (0, 1000, 0), (0, 4000, 0), (0, 6000, 0)))
    assert found.tolist() == pytest.approx([0.0, 2 * 5120 * 1000.0, 2 * 5120 * 2000.0, 0.0])


def test_the_slower_axis_decides() -> None:
    # The boom takes 1 of √101 of the way and does 1024 counts/s², the line 10 of them and 5120.
    found = squares(through((0, 0, 0), (100, 1000, 0), (200, 2000, 0)))
    length = 100.0 * sqrt(101.0)
    assert found[1] == pytest.approx(2.0 * 512.0 * sqrt(101.0) * length)


def test_a_chord_alone_has_its_peak_in_the_middle() -> None:
    chords = through((0, 0, 0), (0, 1000, 0))
    budget = Budget.of(chords, LIMITS, FREE, FREE)
    top, up, down = peaks(chords, budget, np.array([45_000.0]), np.zeros(2))
    assert (top[0], up[0], down[0]) == pytest.approx((5120 * 1000.0, 5120.0, 5120.0))
    assert peaks(chords, budget, np.array([500.0]), np.zeros(2))[0][0] == 500.0**2


def test_controller_is_a_separate_axis() -> None:
    chords = through((0, 0, 0), (0, 1000, 0), (0, 4000, 0))
    found = knot_squares(chords, Budget.of(chords, LIMITS, 1024.0, 2048.0), np.array([0.0, 45_000.0, 0.0]))
    assert found.tolist() == pytest.approx([0.0, 2 * 1024 * 1000.0, 0.0])


def test_in_a_bend_the_axis_that_turns_away_holds_back() -> None:
    """An arc of the lines: (b, c) on a circle of 100 000 counts, whose normal acceleration is v²/r."""
    turn = np.linspace(0.0, 1.5, 151)
    circle = 1e5 * np.stack((np.zeros_like(turn), np.sin(turn), 1.0 - np.cos(turn)), axis=1)
    chords = Chords.of(Knots(np.rint(circle).astype(np.int64), circle, np.isin(np.arange(151), (0, 150)), ()))
    budget = Budget.of(chords, LIMITS, FREE, FREE)
    free = np.append(np.insert(np.full(149, 1e9), 0, 0.0), 0.0)
    found = knot_squares(chords, budget, free)
    # With d = (cos, sin) and d' = (−sin, cos)/r some u fits as long as v²/r ≤ 5120 (cos + sin).
    angle = turn[2:-2]
    assert np.all(found[2:-2] <= 1.02 * 5120.0 * 1e5 * (np.cos(angle) + np.sin(angle)))
    assert found.max() > 0.9 * 5120.0 * 1e5


def test_between_knots_every_axis_keeps_its_acceleration() -> None:
    path = Path.line(Point(0.3, 1.2, 0.5), Point(1.2, 0.3, 0.6))
    chords = Chords.of(lay(path, MAYA, UNITS, LIMITS))
    found = squares(chords)
    # At constant u along a chord, x its square of the speed: q'' = d u + c x in the middle of it.
    u = np.diff(found) / (2.0 * chords.lengths)
    middle = 0.5 * (found[1:] + found[:-1])
    bends = 0.5 * (chords.bends[:, 1:] + chords.bends[:, :-1])
    accelerations = chords.directions * u + bends * middle
    assert np.all(np.abs(accelerations) <= 1.0001 * LIMITS.rise)
    assert np.all(np.sqrt(found[1:]) * np.abs(chords.directions) <= 1.0001 * LIMITS.slew)


UP = Path.line(Point(0.4, 1.1, 0.4), Point(0.4, 1.1, 0.7))
OUT = Path.line(Point(0.3, 0.9, 0.5), Point(0.3, 1.6, 0.5))
ROUND = Path.swing((0.3, 1.2, 0.5), (1.5, 1.2, 0.5))
PAST = Path.line(Point(0.3, 1.2, 0.5), Point(1.2, 0.3, 0.5))


@pytest.mark.parametrize("path", [UP, OUT, ROUND, PAST], ids=["up", "out", "round", "past"])
def test_no_way_takes_two_per_cent_longer_than_the_optimum(path: Path) -> None:
    speeds, rises, falls = (
        np.array(column) / PER_UNIT for column in (LIMITS.speed, LIMITS.acceleration, LIMITS.deceleration)
    )
    rates = Rates(*(tuple(column.tolist()) for column in (speeds, rises, falls)))
    best = least_time(lambda at: to_joints(path.space, MAYA, path.pieces.at(at)), [0.0, 1.0], rates, points=800)
    taken = plan(lay(path, MAYA, UNITS, LIMITS), LIMITS, UNITS).duration
    assert 0.99 * best <= taken <= 1.02 * best


def test_a_stop_on_the_way_is_never_quicker_than_none() -> None:
    here, via, there = Joints(0.5, 1.5, 1.7), Joints(0.6, 1.6, 1.6), Joints(0.8, 1.8, 1.4)
    at_once = plan(straight(UNITS, (here, there)), LIMITS, UNITS).duration
    assert plan(straight(UNITS, (here, via, there)), LIMITS, UNITS).duration >= at_once - 1e-3
