"""Paths and moves against brute force: accepted paths are inside, plans keep the limits."""

from __future__ import annotations

from itertools import pairwise
from math import dist, hypot
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.config import Config, Units
from maya_un.errors import PathRefused
from maya_un.kinematics import Workspace
from maya_un.motion import (
    CoordinatedMove,
    Counts,
    Limits,
    Segment,
    commands,
    plan,
)
from maya_un.motion.clearance import extremes
from maya_un.motion.move import straight
from maya_un.motion.proof import between
from maya_un.values import Joints
from tests.campaign import Campaign
from tests.strategies import WORKSPACE, configuration, edge_joints, paths, prove_ways, reachable_joints, shares

LIMITS = Limits.of(Config())
UNITS = Units.of(Config())

NARROW = Workspace.of(configuration(safety={"tension_limit": 1.2}, geometry={"height": 2.0}))
"""A machine whose lines reach the table and may carry little: many straight paths leave its workspace."""

NO_PROOF = 1e-9
"""Nearer to a limit than this [m, rad, loads] rounding may keep a path from being proved."""

counts = st.one_of(st.integers(-6, 6), st.integers(-200_000, 200_000))
ways = st.tuples(st.integers(-2000, 2000), counts, counts)
moves = st.lists(ways, min_size=1, max_size=4)
HERE: Counts = (20_000, 1_400_000, 1_500_000)


def moved(steps: list[Counts], scale: float = 1.0) -> CoordinatedMove:
    """Return the move through the places that lie `steps` apart, in counts."""
    places = [HERE]
    for step in steps:
        a, b, c = (at + way for at, way in zip(places[-1], step, strict=True))
        places.append((a, b, c))
    return plan(straight(UNITS, [UNITS.to_joints(place) for place in places]), LIMITS, UNITS, scale)


def timed(move: CoordinatedMove) -> list[tuple[Segment, float, float, float]]:
    """Return every segment with its duration and the speeds at its begin and end, from the profile's pieces."""
    begins = [0.0, *move.ways][: len(move.ways)]
    found: list[tuple[Segment, float, float, float]] = []
    for segment, begin, end in zip(move.segments, begins, move.ways, strict=True):
        first, last = (arrival(move, way) for way in (begin, end))
        found.append((segment, last[0] - first[0], first[1], last[1]))
    return found


def arrival(move: CoordinatedMove, way: float) -> tuple[float, float]:
    """Return time and speed at a way, found by bisection in time."""
    if way >= move.profile.length:
        return move.duration, 0.0
    early, late = 0.0, move.duration
    for _ in range(60):
        middle = 0.5 * (early + late)
        if move.profile.at(middle)[0] < way:
            early = middle
        else:
            late = middle
    return late, move.profile.at(late)[1]


@given(st.one_of(paths(), paths(edge_joints())))
def test_every_point_of_an_accepted_path_is_in_the_workspace(path: list[Joints]) -> None:
    try:
        prove_ways(WORKSPACE, *path)
    except PathRefused as refused:
        assert_breach(WORKSPACE, refused)
    else:
        assert all(WORKSPACE.contains(between(*leg, t)) for leg in pairwise(path) for t in shares(50))


@given(paths(edge_joints(NARROW), most=3))
def test_accepting_and_sampling_agree_on_paths_near_the_border(path: list[Joints]) -> None:
    sampled = all(NARROW.contains(between(*leg, t)) for leg in pairwise(path) for t in shares(200))
    try:
        prove_ways(NARROW, *path)
    except PathRefused as refused:
        assert_breach(NARROW, refused)
    else:
        assert sampled


def assert_breach(workspace: Workspace, refused: PathRefused) -> None:
    """Check that a refusal points at a place which is outside, or so near a limit that no proof reaches it."""
    at = refused.details["at"]
    assert isinstance(at, tuple)
    if workspace.contains(Joints(*at)):
        assert min(workspace.margins(Joints(*at)).limits.values()) < NO_PROOF


@given(paths())
def test_no_sample_is_lower_or_higher_than_the_extremes(path: list[Joints]) -> None:
    fk = WORKSPACE.mechanism.fk
    low, high = (point.z for point in extremes(WORKSPACE.mechanism, path))
    heights = [fk(between(*leg, t)).z for leg in pairwise(path) for t in shares(50)]
    assert low <= min(heights) + 1e-9
    assert high >= max(heights) - 1e-9


@given(moves, st.sampled_from((1.0, 0.37, 0.01)))
def test_a_move_ends_exactly_and_has_no_empty_segment(steps: list[Counts], scale: float) -> None:
    move = moved(steps, scale)
    assert move.start == HERE
    assert move.end == tuple(map(sum, zip(HERE, *steps, strict=True)))
    assert move.end == tuple(map(sum, zip(HERE, *(segment.counts for segment in move.segments), strict=True)))
    assert all(any(segment.counts) for segment in move.segments)
    assert max(map(len, commands(move)), default=0) <= 80


@given(moves, st.sampled_from((1.0, 0.37)))
def test_every_number_is_one_that_the_controller_keeps(steps: list[Counts], scale: float) -> None:
    move = moved(steps, scale)
    for segment in move.segments:
        assert segment.speed % 2 == segment.end_speed % 2 == 0
        assert 2 <= segment.speed <= move.vs
        assert 0 <= segment.end_speed <= segment.speed
    assert move.va % 1024 == move.vd % 1024 == 0
    assert 1024 <= move.va <= move.vd


