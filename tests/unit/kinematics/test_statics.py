"""Tensions and slack against hand-worked cases and the numbers of the mechanism's description."""

from __future__ import annotations

from math import hypot, inf, sqrt

import pytest

from maya_un.kinematics import hanging, slack, tension
from maya_un.kinematics.mechanism import shallowest

W = 2.0


def test_half_way_at_equal_depth_each_line_carries_half_the_load_over_the_sine() -> None:
    # u = 1, h = 1: both lines at 45°, so 2 T sin 45° = 1.
    assert tension(1.0, 1.0, W) == pytest.approx((1 / sqrt(2), 1 / sqrt(2)))


def test_below_one_anchor_its_line_carries_all() -> None:
    assert tension(0.0, 0.7, W) == (1.0, 0.0)
    assert tension(W, 0.7, W) == (0.0, 1.0)


def test_a_three_four_five_triangle() -> None:
    # b = 5, c = √(16 + 169) with u = 3, W = 16, h = 4: T_b = 13/16 · 5/4.
    pull_b, pull_c = tension(3.0, 4.0, 16.0)
    assert pull_b == pytest.approx(13 / 16 * 5 / 4)
    assert pull_c == pytest.approx(3 / 16 * hypot(13, 4) / 4)


def test_forces_balance() -> None:
    u, h = 0.6, 0.9
    pull_b, pull_c = tension(u, h, W)
    b, c = hypot(u, h), hypot(W - u, h)
    assert pull_b * h / b + pull_c * h / c == pytest.approx(1.0)
    assert pull_b * u / b == pytest.approx(pull_c * (W - u) / c)


def test_beyond_an_anchor_the_other_line_would_have_to_push() -> None:
    assert tension(-0.1, 1.0, W)[1] < 0.0
    assert tension(2.1, 1.0, W)[0] < 0.0


@pytest.mark.parametrize("h", [0.0, -0.5])
def test_straight_lines_cannot_carry(h: float) -> None:
    assert tension(1.0, h, W) == (inf, inf)


@pytest.mark.parametrize("u", [0.1, 0.57, 1.0, 1.43, 1.9])
@pytest.mark.parametrize("limit", [1.5, 5.0])
def test_at_the_shallowest_depth_the_more_loaded_line_is_at_the_limit(u: float, limit: float) -> None:
    assert max(tension(u, shallowest(u, W, limit), W)) == pytest.approx(limit)


def test_c_fully_out_with_b_short_is_slack_by_22_centimetres() -> None:
    assert slack(0.575, 2.30, W) == (0.0, pytest.approx(0.219, abs=5e-4))


def test_taut_lines_have_no_slack() -> None:
    assert slack(1.5, 1.5, W) == (0.0, 0.0)


def test_a_slack_line_lets_the_gripper_hang_below_the_other_anchor() -> None:
    assert hanging(0.575, 2.30, W) == (0.0, 0.575)
    assert hanging(2.26, 0.565, W) == (W, 0.565)


def test_taut_lines_meet_at_the_apex_of_the_triangle() -> None:
    assert hanging(hypot(0.6, 0.8), hypot(1.4, 0.8), W) == pytest.approx((0.6, 0.8))


def test_lines_too_short_to_meet_are_drawn_straight() -> None:
    assert hanging(0.8, 0.8, W) == (1.0, 0.0)
