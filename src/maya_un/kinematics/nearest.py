"""The nearest place that is clear of all zones, by branch and bound over boxes of (α, u, h).

A box is given up as soon as nothing in it can be reached, or as nothing in it is much nearer than what has been found.
The first follows from its middle, because the distances to the edge of the section and to the zones change by no
more than the place does. The second is the distance of the box itself, which is exact.

The nearer what has been found already, the fewer boxes are left. So all is searched to a centimetre first, from the
place found there one slides along what is in the way, and then all is searched to a millimetre, as far as the number
of boxes allows that may be looked at while others wait.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import atan2, cos, dist, hypot, inf, pi, sin, tau
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from maya_un.kinematics.mechanism import Floats, Mechanism
from maya_un.kinematics.section import Section
from maya_un.kinematics.zones import Zone, clearances_between, corners_at
from maya_un.values import Point

EXACTNESS = 1e-3
"""Tolerance of the search [m], in addition to the distance from zones for the rounding to counts."""

_COARSE = 0.01

_SLIDES = 30
"""Most steps of sliding; each is the best of many."""

_LEAST_GAIN = 1e-7
"""Sliding ends where a step brings no more than this [m]."""

_AT_ONCE = 1024

_MOST = 12_000
"""Most boxes of one search: some 30 ms, in which nobody else is served."""

_SIDES = np.array(list(product((-1.0, 1.0), repeat=3)))


def _moves() -> Floats:
    """Return steps in three directions, of which the third is away from the target, shape (n, 3) [m].

    They go aside all around and a little towards the target, steeply or hardly at all, and straight towards it.
    """
    ring = np.linspace(0.0, tau, 12, endpoint=False)
    steep = (1.0, 0.3, 0.1, 0.03, 0.01)
    directions = [(cos(angle), sin(angle), -down) for angle in ring for down in steep]
    lengths = [10.0 ** (-0.5 * power) for power in range(4, 11)]
    steps = [[length * part for part in way] for length in lengths for way in (*directions, (0.0, 0.0, -1.0))]
    return np.array(steps)


_MOVES = _moves()


def _frame(away: Floats) -> Floats:
    """Return two directions across a vector (3,) and its own, as rows (3, 3)."""
    ahead = away / np.linalg.norm(away)
    across = np.cross(ahead, np.eye(3)[np.abs(ahead).argmin()])
    across /= np.linalg.norm(across)
    return np.array([across, np.cross(ahead, across), ahead], dtype=np.float64)


class _SearchBoxes(NamedTuple):
    """Boxes of (α, u, h) [rad, m, m]: their middles and half their edges, each (n, 3)."""

    middles: Floats
    halves: Floats

    def chosen(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> _SearchBoxes:
        return _SearchBoxes(self.middles[rows], self.halves[rows])

    def shrunk(self, factor: float) -> _SearchBoxes:
        return _SearchBoxes(self.middles, factor * self.halves)

    def joined(self, others: _SearchBoxes) -> _SearchBoxes:
        return _SearchBoxes(*(np.concatenate(pair) for pair in zip(self, others, strict=True)))

    def split(self) -> _SearchBoxes:
        """Return each box as eight of half its size."""
        quarters = 0.5 * self.halves
        inner = self.middles[:, None] + quarters[:, None] * _SIDES
        return _SearchBoxes(inner.reshape(-1, 3), np.repeat(quarters, 8, axis=0))


@dataclass(frozen=True, slots=True)
class Search:
    """The searched space: the range of the `boom` [rad] times the `section`, at least `clear` [m] off all `zones`."""

    mechanism: Mechanism
    boom: tuple[float, float]
    section: Section
    zones: Sequence[Zone]
    clear: float

    def nearest(self, target: Point) -> Point | None:
        """Return the place nearest to `target`, None where the zones leave none.

        It is nearest to `EXACTNESS`, mostly to a tenth of that. If zones leave many places that are almost as near, the
        search ends early. It may then overlook a place that is nearer by a few millimetres, and gaps that are narrower
        than a centimetre.
        """
        place, distance = None, inf
        for exactness in (_COARSE, EXACTNESS):
            found = self._search(distance, exactness, target)
            if found is not None:
                place = self._slid(found, target)
                distance = dist(place, target)
        return place

    def _slid(self, place: Point, target: Point) -> Point:
        """Return a place that is nearer, by steps aside and a little towards the target."""
        best = np.array(place)
        for _ in range(_SLIDES):
            away = best - np.array(target)
            trials = best + _MOVES @ _frame(away)
            trials = trials[self._reachable(trials)]
            distances = np.sqrt(((trials - np.array(target)) ** 2).sum(axis=1))
            if distances.min(initial=inf) > float(np.linalg.norm(away)) - _LEAST_GAIN:
                break
            best = trials[distances.argmin()]
        return Point(*map(float, best))

    def _reachable(self, points: Floats) -> NDArray[np.bool_]:
        """Return which points (n, 3) [m] are places to be searched, shape (n,)."""
        x, y, z = points.T
        middle = 0.5 * (self.boom[0] + self.boom[1])
        a = middle + (np.arctan2(x, y) - middle + pi) % tau - pi
        u, h = np.hypot(x, y) - self.mechanism.delta, self.mechanism.reach_down - z
        within = (self.boom[0] <= a) & (a <= self.boom[1])
        return within & (self._spare(np.stack([a, u, h], axis=1)) >= 0.0)

    def _search(self, best: float, exactness: float, target: Point) -> Point | None:
        """Return a place to be searched that is nearer than `best` by more than `exactness` [m], None for none.

        No other is nearer than that one by more than `exactness`.
        """
        boxes, found = self._everything(), None
        near = self._distances(boxes, target)
        seen = 0
        while len(near) and seen < _MOST:
            order = np.argsort(near)
            now, later = boxes.chosen(order[:_AT_ONCE]), boxes.chosen(order[_AT_ONCE:])
            seen += len(now.middles)
            radii = self._radii(now)
            spare = self._spare(now.middles, -radii)
            away = np.where(spare >= 0.0, self._distances(now.shrunk(0.0), target), inf)
            if away.min() < best:
                best, found = float(away.min()), now.middles[away.argmin()]
            inner = now.chosen(spare >= -radii).split()
            boxes = later.joined(inner)
            near = np.concatenate([near[order[_AT_ONCE:]], self._distances(inner, target)])
            worth = near < best - exactness
            boxes, near = boxes.chosen(worth), near[worth]
        return None if found is None else self._point(*map(float, found))

    def _everything(self) -> _SearchBoxes:
        """Return the box of all (α, u, h)."""
        low = np.array([[self.boom[0], 0.0, 0.0]])
        high = np.array([[self.boom[1], self.section.width, self.section.deepest]])
        return _SearchBoxes(0.5 * (low + high), 0.5 * (high - low))

    def _distances(self, boxes: _SearchBoxes, target: Point) -> Floats:
        """Return the distance [m] of `target` from each box, shape (n,)."""
        mechanism = self.mechanism
        middle_a, middle_u, middle_h = boxes.middles.T
        turn, outward, down = boxes.halves.T
        radius, bearing = hypot(target.x, target.y), atan2(target.x, target.y)
        turned = np.abs((middle_a - bearing + pi) % tau - pi)
        along = np.cos(np.maximum(turned - turn, 0.0)) * radius
        d = mechanism.delta + middle_u
        d = np.clip(along, d - outward, d + outward)
        higher = np.maximum(np.abs(mechanism.reach_down - target.z - middle_h) - down, 0.0)
        level = (d - along) ** 2 + (radius - along) * (radius + along)
        return np.sqrt(np.maximum(level, 0.0) + higher * higher)

    def _spare(self, places: Floats, least: Floats | float = 0.0) -> Floats:
        """Return how far places (n, 3) are from the edge of what can be reached [m], at most; negative outside.

        If that is below `least` for the section alone, zones are ignored.
        """
        a, u, h = places.T
        spare = self.section.spare(u, h)
        within = np.flatnonzero(spare >= least)
        corners = corners_at(self.mechanism, a[within], u[within], h[within])
        clear = clearances_between(self.zones, corners, self.clear).min(axis=1) - self.clear
        spare[within] = np.minimum(spare[within], clear)
        return spare

    def _radii(self, boxes: _SearchBoxes) -> Floats:
        """Return how far anything moves between the middle of a box and any other place in it [m], shape (n,)."""
        turn, outward, down = boxes.halves.T
        sideways = turn * (self.mechanism.delta + boxes.middles[:, 1] + outward)
        gripper = np.sqrt(outward * outward + down * down + sideways * sideways)
        return np.maximum(gripper, turn * self.mechanism.length)

    def _point(self, a: float, u: float, h: float) -> Point:
        d = self.mechanism.delta + u
        return Point(d * sin(a), d * cos(a), self.mechanism.reach_down - h)
