"""The mean of a speed over a window: numbers worked by hand for a trapezoid, and what holds of every one."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from maya_un.motion.jerk import Ramped, Smooth

TRAPEZOID = Ramped.over(np.array([2.0, 2.0, 2.0]), np.array([0.0, 10.0, 10.0, 0.0]))
"""Up to 10 counts/s in 2 s, on for 2 s, down in 2 s: 40 counts."""


def test_the_way_of_a_ramped_speed() -> None:
    found = TRAPEZOID.way(np.array([-1.0, 0.0, 1.0, 2.0, 3.0, 5.0, 6.0, 9.0]))
    assert found == pytest.approx([0.0, 0.0, 2.5, 10.0, 20.0, 37.5, 40.0, 40.0])


def test_spans_without_time_are_left_out() -> None:
    found = Ramped.over(np.array([1.0, 0.0, 1.0]), np.array([0.0, 5.0, 5.0, 0.0]))
    assert found.times.tolist() == [0.0, 1.0, 2.0]
    assert found.ways.tolist() == [0.0, 2.5, 5.0]


def test_a_trapezoid_becomes_seven_phases() -> None:
    # A = 5 over a window of 1 s: the acceleration rises and falls at 5 counts/s³ for 1 s each.
    smooth = Smooth.mean(TRAPEZOID, 1.0)
    assert smooth.times == pytest.approx([0, 1, 2, 3, 4, 5, 6, 7])
    assert smooth.jerks == pytest.approx([5, 0, -5, 0, -5, 0, 5], abs=1e-12)
    assert smooth.accelerations == pytest.approx([0, 5, 5, 0, 0, -5, -5, 0], abs=1e-12)
    assert smooth.speeds == pytest.approx([0, 2.5, 7.5, 10, 10, 7.5, 2.5, 0], abs=1e-12)
    assert smooth.ways == pytest.approx([0, 5 / 6, 35 / 6, 15, 25, 205 / 6, 235 / 6, 40])


def test_between_the_corners_it_is_a_cubic() -> None:
    way, speed, acceleration = Smooth.mean(TRAPEZOID, 1.0).at(np.array([0.5, 2.5]))
    assert way == pytest.approx([5 * 0.125 / 6, 35 / 6 + 7.5 * 0.5 + 5 * 0.25 / 2 - 5 * 0.125 / 6])
    assert speed == pytest.approx([5 * 0.25 / 2, 7.5 + 2.5 - 0.625])
    assert acceleration == pytest.approx([2.5, 2.5])


def test_when_is_the_inverse_of_the_way() -> None:
    smooth = Smooth.mean(TRAPEZOID, 1.3)
    times = np.linspace(0.3, smooth.duration - 0.3, 57)
    assert smooth.when(smooth.at(times)[0]) == pytest.approx(times, abs=1e-9)


def test_a_window_longer_than_the_motion_keeps_the_way() -> None:
    smooth = Smooth.mean(TRAPEZOID, 10.0)
    assert smooth.duration == pytest.approx(16.0)
    assert smooth.ways[-1] == 40.0
    assert smooth.speeds.max() == pytest.approx(4.0)
    assert smooth.accelerations.max() == pytest.approx(1.0)


def test_slowed_is_the_same_in_more_time() -> None:
    smooth = Smooth.mean(TRAPEZOID, 1.0)
    slow = smooth.slowed(2.0)
    way, speed, acceleration = slow.at(np.array([3.0]))
    faster = smooth.at(np.array([1.5]))
    assert (way, 2 * speed, 4 * acceleration) == tuple(pytest.approx(value) for value in faster)
    assert slow.jerks * 8 == pytest.approx(smooth.jerks)


def test_a_peak_is_cut_to_last_as_long_as_wanted() -> None:
    # 20 counts with A = 5: v²/5 + v t = 20.
    triangle = Ramped.over(np.array([2.0, 2.0]), np.array([0.0, 10.0, 0.0]))
    assert triangle.level(1.0) == pytest.approx(2.5 * (sqrt(17.0) - 1.0))
    assert triangle.level(0.0) == 10.0


def test_a_peak_that_lasts_is_not_cut() -> None:
    assert TRAPEZOID.level(2.0) == 10.0
    assert TRAPEZOID.level(2.1) < 10.0


def test_only_the_highest_peak_counts() -> None:
    # 0 to 6 to 2 to 10 to 0, A = 2: from 6 on the way up to 6 on the way down are 16 + 16 counts.
    peaks = Ramped.over(np.array([3.0, 2.0, 4.0, 5.0]), np.array([0.0, 6.0, 2.0, 10.0, 0.0]))
    assert peaks.level(32 / 6.0 * (1 - 1e-12)) == pytest.approx(6.0)


def test_cruises_are_the_spans_of_constant_speed() -> None:
    assert Smooth.mean(TRAPEZOID, 1.0).cruises().tolist() == [3.0, 4.0]
    assert not Smooth.mean(TRAPEZOID, 2.5).cruises().size
