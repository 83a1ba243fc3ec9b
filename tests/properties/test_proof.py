"""Proofs about paths of many chords, against dense sampling: nothing missed, nothing refused without cause."""

from __future__ import annotations

from itertools import pairwise
from math import inf

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from maya_un.errors import PathRefused, Unreachable
from maya_un.kinematics import Floats, Workspace
from maya_un.kinematics.zones import Box, Cylinder, HalfSpace, Zone
from maya_un.motion.clearance import closest, highest, lowest
from maya_un.motion.proof import prove
from maya_un.values import Joints, Point
from tests.strategies import WORKSPACE, configuration, edge_joints, reachable_joints, reachable_points

NARROW = Workspace.of(configuration(safety={"tension_limit": 1.2}, geometry={"height": 2.0}))
"""A machine whose lines reach the table and may carry little: many straight paths leave its workspace."""

DENSE = 20_000
TOUCH = 1e-6
"""Paths that stay this far inside must be accepted [m, rad, loads]."""


def knots(joints: list[Joints]) -> Floats:
    """Return the knots of straight chords between joints."""
    return np.array(joints)


def level(workspace: Workspace, points: list[Point]) -> Floats:
    """Return ten knots a leg on the straight lines of the gripper between points."""
    legs = [np.linspace(one, two, 10) for one, two in pairwise(points)]
    return workspace.mechanism.ik_many(np.concatenate(legs))


def polylines(workspace: Workspace) -> st.SearchStrategy[Floats]:
    """Draw paths that are straight in the joints or, nearly, in space, at the edges of the workspace or anywhere."""
    edges = st.lists(edge_joints(workspace), min_size=2, max_size=4).map(knots)
    inside = st.lists(reachable_joints(workspace), min_size=2, max_size=4).map(knots)
    spatial = st.lists(reachable_points(workspace), min_size=2, max_size=3).map(lambda found: level(workspace, found))
    return st.one_of(edges, inside, spatial)


def sampled(path: Floats, count: int) -> Floats:
    """Return `count` + 1 evenly spaced joints of every chord, shape (chords · (count + 1), 3)."""
    shares = np.linspace(0.0, 1.0, count + 1)[:, np.newaxis]
    return (path[:-1, np.newaxis] + np.diff(path, axis=0)[:, np.newaxis] * shares).reshape(-1, 3)


def least_margin(workspace: Workspace, joints: Floats) -> float:
    """Return the least distance to any limit but zones [m, rad, loads], from the formulas of statics, −inf for none."""
    a, b, c = joints.T
    W = workspace.mechanism.width
    u = (W * W + b * b - c * c) / (2.0 * W)
    square = b * b - u * u
    if not (square > 0.0).all():
        return -inf
    h = np.sqrt(square)
    margins = [u, W - u, workspace.mechanism.reach_down - h]
    margins += [workspace.tension_limit - (W - u) / W * b / h, workspace.tension_limit - u / W * c / h]
    for column, (low, high) in ((a, workspace.boom), (b, workspace.line_b), (c, workspace.line_c)):
        margins += [column - low, high - column]
    return float(min(margin.min() for margin in margins))


def accepted(workspace: Workspace, path: Floats) -> bool:
    """Whether a path is proved."""
    try:
        prove(workspace, path)
    except (PathRefused, Unreachable):
        return False
    return True


@given(st.one_of(polylines(WORKSPACE), polylines(NARROW)), st.sampled_from((WORKSPACE, NARROW)))
def test_no_sample_of_a_proved_path_is_outside(path: Floats, workspace: Workspace) -> None:
    assume(accepted(workspace, path))
    for chord in range(len(path) - 1):
        ends = path[chord : chord + 2]
        at_ends = min(0.0, least_margin(workspace, ends[:1]), least_margin(workspace, ends[1:]))
        assert least_margin(workspace, sampled(ends, DENSE)) >= at_ends - 1e-8


@given(st.one_of(polylines(WORKSPACE), polylines(NARROW)), st.sampled_from((WORKSPACE, NARROW)))
def test_path_whose_samples_lie_inside_is_proved(path: Floats, workspace: Workspace) -> None:
    assume(least_margin(workspace, sampled(path, 2000)) >= TOUCH)
    assert accepted(workspace, path)


