"""From a path to a coordinated sequence: segments in counts, their speeds, and how long it will take.

In the controller's linear mode the speed is the norm over the listed axes in counts/s. It accelerates at VA and
brakes at VD; VD is the deceleration of a stop and cannot be changed while the sequence runs. The normal slow-down is
therefore a staircase: segments whose end speeds fall in steps of at most 2 % of the slew speed. The controller
brakes at VD inside each, and each is just long enough for the mean deceleration over it to be the axes' own limit.

    per segment n (counts), L = |n|:   speed ≤ minᵢ spᵢ L/|nᵢ|     D = minᵢ dcᵢ L/|nᵢ|
    from s to e over L at mean D:      (s − e)·s = D L + D (s − e)²/2VD

so the speed limit of an axis is exact, its deceleration limit holds for the mean over each segment, and the bound at
any instant is the stop's deceleration. Speeds are planned from the end backwards; what the controller makes of them
is `maya_un.motion.profile`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, sqrt
from typing import NamedTuple

from maya_un.config import Config, Units
from maya_un.errors import InvalidValue
from maya_un.motion.move import CoordinatedMove, Counts, Segment, norm
from maya_un.motion.path import JointPath

STEP = 0.02
"""Largest step of an axis' speed inside a segment or at a corner, as a share of its slew speed."""

LONGEST = 8_388_607
"""Largest distance of one axis in one segment [counts]."""

_SLOWEST = 2
_QUANTUM = 1024


@dataclass(frozen=True, slots=True)
class Limits:
    """What the axes a, b, c can do: speeds in counts/s, accelerations in counts/s²; `letters` on the controller."""

    letters: tuple[str, str, str]
    speed: tuple[int, int, int]
    acceleration: tuple[int, int, int]
    deceleration: tuple[int, int, int]
    stop_deceleration: tuple[int, int, int]

    @classmethod
    def of(cls, config: Config) -> Limits:
        """Return the limits of a configuration."""
        a, b, c = config.axes.a, config.axes.b, config.axes.c
        return cls(
            (a.letter, b.letter, c.letter),
            (a.speed_counts, b.speed_counts, c.speed_counts),
            (a.acceleration_counts, b.acceleration_counts, c.acceleration_counts),
            (a.deceleration_counts, b.deceleration_counts, c.deceleration_counts),
            (a.stop_deceleration_counts, b.stop_deceleration_counts, c.stop_deceleration_counts),
        )


def plan(path: JointPath, limits: Limits, units: Units, speed_scale: float = 1.0) -> CoordinatedMove:
    """Return the coordinated move along `path`, from its first waypoint (where the robot must be) to its last.

    `speed_scale` in (0, 1] slows the cruise, not the ramps. At a corner the speed is such that no axis' speed
    jumps by more than 2 % of its slew: next to rest at a sharp one. A path that is shorter than a count gives a
    move without segments. Raises `InvalidValue` for a scale out of range.
    """
    if not 0.0 < speed_scale <= 1.0:
        raise InvalidValue(key="speed_scale", value=speed_scale, reason="it is a share, above 0 and at most 1")
    knots = [units.to_counts(waypoint) for waypoint in path.waypoints]
    legs = [_Leg.of(start, end) for start, end in pairwise(knots) if start != end]
    pace = _Pace.of(limits, legs, speed_scale)
    segments: list[Segment] = []
    end_speed = 0
    for index in range(len(legs) - 1, -1, -1):
        leg = legs[index]
        corner = pace.corner(legs[index - 1], leg) if index else 0
        segments += pace.backwards(leg, corner, end_speed)
        end_speed = max(_SLOWEST, min(corner, segments[-1].speed))
    segments.reverse()
    return CoordinatedMove.along(knots[0], segments, limits.letters, pace.va, pace.vd, units)


class _Leg(NamedTuple):
    """A straight piece of the path: its counts, its length, its direction."""

    counts: Counts
    length: float
    direction: tuple[float, float, float]

    @classmethod
    def of(cls, start: Counts, end: Counts) -> _Leg:
        counts = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
        length = norm(counts)
        return cls(counts, length, (counts[0] / length, counts[1] / length, counts[2] / length))


