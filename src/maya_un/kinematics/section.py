"""The workspace's vertical section: which depths h are reachable at each radial distance u, and the nearest of them.

For a given u every limit is an interval of h: the strokes are circles about the two anchors, the tension limit is
a closed curve above (`statics.shallowest`), the table a line below. The section is therefore the area between
two curves, low(u) ≤ h ≤ high(u) over 0 ≤ u ≤ W, and stays so for every configuration.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from math import inf, sqrt

import numpy as np

from maya_un.kinematics.mechanism import Floats
from maya_un.kinematics.statics import shallowest

_COLUMNS = 2001
_GOLDEN = 0.5 * (sqrt(5.0) - 1.0)


@dataclass(frozen=True, slots=True)
class Section:
    """Reachable (u, h) [m]: strokes of the lines, tension limit in loads, greatest depth (the table) [m].

    `inset` [m] shrinks the area from every side; it is 0 for the area itself.
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
        """Return the interval of reachable depths (low, high) [m] at `u`, None where there is none."""
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

    def is_empty(self) -> bool:
        """Whether no place at all is reachable."""
        _, low, high = _curves(self)
        return not bool(np.any(low <= high))

    def nearest(self, u: float, h: float) -> tuple[float, float]:
        """Return the place (u, h) of the section that is nearest to any place of its plane [m].

        Scans all u on a grid, then refines around the best column by golden section. The section must not be
        empty.
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


def _root(square: float) -> float:
    return sqrt(square) if square > 0.0 else 0.0


@lru_cache(maxsize=8)
def _curves(section: Section) -> tuple[Floats, Floats, Floats]:
    """Return a grid of u and the two curves above it, (inf, −inf) where nothing is reachable; each (n,)."""
    grid = np.linspace(section.inset, section.width - section.inset, _COLUMNS)
    low, high = np.array([section.depths(float(u)) or (inf, -inf) for u in grid]).T
    return grid, low, high
