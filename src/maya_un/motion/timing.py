"""From a path to a coordinated sequence: segments in counts, their speeds, and the duration.

In the controller's linear mode the speed is the norm over the listed axes in counts/s. It accelerates at VA and brakes
at VD; VD is the deceleration of a stop. `maya_un.motion.speeds` computes the fastest motion along the path under the
limits of every axis, and cuts it into segments that follow it. The controller drives them as `maya_un.motion.profile`
computes, and that gives the duration.
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, inf

import numpy as np

from maya_un.config import Units
from maya_un.errors import InvalidValue
from maya_un.kinematics import Floats
from maya_un.motion.jerk import Allowed, Fastest, smoothed
from maya_un.motion.move import CoordinatedMove, Knots, Segments
from maya_un.motion.profile import Limits
from maya_un.motion.speeds import Budget, Chords, Ramps, caps, knot_squares, peaks, segments

_QUANTUM = 1024

_STEEPEST = 1_073_740_800
"""Greatest VA and VD [counts/s²] (Galil DMC-41x3, commands VA, VD)."""

_STEEP = 0.9
"""The planned slow-down is at most this share of VD, so that its steps fit in."""

HARDER = 5
"""Factor by which an axis in a sequence with slower ones may stop harder than alone."""

_NEARLY = 0.99
"""VA may be reduced to this share of the axes' limit, if that saves the steps of a rise."""

Safely = Callable[[Floats, float, Floats], Floats]
"""Another bound on speeds: from directions (3, n) of the chords, VD, and requested speeds (n,), to speeds (n,).

The result is infinite if the requested speed is safe.
"""


def plan(
    knots: Knots,
    limits: Limits,
    units: Units,
    speed_scale: float = 1.0,
    *,
    safely: Safely | None = None,
    coarseness: float = 1.0,
) -> CoordinatedMove:
    """Return the coordinated move through `knots`, from the first (where the robot must be) to the last.

    `speed_scale` in (0, 1] slows the cruise, not the ramps. At a sharp corner the speed is such that no axis' speed
    jumps by more than 2 % of its slew: next to rest. Steps are `coarseness` times as high. A path that is shorter
    than a count gives a move without segments. Raises `InvalidValue` for a scale out of range.
    """
    if not 0.0 < speed_scale <= 1.0:
        raise InvalidValue(key="speed_scale", value=speed_scale, reason="it must be a share, above 0 and at most 1")
    a, b, c = knots.counts[0].tolist()
    start = (a, b, c)
    if len(knots.counts) < 2:
        return CoordinatedMove.along(start, Segments.of(()), limits.letters, _QUANTUM, _QUANTUM, units)
    chords = Chords.of(knots)
    within, at = caps(chords, limits, speed_scale)
    gentle = _stop_rate(chords, limits)
    va = min(_rise_rate(chords, limits), gentle)
    budget = Budget.of(chords, limits, va, _STEEP * gentle)
    ramps = _ramps(chords, budget, within, at)
    vd = _brisk(gentle, float(ramps.top.max()), limits)
    if safely is not None:
        safe = safely(chords.directions, vd, ramps.top)
        if (safe < ramps.top).any():
            within = np.minimum(within, safe)
            at[1:-1] = np.minimum(at[1:-1], np.minimum(within[:-1], within[1:]))
            ramps = _ramps(chords, budget, within, at)
    if min(limits.jerk) < inf:
        allowed = None if safely is None else _allowed(safely, chords, vd)
        chords, ramps = smoothed(knots, limits, within, at, _fastest(chords, budget), allowed, coarseness)
    found = segments(chords, ramps, limits.slew, va, coarseness, speed_scale)
    return CoordinatedMove.along(start, found, limits.letters, va, vd, units, vias=knots.vias)


def _ramps(chords: Chords, budget: Budget, within: Floats, at: Floats) -> Ramps:
    squares = knot_squares(chords, budget, at)
    top, up, down = peaks(chords, budget, within, squares)
    speeds = np.sqrt(squares)
    return Ramps(speeds[:-1], np.sqrt(top), speeds[1:], up, down)


def _fastest(chords: Chords, budget: Budget) -> Fastest:
    return lambda within, at, share: _ramps(chords, budget.less(share), within, at)


def _allowed(safely: Safely, chords: Chords, vd: float) -> Allowed:
    return lambda requested: safely(chords.directions, vd, requested)


def _rise_rate(chords: Chords, limits: Limits) -> int:
    """Return VA [counts/s²]: the next multiple of 1024 above the greatest acceleration that any chord allows.

    On the other chords steps make it gentler.
    """
    most = float((limits.rise / chords.shares).min(axis=0).max())
    return min(_STEEPEST, max(_QUANTUM, ceil(_NEARLY * most / _QUANTUM) * _QUANTUM))


def _stop_rate(chords: Chords, limits: Limits) -> int:
    """Return the greatest deceleration along the path with which a stop anywhere keeps every axis within its limit."""
    own = int((limits.stop / chords.shares).min()) // _QUANTUM * _QUANTUM
    return min(_STEEPEST, max(_QUANTUM, own))


def _brisk(gentle: int, fastest: float, limits: Limits) -> int:
    """Return VD [counts/s²]: `gentle`, or more if a stop from the `fastest` speed would take too long with it.

    The path of the lines is long in counts, that of the boom is short, and VD is one for the whole sequence. If a move
    has spans of both, a stop may take as long as that of the slowest axis alone, and no longer; in return another axis
    may stop up to `HARDER` times as hard as it would alone.
    """
    longest = max(speed / rate for speed, rate in zip(limits.speed, limits.stop_deceleration, strict=True))
    wanted = ceil(fastest / longest / _QUANTUM) * _QUANTUM
    return max(gentle, min(wanted, HARDER * gentle, _STEEPEST))
