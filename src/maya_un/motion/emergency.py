"""The greatest speed along a path at which no fault does harm beside it.

A stop, the guard and a limit switch of the coordinated mode brake along the path, which is proved. Two faults end
beside it:

    one axis fails (following error, amplifier): its motor goes off and the drum holds it in place, while the others
    continue along the path until they have braked, at VD;

    every axis stops: a controller may brake the axes of a sequence independently at a limit (SD). The sources do not
    specify this; the worse case is assumed.

In both cases the axes end somewhere in the box between their positions at the fault and those at which each of them
would have come to rest independently: q + [−e⁻, e⁺], with e = vτ + v²/2r for the deceleration r and an axis with delay
τ, and as far as the path ahead takes an axis on the way of braking. All e grow with the speed along the path. The
result is the greatest speed at which the boxes at all places of a chord keep the emergency bounds:

    T ≤ the emergency tension     greatest at the box' corner of shortest lines, or no more than the load
    slack ≤ the emergency slack   of c greatest where c is longest and b shortest, of b the other way round
    z ≥ 0                         least at the corner of longest lines (to a millimetre where a line is slack)
    no zone entered               its margin may be used up

Because ∂ ln T_b/∂b = (1 − b²c²/(W (W − u) h²))/b ≤ 0, as bc ≥ Wh; and ∂ ln T_b/∂c has the sign of b² − uW, which rises
with c: a longer line c first takes load off line b, then puts it back, until b carries all of it and c is slack. As q
runs along a chord, each corner runs along a separate chord, on which the bounds are proved like all others.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from maya_un.config import Config, Units
from maya_un.kinematics.mechanism import Floats
from maya_un.kinematics.workspace import Workspace
from maya_un.kinematics.zones import clearances, travel_bounds
from maya_un.motion.proof import coefficients, dips, places

SLACK = 0.05
"""Surplus length of a line that the drum tolerates once [m]."""

CREEP = 1e-3
"""Negligible excess of a stop [m]: the end of a line or of the boom may move by this anywhere."""

LATE = 0.04
"""Greatest delay of an axis behind its reference [s]; a failing axis stops there, the others continue."""

_CORNER = 0.2
_MOST = 128
_HALVINGS = 3
_BISECTIONS = 12
_FAR, _NEAR = 0.05, 0.01


@dataclass(frozen=True, slots=True)
class Emergency:
    """Bounds for a fault: `tension` [loads], `slack` [m]; and the motion of the axes after it.

    `rates` are the decelerations of the axes when they brake independently (rad/s², m/s², m/s²); `late` is their
    greatest delay behind their references [s].
    """

    tension: float
    slack: float
    rates: tuple[float, float, float]
    late: float = LATE

    @classmethod
    def of(cls, config: Config) -> Self:
        """Return the bounds of a configuration; an axis brakes with the smaller of its stop's and its limits' rate."""
        axes = (config.axes.a, config.axes.b, config.axes.c)
        rates = (min(axis.stop_deceleration_counts, axis.limit_deceleration_counts) for axis in axes)
        safety = config.safety
        a, b, c = (rate / scale for rate, scale in zip(rates, Units.of(config).per_unit, strict=True))
        return cls(safety.tension_limit * safety.emergency_tension, SLACK, (a, b, c))


class _StopBoxes(NamedTuple):
    """Possible ends of a fault: chords from `starts` to `ends` (3, m), plus boxes from −`back` to `on` (3, m).

    `clear` (m,) is the distance of the nearest zone from the chords [m], infinite without zones.
    """

    starts: Floats
    ends: Floats
    back: Floats
    on: Floats
    clear: Floats


class _Growth(NamedTuple):
    """Growth of boxes with the speed v along the path: `back` and `on` (3, m) with v², `least` and `most` with v.

    The others are as in `_StopBoxes`.
    """

    starts: Floats
    ends: Floats
    back: Floats
    on: Floats
    least: Floats
    most: Floats
    clear: Floats

    def of(self, chords: NDArray[np.intp]) -> _Growth:
        """Return the rows of some chords, which may be repeated."""
        return _Growth(*(rows[..., chords] for rows in self))

    def at(self, squares: Floats) -> _StopBoxes:
        """Return the boxes for these squares of the speed (m,)."""
        speed = np.sqrt(squares)
        back, on = self.back * squares + self.least * speed, self.on * squares + self.most * speed
        return _StopBoxes(self.starts, self.ends, back, on, self.clear)


def emergency_speed(
    workspace: Workspace, emergency: Emergency, joints: Floats, directions: Floats, braking: float, fastest: Floats
) -> Floats:
    """Return for every chord (m,) the greatest speed along the path that keeps the emergency bounds.

    `joints` (m + 1, 3) are the knots [rad, m, m] of a proved path, `directions` (3, m) the ways of the axes per unit of
    the way on every chord, `braking` the deceleration along the path and `fastest` (m,) the greatest requested speed
    there, in that unit per s² and per s. A speed is infinite if `fastest` does no harm, and never so small that a stop
    would take less than `CREEP`.
    """
    found = np.full(len(fastest), np.inf)
    if not len(fastest):
        return found
    squares, places = fastest * fastest, np.array(joints.T, order="C")
    anywhere = directions.max(axis=1, keepdims=True), directions.min(axis=1, keepdims=True)
    starts, ends = places[:, :-1], places[:, 1:]
    clear = _nearest_zone(workspace, joints[:-1], joints[1:], _FAR)
    coarse = _Growth(starts, ends, *_growing(emergency, directions, anywhere, braking), clear)
    chords = _doubtful(workspace, emergency, coarse, squares)
    if len(chords):
        reach = squares / (2.0 * braking) + fastest * emergency.late
        ahead = _ahead(workspace, joints, directions, reach)
        fine = _Growth(starts, ends, *_growing(emergency, directions, ahead, braking), clear).of(chords)
        left = _doubtful(workspace, emergency, fine, squares[chords])
        chords, fine = chords[left], fine.of(left)
        fine = fine._replace(clear=_nearest_zone(workspace, fine.starts.T, fine.ends.T, _NEAR))
        found[chords] = _slowed(workspace, emergency, fine, squares[chords])
    return found


def _doubtful(workspace: Workspace, emergency: Emergency, growth: _Growth, squares: Floats) -> NDArray[np.intp]:
    """Return the indices of the boxes that are not safe at these squares of the speed."""
    return np.flatnonzero(~_safe(workspace, emergency, growth.at(squares)))


def _slowed(workspace: Workspace, emergency: Emergency, growth: _Growth, squares: Floats) -> Floats:
    """Return the greatest speeds (m,), infinite if the requested speeds, whose squares are given, are safe."""
    arms = np.array(((workspace.mechanism.length,), (1.0,), (1.0,)))
    safe = _greatest(workspace, emergency, growth, squares)
    creep = CREEP / (np.maximum(growth.back, growth.on) * arms).max(axis=0)
    return np.where(safe < squares, np.sqrt(np.maximum(safe, creep)), np.inf)


def _growing(
    emergency: Emergency, directions: Floats, ahead: tuple[Floats, Floats], braking: float
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return `back`, `on`, `least` and `most` of `_Growth`.

    `ahead` are the greatest and the least direction on the way of braking.
    """
    alone = directions * np.abs(directions) / (2.0 * np.array(emergency.rates)[:, np.newaxis])
    most, least = np.maximum(ahead[0], 0.0), np.maximum(-ahead[1], 0.0)
    on, back = np.maximum(alone, most / (2.0 * braking)), np.maximum(-alone, least / (2.0 * braking))
    return back, on, least * emergency.late, most * emergency.late


