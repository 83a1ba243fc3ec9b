"""The workspace's vertical section: the reachable depths h at each radial distance u, and the nearest place in it.

For a given u every limit is an interval of h: the strokes are circles about the two anchors, the tension limit is a
closed curve above (`mechanism.shallowest`), the table a line below. The section is therefore the area between two
curves, low(u) ≤ h ≤ high(u) over 0 ≤ u ≤ W, and stays so for every configuration.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from math import hypot, inf, pi, sqrt

import numpy as np

from maya_un.kinematics.mechanism import Floats, shallowest, shallowest_many

_COLUMNS = 2001
_NODES = 40
_HALVINGS = 50
_GOLDEN = 0.5 * (sqrt(5.0) - 1.0)


@dataclass(frozen=True, slots=True)
class Section:
    """The area of reachable points (u, h) [m] in the vertical plane of the boom.

    `stroke_b` and `stroke_c` [m], `tension_limit` [loads] and the depth of the table `deepest` [m] bound it. `inset`
    [m] shrinks the area from every side; it is 0 for the area itself.
    """

    width: float
    stroke_b: tuple[float, float]
    stroke_c: tuple[float, float]
    tension_limit: float
    deepest: float
    inset: float = 0.0

    def shrunk(self, inset: float) -> Section:
        """Return the same section smaller by `inset` [m] on every side."""
        return replace(self, inset=inset)

    def depths(self, u: float) -> tuple[float, float] | None:
        """Return the interval of reachable depths (low, high) [m] at `u`, None if it is empty."""
        W, inset = self.width, self.inset
        if not inset <= u <= W - inset:
            return None
        near, far = u * u, (W - u) * (W - u)
        low = max(
            _root((self.stroke_b[0] + inset) ** 2 - near),
            _root((self.stroke_c[0] + inset) ** 2 - far),
            shallowest(u, W, self.tension_limit) + inset,
        )
        high = min(
            _root((self.stroke_b[1] - inset) ** 2 - near),
            _root((self.stroke_c[1] - inset) ** 2 - far),
            self.deepest - inset,
        )
        return (low, high) if low <= high else None

    def spare(self, u: Floats, h: Floats) -> Floats:
        """Return at most the distance of places (u, h) inside the section [m], each (n,); negative outside.

        It changes by no more than the place does: each stroke is a distance to an anchor, and the depth below the
        tension's curve is divided by the greatest change per step.
        """
        W = self.width
        b, c = np.hypot(u, h), np.hypot(W - u, h)
        pulled = (h - shallowest_many(np.clip(u, 0.0, W), W, self.tension_limit)) / _steepest(self.tension_limit)
        limits = [
            *(u, W - u, self.deepest - h, pulled),
            *(b - self.stroke_b[0], self.stroke_b[1] - b, c - self.stroke_c[0], self.stroke_c[1] - c),
        ]
        return np.min(limits, axis=0) - self.inset

    def area(self) -> float:
        """Return the size of the section [m²], with a relative error of at most 1e-6."""
        return self._integral(np.ones_like)

    def moment(self, axis: float) -> float:
        """Return the section's first moment about the vertical line at u = `axis` [m³].

        It is the area times the distance of its centroid, and the volume that the section fills when it is turned about
        this line by one radian. The relative error is at most 1e-6.
        """
        return self._integral(lambda u: u - axis)

    def _integral(self, weight: Callable[[Floats], Floats]) -> float:
        """Return ∫ weight(u) (high(u) − low(u)) du, by Gauss's rule between the kinks of the two curves.

        The substitution u = middle − half cos θ removes the vertical slope of a circle at the anchors' height.
        """
        nodes, shares = np.polynomial.legendre.leggauss(_NODES)
        angle = 0.5 * pi * (nodes + 1.0)
        breaks = self._kinks()
        half = 0.5 * np.diff(breaks)[:, None]
        u = breaks[:-1, None] + half * (1.0 - np.cos(angle))
        low, high = _low_and_high(self, u.ravel())
        thickness = np.maximum(high - low, 0.0).reshape(u.shape)
        return float((weight(u) * thickness * half * np.sin(angle) * (0.5 * pi * shares)).sum())

    def _kinks(self) -> Floats:
        """Return all u at which the two curves may have a kink, and both ends, in order."""
        W, inset = self.width, self.inset
        ends = (inset, W - inset)
        radii = [
            length + sign * inset for length, sign in zip((*self.stroke_b, *self.stroke_c), (1, -1, 1, -1), strict=True)
        ]
        starts = [radii[0], radii[1], W - radii[2], W - radii[3], 0.5 * W]
        found = np.array([*ends, *np.clip(starts, *ends), *self._crossings()])
        return np.unique(found)

    def _crossings(self) -> Floats:
        """Return the u at which two of the limits meet, by bisection between the columns of a grid."""
        grid = np.linspace(self.inset, self.width - self.inset, _COLUMNS)
        one, other = np.triu_indices(len(_limits(self, grid)), 1)
        apart = _limits(self, grid)[one] - _limits(self, grid)[other]
        pair, column = np.nonzero(np.sign(apart[:, :-1]) * np.sign(apart[:, 1:]) < 0.0)
        one, other, rising = one[pair], other[pair], apart[pair, column] < 0.0
        left, right, rows = grid[column], grid[column + 1], np.arange(len(pair))
        for _ in range(_HALVINGS):
            middle = 0.5 * (left + right)
            limits = _limits(self, middle)
            before = (limits[one, rows] < limits[other, rows]) == rising
            left, right = np.where(before, middle, left), np.where(before, right, middle)
        return left

    def is_empty(self) -> bool:
        """Return whether no place is reachable."""
        _, low, high = _curves(self)
        return not bool(np.any(low <= high))

    def nearest(self, u: float, h: float) -> tuple[float, float]:
        """Return the point of the section that is nearest to the point (u, h) of its plane [m].

        Scans a grid of u, then refines around the best column by a golden-section search. Do not call this for an
        empty section.
        """
        grid, low, high = _curves(self)
        gap = np.clip(h, low, high) - h
        distance = np.where(low <= high, (grid - u) ** 2 + gap * gap, inf)
        best = int(np.argmin(distance))
        left, right = grid[max(0, best - 1)], grid[min(_COLUMNS - 1, best + 1)]
        refined = self._refine(float(left), float(right), u, h)
        column = min((float(grid[best]), refined), key=lambda at: self._distance(at, u, h))
        depths = self.depths(column)
        assert depths is not None, "the best column of a section that is not empty has depths"
        return column, min(max(h, depths[0]), depths[1])

    def _distance(self, column: float, u: float, h: float) -> float:
        depths = self.depths(column)
        if depths is None:
            return inf
        gap = min(max(h, depths[0]), depths[1]) - h
        return (column - u) ** 2 + gap * gap

    def _refine(self, left: float, right: float, u: float, h: float) -> float:
        inner = right - _GOLDEN * (right - left)
        outer = left + _GOLDEN * (right - left)
        at_inner, at_outer = self._distance(inner, u, h), self._distance(outer, u, h)
        for _ in range(60):
            if at_inner <= at_outer:
                right, outer, at_outer = outer, inner, at_inner
                inner = right - _GOLDEN * (right - left)
                at_inner = self._distance(inner, u, h)
            else:
                left, inner, at_inner = inner, outer, at_outer
                outer = left + _GOLDEN * (right - left)
                at_outer = self._distance(outer, u, h)
        return inner if at_inner <= at_outer else outer


def _steepest(tension_limit: float) -> float:
    """Return a bound of √(1 + f'²) for the tension's curve f(u), from |f'| ≤ 1/q + 1/4q³ with q = √(k² − 1)."""
    q = sqrt(tension_limit * tension_limit - 1.0)
    return hypot(1.0, 1.0 / q + 0.25 / q**3)


def _root(square: float) -> float:
    return sqrt(square) if square > 0.0 else 0.0


def _limits(section: Section, u: Floats) -> Floats:
    """Return the depths [m] of all limits at u (n,), shape (6, n): three upper ones, then three lower ones."""
    W, inset = section.width, section.inset
    near, far = u * u, (W - u) * (W - u)
    (short_b, long_b), (short_c, long_c) = section.stroke_b, section.stroke_c
    squares = [(short_b + inset) ** 2 - near, (short_c + inset) ** 2 - far]
    squares += [(long_b - inset) ** 2 - near, (long_c - inset) ** 2 - far]
    top_b, top_c, bottom_b, bottom_c = np.sqrt(np.maximum(squares, 0.0))
    pulled = shallowest_many(u, W, section.tension_limit) + inset
    return np.array([top_b, top_c, pulled, bottom_b, bottom_c, np.full_like(u, section.deepest - inset)])


def _low_and_high(section: Section, u: Floats) -> tuple[Floats, Floats]:
    """Return the two curves at u, each (n,); `high` is less than `low` where no depth is reachable."""
    limits = _limits(section, u)
    return limits[:3].max(axis=0), limits[3:].min(axis=0)


@lru_cache(maxsize=8)
def _curves(section: Section) -> tuple[Floats, Floats, Floats]:
    """Return a grid of u and the two curves above it, each (n,)."""
    grid = np.linspace(section.inset, section.width - section.inset, _COLUMNS)
    return grid, *_low_and_high(section, grid)
