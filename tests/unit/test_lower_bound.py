"""The least time along a path: by hand where a formula has it, by another programme's answer where none has."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from tests.judge.mechanism import Floats, Frame
from tests.judge.paths import Cut, Way
from tests.lower_bound import Curve, Rates, least_time, least_time_of

FRAME = Frame(2.35, 2.30, 0.30, 0.20, ((0.0, 2.0), (0.575, 2.260), (0.565, 2.300)), 5.0)
RATES = Rates((0.047, 0.045, 0.045), (0.0482, 0.00512, 0.00512), (0.0482, 0.00512, 0.00512))


def straight(b: float) -> Curve:
    def curve(share: Floats) -> Floats:
        return np.column_stack((0.0 * share, 1.0 + b * share, 1.5 + 0.5 * b * share))

    return curve


def test_a_long_straight_way_is_a_trapezoid() -> None:
    """0.5 m of line b at 45 mm/s, ramps of 45/5.12 s: 0.5/0.045 + 0.045/0.00512."""
    assert least_time(straight(0.5), [0.0, 1.0], RATES) == pytest.approx(19.90017, abs=1e-4)


def test_a_short_straight_way_is_a_triangle() -> None:
    assert least_time(straight(-0.1), [0.0, 1.0], RATES) == pytest.approx(2.0 * sqrt(0.1 / 0.00512), rel=1e-4)


def test_slowing_down_may_be_faster_than_speeding_up() -> None:
    """From rest at 0.005 and back to it at 0.020 m/s²: the peak is √(2·0.1·0.004), reached after 0.08 m."""
    rates = Rates((1.0, 1.0, 1.0), (1.0, 0.005, 1.0), (1.0, 0.020, 1.0))
    peak = sqrt(2.0 * 0.1 * 0.004)
    for way in (0.1, -0.1):
        assert least_time(straight(way), [0.0, 1.0], rates) == pytest.approx(peak / 0.005 + peak / 0.020, rel=1e-4)


def test_straight_path_is_as_fast_for_any_parameter() -> None:
    def bent(share: Floats) -> Floats:
        return straight(0.5)(0.4 * share + 0.6 * share * share)

    assert least_time(bent, [0.0, 1.0], RATES) == pytest.approx(19.90017, rel=2e-4)


@pytest.mark.parametrize(
    ("way", "expected"),
    [
        (Way("cartesian", ((0.0, 1.0, 0.6), (1.2, 0.8, 1.0))), 27.91649),
        (Way("cartesian", ((0.6, 1.2, 0.5), (1.3, 0.3, 0.5))), 21.52052),
        (Way("cylindrical", ((0.2, 0.8, 0.5), (1.5, 1.6, 0.9))), 33.24327),
        (Way("cartesian", ((0.5, 1.0, 0.4), (0.5, 1.0, 0.5))), 8.39086),
        (Way("cartesian", ((0.05, 0.6, 0.9), (0.6, 0.1, 0.9))), 31.31404),
    ],
)
def test_curved_paths_take_as_long_as_with_toppra(way: Way, expected: float) -> None:
    """Expected: toppra 0.6.3 on splines through 4 001 points (Pham and Pham, IEEE Trans. Robotics 34, 2018)."""
    assert least_time_of(FRAME, way, RATES) == pytest.approx(expected, rel=3e-4)


def test_a_sharp_corner_costs_a_stop_and_a_blend_less() -> None:
    corner = (0.5, 1.3, 1.5)
    legs = [((0.5, 1.0, 1.5), corner), (corner, (0.5, 1.3, 1.8))]
    stops = sum(least_time_of(FRAME, Way("joint", leg), RATES) for leg in legs)
    whole = ((0.5, 1.0, 1.5), corner, (0.5, 1.3, 1.8))
    assert stops == pytest.approx(4.0 * sqrt(0.3 / 0.00512), rel=1e-4)
    assert least_time_of(FRAME, Way("joint", whole), RATES) == pytest.approx(stops)
    blended = least_time_of(FRAME, Way("joint", whole, (Cut(0.1, 0.1),)), RATES)
    assert 2.0 * sqrt(0.3 / 0.00512) < blended < stops - 4.0
