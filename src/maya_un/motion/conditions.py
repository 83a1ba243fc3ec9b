"""The limits of the workspace as polynomials along many chords at once.

Along a chord, straight in (a, b, c), b and c are linear in t and u = (W² + b² − c²)/2W is quadratic, so every limit
is a polynomial condition on 0 ≤ t ≤ 1:

    strokes, boom, b + c ≥ W      degree 1: kept between the ends if kept at the ends
    u ≥ 0,  W − u ≥ 0             degree 2
    z ≥ 0                         (H − Φ)² − b² + u² ≥ 0, degree 4
    T_b ≤ k                       k²W²(b² − u²) − (W − u)²b² ≥ 0, degree 6
    T_c ≤ k                       k²W²(b² − u²) − u²c² ≥ 0, degree 6

A polynomial of degree 6 is known by its values at seven places, and its Bernstein coefficients are these values
times a constant matrix. On [0, 1] it lies between the least and the greatest coefficient, the first and the last are
its values at the ends, and the coefficients of its two halves are again constant matrices away (de Casteljau).
"""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import NDArray

from maya_un.kinematics.mechanism import Floats
from maya_un.kinematics.workspace import Workspace

ROUNDING = 1e-11
"""Rounding of the coefficients, relative to the size of the terms they are made of."""

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
    """Return the five conditions that the ends of a chord do not settle, at lengths of shape s: shape (5, *s).

    They are u, W − u, z, T_b and T_c, as the module's head has them, each divided by the size of its terms: kept
    where it is at least 0.
    """
    W, deepest = workspace.mechanism.width, workspace.mechanism.reach_down
    out = np.empty((len(b), 5, *b.shape[1:])).swapaxes(0, 1)  # places first is how coefficients want it
    bb, cc = b * b, c * c
    u = (bb - cc) * (0.5 / (W * W)) + 0.5  # all lengths as shares of W from here
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
    """Return the seven places at which polynomials along chords are known, for rows of (k, n): (k, 7, n)."""
    return starts[:, np.newaxis] + _SHARES[:, np.newaxis] * (ends - starts)[:, np.newaxis]


def coefficients(sampled: Floats) -> Floats:
    """Return the Bernstein coefficients (7, k, n) of polynomials whose values at seven places are known (k, 7, n)."""
    known = sampled.swapaxes(0, 1)
    found = (_TO_COEFFICIENTS @ known.reshape(_DEGREE + 1, -1)).reshape(known.shape)
    # The matrix leaves the ends as they are but for rounding, which must not matter to what is at rest at a limit.
    found[0], found[-1] = known[0], known[-1]
    return found


def falling(coefficients: Floats) -> list[int]:
    """Return the numbers of the chords on which a condition is broken further than at both ends, in order.

    `coefficients` has shape (7, k, n). If thirty halvings prove neither, the chord counts as broken.
    """
    allowed = np.minimum(0.0, np.minimum(coefficients[0], coefficients[-1])) - ROUNDING
    return np.flatnonzero(dips(coefficients - allowed, _DEEPEST)).tolist()


def dips(coefficients: Floats, halvings: int) -> NDArray[np.bool_]:
    """Return on which chords (n,) not all conditions (7, k, n) are proved to be at least 0 by so many halvings."""
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
