"""Random paths with random limits of jerk, looked at densely: every limit of every axis is kept, all of the way."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from math import cos, inf, sin
from random import Random

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from maya_un.config import Config, Units
from maya_un.controller.planner import Planner
from maya_un.kinematics import Floats
from maya_un.motion import Knots, Limits, Path, lay, plan
from maya_un.motion.emergency import Emergency, emergency_speed
from maya_un.motion.jerk import Smooth, gentle
from maya_un.motion.move import STEP
from maya_un.motion.speeds import Chords, caps
from maya_un.values import Point
from tests.campaign import Campaign
from tests.jerk_limits import fastest_of
from tests.strategies import WORKSPACE, configuration, reachable_joints, reachable_points

LIMITS = Limits.of(Config())
UNITS = Units.of(Config())
PLACES = 9
ROUNDING = 1e-6
CEILING = 2.048
"""A height just below where lines carry 5 loads, 2.0495 in the middle of the boom [m]."""

jerks = st.one_of(st.floats(3.0, 7.0).map(lambda power: 10.0**power), st.just(inf))
rates = st.sampled_from((1024, 5120, 20_480))
limits = st.builds(
    lambda jerk, up, down: replace(LIMITS, jerk=jerk, acceleration=(1024, up, up), deceleration=(1024, down, down)),
    st.tuples(jerks, jerks, jerks).filter(lambda found: min(found) < inf),
    rates,
    rates,
)
paths = st.one_of(
    st.lists(reachable_joints(), min_size=2, max_size=4, unique=True).map(lambda found: Path.joints(*found)),
    st.builds(
        lambda found, blend: Path.line(*found, blend=blend),
        st.lists(reachable_points(), min_size=2, max_size=3, unique=True),
        st.sampled_from((0.0, 0.1)),
    ),
)


@dataclass(frozen=True)
class Driven:
    """One stretch looked at densely: times and speeds `along` the path (m,); the axes' accelerations (m, 3).

    `directions` (m, 3) are those of the chords in whole counts.
    """

    t: Floats
    along: Floats
    accelerations: Floats
    directions: Floats


def laid(path: Path, given: Limits) -> Knots:
    """Return the knots of a path that keeps below the anchors and goes somewhere."""
    knots = lay(path, WORKSPACE.mechanism, UNITS, given)
    assume(np.isfinite(knots.exact).all() and len(knots.counts) > 1)
    return knots


def looked_at(knots: Knots, smooth: Smooth, first: int, last: int) -> Driven:
    """Return what the axes do between two rests, from the knots and the way over time alone.

    The direction at a knot is that of the circle through it; direction and bend are straight in between.
    """
    counts, exact = (np.diff(places[first : last + 1], axis=0).astype(float) for places in (knots.counts, knots.exact))
    lengths = np.linalg.norm(counts, axis=1)
    units = exact / np.linalg.norm(exact, axis=1)[:, None]
    ways = np.concatenate(([0.0], np.cumsum(lengths)))
    bends = 2.0 * np.diff(units, axis=0) / (lengths[1:] + lengths[:-1])[:, None]
    bends[knots.sharp[first + 1 : last]] = 0.0
    inner = units[:-1] + 0.5 * bends * lengths[:-1, None]
    at_knots = np.vstack((units[:1], inner, units[-1:]))
    bent = np.vstack((bends[:1], bends, bends[-1:])) if len(bends) else np.zeros((2, 3))
    corners = np.unique(np.concatenate((smooth.times, smooth.when(ways[1:-1]))))
    t = np.concatenate([np.linspace(*ends, PLACES) for ends in pairwise(corners.tolist())])
    t = t[np.concatenate(([True], np.diff(t) > 1e-6))]
    way, speed, rate = smooth.at(t)
    d, c = (np.column_stack([np.interp(way, ways, values) for values in table.T]) for table in (at_knots, bent))
    chord = np.clip(np.searchsorted(ways, way, side="right") - 1, 0, len(lengths) - 1)
    accelerations = d * rate[:, None] + c * (speed * speed)[:, None]
    return Driven(t, speed, accelerations, (counts / lengths[:, None])[chord])


@settings(max_examples=60)
@given(paths, limits)
def test_every_axis_keeps_its_limits(path: Path, given: Limits) -> None:
    knots = laid(path, given)
    within, at = caps(Chords.of(knots), given, 1.0)
    for stretch, smooth in gentle(knots, given, within, at, fastest_of(knots, given)):
        seen = looked_at(knots, smooth, stretch.first, stretch.last)
        assert seen.along[[0, -1]].max() < 1e-6 * seen.along.max()
        driven = np.abs(seen.directions) * seen.along[:, None]
        assert (driven <= np.array(given.speed) * (1 + ROUNDING)).all()
        greatest = np.maximum(given.acceleration, given.deceleration) * (1 + STEP) * (1 + ROUNDING)
        assert (np.abs(seen.accelerations) <= greatest + 1e-3).all()
        jerk = np.abs(np.diff(seen.accelerations, axis=0)) / np.diff(seen.t)[:, None]
        assert (jerk <= np.array(given.jerk) * (1 + ROUNDING) + 1e-3).all()


@settings(max_examples=60)
@given(paths, limits)
def test_way_speed_and_acceleration_belong_together(path: Path, given: Limits) -> None:
    """The speed is a parabola between corners, so Simpson's rule is exact, and the acceleration straight."""
    knots = laid(path, given)
    within, at = caps(Chords.of(knots), given, 1.0)
    for stretch, smooth in gentle(knots, given, within, at, fastest_of(knots, given)):
        spans = np.diff(smooth.times)
        middle = smooth.at(smooth.times[:-1] + 0.5 * spans)[1]
        gone = spans / 6.0 * (smooth.speeds[:-1] + 4.0 * middle + smooth.speeds[1:])
        assert np.allclose(np.diff(smooth.ways), gone, rtol=1e-6, atol=1e-6)
        gained = 0.5 * spans * (smooth.accelerations[:-1] + smooth.accelerations[1:])
        assert np.allclose(np.diff(smooth.speeds), gained, rtol=1e-6, atol=1e-6)
        assert np.allclose(np.diff(smooth.accelerations), spans * smooth.jerks, rtol=1e-6, atol=1e-6)
        assert abs(smooth.ways[-1] - stretch.ways[-1]) < 1e-6 * (1.0 + stretch.ways[-1])


