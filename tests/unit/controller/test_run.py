"""One motion as it is predicted: its ends, its times and its vias, through every change of pace."""

from __future__ import annotations

from math import inf

import pytest

from maya_un.config import Config, Units
from maya_un.controller.protocol import MotionPace, MotionRun
from maya_un.motion.move import CoordinatedMove, Segment, Segments
from maya_un.values import StopReport

# Up to 10 000 counts/s in 10 000/10 240 s, as long down, 100 000 counts in all.
MOVE = CoordinatedMove.along(
    (0, 1_500_000, 1_300_000),
    Segments.of([Segment((0, 100_000, 0), 10_000, 0)]),
    ("A", "B", "C"),
    10_240,
    10_240,
    Units.of(Config()),
)
RAMP = 10_000 / 10_240
DURATION = 100_000 / 10_000 + RAMP
BEGAN = 50.0


def begun(*vias: float, told: list[int] | None = None, factor: float = 1.0) -> MotionRun:
    return MotionRun(MOVE, BEGAN, (1, 2), factor, vias=vias, on_via=None if told is None else told.append)


def paced(*, override: float = 1.0, paused: bool = False) -> MotionPace:
    pace = MotionPace()
    pace.change(override=override, paused=paused)
    return pace


async def test_it_ends_and_rests_when_its_profile_does() -> None:
    run = begun()
    assert run.end == run.rest == pytest.approx(BEGAN + DURATION)
    assert run.times(BEGAN + 4.0) == pytest.approx((4.0, DURATION))


async def test_slow_start_takes_longer() -> None:
    assert begun(factor=0.5).end == pytest.approx(BEGAN + 100_000 / 5000 + 0.5 * RAMP)


async def test_in_a_pause_it_rests_and_has_no_end() -> None:
    run = begun()
    run.follow(paced(paused=True), BEGAN + 4.0)
    assert (run.end, run.rest) == (inf, pytest.approx(BEGAN + 4.0 + RAMP))


async def test_times_exclude_pauses() -> None:
    run = begun()
    run.follow(paced(paused=True), BEGAN + 4.0)
    moved, whole = run.times(BEGAN + 500.0)
    assert moved == pytest.approx(4.0 + RAMP)
    # A ramp to rest costs half its time, and so does the one from there.
    assert whole == pytest.approx(DURATION + RAMP)
    run.follow(paced(), BEGAN + 1000.0)
    assert run.times(BEGAN + 1000.0) == pytest.approx((moved, whole))
    assert run.times(run.end) == pytest.approx((whole, whole))
    assert run.end == pytest.approx(BEGAN + 1000.0 + whole - moved)


async def test_a_second_pause_adds_to_the_first() -> None:
    run = begun()
    for start in (2.0, 95.0):
        run.follow(paced(paused=True), BEGAN + start)
        run.follow(paced(), BEGAN + start + 90.0)
    assert run.times(BEGAN + 1e3)[1] == pytest.approx(DURATION + 2.0 * RAMP)


async def test_a_pause_that_is_taken_back_at_once_has_not_stood() -> None:
    run = begun()
    run.follow(paced(paused=True), BEGAN + 4.0)
    run.follow(paced(), BEGAN + 4.25)
    assert run.times(BEGAN + 4.25)[0] == pytest.approx(4.25)
    # 0.25 s down and 0.25 s up lose 0.25² · 10 240 counts.
    assert run.end == pytest.approx(BEGAN + DURATION + 0.25**2 * 10_240 / 10_000)


async def test_an_override_in_a_pause_counts_from_resume() -> None:
    run = begun()
    run.follow(paced(paused=True), BEGAN + 4.0)
    run.follow(paced(override=0.5, paused=True), BEGAN + 20.0)
    assert run.end == inf
    expected = run.times(BEGAN + 30.0)[1]
    run.follow(paced(override=0.5), BEGAN + 30.0)
    assert run.times(BEGAN + 30.0)[1] == pytest.approx(expected)


async def test_stop_is_predicted_from_the_current_speed() -> None:
    run = begun()
    assert run.stop_report(BEGAN + 4.0).duration == pytest.approx(RAMP)
    run.follow(paced(override=0.5), BEGAN + 4.0)
    report = run.stop_report(BEGAN + 6.0)
    assert report.duration == pytest.approx(0.5 * RAMP)
    assert report.distance == pytest.approx((0.0, 5000.0**2 / 20_480 * 1e-6, 0.0))
    run.follow(paced(paused=True), BEGAN + 6.0)
    assert run.stop_report(BEGAN + 9.0) == StopReport(False, 0.0, (0.0, 0.0, 0.0))


async def test_waypoints_are_reported_in_order_and_once() -> None:
    told: list[int] = []
    run = begun(5000.0, 55_000.0, 55_000.0, 100_000.0, told=told)
    middle = BEGAN + RAMP + (55_000 - 10_000 * RAMP / 2) / 10_000
    assert run.next_via() < middle
    run.tell_vias(middle - 1e-3)
    assert told == [0]
    assert run.next_via() == pytest.approx(middle)
    run.tell_vias(middle)
    run.tell_vias(middle)
    assert told == [0, 1, 2]
    run.tell_vias(run.end)
    assert (told, run.next_via()) == ([0, 1, 2, 3], inf)


async def test_a_pause_keeps_vias_away_and_an_override_puts_them_off() -> None:
    told: list[int] = []
    run = begun(55_000.0, told=told)
    due = run.next_via()
    run.follow(paced(override=0.5), BEGAN + 2.0)
    assert run.next_via() > due + 2.0
    run.follow(paced(override=0.5, paused=True), BEGAN + 3.0)
    assert run.next_via() == inf
    run.tell_vias(BEGAN + 1e6)
    assert told == []
    run.follow(paced(), BEGAN + 1e6)
    run.tell_vias(run.end)
    assert told == [0]


async def test_without_a_listener_no_via_is_waited_for() -> None:
    assert begun(5000.0).next_via() == inf


async def test_pace_wakes_waiters_and_keeps_unset_values() -> None:
    pace = MotionPace()
    news = pace.news
    pace.change(override=0.3)
    assert (news.done(), pace.news.done()) == (True, False)
    pace.change(paused=True)
    assert (pace.override, pace.paused, pace.ratio) == (0.3, True, 0.0)
    pace.change(paused=False)
    assert pace.ratio == 19_660 / 65_536  # 0.3 as the controller keeps it
