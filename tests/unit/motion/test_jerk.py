"""Limits of jerk: the fastest S-curves by their closed form, rests, bounds from outside, what the controller gets."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import cbrt, inf, sqrt

import numpy as np
import pytest

from maya_un.config import Config, Units
from maya_un.kinematics import Floats
from maya_un.motion import CoordinatedMove, Limits, Path, commands, lay, plan
from maya_un.motion.jerk import Smooth, gentle
from maya_un.motion.move import straight
from maya_un.values import Joints
from tests.jerk_limits import fastest_of, gentle_of
from tests.strategies import WORKSPACE, configuration

UNITS = Units.of(Config())
LIMITS = Limits.of(Config())
GENTLE = replace(LIMITS, jerk=(1024.0, 5120.0, 5120.0))
HERE = Joints(0.5, 1.5, 1.7)


def shifted(a: int = 0, b: int = 0, c: int = 0) -> Joints:
    """Return HERE moved by whole counts."""
    at = UNITS.to_counts(HERE)
    return UNITS.to_joints((at[0] + a, at[1] + b, at[2] + c))


def move(*waypoints: Joints, limits: Limits = GENTLE, speed_scale: float = 1.0) -> CoordinatedMove:
    return plan(straight(UNITS, waypoints), limits, UNITS, speed_scale)


def fastest(length: float, speed: float, acceleration: float, jerk: float) -> float:
    """Return the least time from rest to rest under limits of speed, acceleration and jerk: seven phases.

    The acceleration is no more than can be reached on the way to the speed, √(v J), or within the way, ∛(L J²/2).
    """
    a = min(acceleration, sqrt(speed * jerk), cbrt(length * jerk * jerk / 2.0))
    reached = -a * a / (2.0 * jerk) + sqrt((a * a / (2.0 * jerk)) ** 2 + a * length)
    v = min(speed, reached)
    return length / v + v / a + a / jerk


def only(found: list[Smooth]) -> Smooth:
    assert len(found) == 1
    return found[0]


@pytest.mark.parametrize("jerk", [1024.0, 5120.0, 80_000.0, 1e7])
@pytest.mark.parametrize("way", [3, 100, 4000, 90_000, 500_000])
def test_a_straight_line_takes_the_least_time_there_is(way: int, jerk: float) -> None:
    limits = replace(LIMITS, jerk=(inf, jerk, inf))
    smooth = only(gentle_of(straight(UNITS, (HERE, shifted(b=-way))), limits))
    assert smooth.duration == pytest.approx(fastest(way, 45_000, 5120, jerk), rel=2e-3, abs=2e-3)


def test_the_slowest_axis_sets_the_pace() -> None:
    # The boom goes 1000 counts while line b goes 100 000: of the path's length L each goes its share.
    found = gentle_of(straight(UNITS, (HERE, shifted(a=1000, b=100_000))), GENTLE)
    alone = fastest(1000, 1000, 1024, 1024), fastest(100_000, 45_000, 5120, 5120)
    assert only(found).duration == pytest.approx(max(alone), rel=2e-3)


def test_it_converges_to_the_fastest_way() -> None:
    path = Path.line(*(WORKSPACE.mechanism.fk(joints) for joints in (Joints(0.5, 1.5, 1.5), Joints(1.6, 1.7, 1.3))))
    knots = lay(path, WORKSPACE.mechanism, UNITS, LIMITS)
    best = plan(knots, LIMITS, UNITS).duration
    durations = [plan(knots, replace(LIMITS, jerk=(j / 5, j, j)), UNITS).duration for j in (5e3, 5e4, 5e5, 1e9)]
    assert all(slow > fast for slow, fast in pairwise(durations))
    assert durations[-1] == pytest.approx(best, rel=5e-3)


def test_without_a_limit_nothing_changes() -> None:
    assert LIMITS.jerk == (inf, inf, inf)
    usual = move(HERE, shifted(b=300_000), shifted(a=2000, b=300_000), limits=LIMITS)
    other = move(HERE, shifted(b=300_000), shifted(a=2000, b=300_000), limits=replace(LIMITS, jerk=(inf, inf, 9e99)))
    assert usual.duration < move(HERE, shifted(b=300_000), shifted(a=2000, b=300_000)).duration
    assert other.duration == pytest.approx(usual.duration, rel=1e-2)


def test_the_configuration_limits_each_axis() -> None:
    lines = {"b": Config().axes.b.model_copy(update={"jerk_counts": 20_000})}
    assert Limits.of(configuration(axes=lines)).jerk == (inf, 20_000.0, inf)


def test_an_axis_without_a_limit_goes_as_it_did() -> None:
    only_lines = replace(LIMITS, jerk=(inf, 5120.0, 5120.0))
    usual = move(HERE, shifted(a=9000), limits=LIMITS)
    assert move(HERE, shifted(a=9000), limits=only_lines).duration == pytest.approx(usual.duration, abs=0.05)


def test_the_controller_follows_within_a_stair() -> None:
    way = (HERE, shifted(b=-500_000))
    found, smooth = move(*way), only(gentle_of(straight(UNITS, way), GENTLE))
    assert found.duration == pytest.approx(smooth.duration, rel=5e-3)
    at = np.linspace(0.0, found.duration, 400)
    speeds = np.array([found.speed_at(t) for t in at.tolist()])
    wanted = smooth.at(np.minimum(at, smooth.duration))[1]
    assert np.abs(speeds - wanted).max() <= 0.025 * 45_000


def test_it_rises_gently() -> None:
    # v = J t²/2 for the first second, while the bare limit of acceleration would give 5120 t.
    found = move(HERE, shifted(b=-500_000))
    assert found.speed_at(0.5) == pytest.approx(640.0, abs=200.0)
    assert found.speed_at(1.0) == pytest.approx(2560.0, abs=450.0)


def test_a_sharp_corner_is_a_rest() -> None:
    corner = shifted(b=200_000)
    found = move(HERE, corner, shifted(b=200_000, c=100_000))
    at = found.places.index(UNITS.to_counts(corner))
    assert found.segments[at - 1].end_speed <= 2
    legs = fastest(200_000, 45_000, 5120, 5120) + fastest(100_000, 45_000, 5120, 5120)
    assert found.duration == pytest.approx(legs, rel=1e-2)


def test_straight_waypoint_is_no_rest() -> None:
    halves = move(HERE, shifted(b=100_000), shifted(b=200_000))
    assert halves.duration == pytest.approx(move(HERE, shifted(b=200_000)).duration, rel=5e-3)


@pytest.mark.parametrize("way", [(1, 0, 0), (-3, 0, 0), (0, 1, 0), (1, 1, 1), (2, -7, 1), (0, 0, -40)])
def test_a_few_counts_are_a_move(way: tuple[int, int, int]) -> None:
    found = move(HERE, shifted(*way))
    assert found.end == tuple(at + step for at, step in zip(found.start, way, strict=True))
    assert 0.0 < found.duration < 1.2 * fastest(max(map(abs, way)), 1000, 1024, 1024) + 0.3


def test_the_speed_scale_slows_the_cruise_only() -> None:
    found = move(HERE, shifted(b=-900_000), speed_scale=0.5)
    assert found.vs == 22_500
    assert found.duration == pytest.approx(fastest(900_000, 22_500, 5120, 5120), rel=5e-3)


def test_numbers_are_those_that_the_controller_keeps() -> None:
    found = move(HERE, shifted(a=3000, b=-400_000), shifted(a=3000, b=-400_000, c=90_000))
    assert max(map(len, commands(found))) <= 80
    for segment in found.segments:
        assert segment.speed % 2 == segment.end_speed % 2 == 0
        assert 0 <= segment.end_speed <= segment.speed <= found.vs


def test_few_segments_are_added() -> None:
    for waypoints in ((HERE, shifted(b=-500_000)), (HERE, shifted(a=9000, b=90_000)), (HERE, shifted(c=300))):
        assert len(move(*waypoints).segments) <= len(move(*waypoints, limits=LIMITS).segments) + 60


def test_invalid_limits_are_refused() -> None:
    asked: list[float] = []

    def allowed(tops: Floats) -> Floats:
        asked.append(float(tops.max()))
        return np.where(tops > 10_000.0, 10_000.0, inf)

    knots = straight(UNITS, (HERE, shifted(b=-500_000)))
    smooth = only(gentle_of(knots, GENTLE, allowed))
    assert max(asked) > 10_000.0
    assert smooth.speeds.max() <= 10_000.0 * (1 + 1e-9)
    assert smooth.duration == pytest.approx(fastest(500_000, 10_000, 5120, 5120), rel=1e-2)


def test_coarser_is_in_fewer_segments() -> None:
    knots = straight(UNITS, (HERE, shifted(a=9000, b=90_000)))
    fine, coarse = (plan(knots, GENTLE, UNITS, coarseness=by) for by in (1.0, 4.0))
    assert len(coarse.segments) < 0.6 * len(fine.segments)
    assert coarse.end == fine.end


def test_rests_begin_and_end_stretches() -> None:
    knots = straight(UNITS, (HERE, shifted(b=50_000), shifted(b=90_000), shifted(b=90_000, c=9000)))
    within, at = np.full(3, 45_000.0), np.array([0.0, 45_000.0, 640.0, 0.0])
    found = gentle(knots, GENTLE, within, at, fastest_of(knots, GENTLE))
    assert [(stretch.first, stretch.last) for stretch, _ in found] == [(0, 2), (2, 3)]
