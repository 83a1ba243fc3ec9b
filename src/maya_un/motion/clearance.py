"""The closest approach of a path to every limit and zone, and the lowest and highest points of the gripper.

Straight in joints is not straight in space: between two places of equal height the gripper dips or rises. Strokes, the
range of the boom and b + c ≥ W are linear along a chord and least at a knot. The others are smooth on it: they are
sampled in a few places, and then more closely at the vertex of a parabola through three of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import ceil, copysign

import numpy as np

from maya_un.kinematics.mechanism import Floats, Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.motion.proof import ChordPlace, ZoneChords, between
from maya_un.values import Joints, MarginUnit, Point

_LOOKS = 64
_NEWTON = 4
_CLOSER = 4.0
_ROUNDS = 2
"""Rounds of parabolas."""
_NEAR = 5e-4
"""The clearance of a zone is at most this too large [m]."""
_PIECES = 100_000
"""The search ends at that many pieces. Only ways on which the lines might be straight have so many."""
_FLAT = 1e-7
"""Least bend of the lines [m], so that tensions stay finite."""

Kinds = Callable[[Floats], Floats]
"""Maps joints (..., 3) to the values of some kinds there (k, ...)."""


@dataclass(frozen=True, slots=True)
class ClosestApproach:
    """The closest approach of a path to a limit or a zone: the least `margin` [`unit`], and its `place`.

    `name` is that of the zone, or one of `LIMITS`; a margin is negative beyond the limit, or inside the margin of a
    zone.
    """

    name: str
    margin: float
    unit: MarginUnit
    place: ChordPlace
    zone: bool = False


LIMITS: dict[str, MarginUnit] = {
    "boom_start": "rad",
    "boom_end": "rad",
    "line_b_short": "m",
    "line_b_long": "m",
    "line_c_short": "m",
    "line_c_long": "m",
    "coupling": "m",
    "inner": "m",
    "outer": "m",
    "floor": "m",
    "tension_b": "load",
    "tension_c": "load",
}
"""The limits of the workspace and the units of their margins."""


def closest(workspace: Workspace, joints: Floats) -> tuple[ClosestApproach, ...]:
    """Return the closest approaches of chords to all limits, in the order of `LIMITS`, and to all zones.

    `joints` are the knots (n, 3) [rad, m, m] between which the chords run. Margins are exact to 1e-6, those of zones to
    `_NEAR`. They are for people: the proof of a path has its own bounds. Lines that cannot meet carry more than a
    million loads.
    """
    joints = _two_at_least(joints)
    curved = _least(lambda places: _margins(workspace, places), joints)
    limits = zip(LIMITS.items(), (*_linear(workspace, joints), *curved), strict=True)
    approaches = [ClosestApproach(name, margin, unit, place) for (name, unit), (margin, place) in limits]
    for zone in workspace.zones:
        margin, place = _nearest(ZoneChords(workspace.mechanism, zone, joints))
        approaches.append(ClosestApproach(zone.name, margin, "m", place, zone=True))
    return tuple(approaches)


def lowest(mechanism: Mechanism, joints: Sequence[Joints] | Floats) -> Point:
    """Return the lowest gripper point of the chords between knots, one or more; exact to 1e-7 m.

    Raises `Unreachable` if the lines cannot meet there.
    """
    return extremes(mechanism, joints)[0]


def highest(mechanism: Mechanism, joints: Sequence[Joints] | Floats) -> Point:
    """Return the highest gripper point of the chords; raises as `lowest` does."""
    return extremes(mechanism, joints)[1]


def extremes(mechanism: Mechanism, joints: Sequence[Joints] | Floats) -> tuple[Point, Point]:
    """Return both `lowest` and `highest`, from the same samples."""
    knots = _two_at_least(np.asarray(joints, dtype=np.float64))
    parts = max(4, ceil(_LOOKS / (len(knots) - 1)))
    shares = np.arange(parts + 1.0) / parts
    starts, ways = knots[:-1, :, np.newaxis], (knots[1:] - knots[:-1])[:, :, np.newaxis]
    _, squares = _section(mechanism, *(starts[:, line] + ways[:, line] * shares for line in (1, 2)))
    low, high = (_extreme(mechanism, knots, sign, sign * squares) for sign in (-1.0, 1.0))
    return low, high


def _extreme(mechanism: Mechanism, knots: Floats, sign: float, seen: Floats) -> Point:
    """Return the point where `sign` h² is least; `seen` (n, parts + 1) holds samples along the chords between knots."""
    parts = seen.shape[1] - 1
    best = int(seen.argmin())
    chord, share, value = best // (parts + 1), best % (parts + 1) / parts, seen.flat[best]
    near = int(_guessed(seen).argmin())
    start, end = knots[near // (parts - 1)].tolist(), knots[near // (parts - 1) + 1].tolist()
    refined, at = _bottom(mechanism.width, start, end, sign, (near % (parts - 1) + 1) / parts, 1.0 / parts)
    if refined < value:
        chord, share = near // (parts - 1), at
    start, end = knots[chord : chord + 2].tolist()
    return mechanism.fk(between(Joints(*start), Joints(*end), share))


def _bottom(
    W: float, start: list[float], end: list[float], sign: float, guess: float, width: float
) -> tuple[float, float]:
    """Return the least `sign` h² on a chord within `width` of the share `guess`, and the share, by Newton's method."""
    (_, b, c), (_, end_b, end_c) = start, end
    db, dc = end_b - b, end_c - c
    t = guess
    for _ in range(_NEWTON):
        b_t, c_t = b + db * t, c + dc * t
        u = 0.5 * W + (b_t - c_t) * (b_t + c_t) / (2.0 * W)
        du, ddu = (b_t * db - c_t * dc) / W, (db * db - dc * dc) / W
        slope, bend = sign * (b_t * db - u * du), sign * (db * db - du * du - u * ddu)
        step = -slope / bend if bend > 0.0 else -copysign(width, slope)
        t = min(max(t + step, guess - width, 0.0), guess + width, 1.0)
    b_t, c_t = b + db * t, c + dc * t
    u = 0.5 * W + (b_t - c_t) * (b_t + c_t) / (2.0 * W)
    return sign * (b_t - u) * (b_t + u), t


