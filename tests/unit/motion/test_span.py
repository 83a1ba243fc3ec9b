"""Motion of the axes between two rests, against numbers worked by hand."""

from __future__ import annotations

from dataclasses import replace
from math import cbrt, inf, sqrt

import numpy as np
import pytest

from maya_un.config import Config
from maya_un.motion import Knots, Limits
from maya_un.motion.jerk import ChordSpan, Ramped, Smooth
from maya_un.motion.speeds import Ramps

LIMITS = replace(Limits.of(Config()), jerk=(10.0, 20.0, 40.0))
SMOOTH = Smooth.mean(Ramped.over(np.array([2.0, 2.0, 2.0]), np.array([0.0, 10.0, 10.0, 0.0])), 1.0)
"""40 counts with 10 counts/s, 5 counts/s² and 5 counts/s³."""


def stretch(*steps: tuple[int, int, int], limits: Limits = LIMITS) -> ChordSpan:
    """Return the stretch over chords that go `steps` [counts]."""
    counts = np.concatenate(([[0, 0, 0]], np.cumsum(steps, axis=0)))
    sharp = np.array([True, *[False] * (len(steps) - 1), True])
    return ChordSpan.of(Knots(counts, counts.astype(np.float64), sharp, ()), limits, 0, len(steps))


def ramps(up: float, top: float) -> Ramps:
    """Return one chord from rest to `top` and back to rest, both at `up`."""
    still = np.zeros(1)
    return Ramps(still, np.array([top]), still, np.array([up]), np.array([up]))


def test_the_greatest_jerk_along_a_chord_is_that_of_the_axis_that_bears_least() -> None:
    assert stretch((0, 0, 40)).most.tolist() == [40.0]
    assert stretch((0, 24, 32)).most == pytest.approx([20.0 / 0.6])


def test_a_straight_line_has_the_jerk_and_acceleration_of_its_way() -> None:
    gentle = replace(LIMITS, acceleration=(1000, 10, 1000), deceleration=(1000, 5, 1000))
    look = stretch((0, 40, 0), limits=gentle).look(SMOOTH, np.array([8.0]), np.array([0.0, 0.0]))
    assert look.strain == pytest.approx(0.25)
    assert look.pull == pytest.approx([1.0 / 1.02])
    assert look.tops == pytest.approx([10.0])
    assert look.excess == pytest.approx([10.0 / 8.0])


def test_it_is_the_deceleration_that_counts_for_an_axis_that_goes_back() -> None:
    gentle = replace(LIMITS, acceleration=(1000, 5, 1000), deceleration=(1000, 50, 1000))
    look = stretch((0, -40, 0), limits=gentle).look(SMOOTH, np.array([80.0]), np.array([0.0, 0.0]))
    assert look.pull == pytest.approx([1.0 / 1.02])


def test_too_much_jerk_asks_for_its_cube_root() -> None:
    hard = replace(LIMITS, jerk=(inf, 5.0 / 8.0, inf))
    look = stretch((0, 40, 0), limits=hard).look(SMOOTH, np.array([80.0]), np.array([0.0, 0.0]))
    assert look.strain == pytest.approx(8.0)
    assert look.excess == pytest.approx([2.0])


def test_a_speed_at_a_knot_counts_for_both_chords() -> None:
    look = stretch((0, 20, 0), (0, 20, 0)).look(SMOOTH, np.full(2, 80.0), np.array([0.0, 5.0, 0.0]))
    assert look.excess == pytest.approx([2.0, 2.0])


def test_a_bend_that_changes_bounds_the_speed() -> None:
    # Chords of 10: straight on, then a turn, then straight on. The bend at the second knot is 0, at the third too.
    turning = stretch((0, 10, 0), (0, 10, 0), (0, 8, 6), (0, 8, 6))
    assert turning.bends[:, 2] == pytest.approx([0.0, 0.0, 0.06, 0.0, 0.0])
    # c' = 0.06/10 for axis c, −0.02/10 for axis b, on both chords beside: v³ = 40/0.006 and 20/0.002.
    assert turning.bent_slowly()[1:3] == pytest.approx([cbrt(40.0 / 0.006)] * 2)
    assert turning.bent_slowly()[0] > 1e6


def test_at_a_steady_speed_the_jerk_is_the_change_of_the_bend() -> None:
    # At 10 counts/s the two chords in the middle of 400 counts have a bend of up to 0.006, that changes by 6e-5.
    turning = stretch((0, 100, 0), (0, 100, 0), (0, 80, 60), (0, 80, 60))
    cruise = Smooth.mean(Ramped.over(np.array([2.0, 38.0, 2.0]), np.array([0.0, 10.0, 10.0, 0.0])), 1.0)
    look = turning.look(cruise, np.full(4, 1000.0), np.full(5, 1000.0))
    assert look.excess[1:3] == pytest.approx([cbrt(6e-5 * 10.0**3 / 40.0)] * 2, rel=1e-6)


def test_short_and_slow_stretches_use_less_of_their_accelerations() -> None:
    one = stretch((0, 0, 4000))
    assert one.share(ramps(up=100.0, top=1000.0)) == 1.0
    assert one.share(ramps(up=400.0, top=1000.0)) == pytest.approx(cbrt(4000 * 1600 / 2) / 400.0)
    assert one.share(ramps(up=400.0, top=10.0)) == pytest.approx(sqrt(10.0 * 40.0) / 400.0)


def test_the_window_is_as_long_as_the_jerk_asks_for() -> None:
    # 100 counts/s² in 2.5 s: 4000 counts at 1000 counts/s would take 4 s and 10 s a ramp, so the peak is lower.
    smooth = stretch((0, 0, 4000)).mean(ramps(up=100.0, top=sqrt(400_000.0)), 1.0)
    assert smooth.duration == pytest.approx(2.0 * sqrt(40.0) + 2.5)
    assert smooth.accelerations.max() == pytest.approx(100.0)


def test_peak_is_cut_only_if_the_window_is_no_wider() -> None:
    one, up = stretch((0, 0, 4000)), ramps(up=100.0, top=sqrt(400_000.0))
    assert one.level(up, 1.0) == pytest.approx((-2.5 + sqrt(2.5**2 + 4 * 4000 / 100)) / (2 / 100))
    assert one.level(up, 1.5) == inf
