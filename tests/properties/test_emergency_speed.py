"""Faults at random places of random paths, at the speed that is allowed there: no box leaves the emergency bounds."""

from __future__ import annotations

from itertools import pairwise
from math import cos, hypot, sin, sqrt
from random import Random

import numpy as np
import pytest
from numpy.typing import NDArray

from maya_un.config import Config, Units
from maya_un.errors import PathRefused, Unreachable
from maya_un.kinematics import Floats, Workspace, hanging, slack, tension
from maya_un.kinematics.zones import Box, HalfSpace
from maya_un.motion.emergency import CREEP, LATE, Emergency, emergency_speed
from maya_un.motion.proof import prove
from maya_un.values import Joints, Point
from tests.campaign import Campaign
from tests.strategies import WORKSPACE, configuration

CONFIG = Config()
EMERGENCY = Emergency.of(CONFIG)
PER_UNIT = np.array(Units.of(CONFIG).per_unit)
SLEW = np.array([axis.speed_counts for axis in (CONFIG.axes.a, CONFIG.axes.b, CONFIG.axes.c)], dtype=np.float64)
STOP = np.array([axis.stop_deceleration_counts for axis in (CONFIG.axes.a, CONFIG.axes.b, CONFIG.axes.c)])

LOW = Workspace.of(configuration(geometry={"height": 2.0}))
"""A lower frame: the table is within reach of the lines."""

ZONES = WORKSPACE.with_zones(
    [
        Box("crate", Point(0.6, 0.6, 0.0), Point(0.9, 0.9, 0.7), margin=0.02),
        HalfSpace("table", Point(0.0, 0.0, 0.35), Point(0.0, 0.0, 1.0), margin=0.02),
    ]
)


class Way:
    """A path as the controller drives it: lengths of the chords and speeds in counts, everything else in SI."""

    def __init__(self, workspace: Workspace, joints: Floats) -> None:
        steps = np.diff(joints, axis=0) * PER_UNIT
        lengths = np.sqrt((steps * steps).sum(axis=1))
        units = steps / lengths[:, np.newaxis]
        shares = np.maximum(np.abs(units), 1e-9)
        self.joints = joints
        self.ends = np.concatenate(([0.0], np.cumsum(lengths)))
        self.directions = units / PER_UNIT
        self.braking = float((STOP / shares).min())
        self.slew = (SLEW / shares).min(axis=1)
        self.speeds = emergency_speed(workspace, EMERGENCY, joints, self.directions.T, self.braking, self.slew)

    def at(self, way: Floats) -> Floats:
        """Return the joints (n, 3) so far on the way (n,)."""
        return np.stack([np.interp(way, self.ends, column) for column in self.joints.T], axis=1)

    def speed(self, chord: int) -> float:
        """Return the greatest speed on a chord [counts/s]."""
        return float(min(self.slew[chord], self.speeds[chord]))

    def crawls(self, chord: int) -> bool:
        """Whether a chord is gone at the creep that is left where nothing is safe."""
        arms = np.array((WORKSPACE.mechanism.length, 1.0, 1.0))
        alone = self.directions[chord] ** 2 / (2.0 * np.array(EMERGENCY.rates))
        along = np.abs(self.directions).max(axis=0) / (2.0 * self.braking)
        return self.speeds[chord] ** 2 * float((np.maximum(alone, along) * arms).max()) <= 1.0001 * CREEP

    def faults(self, chord: int, rng: np.random.Generator, count: int) -> Floats:
        """Return where faults on a chord may leave the axes: each braked by itself, or one dead and the others on."""
        begin = rng.uniform(self.ends[chord], self.ends[chord + 1], count)
        here, speed = self.at(begin), self.speed(chord)
        velocity = speed * self.directions[chord]
        ways = velocity * LATE + velocity * np.abs(velocity) / (2.0 * np.array(EMERGENCY.rates))
        alone = here + rng.integers(0, 2, (count, 3)) * ways
        braked = self.at(np.minimum(begin + self._braked(chord, begin, speed, rng), self.ends[-1]))
        dead: NDArray[np.bool_] = np.arange(3) == rng.integers(0, 3, count)[:, np.newaxis]
        return np.concatenate((alone, np.where(dead, here, braked)))

    def _braked(self, chord: int, begin: Floats, speed: float, rng: np.random.Generator) -> Floats:
        """Return shares of the way of braking, which ends at a sharp corner: there the path is at rest anyway."""
        way = rng.uniform(0.0, 1.0, len(begin)) * (speed * LATE + speed * speed / (2.0 * self.braking))
        units = self.directions * PER_UNIT
        turns = np.flatnonzero(np.abs(np.diff(units[chord:], axis=0)).max(axis=1) > 0.2)
        return np.minimum(way, self.ends[chord + turns[0] + 1] - begin) if len(turns) else way