def _two_at_least(joints: Floats) -> Floats:
    return joints if len(joints) > 1 else np.concatenate((joints, joints))


def _section(mechanism: Mechanism, b: Floats, c: Floats) -> tuple[Floats, Floats]:
    """Return u and h² [m, m²] for lengths of the lines of any one shape."""
    W = mechanism.width
    u = 0.5 * W + (b - c) * (b + c) / (2.0 * W)
    return u, (b - u) * (b + u)


def _margins(workspace: Workspace, places: Floats) -> Floats:
    """Return the margins that are not linear (5, ...), in the order of `LIMITS`, at joints (..., 3)."""
    b, c = places[..., 1], places[..., 2]
    u, square = _section(workspace.mechanism, b, c)
    h = np.sqrt(np.maximum(square, _FLAT * _FLAT))
    W = workspace.mechanism.width
    pulls = np.array(((W - u) * b, u * c)) / (W * h)
    return np.array((u, W - u, workspace.mechanism.reach_down - h, *(workspace.tension_limit - pulls)))


def _linear(workspace: Workspace, joints: Floats) -> Iterator[tuple[float, ChordPlace]]:
    """Yield the margins that are linear along chords, in the order of `LIMITS`, with their places."""
    last = len(joints) - 2
    for margin in _linear_margins(workspace, joints):
        knot = int(np.argmin(margin))
        yield float(margin[knot]), ChordPlace(min(knot, last), float(max(0, knot - last)))


def _linear_margins(workspace: Workspace, joints: Floats) -> Iterator[Floats]:
    for axis, (low, high) in enumerate((workspace.boom, workspace.line_b, workspace.line_c)):
        yield joints[:, axis] - low
        yield high - joints[:, axis]
    yield joints[:, 1] + joints[:, 2] - workspace.mechanism.width


