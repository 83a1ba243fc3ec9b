"""Predictions of a sequence whose speed ratio changes during motion, compared with the twin."""

from __future__ import annotations

from math import inf
from random import Random

import pytest

from dmc41x3.twin.motion.path import PathSegment
from dmc41x3.twin.motion.plane import LINEAR, Plane
from maya_un.motion import SpeedProfile
from tests.campaign import Campaign

Segments = list[tuple[float, int, int]]


def drawn(rng: Random) -> tuple[Segments, int, int]:
    """Return segments of any length and speed, and VA and VD; end speeds that cannot be met are among them."""
    segments: Segments = []
    for _ in range(rng.randint(1, 8)):
        target = rng.randrange(2000, 40_000, 2)
        segments.append((float(rng.choice([3, 300, 3000, 20_000])), target, rng.randrange(0, target + 1, 2)))
    return segments, 1024 * rng.randint(3, 60), 1024 * rng.randint(3, 60)


def begun(segments: Segments, va: int, vd: int, ratio: float) -> Plane:
    """Return the twin's sequence, begun at time 0."""
    plane = Plane("S", {"VS": 25_000.0, "VA": va, "VD": vd, "VR": ratio, "VV": 0.0})
    plane.select(LINEAR, (0,), (0,))
    for length, target, end in segments:
        plane.append(PathSegment.of((length,), target, end), 0.0)
    plane.close()
    plane.begin(0.0, [0], [0])
    return plane


def changed(plane: Plane, t: float, ratio: float) -> None:
    """Have the twin take over a speed ratio at time `t`."""
    plane.registers["VR"] = ratio
    plane.rates_changed()
    plane.replan(t)


def another(rng: Random, ratio: float) -> float:
    return rng.choice([0.0, 0.0, 1.0, 0.5, rng.uniform(0.01, 1.0)]) if ratio else rng.choice([1.0, 0.5, 0.05])


def test_predictions_hold_through_any_changes_at_any_instants(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=300, long=20_000)):
        rng = campaign.rng(case)
        segments, va, vd = drawn(rng)
        ratio, t = rng.choice([1.0, 0.3]), 0.0
        plane, profile = begun(segments, va, vd, ratio), SpeedProfile.along(segments, va, vd, ratio)
        for _ in range(rng.randint(1, 6)):
            t = rng.uniform(t, min(profile.duration, t + 3.0))
            if t >= plane.end:  # a pause in the last ramp: by the last digit it ends there or stands there
                break
            ratio = another(rng, ratio)
            changed(plane, t, ratio)
            profile = profile.changed(t, ratio)
            for u in (rng.uniform(t, min(profile.duration, t + 5.0)) for _ in range(5)):
                assert profile.at(u)[0] == pytest.approx(plane.distance(u), abs=1e-6), f"case {case} at {u}"
                assert profile.at(u)[1] == pytest.approx(plane.speed(u), abs=1e-3), f"case {case} at {u}"
        if ratio > 0.0 and t < plane.end:
            assert profile.duration == pytest.approx(plane.end, abs=1e-6), f"case {case}"


def test_a_pause_anywhere_and_a_resume_lead_to_the_end(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=200, long=5000)):
        rng = campaign.rng(case)
        segments, va, vd = drawn(rng)
        plain = SpeedProfile.along(segments, va, vd)
        told = rng.uniform(0.0, plain.duration)
        paused = plain.changed(told, 0.0)
        if paused.duration < inf:  # it was in its last ramp
            assert paused.duration == pytest.approx(plain.duration, abs=1e-6)
            continue
        rest = paused.pieces[-1].t
        assert rest - told == pytest.approx(plain.at(told)[1] / vd, abs=1e-6)
        resumed = paused.changed(rest + 10.0, 1.0)
        assert resumed.at(resumed.duration) == (plain.length, 0.0)
        assert resumed.duration >= plain.duration + 10.0 - 1e-6
        assert resumed.at(rest + 5.0) == (pytest.approx(paused.at(rest)[0]), 0.0)


def test_a_way_is_reached_when_it_says(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=200, long=5000)):
        rng = campaign.rng(case)
        segments, va, vd = drawn(rng)
        profile = SpeedProfile.along(segments, va, vd)
        for _ in range(2):
            profile = profile.changed(rng.uniform(0.0, profile.duration), rng.uniform(0.05, 1.0))
        for way in (rng.uniform(0.0, profile.length) for _ in range(10)):
            assert profile.at(profile.when(way))[0] == pytest.approx(way, abs=1e-5), f"case {case}"


@pytest.mark.parametrize("before_end", [0.0, 1e-12, 1e-9, 1e-6])
def test_changes_at_the_last_instant_leave_the_twin_at_its_end(before_end: float) -> None:
    plane = begun([(3000.0, 24_700, 9838)], 57_344, 9216, 1.0)
    t = plane.end - before_end
    for ratio in (0.0, 0.05, 0.3, 1.0):
        changed(plane, t, ratio)
        assert plane.distance(t) == pytest.approx(3000.0, abs=1e-6)
    assert plane.end == pytest.approx(t, abs=1e-4)
