"""Division of a path into pieces that the controller can drive: straight ones, in whole counts.

Between two knots the controller goes straight in the joints. On a curve the knots lie so close that

    the chord stays within `TOLERANCE` of the curve, and
    no axis' speed jumps at a knot by more than its share in `JUMPS`, at the speed that the curve allows there,

which both ask for a density of knots along the way: √(κ/8e) for the first, κᵢ v / jumpᵢ for the second. It is worked
out on a fine grid, added up, and the knots are laid at equal parts of the sum; then each is moved a little, to where
the boom is at a whole count, because a count of the boom is coarse.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from maya_un.config import Units
from maya_un.kinematics import Floats, Mechanism
from maya_un.motion.limits import Limits
from maya_un.motion.path import BezierPieces, Path, Space, boom_angles, to_joints
from maya_un.values import Joints

Whole = NDArray[np.int64]
"""An array of whole numbers; the shape stands where it is used."""

STEP = 0.02
"""How much the speed changes from one segment of a slow-down to the next, as a share of the slew speed."""

JUMPS = np.array([[0.05], [0.02], [0.02]])
"""How much the speeds of a, b, c may jump where two chords meet, as shares of their slew speeds; a column.

The boom's counts are coarse: where the lines come to rest and it goes on, it asks for most of the knots.
"""

_LOOSE = 1.5
"""However coarse, chords leave the curve by no more than the square of this times `TOLERANCE`."""

TOLERANCE = 5e-5
"""How far a chord may be off its curve [m]; an angle counts at 1 m."""

_GRID = 24
_SHARES = np.arange(_GRID)[:, np.newaxis] / _GRID
_WEIGHTS = ((1.0 - _SHARES) ** 2, 2.0 * _SHARES * (1.0 - _SHARES), _SHARES**2)
_TINY = 1e-12
_FARTHEST = 2.0**53


@dataclass(frozen=True)
class Knots:
    """The ends of all chords of a path.

    `counts` (n, 3) are where the controller goes; `exact` (n, 3) the same before rounding, in counts. `sharp` (n,)
    tells where the path has a corner. `vias` are the ways to the path's waypoints between its ends [counts].
    """

    counts: Whole
    exact: Floats
    sharp: NDArray[np.bool_]
    vias: tuple[float, ...]


def straight(units: Units, waypoints: Sequence[Joints]) -> Knots:
    """Return the knots of straight lines in the joints through `waypoints` (rad, m, m)."""
    exact = np.array([units.to_counts(waypoint) for waypoint in waypoints], dtype=np.float64)
    ways = np.cumsum(np.sqrt(np.sum(np.diff(exact, axis=0) ** 2.0, axis=1)))
    return _distinct(exact.astype(np.int64), exact, np.full(len(exact), True), tuple(ways[:-1].tolist()))


def lay(path: Path, mechanism: Mechanism, units: Units, limits: Limits, coarseness: float = 1.0) -> Knots:
    """Return the knots of `path`; with a greater `coarseness` fewer of them, with as much greater steps."""
    pieces = path.pieces
    scale = np.array(units.per_unit)
    if path.space is Space.JOINT and all(pieces.straight):
        parameters = np.arange(len(pieces) + 1.0)
        exact = pieces.at(parameters) * scale
    else:
        parameters, exact = _laid(path, mechanism, scale, limits, coarseness)
    nearest = np.rint(parameters)
    sharp = (parameters == nearest) & np.array(pieces.sharp)[nearest.astype(np.intp)]
    counts = np.rint(_finite(exact)).astype(np.int64)
    return _distinct(counts, exact, sharp, _vias(parameters, counts, pieces))


def divided(knots: Knots, longest: float) -> Knots:
    """Return knots with chords longer than `longest` [counts] divided evenly: straight on, so nothing else changes."""
    steps = np.diff(knots.exact, axis=0)
    parts = np.maximum(1, np.ceil(np.sqrt(np.sum(steps * steps, axis=1)) / longest)).astype(np.intp)
    chord = np.repeat(np.arange(len(parts)), parts)
    share = (np.arange(len(chord)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[chord]
    exact = np.concatenate((knots.exact[chord] + share[:, np.newaxis] * steps[chord], knots.exact[-1:]))
    sharp = np.append((share == 0.0) & knots.sharp[chord], knots.sharp[-1])
    return _distinct(np.rint(exact).astype(np.int64), exact, sharp, knots.vias)


def _finite(places: Floats) -> Floats:
    """Return places with 0 where there is none: above the anchors of the lines; none is beyond whole numbers."""
    return np.clip(np.where(np.isfinite(places), places, 0.0), -_FARTHEST, _FARTHEST)


def _vias(parameters: Floats, counts: Whole, pieces: BezierPieces) -> tuple[float, ...]:
    if not pieces.vias:
        return ()
    ways = np.zeros(len(counts))
    norms(steps(counts)).cumsum(out=ways[1:])
    return tuple(np.interp(pieces.vias, parameters, ways).tolist())


def _distinct(counts: Whole, exact: Floats, sharp: NDArray[np.bool_], vias: tuple[float, ...]) -> Knots:
    """Leave out knots that do not differ from the one before by a count; the last one is kept."""
    moves = (counts[1:] != counts[:-1]).any(axis=1)
    if moves.all():
        return Knots(counts, exact, sharp, vias)
    kept = np.concatenate(([True], moves))
    number = np.cumsum(kept) - 1
    corners = np.zeros(int(number[-1]) + 1, dtype=np.bool_)
    np.logical_or.at(corners, number, sharp)
    return Knots(counts[kept], exact[kept], corners, vias)


def steps(places: Floats | Whole) -> Floats:
    """Return the ways (3, n) between places (n + 1, 3)."""
    rows = np.array(places.T, dtype=np.float64, order="C")
    return rows[:, 1:] - rows[:, :-1]


def norms(ways: Floats) -> Floats:
    """Return the lengths (n,) of ways (3, n)."""
    a, b, c = ways
    return np.sqrt(a * a + c * c + b * b)


def _laid(path: Path, mechanism: Mechanism, scale: Floats, limits: Limits, coarseness: float) -> tuple[Floats, Floats]:
    """Return the parameters of the knots (m,) and their places in counts (m, 3).

    They are the ends of all pieces, the vias, and as many between as needed.
    """
    pieces = path.pieces
    fine = to_joints(path.space, mechanism, _fine(pieces)) * scale
    density = _density(_finite(fine), scale, limits, coarseness)
    if path.space is Space.JOINT:
        density[np.repeat(pieces.straight, _GRID)] = 0.0
    along = np.zeros(len(fine))
    np.cumsum(density, out=along[1:])
    ends = along[::_GRID]
    asked = ends[1:] - ends[:-1]
    parts = np.maximum(1, np.ceil(asked - 1e-9)).astype(np.intp)
    if parts.max() == 1:
        return np.arange(len(parts) + 1.0), fine[::_GRID]
    firsts = parts.cumsum() - parts
    piece = np.arange(len(parts)).repeat(parts)
    wanted = ends[piece] + asked[piece] * ((np.arange(len(piece)) - firsts[piece]) / parts[piece])
    chosen = np.empty(len(piece) + 1)
    chosen[:-1] = np.interp(wanted, along, np.arange(len(along)) / _GRID)
    chosen[firsts], chosen[-1] = np.arange(len(parts)), len(parts)
    _to_whole_counts(chosen, fine[:, 0], path, mechanism, scale[0])
    return chosen, to_joints(path.space, mechanism, pieces.at(chosen)) * scale


def _fine(pieces: BezierPieces) -> Floats:
    """Return the coordinates of an even grid along all pieces."""
    one, two, three = _WEIGHTS
    grid = one * pieces.first[:, np.newaxis] + two * pieces.control[:, np.newaxis] + three * pieces.last[:, np.newaxis]
    return np.concatenate((grid.reshape(-1, 3), pieces.last[-1:]))


def _to_whole_counts(chosen: Floats, boom: Floats, path: Path, mechanism: Mechanism, per_angle: float) -> None:
    """Move the parameters between the ends of the pieces to where the boom is at whole counts, if that is near.

    `boom` is where it is on the fine grid [counts].
    """
    if boom.max() - boom.min() < 1.0:
        return
    inner = chosen[1:-1]
    angles = boom_angles(path.space, mechanism, path.pieces.at(inner)) * per_angle
    slope = np.interp(inner, (np.arange(len(boom) - 1) + 0.5) / _GRID, (boom[1:] - boom[:-1]) * _GRID)
    gap = chosen[1:] - chosen[:-1]
    shift = (np.rint(angles) - angles) / np.where(np.abs(slope) > _TINY, slope, np.inf)
    movable = (inner != np.rint(inner)) & (np.abs(shift) < 0.3 * np.minimum(gap[1:], gap[:-1]))
    inner += np.where(movable, shift, 0.0)


def _density(exact: Floats, scale: Floats, limits: Limits, coarseness: float) -> Floats:
    """Return how many chords every interval of a fine grid of (n + 1, 3) counts asks for, (n,)."""
    ways = steps(exact)
    lengths = norms(ways) + _TINY
    directions = ways / lengths
    turns = directions[:, 1:] - directions[:, :-1]
    between = 0.5 * (lengths[1:] + lengths[:-1])
    turned = np.abs(turns)
    speeds = fastest(0.5 * (directions[:, 1:] + directions[:, :-1]), turns / between, limits)
    jump = (turned / (limits.slew * JUMPS)).max(axis=0) * speeds
    off = (turned / scale[:, np.newaxis]).max(axis=0) * between / (8.0 * TOLERANCE)
    at_points = np.maximum(jump / coarseness, np.sqrt(off) / min(coarseness, _LOOSE))
    density = np.empty(len(lengths))
    density[0], density[-1] = at_points[0], at_points[-1]
    np.maximum(at_points[1:], at_points[:-1], out=density[1:-1])
    density[~np.isfinite(density)] = 0.0
    return density


def fastest(directions: Floats, bends: Floats, limits: Limits) -> Floats:
    """Return the greatest speed along the path where its direction is q' and its bend q'', both (3, n), as (n,).

    Speeds of the axes: |q'ᵢ| v ≤ spᵢ. Accelerations |q'ᵢ u + q''ᵢ v²| ≤ aᵢ for some u: the intervals of u that the axes
    allow have a point in common if every two of them have one, which is |q''ᵢ q'ⱼ − q''ⱼ q'ᵢ| v² ≤ aᵢ|q'ⱼ| + aⱼ|q'ᵢ|.
    """
    share, rates = np.abs(directions), np.minimum(limits.rise, limits.fall)
    speed = (limits.slew / np.maximum(share, _TINY)).min(axis=0)
    crossed = np.abs(bends * directions[_OTHER] - bends[_OTHER] * directions)
    room = rates * share[_OTHER] + rates[_OTHER] * share
    square = (np.maximum(room, _TINY) / np.maximum(crossed, _TINY * _TINY)).min(axis=0)
    return np.minimum(speed, np.sqrt(square))


_OTHER = np.array([1, 2, 0])
"""For every axis another one, so that all pairs occur."""
