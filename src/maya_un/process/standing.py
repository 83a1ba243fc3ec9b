"""Which part stands where, found in an instant however many there are."""

from __future__ import annotations

from collections import defaultdict
from itertools import product
from math import dist

from maya_un.values import Point

SAME = 1e-6
"""Places nearer to each other than this [m] are one: less than a count of any axis moves the gripper."""

_GRAIN = 1e-4
_FAR = 1e6
"""Parts that are farther away than this [m] are out of reach, and are told apart by their distance alone."""

_Square = tuple[int, ...]


class PartMap:
    """Parts by their names and by their places [m]; `parts` holds None for a part that nobody knows the place of."""

    def __init__(self, parts: dict[str, Point | None]) -> None:
        self.parts = parts
        self._order = {name: number for number, name in enumerate(parts)}
        self._there: defaultdict[_Square, set[str]] = defaultdict(set)
        for name, place in parts.items():
            self._enter(name, place)

    def at(self, place: Point) -> str | None:
        """Return the part that stands at a place, however that was computed; of several the first that was named."""
        around = product(*({_square(value - SAME), _square(value + SAME)} for value in place))
        near = (name for square in around for name in self._there.get(square, ()))
        return min((name for name in near if self._stands(name, place)), key=self._order.__getitem__, default=None)

    def put(self, name: str, place: Point | None) -> None:
        """Have a part stand somewhere else, or nobody know where."""
        old = self.parts[name]
        if old is not None:
            self._there[tuple(map(_square, old))].discard(name)
        self.parts[name] = place
        self._enter(name, place)

    def _enter(self, name: str, place: Point | None) -> None:
        if place is not None:
            self._there[tuple(map(_square, place))].add(name)

    def _stands(self, name: str, place: Point) -> bool:
        here = self.parts[name]
        return here is not None and dist(here, place) < SAME


def _square(value: float) -> int:
    return round(max(-_FAR, min(_FAR, value)) / _GRAIN)
