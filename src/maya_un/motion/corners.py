"""How far to cut a corner so that the leg before slows down exactly while the leg behind speeds up."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from maya_un.config import Units
from maya_un.kinematics import Mechanism
from maya_un.motion.limits import Limits
from maya_un.motion.path import Blend, Space, Waypoint, to_joints

_STEP = 1e-4


class LegLimits(NamedTuple):
    """Limits of the axes along a leg: speed [m/s] and acceleration [m/s²] of the gripper.

    `lines` tells how much of their speed the lines need for it, from 0 to 1: 1 where they are what limits it.
    """

    speed: float
    acceleration: float
    lines: float

    def after(self, run_up: float) -> float:
        """Return the speed that is reached from rest over a run-up [m]."""
        return min(self.speed, sqrt(2.0 * self.acceleration * run_up))


def pace(
    space: Space, start: Waypoint, end: Waypoint, length: float, mechanism: Mechanism, units: Units, limits: Limits
) -> LegLimits:
    """Return what the axes allow about `start` on the way to `end`, which is `length` away [m].

    It is the pace of the directions there: bends are left to the timing.
    """
    share = min(1.0, _STEP / length)
    near = [one + (two - one) * share for one, two in zip(start, end, strict=True)]
    here, there = to_joints(space, mechanism, np.array([start, near]))
    ways = zip((there - here).tolist(), units.per_unit, strict=True)
    rates = [max(abs(way) * per_unit / (share * length), 1e-9) for way, per_unit in ways]
    speeds = [speed / rate for speed, rate in zip(limits.speed, rates, strict=True)]
    slowest = map(min, limits.acceleration, limits.deceleration)
    acceleration = min(most / rate for most, rate in zip(slowest, rates, strict=True))
    return LegLimits(min(speeds), acceleration, min(speeds) / min(speeds[1:]))


def overlap(before: LegLimits, speed_before: float, behind: LegLimits, room: float) -> Blend:
    """Return the blend in which the leg before slows down from `speed_before` [m/s] while the leg behind speeds up.

    `room` is the most that the blend may take of the leg behind [m].
    """
    speed = behind.speed
    slowing, rising = speed_before / before.acceleration, speed / behind.acceleration
    whole = max(slowing, rising)
    after = speed * (whole - 0.5 * rising)
    if after > room:
        return _tight(before, speed_before, behind, room)
    return Blend(speed_before * (whole - 0.5 * slowing), after, slowing / whole, rising / whole)


def reversed_blend(blend: Blend) -> Blend:
    """Return the blend of the same corner gone through the other way."""
    return Blend(blend.after, blend.before, blend.rise, blend.fall)


def _tight(before: LegLimits, speed_before: float, behind: LegLimits, room: float) -> Blend:
    """Return a blend for a short leg behind: one parabola, as long as the leg's own acceleration needs."""
    whole = sqrt(2.0 * room / behind.acceleration)
    slowing = min(whole, speed_before / before.acceleration)
    return Blend(before.acceleration * slowing * (whole - 0.5 * slowing), room, slowing / whole, 1.0)
