"""Keep-out zones by brute force: distances of many points of the gripper and the lines to a solid.

The distance to a convex solid, negative inside it, is a convex function along a straight line. So the least of
many points brackets the least of all, and narrowing the bracket finds it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from math import hypot, sqrt

import numpy as np

from tests.judge.mechanism import Floats, Frame, from_cylinder, places

_COARSE = (3, 9)
"""Numbers of points of a segment to look at first; most segments are far off."""

_POINTS = 17
_ROUNDS = 32
_GOLDEN = (sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True, slots=True)
class Solid:
    """A zone: its shape, the required distance, and whether the lines have to keep it as well."""

    name: str
    margin: float
    lines: bool

    def distance(self, points: Floats) -> Floats:
        """Return how far points (n, 3) are outside, negative inside, shape (n,)."""
        raise NotImplementedError


@dataclass(frozen=True, slots=True)
class Block(Solid):
    """A box between two corners."""

    low: tuple[float, float, float]
    high: tuple[float, float, float]

    def distance(self, points: Floats) -> Floats:
        return _outside(*np.maximum(np.subtract(self.low, points), np.subtract(points, self.high)).T)


@dataclass(frozen=True, slots=True)
class Column(Solid):
    """An upright cylinder."""

    centre: tuple[float, float]
    radius: float
    bottom: float
    top: float

    def distance(self, points: Floats) -> Floats:
        x, y, z = points.T
        across = np.hypot(x - self.centre[0], y - self.centre[1]) - self.radius
        return _outside(across, np.maximum(self.bottom - z, z - self.top))


@dataclass(frozen=True, slots=True)
class Behind(Solid):
    """All that lies behind a plane: the side that `normal` (of any length) points away from."""

    point: tuple[float, float, float]
    normal: tuple[float, float, float]

    def distance(self, points: Floats) -> Floats:
        x, y, z = self.normal
        return np.asarray(np.subtract(points, self.point) @ np.asarray(self.normal) / hypot(x, y, z))


def _outside(*beyond: Floats) -> Floats:
    """Return the distance to a product of intervals, given how far each coordinate lies beyond its own."""
    outer = np.zeros_like(beyond[0])
    for one in beyond:
        outer = np.hypot(outer, np.maximum(one, 0.0))
    return outer + np.minimum(reduce(np.maximum, beyond), 0.0)


def segments(frame: Frame, joints: Floats, *, lines: bool) -> Iterator[tuple[Floats, Floats]]:
    """Yield the ends of the gripper's segment, and of the two lines, for joints (n, 3): arrays of (n, 3)."""
    gripper = places(frame, joints)
    meeting = gripper + np.array((0.0, 0.0, frame.gripper_height))
    yield gripper, meeting
    if lines:
        for radius in (frame.delta, frame.length):
            cylinder = np.column_stack((joints[:, 0], np.full(len(joints), radius), np.full(len(joints), frame.height)))
            yield meeting, from_cylinder(cylinder)


def clearances(frame: Frame, zone: Solid, joints: Floats, near: float = 0.0) -> Floats:
    """Return the distance to the zone less its margin, for joints (n, 3), shape (n,).

    It is exact where it is below `near`; elsewhere it is above `near`, and no greater than the distance.
    """
    least = np.full(len(joints), np.inf)
    for start, end in segments(frame, joints, lines=zone.lines):
        least = np.minimum(least, _closest(zone, start, end, zone.margin + near))
    return least - zone.margin


def _closest(zone: Solid, start: Floats, end: Floats, near: float) -> Floats:
    lengths = np.sqrt(((end - start) ** 2).sum(axis=1))
    found, doubt = np.empty(len(start)), np.arange(len(start))

    def look(count: int) -> Floats:
        """Return the distances of so many points of each doubtful segment; forget those that are certainly far off."""
        nonlocal doubt
        points = start[doubt] + np.linspace(0.0, 1.0, count)[:, None, None] * (end - start)[doubt]
        seen = zone.distance(points.reshape(-1, 3)).reshape(count, -1)
        found[doubt] = seen.min(axis=0) - 0.5 * lengths[doubt] / (count - 1)  # a point between may be so much nearer
        close = found[doubt] < near
        doubt = doubt[close]
        return seen[:, close]

    for count in _COARSE:
        look(count)
    seen = look(_POINTS)
    shares, at = np.linspace(0.0, 1.0, _POINTS), seen.argmin(axis=0)
    low, high = shares[np.maximum(at - 1, 0)], shares[np.minimum(at + 1, _POINTS - 1)]
    found[doubt] = np.minimum(seen.min(axis=0), _narrowed(zone, start[doubt], end[doubt], low, high))
    return found


def _narrowed(zone: Solid, start: Floats, end: Floats, low: Floats, high: Floats) -> Floats:
    """Return the least distance between two shares of each segment, by golden sections."""

    def distance(share: Floats) -> Floats:
        return zone.distance(start + share[:, None] * (end - start))

    left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_left, at_right = distance(left), distance(right)
    for _ in range(_ROUNDS):
        falls = at_left > at_right
        low, high = np.where(falls, left, low), np.where(falls, high, right)
        new = np.where(falls, low + _GOLDEN * (high - low), high - _GOLDEN * (high - low))
        at_new = distance(new)
        left, right = np.where(falls, right, new), np.where(falls, new, left)
        at_left, at_right = np.where(falls, at_right, at_new), np.where(falls, at_new, at_left)
    return distance(0.5 * (low + high))
