"""The least value of a convex function on a line, from below: the tangents at two places bound it between them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from maya_un.kinematics.mechanism import Floats

_INWARD = 0.1


class Tangents(NamedTuple):
    """Values of functions and their slopes, each (m,)."""

    value: Floats
    slope: Floats


Probe = Callable[[NDArray[np.intp], Floats], Tangents]
"""Returns the tangents of the functions with these indices (k,) at these places (k,)."""


def least(probe: Probe, begin: Tangents, end: Tangents, enough: Floats, accuracy: float) -> Floats:
    """Return lower bounds (m,) for the least values of m convex functions on 0 ≤ t ≤ 1.

    `begin` and `end` are their tangents at 0 and 1. A bound is smaller than the least value by at most `accuracy`,
    and equal to it where that is at an end; one above `enough` (m,) is not refined further.

    Cuts alternate between where the slope would be 0 if it were linear, which is near for what is round, and where the
    tangents cross, which is exact for what is bent; the latter keeps off the ends, so that the line always shrinks.
    """
    found = np.minimum(begin.value, end.value)
    rows = np.flatnonzero((begin.slope < 0.0) & (end.slope > 0.0))
    if not len(rows):
        return found
    # Of every function: place, value and slope at the left of its least value, and at the right.
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