@given(polylines(NARROW))
def test_a_refusal_points_at_a_place_outside(path: Floats) -> None:
    try:
        prove(NARROW, path)
    except PathRefused as refused:
        at = refused.details["at"]
        assert isinstance(at, tuple)
        assert not NARROW.contains(Joints(*at))
        share = refused.details["share"]
        assert isinstance(share, float)
        assert 0.0 <= share <= 1.0


coordinates = st.floats(-0.5, 2.5)
points = st.builds(Point, coordinates, coordinates, st.floats(0.0, 2.3))
boxes = st.builds(
    lambda corner, size: Box("box", corner, Point(*(at + more for at, more in zip(corner, size, strict=True)))),
    points,
    st.tuples(*[st.floats(0.01, 0.8)] * 3),
)
cylinders = st.builds(
    lambda x, y, radius, low, tall: Cylinder("post", x, y, radius, low, low + tall),
    coordinates,
    coordinates,
    st.floats(0.01, 0.5),
    st.floats(0.0, 1.0),
    st.floats(0.01, 1.5),
)
walls = st.builds(
    lambda point, turn: HalfSpace("wall", point, Point(np.sin(turn), np.cos(turn), 0.2)), points, st.floats(0.0, 6.3)
)


@given(polylines(WORKSPACE), st.lists(st.one_of(boxes, cylinders, walls), min_size=1, max_size=3))
def test_a_proved_path_keeps_clear_of_every_zone(path: Floats, zones: list[Zone]) -> None:
    assume(accepted(WORKSPACE, path))
    workspace = WORKSPACE.with_zones(zones)
    samples = sampled(path, 300)
    least = min(float(zone.clearances(WORKSPACE.mechanism, samples).min()) for zone in zones)
    if accepted(workspace, path):
        assert least >= -workspace.zone_grain
    else:
        assert least < TOUCH


@given(polylines(WORKSPACE))
def test_margins_are_those_of_dense_samples(path: Floats) -> None:
    samples = sampled(path, max(100, DENSE // len(path)))
    a, b, c = samples.T
    W = WORKSPACE.mechanism.width
    u = (W * W + b * b - c * c) / (2.0 * W)
    h = np.sqrt(b * b - u * u)
    dense = {
        "boom_start": a - WORKSPACE.boom[0],
        "boom_end": WORKSPACE.boom[1] - a,
        "line_b_short": b - WORKSPACE.line_b[0],
        "line_b_long": WORKSPACE.line_b[1] - b,
        "line_c_short": c - WORKSPACE.line_c[0],
        "line_c_long": WORKSPACE.line_c[1] - c,
        "coupling": b + c - W,
        "inner": u,
        "outer": W - u,
        "floor": WORKSPACE.mechanism.reach_down - h,
        "tension_b": WORKSPACE.tension_limit - (W - u) / W * b / h,
        "tension_c": WORKSPACE.tension_limit - u / W * c / h,
    }
    for approach in closest(WORKSPACE, path):
        assert -TOUCH <= dense[approach.name].min() - approach.margin <= TOUCH, approach


@given(polylines(WORKSPACE), st.one_of(boxes, cylinders, walls))
def test_clearances_are_those_of_dense_samples(path: Floats, zone: Zone) -> None:
    *_, approach = closest(WORKSPACE.with_zones([zone]), path)
    chord, share = approach.place
    there = path[chord] + share * (path[chord + 1] - path[chord])
    assert zone.clearances(WORKSPACE.mechanism, there[np.newaxis])[0] == pytest.approx(approach.margin, abs=1e-9)
    assert zone.clearances(WORKSPACE.mechanism, sampled(path, 400)).min() >= approach.margin - 5e-4


@given(polylines(WORKSPACE))
def test_no_sample_is_lower_or_higher_than_the_extremes(path: Floats) -> None:
    z = WORKSPACE.mechanism.fk_many(sampled(path, 500))[:, 2]
    assert z.min() + 1e-7 >= lowest(WORKSPACE.mechanism, path).z >= z.min() - 1e-4
    assert z.max() - 1e-7 <= highest(WORKSPACE.mechanism, path).z <= z.max() + 1e-4
