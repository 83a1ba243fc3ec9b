"""The controller's rule for segments, worked by hand."""

from __future__ import annotations

from itertools import pairwise
from math import inf, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.motion import SpeedProfile


def test_a_long_segment_accelerates_cruises_and_brakes() -> None:
    # 1 s up to 1000 over 500 counts, 0.1 s down over 50, the rest at 1000.
    profile = SpeedProfile.along([(10_550.0, 1000.0, 0.0)], va=1000.0, vd=10_000.0)
    assert profile.duration == pytest.approx(1.0 + 10.0 + 0.1)
    assert profile.at(0.5) == pytest.approx((125.0, 500.0))
    assert profile.at(6.0) == pytest.approx((5500.0, 1000.0))
    assert profile.at(11.05) == pytest.approx((10_537.5, 500.0))


def test_a_short_segment_has_no_cruise() -> None:
    # Up at 1000, down at 3000 over 400 counts: 300 up to √600000, 100 down.
    profile = SpeedProfile.along([(400.0, 5000.0, 0.0)], va=1000.0, vd=3000.0)
    peak = sqrt(2 * 1000 * 300)
    assert profile.duration == pytest.approx(peak / 1000 + peak / 3000)
    assert profile.at(peak / 1000) == pytest.approx((300.0, peak))


def test_a_stair_brakes_at_its_very_end() -> None:
    profile = SpeedProfile.along([(1000.0, 1000.0, 1000.0), (500.0, 1000.0, 800.0), (100.0, 800.0, 0.0)], 1e6, 1e4)
    brake = (1000**2 - 800**2) / 2e4
    begun = profile.pieces[[piece.acceleration for piece in profile.pieces].index(-1e4)]
    assert begun.s == pytest.approx(1500 - brake)


def test_an_end_speed_that_is_out_of_reach_is_not_braked_for() -> None:
    profile = SpeedProfile.along([(8.0, 1000.0, 900.0), (1e4, 1000.0, 0.0)], va=1000.0, vd=1e4)
    assert [piece.acceleration for piece in profile.pieces] == [1000.0, 1000.0, 0.0, -1e4]


def test_a_segment_entered_too_fast_brakes_at_once() -> None:
    profile = SpeedProfile.along([(1000.0, 1000.0, 1000.0), (1000.0, 500.0, 0.0)], va=1e4, vd=1e4)
    entered = next(piece for piece in profile.pieces if piece.s == pytest.approx(1000.0))
    assert (entered.v, entered.acceleration) == pytest.approx((1000.0, -1e4))


def test_too_short_to_brake_brakes_all_the_way() -> None:
    profile = SpeedProfile.along([(1000.0, 1000.0, 1000.0), (10.0, 1000.0, 0.0)], va=1e4, vd=1e4)
    assert profile.pieces[-1].acceleration == -1e4
    assert profile.length == 1010.0


def test_before_and_after_it_rests() -> None:
    profile = SpeedProfile.along([(100.0, 1000.0, 0.0)], va=1000.0, vd=1000.0)
    assert profile.at(-1.0) == (0.0, 0.0)
    assert profile.at(profile.duration + 1.0) == (100.0, 0.0)


def test_no_segments_take_no_time() -> None:
    assert SpeedProfile.along([], 1.0, 1.0).at(5.0) == (0.0, 0.0)


LONG = SpeedProfile.along([(10_550.0, 1000.0, 0.0)], va=1000.0, vd=10_000.0)
"""As above: 1 s up, 10 s at 1000, 0.1 s down."""


def test_half_the_speed_is_fallen_to_at_vd_and_kept() -> None:
    # At 6 s 5500 counts are gone. 0.05 s and 37.5 counts down to 500, which brakes over 12.5 counts in 0.05 s.
    slowed = LONG.changed(6.0, 0.5)
    assert slowed.at(5.0) == LONG.at(5.0)
    assert slowed.at(6.05) == pytest.approx((5537.5, 500.0))
    assert slowed.duration == pytest.approx(6.05 + (10_550.0 - 5537.5 - 12.5) / 500.0 + 0.05)


def test_full_speed_again_is_risen_to_at_va() -> None:
    again = LONG.changed(6.0, 0.5).changed(7.0, 1.0)
    assert again.at(7.5)[1] == pytest.approx(1000.0)
    assert again.at(7.5)[0] == pytest.approx(5537.5 + 0.95 * 500.0 + 0.5 * 750.0)


def test_pause_rests_at_the_deceleration_of_vd() -> None:
    paused = LONG.changed(6.0, 0.0)
    assert paused.duration == inf
    assert paused.at(6.1) == pytest.approx((5550.0, 0.0))
    assert paused.at(1e6) == pytest.approx((5550.0, 0.0))
    # From 5550 again 500 counts up in 1 s, 50 down in 0.1 s, the other 4450 at 1000.
    assert paused.changed(100.0, 1.0).duration == pytest.approx(100.0 + 1.0 + 4.45 + 0.1)