def _ahead(workspace: Workspace, joints: Floats, directions: Floats, reach: Floats) -> tuple[Floats, Floats]:
    """Return the greatest and the least direction (3, m) on the way of braking from anywhere on a chord.

    `reach` (m,) is the length of that way. It ends at corners, because the path is next to rest there.
    """
    steps = np.diff(joints, axis=0) / workspace.grain
    units = directions.T / workspace.grain
    sizes = np.sqrt(np.einsum("ij,ij->i", units, units))
    units /= sizes[:, np.newaxis]
    ways = np.concatenate(([0.0], np.cumsum(np.sqrt(np.einsum("ij,ij->i", steps, steps)) / sizes)))
    last = np.searchsorted(ways, ways[1:] + reach) - 1
    legs = np.concatenate(([0], np.cumsum(np.abs(np.diff(units, axis=0)).max(axis=1) > _CORNER)))
    last = np.minimum(last, np.searchsorted(legs, legs, side="right") - 1)
    further = last - np.arange(len(last))
    most, least = directions.copy(), directions.copy()
    for step in range(1, int(further.max()) + 1):
        chords = np.flatnonzero(further >= step)
        most[:, chords] = np.maximum(most[:, chords], directions[:, chords + step])
        least[:, chords] = np.minimum(least[:, chords], directions[:, chords + step])
    return most, least