def random_path(workspace: Workspace, rng: Random) -> Floats:
    """Return the knots of one or two legs near the ceiling, the table or zones, straight in space or in the joints."""
    low, high = {WORKSPACE: (1.9, 2.065), LOW: (0.0, 0.05), ZONES: (0.38, 0.8)}[workspace]
    ends: list[Point] = []
    for _ in range(rng.choice((2, 2, 3))):
        a, d = rng.uniform(0.0, 2.0), rng.uniform(0.45, 2.15)
        ends.append(Point(d * sin(a), d * cos(a), rng.uniform(low, high)))
    count = rng.choice((2, 20, 60))
    straight = rng.random() < 0.7
    legs = [workspace.mechanism.ik_many(np.linspace(one, two, count)) for one, two in pairwise(ends)]
    legs = [leg if straight else np.linspace(leg[0], leg[-1], count) for leg in legs]
    return np.concatenate([legs[0], *(leg[1:] for leg in legs[1:])])


def assert_bounds_kept(workspace: Workspace, places: Floats) -> None:
    """Check where a fault may end, from what hangs there."""
    W, deepest = workspace.mechanism.width, workspace.mechanism.reach_down
    for _, b, c in places.tolist():
        assert b + c > W
        u, h = hanging(b, c, W)
        assert h <= deepest + 1e-3
        assert max(tension(u, h, W)) <= EMERGENCY.tension * (1.0 + 1e-9)
        assert max(slack(b, c, W)) <= EMERGENCY.slack
    for zone in workspace.zones:
        taut = np.array([place for place in places if max(slack(place[1], place[2], W)) == 0.0]).reshape(-1, 3)
        assert (zone.clearances(workspace.mechanism, taut) >= -zone.margin - 1e-9).all()


@pytest.mark.parametrize("workspace", [WORKSPACE, LOW, ZONES], ids=["alone", "low", "zones"])
def test_no_fault_leaves_the_emergency_bounds(workspace: Workspace, campaign: Campaign) -> None:
    rng = campaign.rng()
    paths = slowed = 0
    for number in range(campaign.size(ci=80, long=2000)):
        joints = random_path(workspace, rng)
        try:
            prove(workspace, joints)
        except (PathRefused, Unreachable):
            continue
        way, draws = Way(workspace, joints), np.random.default_rng(number)
        paths += 1
        slowed += bool(np.isfinite(way.speeds).any())
        for chord in rng.sample(range(len(joints) - 1), min(8, len(joints) - 1)):
            if not way.crawls(chord):
                assert_bounds_kept(workspace, way.faults(chord, draws, 60))
    assert 0 < slowed < paths


def test_speed_is_no_smaller_than_needed_when_lines_move_alone(campaign: Campaign) -> None:
    rng, rates = campaign.rng(), np.array(EMERGENCY.rates)
    W = WORKSPACE.mechanism.width
    for _ in range(campaign.size(ci=100, long=2000)):
        u, pull = rng.uniform(0.3, 1.7), rng.uniform(3.0, 4.9)
        longer = max(u, W - u)
        h = u * (W - u) / sqrt((pull * W) ** 2 - longer * longer)
        place = Joints(0.5, hypot(u, h), hypot(W - u, h))
        direction = rng.choice([(0.0, -1.0, 0.0), (0.0, 0.0, -1.0), (0.0, -0.7, -0.7), (0.0, -0.7, 0.7)])
        knots = np.array([place, np.array(place) + 1e-7 * np.array(direction)])
        ways = np.array([direction]).T
        found = emergency_speed(WORKSPACE, EMERGENCY, knots, ways, np.inf, np.full(1, 0.1))[0]
        # A little faster, and the box' corner of shortest lines lies beyond the bound.
        speed = np.maximum(-1.02 * found * np.array(direction), 0.0)
        way = speed * LATE + speed * speed / (2.0 * rates)
        assert max(tension(*hanging(place.b - way[1], place.c - way[2], W), W)) > EMERGENCY.tension
