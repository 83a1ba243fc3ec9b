"""The way across the table: from where the gripper is to the approach point of a target, never low on the way.

A path that is straight in (a, b, c) sags between two places at the same height: from d = 0.90 m to 1.70 m at
z = 0.50 m by 35 mm. So a crossing has a floor, below which the gripper does not come, and is the first of these
that keeps above it and passes the controller's own check:

1. straight;
2. over a point half way, raised by little more than the sag;
3. up to a common height, straight across, down.

A start below the floor is left straight up first, a goal below it is reached straight down.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from math import cos, hypot, sin

from maya_un.controller.protocol import Preview
from maya_un.errors import PathRefused, Unreachable
from maya_un.kinematics.mechanism import Mechanism
from maya_un.motion.path import JointPath, lowest_point
from maya_un.values import Joints, Point

TOLERANCE = 1e-5
"""Heights closer than this [m] are the same: ten counts of a line."""

_LIFTS = (1.1, 1.25, 1.5, 2.0, 3.0, 5.0)
"""How far a way is raised, in multiples of the straight path's sag."""

Way = tuple[Joints, ...]
Check = Callable[[Sequence[Joints]], Preview]


def raised(mechanism: Mechanism, joints: Joints, height: float) -> Joints:
    """Return the joints straight above (or below) `joints`, with the gripper point at `height` [m].

    Raises `Unreachable` above the anchors.
    """
    x, y, _ = mechanism.fk(joints)
    return mechanism.ik(Point(x, y, height))._replace(a=joints.a)


def cross(mechanism: Mechanism, check: Check, start: Joints, goal: Joints, floor: float) -> tuple[Way, Preview]:
    """Return the way from `start` to `goal` that crosses above `floor` [m], and its preview by `check`.

    Raises what `check` says of the last way tried, or `PathRefused` where none keeps above the floor.
    """
    first, last = _above(mechanism, start, floor), _above(mechanism, goal, floor)
    refusal: PathRefused | Unreachable | None = None
    for middle in _ways(mechanism, first, last, floor):
        if _sag(mechanism, middle, floor) > TOLERANCE:
            continue
        way = _distinct((start, *middle, goal))
        try:
            return way, check(way)
        except (PathRefused, Unreachable) as error:
            refusal = error
    if refusal is None:
        x, y, z = mechanism.fk(goal)
        reason = f"every way found comes lower than {floor:.3f} m above the table"
        raise PathRefused(target=f"({x:.3f}, {y:.3f}, {z:.3f}) m", reason=reason)
    raise refusal


def _above(mechanism: Mechanism, joints: Joints, floor: float) -> Joints:
    """Return `joints`, or the joints straight above them at the floor where they are lower."""
    return joints if mechanism.fk(joints).z >= floor - TOLERANCE else raised(mechanism, joints, floor)


def _ways(mechanism: Mechanism, first: Joints, last: Joints, floor: float) -> Iterator[Way]:
    """Yield the candidates, the simplest first, each family until it leads above the anchors."""
    yield first, last
    sag = _sag(mechanism, (first, last), floor)
    for family in (_over_the_middle, _at_one_height):
        for factor in _LIFTS:
            try:
                way = family(mechanism, first, last, factor * sag)
            except Unreachable:
                break
            yield way


def _over_the_middle(mechanism: Mechanism, first: Joints, last: Joints, lift: float) -> Way:
    here, there = mechanism.fk(first), mechanism.fk(last)
    a, d = 0.5 * (first.a + last.a), 0.5 * (hypot(here.x, here.y) + hypot(there.x, there.y))
    middle = Point(d * sin(a), d * cos(a), 0.5 * (here.z + there.z) + lift)
    return first, mechanism.ik(middle), last


def _at_one_height(mechanism: Mechanism, first: Joints, last: Joints, lift: float) -> Way:
    height = max(mechanism.fk(first).z, mechanism.fk(last).z) + lift
    return first, raised(mechanism, first, height), raised(mechanism, last, height), last


def _sag(mechanism: Mechanism, way: Way, floor: float) -> float:
    """Return how far `way` comes below `floor` [m], 0 where it does not."""
    return max(0.0, floor - lowest_point(mechanism, JointPath(way)).z)


def _distinct(way: Way) -> Way:
    """Return `way` without points that repeat the one before; two points at least."""
    kept = [way[0]]
    kept.extend(point for last, point in pairwise(way) if point != last)
    return tuple(kept) if len(kept) > 1 else (way[0], way[0])