def _nearest_zone(workspace: Workspace, starts: Floats, ends: Floats, step: float) -> Floats:
    """Return a lower bound (m,) of the distance of chords from any zone itself, without its margin [m].

    The distance is sampled each time a point has travelled `step` [m], and is too small by at most half of that.
    """
    if not workspace.zones or not len(starts):
        return np.full(len(starts), np.inf)
    travelled = travel_bounds(workspace.mechanism, starts, ends)
    parts = np.clip(np.ceil(travelled / step), 1, _MOST).astype(np.intp)
    owners = np.repeat(np.arange(len(parts)), parts + 1)
    begins = np.cumsum(parts + 1) - parts - 1
    shares = (np.arange(len(owners)) - begins[owners]) / parts[owners]
    at = starts[owners] + shares[:, np.newaxis] * (ends[owners] - starts[owners])
    margins = np.array([zone.margin for zone in workspace.zones])
    free = (clearances(workspace.zones, workspace.mechanism, at) + margins).min(axis=1)
    least = 0.5 * (free[:-1] + free[1:] - travel_bounds(workspace.mechanism, at[:-1], at[1:]))
    least[begins[1:] - 1] = np.inf  # from the end of one chord to the start of another
    return np.minimum.reduceat(least, begins)


def _greatest(workspace: Workspace, emergency: Emergency, growth: _Growth, squares: Floats) -> Floats:
    """Return the greatest safe squares of the speed (m,) up to `squares`, by bisection; 0 if none is safe."""
    low, high = np.zeros(len(squares)), squares
    tried = squares
    for _ in range(_BISECTIONS):
        safe = _safe(workspace, emergency, growth.at(tried))
        low, high = np.where(safe, tried, low), np.where(safe, high, tried)
        tried = 0.5 * (low + high)
    return low


def _safe(workspace: Workspace, emergency: Emergency, boxes: _StopBoxes) -> NDArray[np.bool_]:
    """Return the chords (m,) on which all boxes are proved to keep the emergency bounds."""
    found = coefficients(_kept(workspace, emergency, boxes))
    safe = ~dips(found, _HALVINGS)
    if workspace.zones:
        safe &= _strayed(workspace, boxes, found[:, -1]) <= boxes.clear
    return safe


def _kept(workspace: Workspace, emergency: Emergency, boxes: _StopBoxes) -> Floats:
    """Return the bounds at seven places of every chord, kept where not negative, shape (6, 7, m).

    They are, in the notation of `maya_un.motion.proof` and as shares of W: slack of c and of b, z, T_b and T_c, and h²
    at the corner of shortest lines, which T implies.
    """
    W, deepest = workspace.mechanism.width, workspace.mechanism.reach_down
    lines = places(boxes.starts[1:] / W, boxes.ends[1:] / W)
    short = lines - boxes.back[1:, np.newaxis] / W
    long = lines + boxes.on[1:, np.newaxis] / W
    short *= short
    long *= long
    loose = emergency.slack / W
    loose += 0.5 * loose * loose
    strength = emergency.tension**-2
    out = np.empty((short.shape[1], 6, short.shape[2])).swapaxes(0, 1)
    out[0] = 0.5 + loose + 0.5 * (short[0] - long[1])
    out[1] = 0.5 + loose - 0.5 * (long[0] - short[1])
    u = 0.5 + 0.5 * (long[0] - long[1])
    out[2] = (deepest / W) ** 2 - long[0] + u * u
    u = 0.5 + 0.5 * (short[0] - short[1])
    out[5] = hh = short[0] - u * u
    out[3] = hh - strength * (1.0 - u) ** 2 * short[0]
    out[4] = hh - strength * u * u * short[1]
    return out


def _strayed(workspace: Workspace, boxes: _StopBoxes, depth: Floats) -> Floats:
    """Return the greatest distance of any point from the path (m,) [m]; infinite if the lines might be straight.

    A line that is longer by e moves the meeting point by e/sin γ about the other line's anchor, where the lines meet at
    the angle γ and sin γ = W h/bc. `depth` are the coefficients of h² at the corner of shortest lines, as shares of W².
    """
    W = workspace.mechanism.width
    most = np.maximum(boxes.back, boxes.on)
    longest = np.maximum(boxes.starts, boxes.ends) + boxes.on
    h = W * np.sqrt(np.maximum(depth.min(axis=0), 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        sideways = (most[1] + most[2]) * longest[1] * longest[2] / (W * h)
    return np.where(h > 0.0, sideways, np.inf) + most[0] * (workspace.mechanism.length + SLACK)
