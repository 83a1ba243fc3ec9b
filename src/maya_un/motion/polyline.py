"""A path as straight chords: which of its points is nearest to a place."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from maya_un.kinematics.mechanism import Floats


class NearestPoint(NamedTuple):
    """The nearest point of a path: its chord, its share of that chord (0 to 1), and the vector from it to the place."""

    chord: int
    share: float
    away: Floats


class Polyline:
    """Chords through `places` (n, k), at least two, in any unit."""

    def __init__(self, places: Floats) -> None:
        self._starts, self._ways = places[:-1], places[1:] - places[:-1]
        squares = np.einsum("ij,ij->i", self._ways, self._ways)
        self._squares = np.where(squares > 0.0, squares, 1.0)

    def nearest(self, place: Floats, chords: slice = slice(None), same: float = 0.0) -> NearestPoint:
        """Return the point nearest to `place` (k,) on these chords.

        If the squares of several distances differ by at most `same` [unit²], it lies on the first of their chords.
        """
        ways = self._ways[chords]
        apart = place - self._starts[chords]
        shares = np.einsum("ij,ij->i", apart, ways) / self._squares[chords]
        shares = np.minimum(np.maximum(shares, 0.0), 1.0)
        away = apart - shares[:, np.newaxis] * ways
        squares = np.einsum("ij,ij->i", away, away)
        found = int((squares <= squares.min() + same).argmax())
        return NearestPoint((chords.start or 0) + found, float(shares[found]), away[found])
