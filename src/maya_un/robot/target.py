"""The place that is asked for, and the approach point above it: refused by the name of the first."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from math import dist, floor

from maya_un.errors import Unreachable
from maya_un.kinematics.workspace import Limit, Workspace
from maya_un.values import Point

_ROUNDS = 200


def raised(target: Point, height: float) -> Point:
    """Return the point `height` [m] above `target`."""
    return target._replace(z=target.z + height)


def require_above(workspace: Workspace, target: Point, clearance: float, *, touched: bool) -> Point:
    """Return the approach point, `clearance` [m] above `target`.

    Raises `Unreachable` where it, or with `touched` the target itself, is outside the workspace; its `nearest` is a
    target too, that keeps both within.
    """
    own = workspace.why_not(target) if touched else None
    reason = own or workspace.why_not(raised(target, clearance))
    if reason is None:
        return raised(target, clearance)
    words = str(reason)
    if own is None and reason.limit is not Limit.NUMBER:
        words = f"its approach point is {clearance * 1e3:.4g} mm higher, and there {reason}"

    def accepts(place: Point) -> bool:
        return all(
            workspace.why_not(point) is None
            for point in (raised(place, clearance), *((place,) if touched else ()))
        )

    nearest = _nearest(workspace, target, clearance, accepts)
    raise Unreachable(
        target=text(target),
        reason=words,
        nearest=text(_in_tenths(nearest, accepts)),
        limit=str(reason.limit),
        excess=reason.excess,
        nearest_point=tuple(nearest),
    )


def text(point: Point) -> str:
    """Return a point [m] for people."""
    return f"({point.x:.4f}, {point.y:.4f}, {point.z:.4f}) m"


def _nearest(workspace: Workspace, target: Point, clearance: float, accepts: Callable[[Point], bool]) -> Point:
    """Return the nearest place that is accepted: by one of its two points, else by going back and forth."""

    def by_above(place: Point) -> Point:
        return raised(workspace.nearest(raised(place, clearance)), -clearance)

    place = by_above(target)
    if accepts(place):
        return place
    place = workspace.nearest(target)
    for _ in range(_ROUNDS):
        if accepts(place):
            break
        place = workspace.nearest(by_above(place))
    return place


def _in_tenths(point: Point, accepts: Callable[[Point], bool]) -> Point:
    """Return an accepted place in whole tenths of a millimetre beside `point`, so that its text can be used."""
    steps = [[(floor(value * 1e4) + step) / 1e4 for step in (-1, 0, 1, 2)] for value in point]
    beside = sorted((Point(*place) for place in product(*steps)), key=lambda place: dist(place, point))
    return next((place for place in beside if accepts(place)), point)
