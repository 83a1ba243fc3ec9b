"""The proof that every point of a path is in the workspace and outside all zones.

Along a chord, straight in (a, b, c), b and c are linear in t and u = (W² + b² − c²)/2W is quadratic, so every limit is
a polynomial condition on 0 ≤ t ≤ 1:

    strokes, boom, b + c ≥ W      degree 1: kept between the ends if kept at the ends
    u ≥ 0,  W − u ≥ 0             degree 2
    z ≥ 0                         (H − Φ)² − b² + u² ≥ 0, degree 4
    T_b ≤ k                       k²W²(b² − u²) − (W − u)²b² ≥ 0, degree 6
    T_c ≤ k                       k²W²(b² − u²) − u²c² ≥ 0, degree 6

A polynomial of degree 6 is determined by its values at seven places, and its Bernstein coefficients are these values
times a constant matrix. On [0, 1] it lies between the least and the greatest coefficient, the first and the last are
its values at the ends, and constant matrices give the coefficients of its two halves (de Casteljau).

A clearance changes by no more than gripper, lines and anchors travel. So on a chord whose ends have the clearances c₀
and c₁, and on which nothing travels further than L, it is nowhere less than (c₀ + c₁ − L)/2. Chords on which this does
not suffice are halved.

Safe ends do not make a path safe: between them the lines can become too straight, hang slack, or let the gripper down
to the table. Between two knots the controller drives straight in (a, b, c). Every condition along such a chord is
proved, not sampled: the limits of the machine by the polynomials, zones by their clearances.

Coordinated motion keeps the axes on this path at every speed, and a coordinated stop decelerates along it. A stop at
any time therefore stays on the same chords: the proof for the path holds for every stop on it. `emergency` bounds the
effects of a fault beside the path.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from math import comb
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dmc41x3.i18n import phrase
from maya_un.errors import PathRefused
from maya_un.kinematics.mechanism import Floats, Mechanism
from maya_un.kinematics.workspace import TOLERANCE, Workspace
from maya_un.kinematics.zones import Zone, clearances, travel_bounds
from maya_un.values import Joints

ROUNDING = 1e-11
"""Rounding of the coefficients, relative to the size of their terms."""

_DEGREE = 6
_DEEPEST = 30


def _basis(shares: Floats) -> Floats:
    """Return the Bernstein polynomials of degree 6 at `shares` (n,), shape (n, 7)."""
    columns = [comb(_DEGREE, i) * shares**i * (1.0 - shares) ** (_DEGREE - i) for i in range(_DEGREE + 1)]
    return np.stack(columns, axis=1)


_SHARES = np.arange(_DEGREE + 1.0) / _DEGREE
_TO_COEFFICIENTS = np.linalg.inv(_basis(_SHARES))
_FIRST_HALF = _TO_COEFFICIENTS @ _basis(0.5 * _SHARES)
_SECOND_HALF = _TO_COEFFICIENTS @ _basis(0.5 + 0.5 * _SHARES)


def values(workspace: Workspace, b: Floats, c: Floats) -> Floats:
    """Return the five conditions that the ends of a chord do not determine, at lengths of shape s: shape (5, *s).

    They are u, W − u, z, T_b and T_c, as in the module's docstring, each divided by the size of its terms. A condition
    is kept where it is at least 0.
    """
    W, deepest = workspace.mechanism.width, workspace.mechanism.reach_down
    out = np.empty((len(b), 5, *b.shape[1:])).swapaxes(0, 1)  # memory order with places first suits `coefficients`
    bb, cc = b * b, c * c
    u = (bb - cc) * (0.5 / (W * W)) + 0.5  # from here on all lengths are shares of W
    rest = 1.0 - u
    bb *= 1.0 / (W * W)
    cc *= 1.0 / (W * W)
    uu = u * u
    hh = bb - uu
    out[0], out[1] = u, rest
    np.subtract(1.0, hh * (W * W / (deepest * deepest)), out=out[2])
    strength = workspace.tension_limit**-2
    rest *= rest
    rest *= strength
    rest *= bb
    np.subtract(hh, rest, out=out[3])
    uu *= strength
    uu *= cc
    np.subtract(hh, uu, out=out[4])
    return out


def along(workspace: Workspace, joints: Floats) -> Floats:
    """Return the Bernstein coefficients of the conditions along the chords between knots (n, 3): (7, 5, n − 1)."""
    lines = np.array(joints[:, 1:].T, order="C")
    return coefficients(values(workspace, *places(lines[:, :-1], lines[:, 1:])))


def places(starts: Floats, ends: Floats) -> Floats:
    """Return seven places (k, 7, n) on chords from `starts` to `ends` (k, n); values there determine a polynomial."""
    return starts[:, np.newaxis] + _SHARES[:, np.newaxis] * (ends - starts)[:, np.newaxis]


def coefficients(sampled: Floats) -> Floats:
    """Return the Bernstein coefficients (7, k, n) of polynomials from their values at seven places (k, 7, n)."""
    known = sampled.swapaxes(0, 1)
    found = (_TO_COEFFICIENTS @ known.reshape(_DEGREE + 1, -1)).reshape(known.shape)
    # The matrix changes the ends by rounding, which must not matter for a position at rest at a limit.
    found[0], found[-1] = known[0], known[-1]
    return found


def falling(coefficients: Floats) -> list[int]:
    """Return the indices of the chords on which a condition is broken further than at both ends, in order.

    `coefficients` has shape (7, k, n). If thirty halvings prove neither, the chord counts as broken.
    """
    allowed = np.minimum(0.0, np.minimum(coefficients[0], coefficients[-1])) - ROUNDING
    return np.flatnonzero(dips(coefficients - allowed, _DEEPEST)).tolist()


def dips(coefficients: Floats, halvings: int) -> NDArray[np.bool_]:
    """Return the chords (n,) on which `halvings` halvings do not prove all conditions (7, k, n) to be at least 0."""
    chords = coefficients.shape[-1]
    found = np.zeros(chords, dtype=np.bool_)
    columns = np.flatnonzero(coefficients.min(axis=0) < 0.0)
    if not len(columns):
        return found
    pieces, owners = coefficients.reshape(_DEGREE + 1, -1)[:, columns], columns % chords
    for _ in range(halvings):
        found[owners[(pieces[0] < 0.0) | (pieces[-1] < 0.0)]] = True
        doubtful = (pieces.min(axis=0) < 0.0) & ~found[owners]
        if not doubtful.any():
            return found
        pieces, owners = pieces[:, doubtful], owners[doubtful]
        pieces = np.concatenate((_FIRST_HALF @ pieces, _SECOND_HALF @ pieces), axis=1)
        owners = np.concatenate((owners, owners))
    found[owners[pieces.min(axis=0) < 0.0]] = True
    return found


_SMALLEST = 1e-5
"""A doubtful piece of a chord on which nothing travels further than this [m] counts as too near."""

_LARGEST = 0.05
_MOST = 64
"""Chords on which a point travels further than `_LARGEST` [m] are first divided, into at most this number of parts."""


class ChordPlace(NamedTuple):
    """A place on a path: `share` (0 to 1) of the chord with this index."""

    chord: int
    share: float


class ZoneEntry(NamedTuple):
    """A place at which a path comes too near to a zone."""

    zone: Zone
    place: ChordPlace


def first_entry(workspace: Workspace, joints: Floats) -> ZoneEntry | None:
    """Return a place where the chords between knots (n, 3) come too near to a zone, None if that is excluded.

    The tolerance is the size of an encoder count (`Workspace.zone_grain`). On the chords the lines must not be
    straight.
    """
    travelled = travel_bounds(workspace.mechanism, joints[:-1], joints[1:])
    if travelled.max() <= _LARGEST:
        return _first_entry(workspace, joints, travelled)
    parts = np.clip(np.ceil(travelled / _LARGEST), 1, _MOST).astype(np.intp)
    chords = np.repeat(np.arange(len(parts)), parts)
    shares = (np.arange(len(chords)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[chords]
    finer = joints[chords] + shares[:, np.newaxis] * (joints[chords + 1] - joints[chords])
    finer = np.concatenate((finer, joints[-1:]))
    entry = _first_entry(workspace, finer, travel_bounds(workspace.mechanism, finer[:-1], finer[1:]))
    if entry is None:
        return None
    part, share = entry.place
    return ZoneEntry(entry.zone, ChordPlace(int(chords[part]), float(shares[part] + share / parts[chords[part]])))


def _first_entry(workspace: Workspace, joints: Floats, travelled: Floats) -> ZoneEntry | None:
    bound = -workspace.zone_grain
    clear = clearances(workspace.zones, workspace.mechanism, joints)
    doubtful = clear[:-1] + clear[1:] - travelled[:, np.newaxis] < 2.0 * bound
    for number in np.flatnonzero(doubtful.any(axis=0)).tolist():
        zone, chords = workspace.zones[number], np.flatnonzero(doubtful[:, number])
        place = _search(ZoneChords(workspace.mechanism, zone, joints), clear[:, number], chords, bound)
        if place is not None:
            return ZoneEntry(zone, place)
    return None


class ZoneChords(NamedTuple):
    """The chords between knots (n, 3), for one zone."""

    mechanism: Mechanism
    zone: Zone
    joints: Floats

    def at(self, chords: NDArray[np.intp], shares: Floats) -> Floats:
        """Return the joints (m, 3) at shares (m,) of chords (m,)."""
        starts = self.joints[chords]
        return starts + shares[:, np.newaxis] * (self.joints[chords + 1] - starts)

    def clear(self, chords: NDArray[np.intp], shares: Floats) -> Floats:
        """Return the clearances (m,) there [m]."""
        return self.zone.clearances(self.mechanism, self.at(chords, shares))

    def travelled(self, chords: NDArray[np.intp], begins: Floats, width: float) -> Floats:
        """Return bounds (m,) of the travel of any point on pieces that begin at `begins` and are `width` wide [m]."""
        return travel_bounds(self.mechanism, self.at(chords, begins), self.at(chords, begins + width))


def _search(every: ZoneChords, clear: Floats, chords: NDArray[np.intp], bound: float) -> ChordPlace | None:
    """Return a place on `chords` where the clearance is below `bound`, or None; `clear` (n,) is that of the knots.

    All pieces of a round have the same width, which halves for the next one.
    """
    begins, width = np.zeros(len(chords)), 1.0
    first, last = clear[chords], clear[chords + 1]
    while True:
        below = np.flatnonzero((first < bound) | (last < bound))
        if len(below):
            piece = int(below[0])
            return ChordPlace(int(chords[piece]), float(begins[piece] + (width if last[piece] < first[piece] else 0.0)))
        travelled = every.travelled(chords, begins, width)
        doubtful = first + last - travelled < 2.0 * bound
        chords, begins, travelled = chords[doubtful], begins[doubtful], travelled[doubtful]
        if not len(chords):
            return None
        width *= 0.5
        small = np.flatnonzero(travelled < _SMALLEST)
        if len(small):
            return ChordPlace(int(chords[small[0]]), float(begins[small[0]] + width))
        middle = every.clear(chords, begins + width)
        first, last = np.concatenate((first[doubtful], middle)), np.concatenate((middle, last[doubtful]))
        chords, begins = np.concatenate((chords, chords)), np.concatenate((begins, begins + width))


_SAMPLES = 64
_SURE = 1e-12
"""Conditions kept by this need no second check: it is far below `TOLERANCE`, far above rounding."""


def between(start: Joints, end: Joints, t: float) -> Joints:
    """Return the joints at share `t` (0 to 1) of the straight line from `start` to `end`."""
    a, b, c = start
    return Joints(a + (end.a - a) * t, b + (end.b - b) * t, c + (end.c - c) * t)


def prove(workspace: Workspace, joints: Floats, vias: Sequence[int] = ()) -> None:
    """Prove that every point of the chords between knots is in the workspace, or refuse the path.

    `joints` are the knots, shape (n, 3) [rad, m, m]; `vias` are the indices of the requested ones between the first and
    the last. Knots may lie outside by the size of an encoder count, because places on the edge are rounded to counts;
    between two of them no limit is broken further than at these two. Raises `Unreachable` for an end or a via outside,
    `PathRefused` for a way between valid points that leaves the workspace, or for a start that is outside already, or
    inside a zone. The details contain `at`, the joints where the path leaves the workspace, and `share`, the part of
    the path to `target` before it, in counts.
    """
    if len(joints) == 1:
        joints = np.concatenate((joints, joints))
    waypoints = [0, *vias, len(joints) - 1]
    _prove_limits(workspace, joints, waypoints)
    if workspace.zones:
        entry = first_entry(workspace, joints)
        if entry is not None:
            raise _kept_out(workspace, joints, waypoints, entry)


def _prove_limits(workspace: Workspace, joints: Floats, waypoints: list[int]) -> None:
    coefficients = along(workspace, joints)
    if _surely_inside(workspace, joints, coefficients):
        return
    _prove_knots(workspace, joints, coefficients, waypoints)
    broken = falling(coefficients)
    if broken:
        first, last = _leg(waypoints, broken[0])
        knots = joints[first : last + 1]
        raise _refusal(
            workspace,
            knots,
            _worst(workspace, knots),
            phrase("it comes so close to a limit that Maya cannot prove it safe"),
        )


def _surely_inside(workspace: Workspace, joints: Floats, coefficients: Floats) -> bool:
    """Return whether all limits are kept beyond doubt: for most paths a check of the least values suffices."""
    if not coefficients.min() >= -_SURE:
        return False
    least, most = joints.min(axis=0).tolist(), joints.max(axis=0).tolist()
    strokes = (workspace.boom, workspace.line_b, workspace.line_c)
    return all(
        stroke[0] - TOLERANCE <= low and high <= stroke[1] + TOLERANCE
        for low, high, stroke in zip(least, most, strokes, strict=True)
    )


def _prove_knots(workspace: Workspace, joints: Floats, coefficients: Floats, waypoints: list[int]) -> None:
    outside = _outside(workspace, joints, coefficients)
    for waypoint in waypoints[1:]:
        if waypoint in outside:
            workspace.require(_at(joints, waypoint))
    if 0 in outside:
        reason = phrase("it starts outside the workspace: {reason}", reason=workspace.why_not(_at(joints, 0)))
        raise PathRefused(target=_words(workspace, _at(joints, -1)), reason=reason)
    if outside:
        first, last = _leg(waypoints, min(outside) - 1)
        knots = joints[first : last + 1]
        raise _refusal(workspace, knots, _worst(workspace, knots), phrase("it leaves the workspace"))


def _outside(workspace: Workspace, joints: Floats, coefficients: Floats) -> set[int]:
    """Return the indices of the knots that break a limit by more than an encoder count, zones ignored."""
    low, high = np.array((workspace.boom, workspace.line_b, workspace.line_c)).T
    sure = ((joints >= low - TOLERANCE) & (joints <= high + TOLERANCE)).all(axis=1)
    sure[:-1] &= (coefficients[0] >= -_SURE).all(axis=0)
    sure[-1] &= bool((coefficients[-1, :, -1] >= -_SURE).all())
    doubtful = np.flatnonzero(~sure).tolist()
    bare = workspace.with_zones(())  # a path that is far outside has thousands of knots; zones are proved separately
    return {knot for knot in doubtful if not bare.holds_grain(_at(joints, knot))}


def _kept_out(workspace: Workspace, joints: Floats, waypoints: list[int], entry: ZoneEntry) -> PathRefused:
    """Return the error for a path that comes too near to a zone; raises `Unreachable` for a waypoint that does."""
    zone, place = entry
    inside = {at for at in waypoints if zone.clearance(workspace.mechanism, _at(joints, at)) < -workspace.zone_grain}
    if 0 in inside:
        reason = phrase("it starts too near to the zone {name}; remove the zone to leave it", name=zone.name)
        return PathRefused(target=_words(workspace, _at(joints, -1)), reason=reason)
    for waypoint in sorted(inside):
        workspace.require(_at(joints, waypoint))
    first, last = _leg(waypoints, place.chord)
    knots = joints[first : last + 1]
    deepest = _deepest(workspace, zone, knots)
    return _refusal(workspace, knots, deepest, phrase("it comes too near to the zone {name}", name=zone.name))


def _leg(waypoints: list[int], chord: int) -> tuple[int, int]:
    """Return the indices of the waypoints before and after a chord."""
    behind = bisect_right(waypoints, chord)
    return waypoints[behind - 1], waypoints[behind]


def _refusal(workspace: Workspace, knots: Floats, place: ChordPlace, otherwise: str) -> PathRefused:
    """Return the error for the way along `knots`, whose ends are valid.

    `otherwise` is the reason if no limit gives one.
    """
    at = between(_at(knots, place.chord), _at(knots, place.chord + 1), place.share)
    reason = workspace.why_not(at) or otherwise
    share = _gone(workspace, knots, place)
    return PathRefused(
        target=_words(workspace, _at(knots, -1)),
        reason=phrase("{share:.0%} of the way there {reason}", share=share, reason=reason),
        at=tuple(at),
        share=share,
    )


def _deepest(workspace: Workspace, zone: Zone, knots: Floats) -> ChordPlace:
    """Return where the chords between knots come nearest to a zone, or deepest into it."""
    places = _sampled(knots)
    clear = zone.clearances(workspace.mechanism, places.reshape(-1, 3))
    return _place(clear.reshape(places.shape[:2]))


def _worst(workspace: Workspace, knots: Floats) -> ChordPlace:
    """Return where the chords between knots break a limit furthest beyond its value at the first and the last knot."""
    places = _sampled(knots)
    strokes = np.array((workspace.boom, workspace.line_b, workspace.line_c))
    inside = np.minimum(places - strokes[:, 0], strokes[:, 1] - places) / (strokes[:, 1] - strokes[:, 0])
    kept = np.concatenate((values(workspace, places[..., 1], places[..., 2]), np.moveaxis(inside, -1, 0)))
    ends = np.minimum(kept[:, 0, 0], kept[:, -1, -1])
    return _place((kept - np.minimum(0.0, ends)[:, np.newaxis, np.newaxis]).min(axis=0))


def _sampled(knots: Floats) -> Floats:
    """Return evenly spaced joints of every chord with its ends, shape (n − 1, samples, 3)."""
    shares = np.linspace(0.0, 1.0, _SAMPLES + 1)[:, np.newaxis]
    return knots[:-1, np.newaxis] + (knots[1:] - knots[:-1])[:, np.newaxis] * shares


def _place(sampled: Floats) -> ChordPlace:
    """Return where samples (chords, samples) are least."""
    chord, sample = np.unravel_index(int(np.argmin(sampled)), sampled.shape)
    return ChordPlace(int(chord), float(sample) / _SAMPLES)


def _gone(workspace: Workspace, knots: Floats, place: ChordPlace) -> float:
    """Return the share of the way along all chords before a place, in counts."""
    lengths = np.sqrt((((knots[1:] - knots[:-1]) / workspace.grain) ** 2).sum(axis=1))
    return float((lengths[: place.chord].sum() + place.share * lengths[place.chord]) / lengths.sum())


def _at(joints: Floats, knot: int) -> Joints:
    return Joints(*joints[knot].tolist())


def _words(workspace: Workspace, joints: Joints) -> str:
    x, y, z = workspace.mechanism.fk(joints)
    return f"({x:.4f}, {y:.4f}, {z:.4f}) m"
