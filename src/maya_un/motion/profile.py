"""Limits of the axes in the controller's units, and the profiles of a DMC-41x3 under them, as a closed form.

A profile is the speed of a DMC-41x3 along the segments of a coordinated sequence.

Every segment has a length, a target speed (`<o`) and an end speed (`>p`). The controller accelerates towards the target
speed at VA, cruises, and brakes at VD just in time for the end speeds of the segment and of all later ones. It enters
the next segment with its present speed, and comes to rest at the end of the last. Lengths are in counts, measured as
the norm over the axes of the sequence; speeds in counts/s; accelerations in counts/s².

The speed ratio (Galil DMC-41x3, command VR) acts at once, at VA and VD. It scales the target speeds. The manual does
not specify whether it scales end speeds too. Here they are unscaled, but never above a scaled target; a caller that
checks the position at the predicted end is right in both cases. At a ratio of 0 the sequence brakes on its path and
stands there.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from math import inf, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from maya_un.config import Config
from maya_un.kinematics import Floats


@dataclass(frozen=True)
class Limits:
    """Limits of the axes a, b, c: speeds in counts/s, accelerations in counts/s²; `letters` on the controller.

    `jerk` is the greatest change of their accelerations [counts/s³], infinite for no limit.
    """

    letters: tuple[str, str, str]
    speed: tuple[int, int, int]
    acceleration: tuple[int, int, int]
    deceleration: tuple[int, int, int]
    stop_deceleration: tuple[int, int, int]
    jerk: tuple[float, float, float] = (inf, inf, inf)

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
            (a.jerk_counts or inf, b.jerk_counts or inf, c.jerk_counts or inf),
        )

    @cached_property
    def slew(self) -> Floats:
        """The speeds as a column (3, 1), to be compared with arrays (3, n)."""
        return _column(self.speed)

    @cached_property
    def rise(self) -> Floats:
        """The accelerations as a column."""
        return _column(self.acceleration)

    @cached_property
    def fall(self) -> Floats:
        """The decelerations as a column."""
        return _column(self.deceleration)

    @cached_property
    def stop(self) -> Floats:
        """The decelerations of a stop as a column."""
        return _column(self.stop_deceleration)


def _column(values: tuple[int, int, int]) -> Floats:
    return np.array(values, dtype=np.float64)[:, np.newaxis]


_ROUNDING = 1e-6
"""Counts: a ramp that misses its segment by less fits it, because only rounding causes such a difference."""


Speeds = Floats | NDArray[np.int64]
"""Speeds in counts/s, in whole numbers for the controller or not."""


class ProfilePiece(NamedTuple):
    """A piece of constant acceleration: begins at time `t` [s], way `s`, speed `v`; lasts until the next."""

    t: float
    s: float
    v: float
    acceleration: float


class ProfileLeg(NamedTuple):
    """A driven segment: the way at its end, its target speed, and the largest speed allowed at its end."""

    stop: float
    target: float
    bound: float


class _Legs(NamedTuple):
    """The legs in order, (n,) each, with the fields of `ProfileLeg`; `lengths` are the lengths of the legs."""

    lengths: Floats
    stops: Floats
    targets: Floats
    bounds: Floats

    @classmethod
    def of(cls, lengths: Floats, targets: Speeds, ends: Speeds, vd: float) -> _Legs:
        """Return the segments with the speed at every end bounded so that all later ends can be reached by braking."""
        bounds: Floats = ends.astype(np.float64)
        bounds[-1:] = 0.0
        squares = bounds * bounds
        if (squares[:-1] > squares[1:] + 2.0 * vd * lengths[1:]).any():
            bounds = _bounded(lengths, ends, vd)
        return cls(lengths, lengths.cumsum(), targets.astype(np.float64), bounds)


@dataclass(frozen=True, eq=False)
class SpeedProfile:
    """Way and speed over time: `course` (m, 4) has a row like `ProfilePiece` for every piece, in order of time.

    `duration` [s] is infinite if the sequence stands at a ratio of 0. `va` and `vd` are its accelerations.
    """

    course: Floats
    duration: float
    va: float
    vd: float
    driven: _Legs

    @classmethod
    def along(
        cls, segments: Iterable[tuple[float, float, float]], va: float, vd: float, ratio: float = 1.0
    ) -> SpeedProfile:
        """Return the profile over segments (length > 0, target speed > 0, end speed), from rest.

        `ratio` is the speed ratio from the start on, 0 or above.
        """
        table: Floats = np.array(list(segments), dtype=np.float64).reshape(-1, 3)
        return cls.over(table[:, 0], table[:, 1], table[:, 2], va, vd, ratio)

    @classmethod
    def over(
        cls, lengths: Floats, targets: Speeds, ends: Speeds, va: float, vd: float, ratio: float = 1.0
    ) -> SpeedProfile:
        """Return the profile over segments given as arrays (n,); otherwise as `along`."""
        legs = _Legs.of(lengths, targets, ends, vd)
        even = _even(legs, va, vd, ratio)
        if even is None:
            return cls._driven(_Run(va, vd), legs, 0, ratio)
        return cls(*even, va, vd, legs)

    @property
    def length(self) -> float:
        """The way of the whole sequence [counts]."""
        return float(self.driven.stops[-1]) if len(self.driven.stops) else 0.0

    @cached_property
    def legs(self) -> tuple[ProfileLeg, ...]:
        """The segments of the profile."""
        return _rows(self.driven.stops, self.driven.targets, self.driven.bounds)

    @cached_property
    def pieces(self) -> tuple[ProfilePiece, ...]:
        """The pieces of constant acceleration, in order of time."""
        return tuple(ProfilePiece(*row) for row in self.course.tolist())

    def at(self, t: float) -> tuple[float, float]:
        """Return (way [counts], speed [counts/s]) at time `t` [s]; before the start and after the end at rest."""
        if t <= 0.0 or not len(self.course):
            return 0.0, 0.0
        if t >= self.duration:
            return self.length, 0.0
        begun, s, v, acceleration = self.course[self.course[:, 0].searchsorted(t, side="right") - 1].tolist()
        passed = t - begun
        return min(self.length, s + passed * (v + 0.5 * acceleration * passed)), max(0.0, v + acceleration * passed)

    def changed(self, t: float, ratio: float) -> SpeedProfile:
        """Return the profile with the speed ratio `ratio` from time `t` [s] on; the part before `t` is unchanged."""
        if t >= self.duration:
            return self
        way, speed = self.at(t)
        past = self.pieces[: int(self.course[:, 0].searchsorted(max(0.0, t)))]
        here = int(self.driven.stops.searchsorted(way, side="right"))
        return self._driven(_Run(self.va, self.vd, max(0.0, t), way, speed, past), self.driven, here, ratio)

    def when(self, way: float) -> float:
        """Return the time at which the sequence has gone `way` [counts]; infinite if it stands before."""
        if way <= 0.0:
            return 0.0
        if way >= self.length:
            return self.duration
        index = int(self.course[:, 1].searchsorted(way, side="right")) - 1
        begun, s, v, acceleration = self.course[index].tolist()
        left = way - s
        speed = v + sqrt(max(0.0, v * v + 2.0 * acceleration * left))
        if speed <= 0.0:
            return begun if left <= 0.0 else inf
        until = float(self.course[index + 1, 0]) if index + 1 < len(self.course) else self.duration
        return min(begun + 2.0 * left / speed, until)

    @classmethod
    def _driven(cls, run: _Run, legs: _Legs, first: int, ratio: float) -> SpeedProfile:
        """Return the profile of the run over the legs from the `first` on, one by one."""
        stands = False
        for leg in _rows(legs.stops[first:], legs.targets[first:], legs.bounds[first:]):
            stands = not run.leg(leg, ratio * leg.target)
            if stands:
                break
        course = np.array(run.pieces, dtype=np.float64).reshape(-1, 4)
        return cls(course, inf if stands else run.t, run.va, run.vd, legs)


def _rows(stops: Floats, targets: Floats, bounds: Floats) -> tuple[ProfileLeg, ...]:
    return tuple(map(ProfileLeg, stops.tolist(), targets.tolist(), bounds.tolist()))


def _bounded(lengths: Floats, ends: Speeds, vd: float) -> Floats:
    """Return the bounds if later segments cannot brake from the requested end speeds."""
    bounds: list[float] = []
    limit = 0.0
    for length, end in zip(reversed(lengths.tolist()), reversed(ends.tolist()), strict=True):
        limit = min(limit, end)
        bounds.append(limit)
        limit = sqrt(limit * limit + 2.0 * vd * length)
    return np.array(bounds[::-1])


def _even(legs: _Legs, va: float, vd: float, ratio: float) -> tuple[Floats, float] | None:
    """Return course and duration if every segment is long enough for its speed changes, else None.

    The segments are then independent: the speed changes to a peak, or to the target, and falls to the end speed. `_Run`
    computes the same one by one.
    """
    lengths, targets = legs.lengths, ratio * legs.targets
    squares = _squares(np.minimum(legs.bounds, targets), 2.0 * va * lengths)
    entries, falls = squares[:-1], squares[1:]
    meeting = (2.0 * va * vd * lengths + vd * entries + va * falls) / (va + vd)
    highest = np.minimum(targets * targets, np.maximum(meeting, np.maximum(entries, falls)))
    speeds, peaks = np.sqrt(squares), np.sqrt(highest)
    first = np.where(highest < entries, -vd, va)
    ways = np.empty((3, len(peaks)))
    ways[0] = (highest - entries) / (2.0 * first)
    ways[2] = (highest - falls) / (2.0 * vd)
    ways[1] = lengths - ways[0] - ways[2]
    if not ratio > 0.0 or ways.min(initial=0.0) < -_ROUNDING:
        return None
    np.maximum(ways, 0.0, out=ways)
    times = ways / (0.5 * (speeds[:-1] + peaks), peaks, 0.5 * (speeds[1:] + peaks))
    ran = np.zeros(times.size + 1)
    times.T.ravel().cumsum(out=ran[1:])
    course = np.empty((len(peaks), 3, 4))
    course[..., 0] = ran[:-1].reshape(-1, 3)
    course[:, 0, 1] = legs.stops - lengths
    course[:, 1, 1] = course[:, 0, 1] + ways[0]
    course[:, 2, 1] = legs.stops - ways[2]
    course[:, 0, 2], course[:, 1, 2], course[:, 2, 2] = speeds[:-1], peaks, peaks
    course[:, 0, 3], course[:, 1, 3], course[:, 2, 3] = first, 0.0, -vd
    kept = (ways > 0.0).T.ravel().nonzero()[0]
    return course.reshape(-1, 4).take(kept, axis=0), float(ran[-1])


def _squares(ends: Floats, gains: Floats) -> Floats:
    """Return the squares of the speeds at the start and at every segment's end, (n + 1,), for the requested end speeds.

    A segment adds at most its gain. Few are too short for the requested speed, and these only rise.
    """
    squares = np.zeros(len(ends) + 1)
    np.multiply(ends, ends, out=squares[1:])
    for short in (squares[1:] > squares[:-1] + gains).nonzero()[0].tolist():
        for segment in range(short, len(gains)):
            if squares[segment + 1] <= squares[segment] + gains[segment]:
                break
            squares[segment + 1] = squares[segment] + gains[segment]
    return squares


class _Run:
    """The state of the sequence while its pieces are added."""

    __slots__ = ("pieces", "s", "t", "v", "va", "vd")

    def __init__(
        self, va: float, vd: float, t: float = 0.0, s: float = 0.0, v: float = 0.0, past: Iterable[ProfilePiece] = ()
    ) -> None:
        self.va, self.vd = va, vd
        self.t, self.s, self.v = t, s, v
        self.pieces = list(past)

    def leg(self, leg: ProfileLeg, target: float) -> bool:
        """Add the pieces of one segment: brake to the target speed if entered faster, then rise, cruise, fall.

        Returns False if the sequence stands in it, at a target of 0.
        """
        if self.v > target:
            self._ramp(target, leg.stop - self.s)
        if target <= 0.0 and self.v <= 0.0:
            self.pieces.append(ProfilePiece(self.t, self.s, 0.0, 0.0))
            return False
        end = min(leg.bound, target)
        self._rise(target, end, leg.stop - self.s)
        left = leg.stop - self.s
        fall = (self.v * self.v - end * end) / (2.0 * self.vd) if self.v > end else 0.0
        if left > fall:
            self._cruise(left - fall)
        if fall > 0.0 and left > 0.0:
            self._ramp(end, leg.stop - self.s)
        self.s = leg.stop
        return True

    def _rise(self, target: float, end: float, left: float) -> None:
        """Accelerate to where the fall to `end` at VD begins; a segment too short to fall only rises."""
        va, vd, square = self.va, self.vd, self.v * self.v
        meeting = (2.0 * va * vd * left + vd * square + va * end * end) / (va + vd)
        peak = min(target, sqrt(max(square, min(meeting, square + 2.0 * va * left))))
        if peak > self.v:
            self._ramp(peak, left)

    def _cruise(self, way: float) -> None:
        self.pieces.append(ProfilePiece(self.t, self.s, self.v, 0.0))
        self.t += way / self.v
        self.s += way

    def _ramp(self, after: float, left: float) -> None:
        """Change the speed to `after`, or as near to it as the way `left` allows."""
        v = self.v
        acceleration = self.va if after > v else -self.vd
        way = (after * after - v * v) / (2.0 * acceleration)
        if way - left > _ROUNDING:
            way = max(0.0, left)
            after = sqrt(max(0.0, v * v + 2.0 * acceleration * way))
        self.pieces.append(ProfilePiece(self.t, self.s, v, acceleration))
        # The mean speed gives the time without the cancellation in (after − v)/acceleration.
        self.t += 2.0 * way / (v + after)
        self.s += way
        self.v = after