class _Pace(NamedTuple):
    """The limits of one move, turned into what a segment may do along its own direction."""

    per_speed: tuple[float, ...]
    per_deceleration: tuple[float, ...]
    scale: float
    va: int
    vd: int

    @classmethod
    def of(cls, limits: Limits, legs: list[_Leg], scale: float) -> _Pace:
        directions = [leg.direction for leg in legs] or [(1.0, 1.0, 1.0)]
        return cls(
            tuple(1.0 / speed for speed in limits.speed),
            tuple(1.0 / deceleration for deceleration in limits.deceleration),
            scale,
            min(_floor(_along(limits.acceleration, direction), _QUANTUM) for direction in directions),
            min(_floor(_along(limits.stop_deceleration, direction), _QUANTUM) for direction in directions),
        )

    def slew(self, counts: Counts, length: float) -> float:
        """Return the speed along a segment at which the first of its axes is at its slew speed."""
        one, two, three = self.per_speed
        return length / max(abs(counts[0]) * one, abs(counts[1]) * two, abs(counts[2]) * three)

    def deceleration(self, counts: Counts, length: float) -> float:
        """Return the mean deceleration that a segment may have; never more than the controller brakes with."""
        one, two, three = self.per_deceleration
        return min(self.vd, length / max(abs(counts[0]) * one, abs(counts[1]) * two, abs(counts[2]) * three))

    def corner(self, before: _Leg, after: _Leg) -> int:
        """Return the speed through a corner at which no axis' speed jumps by more than `STEP` of its slew."""
        jump = max(
            abs(two - one) * per_speed
            for one, two, per_speed in zip(before.direction, after.direction, self.per_speed, strict=True)
        )
        fastest = self.scale * min(self.slew(before.counts, before.length), self.slew(after.counts, after.length))
        return max(_SLOWEST, _floor(min(fastest, STEP / jump) if jump > 0.0 else fastest, 2))

    def segment(self, counts: Counts, end_speed: int) -> Segment:
        """Return the segment with the fastest speed from which it may slow down to `end_speed`."""
        length = norm(counts)
        slew = self.slew(counts, length)
        mean = self.deceleration(counts, length)
        steepness = 0.5 * mean / self.vd
        rest = end_speed * (1.0 - 2.0 * steepness)
        reach = mean * length + steepness * end_speed * end_speed
        fastest = (rest + sqrt(rest * rest + 4.0 * (1.0 - steepness) * reach)) / (2.0 * (1.0 - steepness))
        step = max(_SLOWEST, _floor(STEP * slew, 2))
        speed = max(_SLOWEST, _floor(min(fastest, end_speed + step, self.scale * slew), 2))
        return Segment(counts, speed, min(end_speed, speed))

    def backwards(self, leg: _Leg, entry: int, end_speed: int) -> list[Segment]:
        """Return the segments of a leg, the last one first: the staircase down to `end_speed`, then the rest.

        Stairs are laid from the end of the leg until the rest can make the last step to the cruise, or until
        a speed that cannot be reached from the entry speed anyway. They end on whole counts of the axis that
        limits the speed, so that rounding does not turn the direction towards it.
        """
        counts, length, _ = leg
        slew, mean = self.slew(counts, length), self.deceleration(counts, length)
        step = max(_SLOWEST, _floor(STEP * slew, 2))
        steepness = 0.5 * mean / self.vd
        grid = max((abs(count) * slow, abs(count)) for count, slow in zip(counts, self.per_speed, strict=True))[1]
        way, laid, speed = 0.0, (0, 0, 0), end_speed
        stairs: list[Segment] = []
        while speed + step < self.scale * slew and speed * speed - entry * entry < 2.0 * self.va * (length - way):
            way += (step * (speed + step) - steepness * step * step) / mean
            marks = ceil(way / length * grid)
            if marks >= grid:
                break
            way = marks / grid * length
            reached = _share(counts, marks / grid)
            stairs.append(self.segment(_minus(reached, laid), speed))
            laid, speed = reached, stairs[-1].speed
        for rest in _split(_minus(counts, laid)):
            stairs.append(self.segment(rest, speed))
            speed = stairs[-1].speed
        return stairs


def _along(limits: tuple[int, int, int], direction: tuple[float, float, float]) -> float:
    return min(limit / abs(share) for limit, share in zip(limits, direction, strict=True) if share)


def _floor(value: float, quantum: int) -> int:
    return int(value) // quantum * quantum


def _share(counts: Counts, share: float) -> Counts:
    return round(counts[0] * share), round(counts[1] * share), round(counts[2] * share)


def _minus(one: Counts, two: Counts) -> Counts:
    return one[0] - two[0], one[1] - two[1], one[2] - two[2]


def _split(counts: Counts) -> Iterator[Counts]:
    """Yield a way in parts that the controller takes, none of them empty."""
    parts = ceil(max(map(abs, counts)) / LONGEST)
    done = (0, 0, 0)
    for part in range(1, parts + 1):
        reached = _share(counts, part / parts)
        yield _minus(reached, done)
        done = reached
