"""How near a path comes to its limits, and how low and how high it takes the gripper.

Straight in joints is not straight in space: between two places of equal height the gripper dips or rises.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

from maya_un.kinematics.mechanism import Mechanism
from maya_un.motion.proof import between
from maya_un.values import Joints, Point

_STEPS = 16


def lowest(mechanism: Mechanism, waypoints: Sequence[Joints]) -> Point:
    """Return the point of the straight legs between waypoints where the gripper is lowest.

    Raises `Unreachable` where the lines cannot meet.
    """
    legs = pairwise(waypoints)
    return min((_extreme(mechanism, *leg, sign=1.0) for leg in legs), key=lambda point: point.z)


def highest(mechanism: Mechanism, waypoints: Sequence[Joints]) -> Point:
    """Return the point of the path where the gripper is highest; raises as `lowest` does."""
    legs = pairwise(waypoints)
    return max((_extreme(mechanism, *leg, sign=-1.0) for leg in legs), key=lambda point: point.z)


def _extreme(mechanism: Mechanism, start: Joints, end: Joints, sign: float) -> Point:
    """Return the lowest (sign 1) or highest (sign −1) point of one leg."""
    W = mechanism.width
    _, b, c = start
    along_b, along_c = end.b - b, end.c - c

    def depth(t: float) -> float:
        b_t, c_t = b + along_b * t, c + along_c * t
        u = 0.5 * W + (b_t - c_t) * (b_t + c_t) / (2.0 * W)
        return sign * (b_t - u) * (b_t + u)

    shares = [step / _STEPS for step in range(_STEPS + 1)]
    best = max(shares, key=depth)
    peak = _peak(depth, max(0.0, best - 1.0 / _STEPS), min(1.0, best + 1.0 / _STEPS))
    return mechanism.fk(between(start, end, max((best, peak), key=depth)))


def _peak(function: Callable[[float], float], left: float, right: float) -> float:
    """Return where a function with one peak between `left` and `right` has it."""
    for _ in range(40):
        third = (right - left) / 3.0
        if function(left + third) < function(right - third):
            left += third
        else:
            right -= third
    return 0.5 * (left + right)
