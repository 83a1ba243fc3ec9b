"""From a path to a coordinated sequence: segments in counts, their speeds, and how long it will take.

In the controller's linear mode the speed is the norm over the listed axes in counts/s. It accelerates at VA and
brakes at VD; VD is the deceleration of a stop. The fastest way along the path under the limits of every axis
(`maya_un.motion.speeds`) is cut into segments that follow it (`maya_un.motion.stairs`); what the controller makes of
them, and so the duration, is `maya_un.motion.profile`.
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil

import numpy as np

from maya_un.config import Units
from maya_un.errors import InvalidValue
from maya_un.kinematics import Floats
from maya_un.motion.knots import STEP, Knots
from maya_un.motion.limits import Limits
from maya_un.motion.move import CoordinatedMove, Segment
from maya_un.motion.speeds import Budget, Chords, caps, knot_squares, peaks
from maya_un.motion.stairs import Ramps, segments

_QUANTUM = 1024

_STEEP = 0.9
"""The slow-down planned is at most this share of VD, so that stairs fit in."""

_NEARLY = 0.99
"""VA may be this much below what the axes allow, where that saves the stairs of a rise."""

SpeedCap = Callable[[Floats], Floats]
"""From the directions at the knots (n + 1, 3) to the greatest speed along the path there (n + 1,) [counts/s]."""


def plan(
    knots: Knots,
    limits: Limits,
    units: Units,
    speed_scale: float = 1.0,
    *,
    cap: SpeedCap | None = None,
    coarseness: float = 1.0,
) -> CoordinatedMove:
    """Return the coordinated move through `knots`, from the first (where the robot must be) to the last.

    `speed_scale` in (0, 1] slows the cruise, not the ramps. At a sharp corner the speed is such that no axis' speed jumps
    by more than a few per cent of its slew: next to rest. `cap` bounds the speed for other reasons. A path that is
    shorter than a count gives a move without segments. Raises `InvalidValue` for a scale out of range.
    """
    if not 0.0 < speed_scale <= 1.0:
        raise InvalidValue(key="speed_scale", value=speed_scale, reason="it is a share, above 0 and at most 1")
    a, b, c = knots.counts[0].tolist()
    start = (a, b, c)
    if len(knots.counts) < 2:
        return CoordinatedMove.along(start, [], limits.letters, _QUANTUM, _QUANTUM, units, vias=())
    chords = Chords.of(knots)
    va, vd = _rates(chords, limits)
    found = _segments(chords, limits, speed_scale, (va, vd), cap, coarseness)
    return CoordinatedMove.along(start, found, limits.letters, va, vd, units, vias=knots.vias)


def _segments(
    chords: Chords,
    limits: Limits,
    scale: float,
    rates: tuple[int, int],
    cap: SpeedCap | None,
    coarseness: float,
) -> list[Segment]:
    va, vd = rates
    within, at = caps(chords, limits, scale)
    if cap is not None:
        bound = cap(_at_knots(chords.directions))
        at = np.minimum(at, bound)
        within = np.minimum(within, np.minimum(bound[1:], bound[:-1]))
    budget = Budget.of(chords, limits, va, _STEEP * vd)
    squares = knot_squares(chords, budget, at)
    top, up, down = peaks(chords, budget, within, squares)
    speeds = np.sqrt(squares)
    ramps = Ramps(speeds[:-1], np.sqrt(top), speeds[1:], up, down)
    return segments(chords, ramps, scale * np.array(limits.speed, dtype=np.float64), va, STEP * coarseness)


def _at_knots(directions: Floats) -> Floats:
    """Return for every knot the direction of the chord behind it; at the last one that of the chord before."""
    return np.concatenate((directions, directions[-1:]))


def _rates(chords: Chords, limits: Limits) -> tuple[int, int]:
    """Return VA and VD [counts/s²], in steps of 1024 as the controller has them.

    VD is the greatest with which a stop anywhere keeps every axis below its own. VA is the next step above what the axes
    allow where they allow most: stairs make it gentler. A stop is never gentler than a rise.
    """
    share = np.maximum(np.abs(chords.directions), 1e-9)
    vd = int(np.min(np.array(limits.stop_deceleration) / share)) // _QUANTUM * _QUANTUM
    most = float(np.max(np.min(np.array(limits.acceleration) / share, axis=1)))
    va = ceil(_NEARLY * most / _QUANTUM) * _QUANTUM
    return max(_QUANTUM, min(va, vd)), max(_QUANTUM, vd)
