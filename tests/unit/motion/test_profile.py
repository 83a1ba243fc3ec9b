"""The controller's rule for segments, worked by hand."""

from __future__ import annotations

from math import sqrt

import pytest

from maya_un.motion import Profile


def test_a_long_segment_accelerates_cruises_and_brakes() -> None:
    # 1 s up to 1000 over 500 counts, 0.1 s down over 50, the rest at 1000.
    profile = Profile.along([(10_550.0, 1000.0, 0.0)], va=1000.0, vd=10_000.0)
    assert profile.duration == pytest.approx(1.0 + 10.0 + 0.1)
    assert profile.at(0.5) == pytest.approx((125.0, 500.0))
    assert profile.at(6.0) == pytest.approx((5500.0, 1000.0))
    assert profile.at(11.05) == pytest.approx((10_537.5, 500.0))


def test_a_short_segment_has_no_cruise() -> None:
    # Up at 1000, down at 3000 over 400 counts: 300 up to √600000, 100 down.
    profile = Profile.along([(400.0, 5000.0, 0.0)], va=1000.0, vd=3000.0)
    peak = sqrt(2 * 1000 * 300)
    assert profile.duration == pytest.approx(peak / 1000 + peak / 3000)
    assert profile.at(peak / 1000) == pytest.approx((300.0, peak))


def test_a_stair_brakes_at_its_very_end() -> None:
    profile = Profile.along([(1000.0, 1000.0, 1000.0), (500.0, 1000.0, 800.0), (100.0, 800.0, 0.0)], 1e6, 1e4)
    brake = (1000**2 - 800**2) / 2e4
    begun = profile.pieces[[piece.acceleration for piece in profile.pieces].index(-1e4)]
    assert begun.s == pytest.approx(1500 - brake)


def test_an_end_speed_that_is_out_of_reach_is_not_braked_for() -> None:
    profile = Profile.along([(8.0, 1000.0, 900.0), (1e4, 1000.0, 0.0)], va=1000.0, vd=1e4)
    assert [piece.acceleration for piece in profile.pieces] == [1000.0, 1000.0, 0.0, -1e4]


def test_a_segment_entered_too_fast_brakes_at_once() -> None:
    profile = Profile.along([(1000.0, 1000.0, 1000.0), (1000.0, 500.0, 0.0)], va=1e4, vd=1e4)
    entered = next(piece for piece in profile.pieces if piece.s == pytest.approx(1000.0))
    assert (entered.v, entered.acceleration) == pytest.approx((1000.0, -1e4))


def test_too_short_to_brake_brakes_all_the_way() -> None:
    profile = Profile.along([(1000.0, 1000.0, 1000.0), (10.0, 1000.0, 0.0)], va=1e4, vd=1e4)
    assert profile.pieces[-1].acceleration == -1e4
    assert profile.length == 1010.0


def test_before_and_after_it_rests() -> None:
    profile = Profile.along([(100.0, 1000.0, 0.0)], va=1000.0, vd=1000.0)
    assert profile.at(-1.0) == (0.0, 0.0)
    assert profile.at(profile.duration + 1.0) == (100.0, 0.0)


def test_no_segments_take_no_time() -> None:
    assert Profile.along([], 1.0, 1.0).at(5.0) == (0.0, 0.0)