def _nearest(every: ZoneChords) -> tuple[float, ChordPlace]:
    """Return the least clearance [m] on chords, and its place.

    A clearance falls by no more than the travel. So pieces of chords are dropped if they cannot have a clearance below
    the least known one, and the other pieces are halved.
    """
    clear = every.zone.clearances(every.mechanism, every.joints)
    knot = int(clear.argmin())
    last = len(clear) - 2
    least, place = float(clear[knot]), ChordPlace(min(knot, last), float(max(0, knot - last)))
    chords, begins, width = np.arange(len(clear) - 1), np.zeros(len(clear) - 1), 1.0
    first, end = clear[:-1], clear[1:]
    while True:
        lowest_possible = 0.5 * (first + end - every.travelled(chords, begins, width))
        kept = lowest_possible < least - _NEAR
        chords, begins, first, end = chords[kept], begins[kept], first[kept], end[kept]
        if not 0 < len(chords) < _PIECES:
            return least, place
        width *= 0.5
        middle = every.clear(chords, begins + width)
        best = int(middle.argmin())
        if middle[best] < least:
            least, place = float(middle[best]), ChordPlace(int(chords[best]), float(begins[best] + width))
        first, end = np.concatenate((first, middle)), np.concatenate((middle, end))
        chords, begins = np.concatenate((chords, chords)), np.concatenate((begins, begins + width))


def _least(values: Kinds, joints: Floats) -> list[tuple[float, ChordPlace]]:
    """Return the least value of every kind on the chords between knots (n, 3), and its place.

    Every chord is sampled in four parts, in more if there are few chords.
    """
    parts = max(4, ceil(_LOOKS / (len(joints) - 1)))
    shares = np.linspace(0.0, 1.0, parts + 1)
    ways = joints[1:] - joints[:-1]
    found = values(joints[:-1, np.newaxis] + ways[:, np.newaxis] * shares[:, np.newaxis])
    flat = found.reshape(len(found), -1)
    best = np.argmin(flat, axis=1)
    least, (chord, sample) = flat[np.arange(len(found)), best], np.divmod(best, parts + 1)
    place = shares[sample]
    guessed, inner = np.divmod(np.argmin(_guessed(found).reshape(len(found), -1), axis=1), parts - 1)
    refined, at = _refined(values, joints[guessed], ways[guessed], shares[inner + 1], 1.0 / parts)
    less = refined < least
    least, chord, place = np.where(less, refined, least), np.where(less, guessed, chord), np.where(less, at, place)
    return [(float(one), ChordPlace(int(on), float(at))) for one, on, at in zip(least, chord, place, strict=True)]


def _guessed(found: Floats) -> Floats:
    """Return the estimated least values around every inner one of samples (..., n): (..., n − 2).

    The range of each is that between its two neighbours.
    """
    before, here, behind = found[..., :-2], found[..., 1:-1], found[..., 2:]
    slope, bend = 0.5 * (behind - before), behind - 2.0 * here + before
    dip = 0.5 * slope * slope / np.where(bend > 0.0, bend, 1.0)
    return np.where(np.abs(slope) <= bend, here - dip, np.minimum(np.minimum(before, behind), here))


def _refined(values: Kinds, starts: Floats, ways: Floats, at: Floats, width: float) -> tuple[Floats, Floats]:
    """Return the value (k,) and the share (k,) where each kind is least near share `at` (k,) of its chord.

    A parabola is fitted through three places, then through three closer ones about its vertex.
    """
    kinds = np.arange(len(at))
    steps = np.array((-1.0, 0.0, 1.0))

    def seen(shares: Floats) -> Floats:
        return values(starts[:, np.newaxis] + ways[:, np.newaxis] * shares[..., np.newaxis])[kinds, kinds]

    for _ in range(_ROUNDS):
        middle = np.clip(at, width, 1.0 - width)
        before, here, behind = seen(middle[:, np.newaxis] + width * steps).T
        slope, bend = 0.5 * (behind - before), behind - 2.0 * here + before
        vertex = np.where(bend > 0.0, -slope / np.where(bend > 0.0, bend, 1.0), -np.sign(slope))
        at = np.clip(middle + width * np.clip(vertex, -_CLOSER, _CLOSER), 0.0, 1.0)
        width /= _CLOSER
    return seen(at[:, np.newaxis])[:, 0], at
