"""A plane by itself: plans that grow segment by segment, and what it tells of the way ahead."""

from __future__ import annotations

from math import inf

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from dmc41x3.twin import registers
from dmc41x3.twin.motion.path import PathSegment
from dmc41x3.twin.motion.plane import LINEAR, VECTOR, Plane
from dmc41x3.twin.timeline import Timeline


def plane(*lengths: int, ended: bool = True, **rates: float) -> Plane:
    """Return a plane of one axis, with straight segments in its buffer."""
    made = Plane("S", {**registers.defaults(registers.PLANE), "VS": 10_240.0, "VA": 10_240.0, "VD": 20_480.0, **rates})
    made.select(LINEAR, (0,), (0,))
    for length in lengths:
        made.append(PathSegment.of((length,)), 0.0)
    if ended:
        made.close()
    return made


def follow(made: Plane, timeline: Timeline, now: float, *, whole: bool = False) -> None:
    """Do what the motion core does with a plane that has changed."""
    if whole:
        made.rates_changed()
    start = made.replan(now)
    if start < inf:
        timeline.plan(start, made.pieces(0)[0])


SEGMENTS = st.lists(
    st.tuples(
        st.integers(1, 20_000),
        st.none() | st.integers(1, 10_000).map(lambda n: 2.0 * n),
        st.none() | st.integers(0, 10_000).map(lambda n: 2.0 * n),
        st.floats(0.0, 0.4),
    ),
    min_size=1,
    max_size=20,
)


@given(SEGMENTS, st.integers(1, 40), st.integers(1, 40), st.lists(st.floats(0.0, 1.0), min_size=1, max_size=10))
@example([(2, None, 0.0, 0.3804305972961994), (1, 9370.0, 60.0, 0.37252898291305014)], 1, 30, [0.0]).via(
    "a rest that rounding alone makes a crawl"
)
def test_extended_plan_equals_a_new_plan(
    segments: list[tuple[int, float | None, float | None, float]], up: int, down: int, shares: list[float]
) -> None:
    made = [plane(5000, ended=False, VA=1024.0 * up, VD=1024.0 * down) for _ in range(2)]
    timelines = [Timeline(), Timeline()]
    for one, timeline in zip(made, timelines, strict=True):
        one.begin(0.0, [0], [0])
        timeline.plan(0.0, one.pieces(0)[0])
    now = 0.0
    for length, speed, end, wait in segments:
        if now + wait >= min(one.end for one in made):
            break  # the sequence would be over
        now += wait
        for whole, one in enumerate(made):
            one.append(PathSegment.of((length,), speed, end), now)
            follow(one, timelines[whole], now, whole=bool(whole))
    for whole, one in enumerate(made):
        one.close()
        follow(one, timelines[whole], now, whole=bool(whole))
    assert made[0].end == pytest.approx(made[1].end, rel=1e-9, abs=1e-9)
    for share in shares:
        t = share * made[0].end
        assert timelines[0].at(t)[0] == pytest.approx(timelines[1].at(t)[0], rel=1e-9, abs=1e-3)
    assert timelines[0].at(1e9) == timelines[1].at(1e9) == (made[0].total, 0.0)


def test_a_segment_appended_far_ahead_changes_nothing_before_it() -> None:
    made = plane(*[1000] * 300, ended=False)
    made.begin(0.0, [0], [0])
    for step in range(200):
        end = made.end
        made.append(PathSegment.of((1000,)), step * 0.01)
        assert made.replan(step * 0.01) == end
        assert len(made.pieces(0)[0]) == 2


def test_an_end_speed_is_prepared_as_far_back_as_the_last_one() -> None:
    made = plane(*[1000] * 100, ended=False)
    made.append(PathSegment.of((1000,), None, 2000.0), 0.0)
    made.begin(0.0, [0], [0])
    end = made.end
    for _ in range(10):
        made.append(PathSegment.of((1000,)), 0.1)
    made.replan(0.1)
    made.append(PathSegment.of((1000,), None, 1000.0), 0.1)
    assert made.replan(0.1) >= end


def test_when_a_distance_is_reached() -> None:
    made = plane(2000, 30_000)
    made.begin(1.0, [0], [0])
    # Half a second for the first 1280 counts of a second's acceleration over 5120.
    assert made.reaches(1280.0, 1.0) == pytest.approx(1.5)
    assert made.reaches(5120.0, 1.2) == pytest.approx(2.0)
    assert made.reaches(15_360.0, 1.0) == pytest.approx(3.0)
    assert made.reaches(32_000.0, 1.0) == pytest.approx(made.end)
    assert made.reaches(99_000.0, 1.0) == made.end
    assert made.reaches(1280.0, 2.0) == 2.0


def test_when_the_acceleration_ends() -> None:
    made = plane(2000, 30_000)
    made.begin(1.0, [0], [0])
    assert made.steady(1.0) == pytest.approx(2.0)
    assert made.steady(1.7) == pytest.approx(2.0)
    assert made.steady(2.5) == 2.5
    assert made.steady(made.end - 0.1) == made.end - 0.1


def test_a_sequence_that_never_ends_is_never_there() -> None:
    made = plane(30_000, VR=0.0)
    made.begin(0.0, [0], [0])
    assert made.end == made.reaches(5.0, 0.0) == inf
    assert made.pieces(0)[0][-1].v == 0.0


def test_a_reset_forgets_all_but_the_rates() -> None:
    made = plane(3000)
    made.scale, made.tangent = (2.0, 1.0), (5.0, 6)
    made.begin(0.0, [0], [0])
    made.reset()
    assert (made.running, made.total, made.members, made.mode) == (False, 0.0, (), "")
    assert (made.scale, made.tangent, made.registers["VS"]) == ((1.0, 1.0), (0.0, 0), 10_240.0)
    made.select(VECTOR, (0, 1), (0, 1))
    assert made.tip == (0.0, 0.0)
