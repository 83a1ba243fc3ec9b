"""Keep-out zones: what the gripper and the lines stay clear of, and the nearest point that is clear of all zones.

Lower bound of the least value of a convex function on a line: the tangents at two places bound it between them.

These must stay clear of a zone: the vertical segment from the gripper point up to the meeting point (length Φ) and,
unless the zone exempts them, the two lines from there to the anchors on the boom. Every zone is convex, so its signed
distance is convex along each of these straight pieces, and its least value there is found from below (`least`).

A signed distance changes by no more than the place does. So between two places of the robot a clearance changes by no
more than the way of the gripper or of an anchor, whichever is longer: `travel_bound`.

The nearest place that is clear of all zones is found by branch and bound over boxes of (α, u, h).

A box is discarded as soon as no place in it is reachable, or none is much nearer than the best place found. The first
follows from its middle, because the distances to the edge of the section and to the zones change by no more than the
place does. The second is the distance of the box itself, which is exact.

The nearer the best place, the fewer boxes remain. So the first search is accurate to a centimetre. From its result the
search slides along the obstacles. Then a second search is accurate to a millimetre, within a number of boxes that
bounds the time for which other tasks wait.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from math import atan2, cos, dist, hypot, inf, pi, sin, tau
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from maya_un.config.model import AnyZone, BoxConfig, CylinderConfig, HalfSpaceConfig
from maya_un.kinematics.mechanism import Floats, Mechanism
from maya_un.kinematics.section import Section
from maya_un.values import Joints, Point

_INWARD = 0.1


class Tangents(NamedTuple):
    """Values of functions and their slopes, each (m,)."""

    value: Floats
    slope: Floats


Probe = Callable[[NDArray[np.intp], Floats], Tangents]
"""Returns the tangents of the functions with these indices (k,) at these places (k,)."""


def least(probe: Probe, begin: Tangents, end: Tangents, enough: Floats, accuracy: float) -> Floats:
    """Return lower bounds (m,) for the least values of m convex functions on 0 ≤ t ≤ 1.

    `begin` and `end` are their tangents at 0 and 1. A bound is smaller than the least value by at most `accuracy`, and
    equal to it if the least value is at an end; a bound above `enough` (m,) is not refined further.

    Cuts alternate between the place where the slope would be 0 if it were linear, which is near for round functions,
    and the crossing of the tangents, which is exact for bent lines; the latter keeps off the ends, so that the interval
    always shrinks.
    """
    found = np.minimum(begin.value, end.value)
    rows = np.flatnonzero((begin.slope < 0.0) & (end.slope > 0.0))
    if not len(rows):
        return found
    # For every function: place, value and slope at the left of its least value, and at the right.
    zeros = np.zeros(len(rows))
    left = np.array([zeros, begin.value[rows], begin.slope[rows]])
    right = np.array([zeros + 1.0, end.value[rows], end.slope[rows]])
    straight = False
    while True:
        at, bound = _crossing(left, right)
        found[rows] = bound
        doubtful = (np.minimum(left[1], right[1]) - bound > accuracy) & (bound < enough[rows])
        if not doubtful.any():
            return found
        rows, at, left, right = rows[doubtful], at[doubtful], left[:, doubtful], right[:, doubtful]
        width = right[0] - left[0]
        if straight:
            at = np.clip(at, left[0] + _INWARD * width, right[0] - _INWARD * width)
        else:
            at = left[0] - width * left[2] / (right[2] - left[2])
        straight = not straight
        cut = np.array([at, *probe(rows, at)])
        falls = cut[2] < 0.0
        left, right = np.where(falls, cut, left), np.where(falls, right, cut)


def _crossing(left: Floats, right: Floats) -> tuple[Floats, Floats]:
    """Return where the tangents cross, and the value there."""
    rise = right[2] - left[2]
    ahead = (left[1] - right[1] + right[2] * (right[0] - left[0])) / rise
    return left[0] + ahead, left[1] + left[2] * ahead


MARGIN = 0.05
"""Default margin of a zone [m]: half the size of gripper and part."""

ACCURACY = 1e-7
"""A clearance is never larger than the true one, and at most this much smaller [m]."""

_FIRST, _LAST = np.array([0, 1, 1]), np.array([1, 2, 3])


class Zone(ABC):
    """A convex region to stay out of, identified by its `name`.

    A `margin` [m] around it stays clear too. With `lines` the two lines stay out too, not only the gripper.
    """

    __slots__ = ()

    name: str
    margin: float
    lines: bool

    @abstractmethod
    def field(self, places: Floats) -> tuple[Floats, Floats]:
        """Return signed distances [m], negative inside, and their gradients.

        `places` are x, y, z [m], shape (3, ...); distances have shape (...), gradients (3, ...). On an edge of the
        distance any slope that bounds it from below counts as its gradient.
        """

    def clearance(self, mechanism: Mechanism, joints: Joints) -> float:
        """Return the clearance of the robot at `joints` beyond the margin [m]; negative inside the margin.

        It is exact to `ACCURACY`, and never too large. Inside the zone it is the negative depth.
        """
        return float(self.clearances(mechanism, np.array([joints]))[0])

    def clearances(self, mechanism: Mechanism, joints: Floats) -> Floats:
        """Return `clearance` for joints of shape (n, 3), shape (n,)."""
        return self.clearances_between(corners(mechanism, joints))

    def clearances_between(self, ends: Floats, enough: float = inf) -> Floats:
        """Return `clearance`, shape (n,), for the pieces between the places that `corners` returns.

        A clearance above `enough` [m] may be less accurate, though not below `enough`; this is faster.
        """
        ends = ends if self.lines else ends[:, :2]
        pieces = len(ends[0]) - 1
        first, last = _FIRST[:pieces], _LAST[:pieces]
        distances, gradients = self.field(ends)
        starts = ends[:, first].reshape(3, -1)
        ways = (ends[:, last] - ends[:, first]).reshape(3, -1)

        def tangents(piece: NDArray[np.intp]) -> Tangents:
            along = (gradients[:, piece].reshape(3, -1) * ways).sum(axis=0)
            return Tangents(distances[piece].ravel(), along)

        def probe(rows: NDArray[np.intp], shares: Floats) -> Tangents:
            distance, gradient = self.field(starts[:, rows] + shares * ways[:, rows])
            return Tangents(distance, (gradient * ways[:, rows]).sum(axis=0))

        known = np.tile(np.minimum(distances.min(axis=0), enough + self.margin), pieces)
        found = least(probe, tangents(first), tangents(last), known, ACCURACY)
        return found.reshape(pieces, -1).min(axis=0) - self.margin


@dataclass(frozen=True, slots=True)
class Box(Zone):
    """A box between its corners `low` and `high`, the edges along x, y and z [m]."""

    name: str
    low: Point
    high: Point
    margin: float = MARGIN
    lines: bool = True

    def field(self, places: Floats) -> tuple[Floats, Floats]:
        """Return signed distances [m] and gradients (see `Zone.field`)."""
        low, high = (np.array(corner).reshape(3, *[1] * (places.ndim - 1)) for corner in (self.low, self.high))
        away = places - 0.5 * (low + high)
        distances, shares = _joined(np.abs(away) - 0.5 * (high - low))
        return distances, shares * np.sign(away)


@dataclass(frozen=True, slots=True)
class Cylinder(Zone):
    """A vertical cylinder about the axis through `x`, `y`, of `radius`, between the heights `low` and `high` [m]."""

    name: str
    x: float
    y: float
    radius: float
    low: float
    high: float
    margin: float = MARGIN
    lines: bool = True

    def field(self, places: Floats) -> tuple[Floats, Floats]:
        """Return signed distances [m] and gradients (see `Zone.field`)."""
        x, y, z = places
        x, y, z = x - self.x, y - self.y, z - 0.5 * (self.low + self.high)
        radial = np.hypot(x, y)
        beyond = np.array([radial - self.radius, np.abs(z) - 0.5 * (self.high - self.low)])
        distances, (outward, upward) = _joined(beyond)
        away = np.where(radial > 0.0, radial, 1.0)
        return distances, np.array([outward * (x / away), outward * (y / away), upward * np.sign(z)])


@dataclass(frozen=True, slots=True)
class HalfSpace(Zone):
    """All of one side of a plane through `point` [m]; `normal` points out of the forbidden side, at any length."""

    name: str
    point: Point
    normal: Point
    margin: float = MARGIN
    lines: bool = False

    def field(self, places: Floats) -> tuple[Floats, Floats]:
        """Return signed distances [m] and gradients (see `Zone.field`)."""
        column = (3, *[1] * (places.ndim - 1))
        unit = (np.array(self.normal) / hypot(*self.normal)).reshape(column)
        distances = ((places - np.array(self.point).reshape(column)) * unit).sum(axis=0)
        return distances, np.broadcast_to(unit, places.shape)


def zone_of(config: AnyZone) -> Zone:
    """Return the zone of a configuration."""
    match config:
        case BoxConfig():
            return Box(config.name, Point(*config.low), Point(*config.high), config.margin, config.lines)
        case CylinderConfig():
            axis = config.x, config.y
            return Cylinder(config.name, *axis, config.radius, config.low, config.high, config.margin, config.lines)
        case HalfSpaceConfig():
            return HalfSpace(config.name, Point(*config.point), Point(*config.normal), config.margin, config.lines)


def written(zone: Zone) -> AnyZone:
    """Return the configuration of a zone; the inverse of `zone_of`."""
    kind: type[AnyZone]
    match zone:
        case Box():
            kind, own = BoxConfig, {"kind": "box", "low": tuple(zone.low), "high": tuple(zone.high)}
        case Cylinder():
            place = {key: getattr(zone, key) for key in ("x", "y", "radius", "low", "high")}
            kind, own = CylinderConfig, {"kind": "cylinder", **place}
        case HalfSpace():
            kind = HalfSpaceConfig
            own = {"kind": "half_space", "point": tuple(zone.point), "normal": tuple(zone.normal)}
        case _:
            raise TypeError(f"{type(zone).__name__} is no kind of zone that can be written")
    return kind.model_validate({"name": zone.name, "margin": zone.margin, "lines": zone.lines, **own})


def _joined(beyond: Floats) -> tuple[Floats, Floats]:
    """Return the distance (...) to a product of intervals, and its change with each of `beyond` (k, ...).

    `beyond` is the distance of a place outside of each interval, negative inside. Outside of the product the distance
    is the norm of the positive values, inside it is the way to the nearest face.
    """
    outside = np.maximum(beyond, 0.0)
    length = np.sqrt((outside * outside).sum(axis=0))
    deepest = beyond.max(axis=0)
    is_out = deepest > 0.0
    face = (beyond == deepest).astype(np.float64)
    face /= face.sum(axis=0)
    return np.where(is_out, length, deepest), np.where(is_out, outside / np.where(is_out, length, 1.0), face)


def corners(mechanism: Mechanism, joints: Floats) -> Floats:
    """Return gripper point, meeting point, inner and outer anchor [m] of joints (n, 3), shape (3, 4, n).

    If the lines cannot meet, the meeting point is at the height of the anchors.
    """
    a, b, c = joints.T
    W = mechanism.width
    u = 0.5 * W + (b - c) * (b + c) / (2.0 * W)
    return corners_at(mechanism, a, u, np.sqrt(np.maximum((b - u) * (b + u), 0.0)))


def corners_at(mechanism: Mechanism, a: Floats, u: Floats, h: Floats) -> Floats:
    """Return `corners` for the boom's angles [rad] and places (u, h) of the section [m], each (n,)."""
    out = np.empty((3, 4, len(a)))
    radial = np.array([mechanism.delta + u, np.full_like(u, mechanism.delta), np.full_like(u, mechanism.length)])
    radial = radial[[0, 0, 1, 2]]
    np.multiply(radial, np.sin(a), out=out[0])
    np.multiply(radial, np.cos(a), out=out[1])
    out[2] = mechanism.height
    out[2, :2] -= h
    out[2, 0] -= mechanism.drop
    return out


