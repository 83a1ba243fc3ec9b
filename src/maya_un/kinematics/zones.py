"""Keep-out zones: what the gripper, and as a rule the lines, must stay clear of.

These must stay clear: the vertical segment from the gripper point up to the meeting point (length Φ) and, where a
zone says so, the two lines from there to the anchors on the boom. Every zone is convex, so its signed distance is
convex along each of these straight pieces, and its least value there is found from below (`kinematics.convex`).

A signed distance changes by no more than the place does. So between two places of the robot a clearance changes by
no more than the way of the gripper or of an anchor, whichever is longer: `travel_bound`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, inf

import numpy as np
from numpy.typing import NDArray

from maya_un.config.model import AnyZone, BoxConfig, CylinderConfig, HalfSpaceConfig
from maya_un.kinematics.convex import Tangents, least
from maya_un.kinematics.mechanism import Floats, Mechanism
from maya_un.values import Joints, Point

MARGIN = 0.05
"""Default margin of a zone [m]: half the size of gripper and part."""

ACCURACY = 1e-7
"""A clearance is never larger than the true one, and at most this much smaller [m]."""

_FIRST, _LAST = np.array([0, 1, 1]), np.array([1, 2, 3])


class Zone(ABC):
    """A convex region to stay out of, known by its `name`.

    `margin` [m] is kept clear around it. With `lines` the two lines stay out too, not only the gripper.
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
        """Return how far the robot at `joints` is from using up the margin [m]; negative where it does.

        It is exact to `ACCURACY`, and never too large. Inside the zone it tells how deep.
        """
        return float(self.clearances(mechanism, np.array([joints]))[0])

    def clearances(self, mechanism: Mechanism, joints: Floats) -> Floats:
        """Return `clearance` for joints of shape (n, 3), shape (n,)."""
        return self.clearances_between(corners(mechanism, joints))

    def clearances_between(self, ends: Floats, enough: float = inf) -> Floats:
        """Return `clearance`, shape (n,), for what hangs between the places that `corners` gives.

        One above `enough` [m] may be smaller than `ACCURACY` says, though not below `enough`; this is faster.
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
    """Return the zone that is written so."""
    match config:
        case BoxConfig():
            return Box(config.name, Point(*config.low), Point(*config.high), config.margin, config.lines)
        case CylinderConfig():
            axis = config.x, config.y
            return Cylinder(config.name, *axis, config.radius, config.low, config.high, config.margin, config.lines)
        case HalfSpaceConfig():
            return HalfSpace(config.name, Point(*config.point), Point(*config.normal), config.margin, config.lines)


def written(zone: Zone) -> AnyZone:
    """Return how a zone is written; `zone_of` undoes it."""
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

    `beyond` is by how much a place is outside of each interval, negative inside. Outside of the product the
    distance is the length of what is beyond, inside it is the way to the nearest face.
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
    """Return `clearances` for what hangs between the places that `corners` gives."""
    found = np.empty((ends.shape[2], len(zones)))
    for column, zone in enumerate(zones):
        found[:, column] = zone.clearances_between(ends, enough)
    return found


def travel_bound(mechanism: Mechanism, start: Joints, end: Joints) -> float:
    """Return a bound of the way [m] of gripper, lines and anchors along the chord between two joints.

    See `travel_bounds`.
    """
    return float(travel_bounds(mechanism, np.array([start]), np.array([end]))[0])


def travel_bounds(mechanism: Mechanism, starts: Floats, ends: Floats) -> Floats:
    """Return how far no place of gripper, lines or anchors travels along chords, which are straight in joints [m].

    `starts` and `ends` have shape (n, 3), the answer (n,). The bound holds for the length of the way, and for any
    share of a chord this share of it. It is infinite where the lines might be straight on the way.

    With t from 0 to 1 along the chord, b² and u are quadratic and h² = b² − u² is of fourth degree. In Bernstein's
    form the coefficients bound a polynomial, their differences its slope: u' and (h²)' from above, h from below, so
    h' = (h²)'/2h and the speed √(u'² + h'² + (d α')²) of gripper and meeting point. The outer anchor has D α'.
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
