"""Where a path is cut into pieces that the controller can drive: straight ones, in whole counts.

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
from maya_un.motion.curve import Path, Pieces, Space, to_joints
from maya_un.motion.limits import Limits
from maya_un.values import Joints

Whole = NDArray[np.int64]
"""An array of whole numbers; the shape stands where it is used."""

STEP = 0.02
"""How much the speed changes from one segment of a slow-down to the next, as a share of the slew speed."""

JUMPS = (0.05, 0.02, 0.02)
"""How much the speeds of a, b, c may jump where two chords meet, as shares of their slew speeds.

The boom's counts are coarse: where the lines come to rest and it goes on, it asks for most of the knots.
"""

TOLERANCE = 5e-5
"""How far a chord may be off its curve [m]; an angle counts at 1 m."""

_GRID = 24
_TINY = 1e-12


@dataclass(frozen=True)
class Knots:
    """The ends of all chords of a path.

    `counts` (n, 3) are where the controller goes; `exact` (n, 3) the same before rounding, in counts. `sharp` (n,) tells
    where the path has a corner. `vias` are the ways to the path's waypoints between its ends [counts].
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
    else:
        parameters = _parameters(path, mechanism, scale, limits, coarseness)
    exact = to_joints(path.space, mechanism, pieces.at(parameters)) * scale
    whole = parameters == np.rint(parameters)
    sharp = whole & np.array(pieces.sharp)[np.rint(parameters).astype(np.intp)]
    counts = np.rint(np.nan_to_num(exact)).astype(np.int64)
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


def _vias(parameters: Floats, counts: Whole, pieces: Pieces) -> tuple[float, ...]:
    if not pieces.vias:
        return ()
    ways = np.concatenate(([0.0], np.cumsum(np.sqrt(np.sum(np.diff(counts, axis=0) ** 2.0, axis=1)))))
    return tuple(np.interp(pieces.vias, parameters, ways).tolist())


def _distinct(counts: Whole, exact: Floats, sharp: NDArray[np.bool_], vias: tuple[float, ...]) -> Knots:
    """Leave out knots that do not differ from the one before by a count; the last one is kept."""
    moves = np.any(counts[1:] != counts[:-1], axis=1)
    if moves.all():
        return Knots(counts, exact, sharp, vias)
    kept = np.concatenate(([True], moves))
    number = np.cumsum(kept) - 1
    corners = np.zeros(int(number[-1]) + 1, dtype=np.bool_)
    np.logical_or.at(corners, number, sharp)
    return Knots(counts[kept], exact[kept], corners, vias)


def _parameters(path: Path, mechanism: Mechanism, scale: Floats, limits: Limits, coarseness: float) -> Floats:
    """Return the parameters of the knots: the ends of all pieces, the vias, and as many between as needed."""
    pieces = path.pieces
    fine = np.arange(len(pieces) * _GRID + 1) / _GRID
    exact = to_joints(path.space, mechanism, pieces.at(fine)) * scale
    density = _density(np.nan_to_num(exact), scale, limits) / coarseness
    density[~np.isfinite(density)] = 0.0
    shares: list[Floats] = []
    for piece, straight in enumerate(pieces.straight):
        own = density[piece * _GRID : (piece + 1) * _GRID]
        if straight and path.space is Space.JOINT:
            shares.append(np.array([float(piece)]))
            continue
        along = np.concatenate(([0.0], np.cumsum(own)))
        parts = max(1, int(np.ceil(along[-1] - 1e-9)))
        wanted = np.arange(parts) * (along[-1] / parts)
        shares.append(piece + np.interp(wanted, along, np.linspace(0.0, 1.0, len(along))))
    chosen = np.concatenate((*shares, [float(len(pieces))]))
    return _on_whole_counts(chosen, fine, exact[:, 0], pieces, path, mechanism, scale[0])


def _on_whole_counts(
    chosen: Floats, fine: Floats, boom: Floats, pieces: Pieces, path: Path, mechanism: Mechanism, per_angle: float
) -> Floats:
    """Move the parameters between the ends of the pieces to where the boom is at whole counts, if that is near."""
    angles = to_joints(path.space, mechanism, pieces.at(chosen))[:, 0] * per_angle
    slope = np.interp(chosen, 0.5 * (fine[1:] + fine[:-1]), np.diff(boom) * _GRID)
    gap = np.diff(chosen)
    room = 0.3 * np.minimum(np.concatenate((gap, gap[-1:])), np.concatenate((gap[:1], gap)))
    shift = (np.rint(angles) - angles) / np.where(np.abs(slope) > _TINY, slope, np.inf)
    inner = (chosen != np.rint(chosen)) & (np.abs(shift) < room)
    return np.where(inner, chosen + shift, chosen)


def _density(exact: Floats, scale: Floats, limits: Limits) -> Floats:
    """Return how many chords every interval of a fine grid of (n + 1, 3) counts asks for, (n,)."""
    steps = np.diff(exact, axis=0)
    lengths = np.sqrt(np.einsum("ij,ij->i", steps, steps)) + _TINY
    directions = steps / lengths[:, np.newaxis]
    turns = np.diff(directions, axis=0)
    between = 0.5 * (lengths[1:] + lengths[:-1])
    jumps = np.array(limits.speed) * np.array(JUMPS)
    speeds = fastest(0.5 * (directions[1:] + directions[:-1]), turns / between[:, np.newaxis], limits)
    jump = np.max(np.abs(turns) / jumps, axis=1) * speeds
    off = np.max(np.abs(turns) / scale, axis=1) * between / (8.0 * TOLERANCE)
    at_points = np.maximum(jump, np.sqrt(off))
    padded = np.concatenate((at_points[:1], at_points, at_points[-1:]))
    return np.maximum(padded[1:], padded[:-1])


def fastest(directions: Floats, bends: Floats, limits: Limits) -> Floats:
    """Return the greatest speed along the path where its direction is q' and its bend q'', both (n, 3), as (n,).

    Speeds of the axes: |q'ᵢ| v ≤ spᵢ. Accelerations |q'ᵢ u + q''ᵢ v²| ≤ aᵢ for some u: the intervals of u that the axes
    allow have a point in common if every two of them have one, which is |q''ᵢ q'ⱼ − q''ⱼ q'ᵢ| v² ≤ aᵢ|q'ⱼ| + aⱼ|q'ᵢ|.
    """
    share = np.abs(directions)
    speed = np.min(np.array(limits.speed) / np.maximum(share, _TINY), axis=1)
    one, two = _PAIRS
    rates = np.minimum(limits.acceleration, limits.deceleration).astype(np.float64)
    crossed = np.abs(bends[:, one] * directions[:, two] - bends[:, two] * directions[:, one])
    room = rates[one] * share[:, two] + rates[two] * share[:, one]
    square = np.min(room / np.maximum(crossed, _TINY * _TINY), axis=1)
    return np.minimum(speed, np.sqrt(square))


_PAIRS = (np.array([0, 0, 1]), np.array([1, 2, 2]))
