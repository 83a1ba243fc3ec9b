"""The judge's own frame against places worked out by hand."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest

from tests.judge.mechanism import Frame, joints_at, margins, places, tensions

FRAME = Frame(2.35, 2.30, 0.30, 0.20, ((0.0, 2.0 * pi / 3.0), (0.575, 2.260), (0.565, 2.300)), 5.0)


def one(a: float, b: float, c: float) -> dict[str, float]:
    return {name: float(values[0]) for name, values in margins(FRAME, np.array([[a, b, c]])).items()}


def test_the_gripper_hangs_in_the_middle_between_equal_lines() -> None:
    """b = c = 1.25 over W = 2 is twice the triangle 3, 4, 5 with h = 0.75."""
    assert places(FRAME, np.array([[pi / 2.0, 1.25, 1.25]]))[0] == pytest.approx((1.30, 0.0, 1.40), abs=1e-12)
    assert tensions(FRAME, np.array([[0.0, 1.25, 1.25]]))[0] == pytest.approx(0.5 * 1.25 / 0.75)


def test_places_and_joints_are_inverse() -> None:
    rng = np.random.default_rng(1)
    d, z, a = rng.uniform(0.4, 2.2, 200), rng.uniform(0.2, 1.9, 200), rng.uniform(0.0, 2.0, 200)
    points = np.column_stack((d * np.sin(a), d * np.cos(a), z))
    assert np.abs(places(FRAME, joints_at(FRAME, points)) - points).max() < 1e-12


def test_margins_are_lengths_to_the_limits() -> None:
    found = one(0.1, 1.25, 1.25)
    assert found["boom"] == pytest.approx(0.13)
    assert found["line_b"] == pytest.approx(0.675)
    assert found["line_c"] == pytest.approx(0.685)
    assert (found["coupling"], found["inner"], found["outer"]) == pytest.approx((0.5, 1.0, 1.0))
    assert found["floor"] == pytest.approx(1.40)
    # In the middle T = √(h² + 1)/2h, which is 5 at h = 1/√99.
    assert found["tension_b"] == found["tension_c"] == pytest.approx(0.75 - 1.0 / sqrt(99.0))


def test_tension_margin_is_zero_at_the_limit_of_a_line() -> None:
    for u in (0.2, 0.7, 1.5, 1.9):
        high = depth_by_halving(u)
        joints = np.array([[0.0, sqrt(u * u + high * high), sqrt((2.0 - u) ** 2 + high * high)]])
        found = margins(FRAME, joints)
        assert min(found["tension_b"][0], found["tension_c"][0]) == pytest.approx(0.0, abs=1e-9)
        assert tensions(FRAME, joints)[0] == pytest.approx(5.0, abs=1e-6)


def depth_by_halving(u: float) -> float:
    """Return the depth where the greater tension is 5, by halving."""
    low, high = 1e-6, 1.0
    for _ in range(80):
        h = 0.5 * (low + high)
        greater = max((2.0 - u) * sqrt(h * h + u * u), u * sqrt(h * h + (2.0 - u) ** 2)) / (2.0 * h)
        low, high = (h, high) if greater > 5.0 else (low, h)
    return 0.5 * (low + high)


def test_lines_that_do_not_meet_break_the_coupling() -> None:
    assert one(1.0, 0.9, 0.9)["coupling"] == pytest.approx(-0.2)
    assert one(1.0, 2.2, 0.8)["outer"] < 0.0
    assert one(1.0, 0.8, 2.2)["inner"] < 0.0
