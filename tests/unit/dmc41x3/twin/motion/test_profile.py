from __future__ import annotations

from itertools import pairwise
from math import inf, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.twin.timeline import AxisProfile, Timeline, TimelinePiece, jog_profile, move_profile, stop_profile

COUNTS = st.integers(-2_000_000, 2_000_000)
SPEEDS = st.integers(1, 100_000).map(lambda n: 2.0 * n)
RATES = st.integers(1, 200).map(lambda n: 1024.0 * n)


def test_stopping_a_line_takes_as_long_and_as_far_as_the_hand_calculation() -> None:
    profile = stop_profile(0.0, 0.0, 45000.0, 5120.0)
    assert profile.end == pytest.approx(45000 / 5120)
    assert profile.end == pytest.approx(8.789, abs=1e-3)
    assert profile.pieces[-1].p == round(45000**2 / (2 * 5120))  # 197 754 counts: 198 mm


def test_a_long_move_is_a_trapezoid() -> None:
    profile = move_profile(0.0, 0.0, 0.0, 1_000_000, 45000.0, 5120.0, 5120.0)
    assert [piece.v for piece in profile.pieces] == [0.0, 45000.0, 45000.0, 0.0]
    assert profile.end == pytest.approx(1_000_000 / 45000 + 45000 / 5120)
    assert profile.braking == pytest.approx(1_000_000 / 45000)


def test_a_short_move_is_a_triangle() -> None:
    profile = move_profile(0.0, 0.0, 0.0, -5120, 45000.0, 5120.0, 5120.0)
    assert profile.end == pytest.approx(2.0)
    assert profile.peak == pytest.approx(5120.0)
    assert profile.pieces[-1] == TimelinePiece(profile.end, -5120, 0.0, 0.0)


def test_a_move_of_no_counts_rests() -> None:
    assert move_profile(3.0, 7.0, 0.0, 7, 1000.0, 1024.0, 1024.0).pieces == [TimelinePiece(3.0, 7, 0.0, 0.0)]


def test_speed_zero_never_arrives() -> None:
    assert move_profile(0.0, 0.0, 0.0, 100, 0.0, 1024.0, 1024.0).end == inf


def test_a_jog_that_reverses_brakes_first() -> None:
    profile = jog_profile(0.0, 0.0, 1000.0, -2000.0, 4096.0, 2048.0)
    assert [piece.a for piece in profile.pieces] == [-2048.0, -4096.0, 0.0]
    assert profile.pieces[-1].v == -2000.0


def test_a_target_behind_is_reached_by_coming_back() -> None:
    profile = move_profile(0.0, 0.0, 4096.0, 100, 4096.0, 4096.0, 4096.0)
    assert profile.pieces[-1].p == 100
    assert max(piece.p for piece in profile.pieces) == pytest.approx(2048.0)


@given(COUNTS, COUNTS, SPEEDS, RATES, RATES)
def test_moves_end_exactly_and_keep_their_limits(start: int, target: int, speed: float, up: float, down: float) -> None:
    profile = move_profile(0.0, start, 0.0, target, speed, up, down)
    assert profile.pieces[-1].p == target
    assert profile.peak <= speed * (1 + 1e-12)
    assert _continuous(profile)
    assert all(abs(piece.a) <= max(up, down) for piece in profile.pieces)
    assert profile.end == pytest.approx(_duration(abs(target - start), speed, up, down), rel=1e-9, abs=1e-9)


@given(COUNTS, st.floats(-50_000, 50_000), COUNTS, SPEEDS, RATES, RATES)
def test_moves_from_any_state_end_exactly(p: int, v: float, target: int, speed: float, up: float, down: float) -> None:
    profile = move_profile(1.0, p, v, target, speed, up, down)
    assert profile.pieces[0][:3] == (1.0, p, pytest.approx(v)) or profile.pieces[0].t == 1.0
    assert profile.pieces[-1].p == target
    assert _continuous(profile)


@given(COUNTS, st.floats(-50_000, 50_000), st.floats(-50_000, 50_000), RATES, RATES)
def test_jogs_arrive_at_their_speed(p: int, v: float, wanted: float, up: float, down: float) -> None:
    profile = jog_profile(0.0, p, v, wanted, up, down)
    assert profile.pieces[-1].v == wanted
    assert profile.end == inf
    assert _continuous(profile)


def _duration(distance: float, speed: float, up: float, down: float) -> float:
    """Return the textbook's duration of a trapezoid from rest to rest."""
    ramps = speed * speed / (2 * up) + speed * speed / (2 * down)
    if distance >= ramps:
        return (distance - ramps) / speed + speed / up + speed / down
    peak = sqrt(2 * distance * up * down / (up + down))
    return peak / up + peak / down


def _continuous(profile: AxisProfile) -> bool:
    """Tell whether position and velocity have no steps, half a count at the end apart."""
    timeline = Timeline()
    timeline.plan(profile.pieces[0].t, profile.pieces)
    for before, after in pairwise(profile.pieces):
        p, v = before.at(after.t)
        if abs(p - after.p) > 0.5 + 1e-6 * (1 + abs(p)) or abs(v - after.v) > 1e-3 * (1 + abs(before.v)):
            return False
    return True
