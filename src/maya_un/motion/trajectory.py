"""A move as curves over time, for looking at, and how long and how far a stop on it takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from maya_un.kinematics import Floats, Mechanism
from maya_un.motion.move import CoordinatedMove


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Samples in order of time [s], (n,): joints (n, 3) [rad, m, m] and their velocities (n, 3) [rad/s, m/s, m/s]."""

    time: Floats
    joints: Floats
    velocity: Floats


@dataclass(frozen=True, slots=True)
class LongestStop:
    """The longest stop on a move: how much time [s] and how much way of the gripper [m] it takes."""

    time: float
    distance: float


def sample(move: CoordinatedMove, count: int) -> Trajectory:
    """Return `count` samples of a move, evenly in time, the first at its start and the last at its end."""
    time = np.linspace(0.0, move.duration, count)
    way, speed = _along(move, time)
    return _at(move, time, way, speed)


def stopping(move: CoordinatedMove, mechanism: Mechanism) -> LongestStop:
    """Return the longest stop on a move (Galil DMC-41x3, ST S: along the path at VD), looked at where the law changes.

    The way of the gripper is measured along the path.
    """
    times = np.array([piece.t for piece in move.profile.pieces])
    way, speed = _along(move, times)
    ahead = np.minimum(move.profile.length, way + speed * speed / (2.0 * move.vd))
    knots = np.concatenate(([0.0], move.ways))
    points = mechanism.fk_many(np.array(move.places) / np.array(move.units.per_unit))
    gone = np.concatenate(([0.0], np.cumsum(np.sqrt(np.sum(np.diff(points, axis=0) ** 2, axis=1)))))
    distances = np.interp(ahead, knots, gone) - np.interp(way, knots, gone)
    return LongestStop(float(np.max(speed)) / move.vd, float(np.max(distances)))


def _along(move: CoordinatedMove, time: Floats) -> tuple[Floats, Floats]:
    """Return way [counts] and speed [counts/s] at times of shape (n,)."""
    t, s, v, acceleration = np.array(move.profile.pieces).T
    piece = np.maximum(0, np.searchsorted(t, time, side="right") - 1)
    passed = time - t[piece]
    way = s[piece] + passed * (v[piece] + 0.5 * acceleration[piece] * passed)
    speed = np.maximum(0.0, v[piece] + acceleration[piece] * passed)
    over = time >= move.duration
    return np.where(over, move.profile.length, np.minimum(way, move.profile.length)), np.where(over, 0.0, speed)


def _at(move: CoordinatedMove, time: Floats, way: Floats, speed: Floats) -> Trajectory:
    ends = np.array(move.ways)
    places = np.array(move.places, dtype=np.float64)
    begins = np.concatenate(([0.0], ends[:-1]))
    segment = np.minimum(np.searchsorted(ends, way, side="right"), len(ends) - 1)
    directions = np.diff(places, axis=0) / (ends - begins)[:, np.newaxis]
    scale = np.array(move.units.per_unit)
    counts = places[segment] + directions[segment] * (way - begins[segment])[:, np.newaxis]
    return Trajectory(time, counts / scale, directions[segment] * speed[:, np.newaxis] / scale)
