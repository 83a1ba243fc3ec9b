from __future__ import annotations

from math import inf, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.twin.motion.path import PathSegment, PathSpan, SequencePath, VectorRates, brake, plan

RATES = VectorRates(5120.0, 10240.0)
START = PathSpan(0.0, 0, 0.0, 0.0, 0.0)


def segments(*lengths: int, ends: dict[int, float] | None = None) -> list[PathSegment]:
    return [PathSegment.of((length, 0), None, (ends or {}).get(i)) for i, length in enumerate(lengths)]


def exit_speeds(path: SequencePath, parts: list[PathSegment]) -> list[float]:
    """Return the speed at the end of every segment."""
    speeds = [0.0] * len(parts)
    for stretch in path.stretches:
        later = [other.t for other in path.stretches if other.t > stretch.t]
        end = min([*later, path.end])
        speeds[stretch.segment] = stretch.v + stretch.a * (end - stretch.t)
    return speeds


def test_one_segment_is_a_trapezoid() -> None:
    path = plan(segments(100_000), [10240.0], START, RATES, ended=True)
    # Ramps of 2 s and 1 s cover 10 240 and 5 120 counts.
    assert path.end == pytest.approx(3.0 + (100_000 - 15_360) / 10240)
    assert [stretch.a for stretch in path.stretches] == [5120.0, 0.0, -10240.0]


def test_the_rest_after_le_is_prepared_over_as_many_segments_as_it_needs() -> None:
    parts = segments(*[1000] * 20)
    path = plan(parts, [10240.0] * 20, START, RATES, ended=True)
    speeds = exit_speeds(path, parts)
    for index, speed in enumerate(speeds):
        assert speed <= sqrt(2 * 10240 * 1000 * (19 - index)) + 1e-2
    assert speeds[-1] == pytest.approx(0.0, abs=1e-2)


def test_without_le_the_end_is_reached_at_speed() -> None:
    parts = segments(50_000)
    assert exit_speeds(plan(parts, [10240.0], START, RATES, ended=False), parts) == [pytest.approx(10240.0)]


def test_an_end_speed_is_met_as_late_as_possible() -> None:
    parts = segments(50_000, 50_000, ends={0: 4096.0})
    path = plan(parts, [10240.0, 10240.0], START, RATES, ended=True)
    assert exit_speeds(path, parts)[0] == pytest.approx(4096.0)
    down = next(stretch for stretch in path.stretches if stretch.a < 0.0)
    assert down.s == pytest.approx(50_000 - (10240**2 - 4096**2) / (2 * 10240))


def test_a_lower_target_is_met_behind_the_boundary() -> None:
    parts = segments(50_000, 50_000)
    path = plan(parts, [10240.0, 2048.0], START, RATES, ended=True)
    assert exit_speeds(path, parts)[0] == pytest.approx(10240.0)


def test_an_end_speed_out_of_reach_is_not_reached() -> None:
    parts = segments(1000, 50_000, ends={0: 10240.0})
    path = plan(parts, [10240.0, 10240.0], START, RATES, ended=True)
    assert exit_speeds(path, parts)[0] == pytest.approx(sqrt(2 * 5120 * 1000))


def test_a_target_of_zero_rests_on_the_way_for_ever() -> None:
    path = plan(segments(50_000), [0.0], PathSpan(1.0, 0, 100.0, 2048.0, 0.0), RATES, ended=True)
    assert path.end == inf
    assert path.stretches[-1].v == 0.0


def test_braking_ends_abruptly_on_a_short_path() -> None:
    path = brake(segments(1000), PathSpan(0.0, 0, 900.0, 10240.0, 0.0), 1024.0)
    assert path.end == pytest.approx(100 / 10240, rel=0.01)


SPEEDS = st.integers(1, 20_000).map(lambda n: 2.0 * n)


@given(
    st.lists(st.tuples(st.integers(1, 60_000), SPEEDS, st.none() | SPEEDS), min_size=1, max_size=12),
    st.integers(1, 50),
    st.integers(1, 50),
    st.booleans(),
)
def test_the_plan_is_the_one_that_small_steps_find(
    parts: list[tuple[int, float, float | None]], up: int, down: int, ended: bool
) -> None:
    rates = VectorRates(1024.0 * up, 1024.0 * down)
    sequence = [PathSegment.of((length,), None, end) for length, _, end in parts]
    targets = [speed for _, speed, _ in parts]
    path = plan(sequence, targets, START, rates, ended)
    assert path.end == pytest.approx(_stepped_duration(sequence, targets, rates, ended), rel=0.01, abs=0.05)
    assert _consistent(path, sequence, rates)


def _consistent(path: SequencePath, sequence: list[PathSegment], rates: VectorRates) -> bool:
    """Tell whether stretches join in way and speed, at VA or VD, and cover the whole sequence."""
    offsets = [sum(segment.length for segment in sequence[:i]) for i in range(len(sequence) + 1)]
    way, speed = 0.0, 0.0
    ends = [stretch.t for stretch in path.stretches[1:]] + [path.end]
    for stretch, end in zip(path.stretches, ends, strict=True):
        assert stretch.a in (0.0, rates.acceleration, -rates.deceleration)
        assert offsets[stretch.segment] + stretch.s == pytest.approx(way, rel=1e-6, abs=1e-3)
        assert stretch.v == pytest.approx(speed, rel=1e-6, abs=1e-3)
        span = end - stretch.t
        way += stretch.v * span + 0.5 * stretch.a * span * span
        speed = stretch.v + stretch.a * span
    return way == pytest.approx(offsets[-1], rel=1e-6, abs=1e-3)


def _stepped_duration(sequence: list[PathSegment], targets: list[float], rates: VectorRates, ended: bool) -> float:
    """Walk the path in small steps of way, at the largest speed that every later obligation allows."""
    pieces = 2000
    steps = [(i, segment.length / pieces) for i, segment in enumerate(sequence) for _ in range(pieces)]
    allowed = [0.0 if ended else inf] * (len(steps) + 1)
    for k in range(len(steps) - 1, -1, -1):
        index, size = steps[k]
        after = allowed[k + 1]
        end = sequence[index].end
        if (k + 1 == len(steps) or steps[k + 1][0] != index) and end is not None:
            after = min(after, end * end)
        allowed[k + 1] = after
        allowed[k] = after + 2 * rates.deceleration * size
    square, duration = 0.0, 0.0
    for k, (index, size) in enumerate(steps):
        goal = targets[index] ** 2
        slower = max(goal, square - 2 * rates.deceleration * size)
        faster = min(goal, square + 2 * rates.acceleration * size)
        after = min(slower if square > goal else faster, allowed[k + 1])
        ramp = size
        if after == goal > 0.0:  # the speed is reached within the step: at 2 counts/s the rest of it takes seconds
            ramp = min(size, abs(square - goal) / (2 * (rates.deceleration if square > goal else rates.acceleration)))
            duration += (size - ramp) / sqrt(goal)
        duration += 2 * ramp / (sqrt(square) + sqrt(after)) if square + after > 0 else 0.0
        square = after
    return duration


def test_a_stop_at_the_very_end_rests_there() -> None:
    segment = PathSegment(length=400.0, deltas=(400,), speed=None, end=None)
    stopped = brake([segment], PathSpan(3.0, 0, 400.0, 1e-7, -1024.0), 1024.0)
    assert stopped.end == 3.0
    assert stopped.stretches[-1].s == 400.0
    assert stopped.stretches[-1].v == 0.0
