"""The place that is asked for, and the approach point above it: refused by the name of the first."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice, product
from math import dist, floor, hypot

from maya_un.kinematics.workspace import Limit, Reason, Workspace
from maya_un.values import Point

_ROUNDS = 200
_SHARES = tuple(0.001 * 2.0**step for step in range(10))


def text(point: Point) -> str:
    """Return a point [m] for people."""
    return f"({point.x:.4f}, {point.y:.4f}, {point.z:.4f}) m"


@dataclass(frozen=True, slots=True)
class ApproachTarget:
    """The requirement of a target on the workspace: that the point `clearance` [m] above it is within.

    With `touched`, the target itself as well.
    """

    workspace: Workspace
    clearance: float
    touched: bool

    def above(self, target: Point) -> Point:
        """Return the approach point of `target`."""
        return target._replace(z=target.z + self.clearance)

    def why_not(self, target: Point) -> Reason | None:
        """Return why `target` is not reachable, None where it is."""
        own = self.workspace.why_not(target) if self.touched else None
        reason = own or self.workspace.why_not(self.above(target))
        if reason is None or reason is own or reason.limit is Limit.NUMBER:
            return reason
        return replace(reason, text=f"its approach point is {self.clearance * 1e3:.4g} mm higher, and there {reason}")

    def candidates(self, target: Point, inside: Point | None) -> Iterator[Point]:
        """Yield reachable targets, the one nearest to `target` first, then deeper and deeper towards `inside`.

        They keep to the direction of the boom: only radius and height go towards those of `inside`.
        """
        nearest = self._nearest(target)
        yield from self._in_tenths(nearest)
        if inside is not None:
            ratio = hypot(inside.x, inside.y) / hypot(nearest.x, nearest.y)
            for share in _SHARES:
                stretch, height = 1.0 + (ratio - 1.0) * share, nearest.z + (inside.z - nearest.z) * share
                yield from self._in_tenths(Point(nearest.x * stretch, nearest.y * stretch, height))
        yield nearest

    def _nearest(self, target: Point) -> Point:
        """Return the nearest reachable target: by one of the two points, else by going back and forth."""
        place = self._by_above(target)
        if self.why_not(place) is None:
            return place
        place = self.workspace.nearest(target)
        for _ in range(_ROUNDS):
            if self.why_not(place) is None:
                break
            place = self.workspace.nearest(self._by_above(place))
        return place

    def _by_above(self, target: Point) -> Point:
        nearest = self.workspace.nearest(self.above(target))
        return nearest._replace(z=nearest.z - self.clearance)

    def _in_tenths(self, point: Point) -> Iterator[Point]:
        """Yield the nearest reachable target in whole tenths of a millimetre beside `point`, as its text has it."""
        steps = [[(floor(value * 1e4) + step) / 1e4 for step in (-1, 0, 1, 2)] for value in point]
        beside = sorted((Point(*place) for place in product(*steps)), key=lambda place: dist(place, point))
        yield from islice((place for place in beside if self.why_not(place) is None), 1)
