"""Properties of every path, in any space and with any cut corners."""

from __future__ import annotations

from math import atan2, hypot

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.config import Config, Units
from maya_un.kinematics import Mechanism
from maya_un.motion import Blend, Knots, Limits, Path, Space, lay, plan
from maya_un.motion.move import JUMPS, TOLERANCE, divided
from maya_un.motion.path import Waypoint, from_joints, to_joints
from maya_un.values import Joints, Point
from tests.strategies import reachable_joints

CONFIG = Config()
UNITS = Units.of(CONFIG)
LIMITS = Limits.of(CONFIG)
MECHANISM = Mechanism.of(CONFIG)
SCALE = np.array(UNITS.per_unit)

blends = st.builds(Blend, *[st.floats(0.0, 0.3)] * 2, *[st.floats(0.05, 1.0)] * 2)


@st.composite
def drawn(draw: st.DrawFn) -> Path:
    """Draw a path through up to four reachable places, most of them some way apart."""
    space = draw(st.sampled_from(Space))
    joints = draw(st.lists(reachable_joints(), min_size=2, max_size=4))
    waypoints = tuple(from_joints(space, MECHANISM, place) for place in joints)
    return Path(space, waypoints, tuple(draw(blends) for _ in waypoints[1:-1]))


def counts(space: Space, waypoint: Waypoint) -> tuple[int, int, int]:
    return UNITS.to_counts(Joints(*to_joints(space, MECHANISM, np.array([waypoint]))[0].tolist()))


def possible(path: Path) -> bool:
    """Whether lines can hold the gripper all along: a straight line may pass above the anchors."""
    along = to_joints(path.space, MECHANISM, path.pieces.at(np.linspace(0.0, len(path.pieces), 500)))
    return bool(np.isfinite(along).all())


@given(drawn())
def test_a_path_begins_and_ends_at_its_waypoints(path: Path) -> None:
    knots = lay(path, MECHANISM, UNITS, LIMITS)
    assert tuple(knots.counts[0].tolist()) == counts(path.space, path.waypoints[0])
    assert tuple(knots.counts[-1].tolist()) == counts(path.space, path.waypoints[-1])
    assert np.all(np.any(np.diff(knots.counts, axis=0) != 0, axis=1))


@given(drawn())
def test_a_move_drives_from_knot_to_knot(path: Path) -> None:
    if not possible(path):
        return
    knots = lay(path, MECHANISM, UNITS, LIMITS)
    move = plan(knots, LIMITS, UNITS)
    places = {tuple(place) for place in move.places}
    assert all(tuple(knot) in places for knot in knots.counts.tolist())
    if not move.segments:
        return
    assert list(move.via_ways) == sorted(move.via_ways)
    assert len(move.via_ways) == len(path.waypoints) - 2


def chord_error(knots: Knots, path: Path) -> float:
    """Return how far the curve is off the chords at worst, an angle at 1 m [m], on a dense sample of it."""
    curve = to_joints(path.space, MECHANISM, path.pieces.at(np.linspace(0.0, len(path.pieces), 601)))
    ends = knots.counts / SCALE
    starts, ways = ends[:-1], np.diff(ends, axis=0)
    squares = np.maximum(np.sum(ways * ways, axis=1), 1e-18)
    share = np.einsum("ij,kij->ki", ways, curve[:, np.newaxis] - starts) / squares
    nearest = starts + np.clip(share, 0.0, 1.0)[..., np.newaxis] * ways
    return float(np.max(np.min(np.linalg.norm(curve[:, np.newaxis] - nearest, axis=2), axis=1)))


@given(drawn())
def test_the_chords_keep_to_the_curve(path: Path) -> None:
    if possible(path) and len(lay(path, MECHANISM, UNITS, LIMITS).counts) > 1:
        rounding = 0.6 * float(np.linalg.norm(1.0 / SCALE))
        assert chord_error(lay(path, MECHANISM, UNITS, LIMITS), path) <= 2.0 * TOLERANCE + rounding


@given(drawn())
def test_no_axis_jumps_between_two_chords(path: Path) -> None:
    if not possible(path):
        return
    knots = lay(path, MECHANISM, UNITS, LIMITS)
    move = plan(knots, LIMITS, UNITS)
    steps = np.diff(knots.counts, axis=0).astype(float)
    times = [move.profile.when(way) for way in np.cumsum(np.linalg.norm(steps, axis=1))]
    directions = steps / np.linalg.norm(steps, axis=1)[:, np.newaxis]
    for knot, time in enumerate(times[:-1]):
        if knots.sharp[knot + 1]:  # there it stops
            continue
        jump = np.abs(directions[knot + 1] - directions[knot]) * move.speed_at(time)
        short = min(np.abs(steps[knot]).max(), np.abs(steps[knot + 1]).max())
        rounding = 2.0 * move.speed_at(time) / short  # a count more or less in one of the two chords
        assert np.all(jump <= 1.6 * JUMPS[:, 0] * LIMITS.speed + rounding)


@given(drawn(), st.floats(2_000.0, 50_000.0))
def test_dividing_changes_nothing_but_the_length_of_chords(path: Path, longest: float) -> None:
    if not possible(path):
        return
    knots = lay(path, MECHANISM, UNITS, LIMITS)
    fine = divided(knots, longest)
    assert np.max(np.linalg.norm(np.diff(fine.exact, axis=0), axis=1), initial=0.0) <= longest * (1 + 1e-9)
    assert {tuple(knot) for knot in knots.counts.tolist()} <= {tuple(knot) for knot in fine.counts.tolist()}
    assert knots.sharp.sum() == fine.sharp.sum()


def test_a_line_is_straight_and_a_swing_keeps_its_height() -> None:
    line = Path.line(Point(0.3, 0.9, 0.5), Point(1.1, 0.7, 0.9))
    points = MECHANISM.fk_many(to_joints(line.space, MECHANISM, line.pieces.at(np.linspace(0.0, 1.0, 50))))
    start, end = np.array(line.waypoints)
    assert np.cross(points - start, end - start) == pytest.approx(np.zeros((50, 3)), abs=1e-12)
    swing = Path.swing((0.1, 0.9, 0.5), (1.9, 1.6, 0.5))
    turned = MECHANISM.fk_many(to_joints(swing.space, MECHANISM, swing.pieces.at(np.linspace(0.0, 1.0, 50))))
    assert turned[:, 2] == pytest.approx(np.full(50, 0.5), abs=1e-12)
    angles = [atan2(x, y) for x, y, _ in turned]
    assert np.diff(angles) == pytest.approx(np.full(49, 1.8 / 49), abs=1e-12)
    assert [hypot(x, y) for x, y, _ in turned] == pytest.approx(np.linspace(0.9, 1.6, 50), abs=1e-12)