@settings(max_examples=60)
@given(paths, limits)
def test_segments_follow_the_same_path_within_the_limits(path: Path, given: Limits) -> None:
    knots = laid(path, given)
    move = plan(knots, given, UNITS)
    assert move.start == tuple(knots.counts[0].tolist())
    assert move.end == tuple(knots.counts[-1].tolist())
    assert set(map(tuple, knots.counts.tolist())) <= set(move.places)
    for segment in move.segments:
        for way, most in zip(segment.counts, given.speed, strict=True):
            assert segment.speed * abs(way) / segment.length <= max(2.0, most) * (1 + 1e-12)
    assert move.duration >= 0.97 * plan(knots, replace(given, jerk=(inf, inf, inf)), UNITS).duration


def drawn(rng: Random) -> Path:
    """Return a level way right below the ceiling, where lines carry nearly 5 loads, across the boom's middle."""
    begin = rng.uniform(0.2, 1.6)
    ends = [(begin, 0.95), (begin + rng.uniform(0.0, 0.3), 1.65)]
    rng.shuffle(ends)
    if rng.random() < 0.5:
        return Path.swing(*((a, d, CEILING) for a, d in ends))
    return Path.line(*(Point(d * sin(a), d * cos(a), CEILING) for a, d in ends))


def test_nowhere_is_it_faster_than_a_fault_may_find_it(campaign: Campaign) -> None:
    """The mean of speeds is greater than the least of them: bounds of a fault are checked in the driven motion."""
    emergency, per_unit = Emergency.of(Config()), np.array(UNITS.per_unit)
    axes = {name: getattr(Config().axes, name).model_copy(update={"jerk_counts": 5120}) for name in "abc"}
    planner = Planner(configuration(axes=axes), WORKSPACE.mechanism)
    for case in range(campaign.size(ci=10, long=500)):
        move = planner.plan(WORKSPACE, drawn(campaign.rng(case)), 1.0).move
        assert move is not None
        directions = move.segments.counts / move.segments.lengths[:, None] / per_unit
        speeds = move.segments.speeds.astype(np.float64)
        joints = np.array(move.places) / per_unit
        safe = emergency_speed(WORKSPACE, emergency, joints, directions.T, move.vd, speeds)
        assert (speeds <= safe * (1 + ROUNDING)).all()