@given(moves, st.sampled_from((1.0, 0.37)))
def test_no_axis_exceeds_its_speed(steps: list[Counts], scale: float) -> None:
    for segment in moved(steps, scale).segments:
        for way, limit in zip(segment.counts, LIMITS.speed, strict=True):
            assert segment.speed * abs(way) / segment.length <= max(2.0, scale * limit) * (1 + 1e-12)


@given(st.lists(ways, min_size=1, max_size=1))
def test_no_axis_is_more_than_a_step_off_its_accelerations(steps: list[Counts]) -> None:
    """Between any two instants an axis' speed changes by what its limits allow in that time, and a step of 2 %."""
    move = moved(steps)
    pieces = timed(move)
    whole = sum(segment.length for segment in move.segments) or 1.0
    ends = np.cumsum([seconds for _, seconds, _, _ in pieces])
    starts = ends - [seconds for _, seconds, _, _ in pieces]
    for axis in range(3):
        share = abs(move.end[axis] - move.start[axis]) / whole  # the leg's own: short segments are rounded to counts
        entry = np.array([share * begin for _, _, begin, _ in pieces])
        exit_ = np.array([share * end for _, _, _, end in pieces])
        later = np.arange(len(pieces))[:, np.newaxis] <= np.arange(len(pieces))
        passed = np.where(later, ends[np.newaxis, :] - starts[:, np.newaxis], np.inf)
        spare = 1.01 * 0.02 * LIMITS.speed[axis] + 4.0
        assert np.all(entry[:, np.newaxis] - exit_ <= LIMITS.deceleration[axis] * passed + spare)
        assert np.all(exit_ - entry[:, np.newaxis] <= LIMITS.acceleration[axis] * passed + spare)


@given(st.lists(ways, min_size=1, max_size=1), st.sampled_from((0.3, 0.1, 0.03, 0.01)))
def test_half_the_speed_takes_less_than_three_times_as_long(steps: list[Counts], scale: float) -> None:
    """Rounding lets no slow move crawl: where steps are lost the rest is not."""
    slow, slower = moved(steps, scale), moved(steps, 0.5 * scale)
    slowest = min(2.0, slow.profile.length)  # a speed is at least 2 counts/s
    assert slow.duration <= 1.01 * slower.duration + 0.02  # the few steps of a short move are cut again
    assert slower.duration <= 3.0 * slow.duration + 2.0 * slowest


@given(moves)
def test_speed_steps_are_two_per_cent_of_slew_at_most(steps: list[Counts]) -> None:
    for segment in moved(steps).segments:
        for way, limit in zip(segment.counts, LIMITS.speed, strict=True):
            assert (segment.speed - segment.end_speed) * abs(way) / segment.length <= max(0.02 * limit, 2.0)


@given(st.lists(ways, min_size=1, max_size=1))
def test_a_leg_has_a_hundred_segments_at_most(steps: list[Counts]) -> None:
    assert len(moved(steps).segments) <= 100


@given(moves, st.floats(0.0, 1.0))
def test_position_and_speed_belong_together(steps: list[Counts], share: float) -> None:
    move = moved(steps)
    t, dt = share * move.duration, 1e-5
    way, speed = move.profile.at(t)
    ahead, after = move.profile.at(t + dt)
    bound = max(move.va, move.vd) * dt
    assert abs(after - speed) <= bound * 1.01 + (speed if t + dt >= move.duration else 0.0)
    assert ahead - way <= (max(speed, after) + bound) * dt + 1e-9
    assert 0.0 <= way <= ahead <= move.profile.length + 1e-9


@given(reachable_joints(), reachable_joints(), st.floats(0.0, 1.0))
def test_a_stop_at_any_instant_stays_on_the_checked_path(start: Joints, end: Joints, share: float) -> None:
    path = [start, end]
    try:
        prove_ways(WORKSPACE, *path)
    except PathRefused:
        return
    move = plan(straight(UNITS, path), LIMITS, UNITS)
    _, rest = move.stop_at(share * move.duration)
    assert WORKSPACE.holds_grain(rest)
    reach = dist(start, end) or 1.0
    on_line = between(start, end, min(1.0, dist(start, rest) / reach))
    assert rest == pytest.approx(on_line, abs=6e-5)  # a count of axis a is 4.7e-5 rad


def at_an_edge(rng: Random) -> Joints:
    """Return joints of the narrow workspace, half of them at an edge of the section."""
    section = NARROW.section
    u = rng.uniform(0.0, section.width)
    low, high = section.depths(u) or (0.0, 0.0)
    h = low + rng.choice((0.001, 0.999, rng.random(), rng.random())) * (high - low)
    return Joints(0.0, hypot(h, u), hypot(h, section.width - u))


def test_both_verdicts_occur_and_agree_with_sampling(campaign: Campaign) -> None:
    size = campaign.size(ci=500, long=20_000)
    rng = campaign.rng()
    refused = 0
    for _ in range(size):
        path = at_an_edge(rng), at_an_edge(rng)
        try:
            prove_ways(NARROW, *path)
        except PathRefused as error:
            refused += 1
            assert_breach(NARROW, error)
        else:
            assert all(NARROW.contains(between(*path, t)) for t in shares(40))
    assert 0 < refused < size
