"""A timeline is a closed form: plans, instants, crossings."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.twin.timeline import Timeline, TimelinePiece

MOVE = (TimelinePiece(1.0, 0.0, 0.0, 10.0), TimelinePiece(2.0, 5.0, 10.0, -10.0), TimelinePiece(3.0, 10.0, 0.0, 0.0))


def moved() -> Timeline:
    timeline = Timeline()
    timeline.plan(1.0, MOVE)
    return timeline


@st.composite
def timelines(draw: st.DrawFn, most: int = 30) -> Timeline:
    """A continuous motion of random accelerations, at rest in the end."""
    t, p, v = 0.0, draw(st.floats(-100.0, 100.0)), 0.0
    pieces: list[TimelinePiece] = []
    for _ in range(draw(st.integers(0, most))):
        a, length = draw(st.floats(-50.0, 50.0)), draw(st.floats(0.01, 2.0))
        pieces.append(TimelinePiece(t, p, v, a))
        t, (p, v) = t + length, pieces[-1].at(t + length)
    timeline = Timeline(p)
    timeline.plan(0.0, [*pieces, TimelinePiece(t, p, 0.0, 0.0)])
    return timeline


def test_rests_before_its_first_piece_and_after_its_last() -> None:
    timeline = moved()
    assert timeline.at(-5.0) == (0.0, 0.0)
    assert timeline.at(0.5) == (0.0, 0.0)
    assert timeline.at(2.5) == (8.75, 5.0)
    assert timeline.at(100.0) == (10.0, 0.0)
    assert timeline.end == 3.0
    assert not timeline.jogs


def test_plan_replaces_later_parts_and_keeps_earlier_ones() -> None:
    timeline = moved()
    before = timeline.version
    timeline.plan(2.0, (TimelinePiece(2.0, 5.0, -1.0, 0.0),))
    assert timeline.at(1.5) == (1.25, 5.0)
    assert timeline.at(4.0) == (3.0, -1.0)
    assert timeline.jogs
    assert timeline.version > before


def test_plan_begins_at_its_start_time() -> None:
    with pytest.raises(ValueError, match="begin at 2"):
        moved().plan(2.0, MOVE)
    with pytest.raises(ValueError, match="begin at 2"):
        moved().plan(2.0, ())


def test_hold_stops_at_once() -> None:
    timeline = moved()
    timeline.hold(2.5)
    assert timeline.at(2.5) == timeline.at(9.0) == (8.75, 0.0)


def test_crossing_finds_the_root_in_the_given_direction_only() -> None:
    timeline = moved()
    assert timeline.crossing(1.25, 0.0, 9.0, rising=True) == pytest.approx(1.5)
    assert timeline.crossing(8.75, 0.0, 9.0, rising=True) == pytest.approx(2.5)
    assert timeline.crossing(8.75, 0.0, 9.0, rising=False) is None
    assert timeline.crossing(8.75, 0.0, 2.4, rising=True) is None
    assert timeline.crossing(8.75, 2.6, 9.0, rising=True) is None


def test_coming_to_rest_at_a_level_reaches_it() -> None:
    assert moved().crossing(10.0, 0.0, 9.0, rising=True) == pytest.approx(3.0)


def test_level_at_the_start_must_be_left_first() -> None:
    timeline = moved()
    assert timeline.crossing(0.0, 0.0, 9.0, rising=True) is None
    timeline.plan(4.0, (TimelinePiece(4.0, 10.0, -10.0, 10.0), TimelinePiece(7.0, 25.0, 0.0, 0.0)))
    assert timeline.crossing(10.0, 4.0, 9.0, rising=True) == pytest.approx(6.0)


def test_a_jump_between_pieces_counts_as_a_crossing() -> None:
    timeline = moved()
    timeline.plan(4.0, (TimelinePiece(4.0, 10.5, 0.0, 0.0),))
    assert timeline.crossing(10.2, 3.5, 9.0, rising=True) == 4.0


def test_boundaries_are_those_after_the_first_instant_up_to_the_last() -> None:
    assert moved().boundaries(1.0, 3.0) == [2.0, 3.0]


def test_forgetting_keeps_needed_parts() -> None:
    timeline = moved()
    timeline.sample(np.array([0.0]))
    timeline.forget(2.5)
    assert timeline.pieces == MOVE[1:]
    assert timeline.at(2.5) == (8.75, 5.0)
    assert timeline.sample(np.array([2.5, 4.0])).tolist() == [8.75, 10.0]


@given(timelines(), st.lists(st.floats(-1.0, 70.0), min_size=1, max_size=20))
def test_sampling_is_asking_one_by_one(timeline: Timeline, times: list[float]) -> None:
    expected = [timeline.at(t) for t in times]
    position, velocity, _ = timeline.motion(np.array(times))
    np.testing.assert_allclose(position, [p for p, _ in expected], rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(velocity, [v for _, v in expected], rtol=1e-12, atol=1e-9)


@given(timelines(), st.floats(0.0, 10.0), st.floats(0.0, 60.0))
def test_bounds_hold(timeline: Timeline, t0: float, length: float) -> None:
    low, high = timeline.bounds(t0, t0 + length)
    positions = timeline.sample(np.linspace(t0, t0 + length, 200))
    assert low - 1e-6 <= positions.min()
    assert positions.max() <= high + 1e-6


@given(timelines(), st.floats(-200.0, 200.0), st.booleans())
def test_crossing_agrees_with_looking_closely(timeline: Timeline, level: float, rising: bool) -> None:
    t1 = timeline.end + 1.0
    met = timeline.crossing(level, 0.0, t1, rising)
    ts = np.linspace(0.0, t1, 2000)
    side = timeline.sample(ts) - level if rising else level - timeline.sample(ts)
    seen = [t for t, (a, b) in zip(ts[1:], pairwise(side), strict=True) if a < -1e-6 and b > 1e-6]
    if seen:
        assert met is not None
        assert met <= seen[0]
    if met is not None:
        position, velocity = timeline.at(met)
        assert position == pytest.approx(level, abs=1e-6 * max(1.0, abs(level)))
        assert velocity * (1 if rising else -1) >= -1e-3