def test_pause_before_the_first_count_rests_at_the_start() -> None:
    paused = LONG.changed(0.0, 0.0)
    assert (paused.duration, paused.at(5.0)) == (inf, (0.0, 0.0))
    assert paused.changed(5.0, 1.0).duration == pytest.approx(5.0 + LONG.duration)


def test_an_end_speed_above_the_slower_target_is_not_risen_to() -> None:
    profile = SpeedProfile.along([(1000.0, 1000.0, 900.0), (1000.0, 1000.0, 0.0)], va=1e5, vd=1e5, ratio=0.5)
    assert max(piece.v for piece in profile.pieces) == pytest.approx(500.0)
    assert profile.when(1000.0) == pytest.approx(0.0025 + 2.0 - 0.0)


def test_after_the_end_nothing_changes() -> None:
    assert LONG.changed(LONG.duration, 0.0) is LONG
    assert LONG.changed(LONG.duration + 1.0, 0.5) is LONG


def test_a_way_is_reached_in_every_part() -> None:
    assert [LONG.when(way) for way in (0.0, 125.0, 5500.0, 10_537.5, 10_550.0)] == pytest.approx(
        [0.0, 0.5, 6.0, 11.05, 11.1]
    )


def test_a_way_behind_a_pause_is_never_reached_and_one_before_was() -> None:
    paused = LONG.changed(6.0, 0.0)
    assert paused.when(5551.0) == inf
    assert paused.when(125.0) == pytest.approx(0.5)


def test_late_target_does_not_delay_later_segments() -> None:
    # 1000 cannot be braked to 0 within 5 counts at 10 000: the speed before is held to √(2·10⁴·5).
    profile = SpeedProfile.along([(1000.0, 1000.0, 1000.0), (5.0, 1000.0, 0.0)], va=1e4, vd=1e4)
    assert profile.at(profile.when(1000.0))[1] == pytest.approx(sqrt(1e5))


segments = st.tuples(st.floats(1e-3, 1e5), st.floats(2.0, 5e4), st.floats(0.0, 1.0)).map(
    lambda drawn: (drawn[0], drawn[1], drawn[1] * drawn[2])
)
"""A segment of any length and target speed, left with a share of it."""


@given(st.lists(segments, max_size=30), st.floats(100.0, 1e4), st.floats(1.0, 20.0), st.sampled_from((1.0, 0.5, 0.01)))
def test_all_segments_at_once_equal_one_by_one(
    asked: list[tuple[float, float, float]], va: float, harder: float, ratio: float
) -> None:
    at_once = SpeedProfile.along(asked, va, va * harder, ratio)
    one_by_one = SpeedProfile.along(asked, va, va * harder).changed(0.0, ratio)
    assert at_once.duration == pytest.approx(one_by_one.duration, rel=1e-9)
    for share in (0.1, 0.5, 0.9, 0.999):
        t = share * at_once.duration
        assert at_once.at(t) == pytest.approx(one_by_one.at(t), rel=1e-6, abs=1e-3)
        way = share * at_once.length
        assert one_by_one.at(at_once.when(way))[0] == pytest.approx(way, rel=1e-9, abs=1e-5)


def slowing(steps: int) -> list[tuple[float, float, float]]:
    """Return a slow-down in `count` steps: every one is entered at the mean of the speeds before it."""
    speeds = [1000.0 * (steps - step) / steps for step in range(steps + 1)]
    return [(500.0, 0.5 * (before + after), after) for before, after in pairwise(speeds)]


def test_slow_down_in_steps_is_computed_at_once() -> None:
    # The first stair begins at rest; all others brake by 20 at once, go on evenly, and brake by 20 again.
    profile = SpeedProfile.along(slowing(25), va=1e6, vd=1e6)
    assert [piece.acceleration for piece in profile.pieces] == [1e6, 0.0, -1e6] + [-1e6, 0.0, -1e6] * 24
    assert profile.course == pytest.approx(profile.changed(0.0, 1.0).course)


def test_unreachable_end_speed_limits_the_next_ones_too() -> None:
    # From rest at 1000 counts/s² 2 and 6 and 10 counts lead to √4000 and √16000 and √36000.
    asked = [(2.0, 1000.0, 900.0), (6.0, 1000.0, 900.0), (10.0, 1000.0, 900.0), (1e4, 1000.0, 0.0)]
    profile = SpeedProfile.along(asked, va=1000.0, vd=1000.0)
    reached = [profile.at(profile.when(way))[1] ** 2 for way in (2.0, 8.0, 18.0)]
    assert reached == pytest.approx([4000.0, 16_000.0, 36_000.0])
