"""The least time along a geometric path under limits of speed and acceleration of every axis, found by optimisation.

With s along the path, b = ṡ² and a = s̈ = b'/2, an axis that goes q(s) has speed q'√b and acceleration q'a + q''b. So
all limits are linear in b at the points of a grid. Among profiles that keep them, the greater of two at every point
keeps them as well: the one that is greatest everywhere exists, is the fastest, and has the greatest sum. A linear
programme finds it: no reach sets and no integration along limits (Verscheure et al., "Time-optimal path tracking for
robots: a convex optimization approach", IEEE Trans. Automatic Control 54, 2009, has b and a as unknowns).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np

from tests.judge.mechanism import Floats, Frame
from tests.judge.paths import Piece, Way

POINTS = 2_000
"""Intervals of the grid, all smooth pieces of a way together."""

Curve = Callable[[Floats], Floats]
"""Joints (n, 3) at the parameters (n,) of a smooth way."""


@dataclass(frozen=True, slots=True)
class Rates:
    """Limits of every axis, each (3,): speed, acceleration and deceleration [rad/s, m/s; rad/s², m/s²]."""

    speed: tuple[float, float, float]
    acceleration: tuple[float, float, float]
    deceleration: tuple[float, float, float]


def least_time_of(frame: Frame, way: Way, rates: Rates, points: int = POINTS) -> float:
    """Return the least time from rest to rest along `way` [s], with a stop at every corner that no blend cuts."""
    total, stretch = 0.0, list[Piece]()
    for piece in way.pieces():
        stretch.append(piece)
        if piece.sharp:
            total += _along(frame, way, tuple(stretch), rates, points)
            stretch.clear()
    return total


def _along(frame: Frame, way: Way, pieces: Sequence[Piece], rates: Rates, points: int) -> float:
    """Return the least time along pieces that join smoothly [s]."""
    knots = list(accumulate((piece.width for piece in pieces), initial=0.0))

    def curve(parameters: Floats) -> Floats:
        number = np.clip(np.searchsorted(knots, parameters, side="right") - 1, 0, len(pieces) - 1)
        joints = np.empty((len(parameters), 3))
        for index, piece in enumerate(pieces):
            own = number == index
            joints[own] = way.joints(frame, piece, (parameters[own] - knots[index]) / piece.width)
        return joints

    return least_time(curve, knots, rates, points)


def least_time(curve: Curve, knots: Sequence[float], rates: Rates, points: int = POINTS) -> float:
    """Return the least time from rest to rest along `curve` [s], from knots[0] to knots[-1].

    Between two knots the curve has two derivatives, at a knot one.
    """
    grid = _grid(knots, points)
    widths = np.diff(grid)
    middle = 0.5 * (grid[1:] + grid[:-1])
    near = 0.25 * widths
    behind, here, ahead = curve(middle - near), curve(middle), curve(middle + near)
    first = (ahead - behind) / (2.0 * near)[:, None]
    second = (ahead - 2.0 * here + behind) / (near * near)[:, None]
    squares = _fastest(first, second, widths, rates)
    pace = np.sqrt(np.maximum(squares, 0.0))
    return float((2.0 * widths / (pace[1:] + pace[:-1])).sum())


def _grid(knots: Sequence[float], points: int) -> Floats:
    """Return a grid with every knot on it and as many points on every piece."""
    share = points // (len(knots) - 1)
    pieces = [np.linspace(one, two, share, endpoint=False) for one, two in pairwise(knots)]
    return np.concatenate([*pieces, [knots[-1]]])


def _fastest(first: Floats, second: Floats, widths: Floats, rates: Rates) -> Floats:
    """Return the greatest b (n + 1,) at the grid's points, given q' and q'' (n, 3) between them."""
    from scipy.optimize import linprog  # half a second, which processes of tests that import a machine need not wait
    from scipy.sparse import coo_array

    count = len(widths)
    up = np.where(first >= 0.0, rates.acceleration, rates.deceleration)
    down = np.where(first >= 0.0, rates.deceleration, rates.acceleration)
    onto_next = 0.5 * first / widths[:, None] + 0.5 * second
    onto_last = -0.5 * first / widths[:, None] + 0.5 * second
    # Rows scaled by their limits, so that one tolerance of the solver serves angles and lengths.
    rows = [(onto_last / up, onto_next / up), (-onto_last / down, -onto_next / down)]
    values = np.concatenate([np.concatenate((last.ravel(), after.ravel())) for last, after in rows])
    numbers = np.arange(3 * count)
    places = np.repeat(np.arange(count), 3)
    row = np.concatenate((numbers, numbers, numbers + 3 * count, numbers + 3 * count))
    column = np.concatenate((places, places + 1, places, places + 1))
    matrix = coo_array((values, (row, column)), shape=(6 * count, count + 1)).tocsr()
    most = np.min((np.asarray(rates.speed) / np.maximum(np.abs(first), 1e-12)) ** 2, axis=1)
    bounds = np.column_stack((np.zeros(count + 1), np.minimum(np.append(most, np.inf), np.insert(most, 0, np.inf))))
    bounds[[0, -1], 1] = 0.0
    scale = float(bounds[1:-1, 1].max())
    found = linprog(-np.ones(count + 1), A_ub=matrix * scale, b_ub=np.ones(6 * count), bounds=bounds / scale)
    assert found.success, found.message
    return found.x * scale