def clearances(zones: Sequence[Zone], mechanism: Mechanism, joints: Floats, enough: float = inf) -> Floats:
    """Return the clearance of every zone [m] at joints of shape (n, 3), shape (n, number of zones).

    Those above `enough` [m] are rough, though truly above it (see `Zone.clearances_between`).
    """
    return clearances_between(zones, corners(mechanism, joints), enough)


def clearances_between(zones: Sequence[Zone], ends: Floats, enough: float = inf) -> Floats:
    """Return `clearances` for the pieces between the places that `corners` returns."""
    found = np.empty((ends.shape[2], len(zones)))
    for column, zone in enumerate(zones):
        found[:, column] = zone.clearances_between(ends, enough)
    return found


def travel_bound(mechanism: Mechanism, start: Joints, end: Joints) -> float:
    """Return an upper bound of the way [m] of gripper, lines and anchors along the chord between two joints.

    See `travel_bounds`.
    """
    return float(travel_bounds(mechanism, np.array([start]), np.array([end]))[0])


def travel_bounds(mechanism: Mechanism, starts: Floats, ends: Floats) -> Floats:
    """Return upper bounds of the travel of gripper, lines and anchors along chords, which are straight in joints [m].

    `starts` and `ends` have shape (n, 3), the result (n,). The bound holds for the length of the way, and in proportion
    for any share of a chord. It is infinite if the lines might be straight on the way.

    With t from 0 to 1 along the chord, b² and u are quadratic and h² = b² − u² is of fourth degree. In Bernstein's form
    the coefficients bound a polynomial, their differences its slope: u' and (h²)' from above, h from below, so h' =
    (h²)'/2h and the speed √(u'² + h'² + (d α')²) of gripper and meeting point. The outer anchor has D α'.
    """
    W = mechanism.width
    (turn, b, c), (turn_end, b_end, c_end) = starts.T, ends.T
    square_b = np.array([b * b, b * b_end, b_end * b_end])
    u = 0.5 * W + (square_b - np.array([c * c, c * c_end, c_end * c_end])) / (2.0 * W)
    depth = _fourth_degree(square_b) - _squared(u)
    shallowest = np.sqrt(np.maximum(depth.min(axis=0), 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        sinking = 2.0 * np.abs(np.diff(depth, axis=0)).max(axis=0) / shallowest
    sinking = np.where(shallowest > 0.0, sinking, np.inf)
    outward = 2.0 * np.abs(np.diff(u, axis=0)).max(axis=0)
    turning = np.abs(turn_end - turn)
    sideways = turning * np.abs(mechanism.delta + u).max(axis=0)
    gripper = np.sqrt(sinking * sinking + outward * outward + sideways * sideways)
    return np.maximum(gripper, turning * mechanism.length)


def _fourth_degree(quadratic: Floats) -> Floats:
    """Return Bernstein coefficients (5, n) of a polynomial whose quadratic ones are given (3, n)."""
    first, middle, last = quadratic
    return np.array([first, 0.5 * (first + middle), (first + 4.0 * middle + last) / 6.0, 0.5 * (middle + last), last])


def _squared(quadratic: Floats) -> Floats:
    """Return Bernstein coefficients (5, n) of the square of a polynomial with quadratic ones (3, n)."""
    first, middle, last = quadratic
    inner = (first * last + 2.0 * middle * middle) / 3.0
    return np.array([first * first, first * middle, inner, middle * last, last * last])


EXACTNESS = 1e-3
"""Tolerance of the search [m], in addition to the distance from zones for the rounding to counts."""

_COARSE = 0.01

_SLIDES = 30
"""Most steps of sliding; each is the best of many trials."""

_LEAST_GAIN = 1e-7
"""Sliding ends when a step gains no more than this [m]."""

_AT_ONCE = 1024

_MOST = 12_000
"""Most boxes of one search: some 30 ms, during which no other task runs."""

_SIDES = np.array(list(product((-1.0, 1.0), repeat=3)))


def _moves() -> Floats:
    """Return steps in three directions, of which the third is away from the target, shape (n, 3) [m].

    They go sideways in all directions and a little towards the target, steeply or hardly at all, and straight towards
    it.
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
        """Return the place nearest to `target`, None if the zones leave none.

        It is nearest to `EXACTNESS`, mostly to a tenth of that. If zones leave many places that are almost as near, the
        search ends early. It may then miss a place that is nearer by a few millimetres, and gaps that are narrower than
        a centimetre.
        """
        place, distance = None, inf
        for exactness in (_COARSE, EXACTNESS):
            found = self._search(distance, exactness, target)
            if found is not None:
                place = self._slid(found, target)
                distance = dist(place, target)
        return place

    def _slid(self, place: Point, target: Point) -> Point:
        """Return a place that is nearer, by steps sideways and a little towards the target."""
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
        """Return which points (n, 3) [m] belong to the searched space, shape (n,)."""
        x, y, z = points.T
        middle = 0.5 * (self.boom[0] + self.boom[1])
        a = middle + (np.arctan2(x, y) - middle + pi) % tau - pi
        u, h = np.hypot(x, y) - self.mechanism.delta, self.mechanism.reach_down - z
        within = (self.boom[0] <= a) & (a <= self.boom[1])
        return within & (self._spare(np.stack([a, u, h], axis=1)) >= 0.0)

    def _search(self, best: float, exactness: float, target: Point) -> Point | None:
        """Return a place of the searched space that is nearer than `best` by more than `exactness` [m], or None.

        No other place is nearer than the returned one by more than `exactness`.
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
        """Return at most the distance of places (n, 3) from the edge of the reachable space [m]; negative outside.

        If the section alone gives less than `least`, zones are ignored.
        """
        a, u, h = places.T
        spare = self.section.spare(u, h)
        within = np.flatnonzero(spare >= least)
        corners = corners_at(self.mechanism, a[within], u[within], h[within])
        clear = clearances_between(self.zones, corners, self.clear).min(axis=1) - self.clear
        spare[within] = np.minimum(spare[within], clear)
        return spare

    def _radii(self, boxes: _SearchBoxes) -> Floats:
        """Return the greatest way of any point from the middle of a box to another place in it [m], shape (n,)."""
        turn, outward, down = boxes.halves.T
        sideways = turn * (self.mechanism.delta + boxes.middles[:, 1] + outward)
        gripper = np.sqrt(outward * outward + down * down + sideways * sideways)
        return np.maximum(gripper, turn * self.mechanism.length)

    def _point(self, a: float, u: float, h: float) -> Point:
        d = self.mechanism.delta + u
        return Point(d * sin(a), d * cos(a), self.mechanism.reach_down - h)
