"""The segments of a sequence (LI; VP, CR), and the speed along them as spans of constant acceleration.

If the distance s along the arc is quadratic in time, a coordinate r cos(s/r) is not. Over a short time h it is replaced
by the quadratic that agrees with it at both ends and has its acceleration in the middle. The error is then at
most |p'''| h³/48, and with the angular velocity w and acceleration e

    |p'''| ≤ r (w³ + 3 w |e|)

so the times are chosen to keep the error below `TOLERANCE`. Chords of the same error would be ten times as many, and
their directions would jump.

Within a segment the vector speed changes to the segment's target at VA (or VD, if it enters faster) and, as late
as possible, brakes at VD to the end speed `>p`. A backward pass over the segments limits the speed at every boundary
so that all later end speeds, and the rest after LE, can be met. A target below the entry speed of its segment is
reached after the boundary. Without LE the sequence stops abruptly at its end.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import repeat
from math import ceil, cos, degrees, hypot, inf, radians, sin, sqrt
from typing import NamedTuple

TOLERANCE = 0.15
"""Largest distance of the pieces from the arc [counts]."""

X, Y, TANGENT = 0, 1, -1
"""Coordinates of a vector sequence: those of its plane, and the direction of the path [degrees]."""


class Arc(NamedTuple):
    """Radius [counts], the angle of its start, and the angle along it [radians], counterclockwise positive."""

    radius: float
    start: float
    turn: float

    @classmethod
    def of(cls, radius: float, start: float, turn: float) -> Arc:
        """Return the arc of CR, whose angles are in degrees."""
        return cls(radius, radians(start), radians(turn))

    @property
    def length(self) -> float:
        """Length along the arc [counts]."""
        return self.radius * abs(self.turn)

    @property
    def heading(self) -> float:
        """Direction of the path at its start [degrees]."""
        return degrees(self.start) + (90.0 if self.turn > 0.0 else -90.0)

    @property
    def bend(self) -> float:
        """How much the direction changes for each count along the arc [degrees/count]."""
        return degrees(self._sense / self.radius)

    def offset(self, coordinate: int, s: float) -> float:
        """Return a coordinate at the distance `s` along the arc, from its start [counts]."""
        wave = sin if coordinate == Y else cos
        return self.radius * (wave(self.start + self._sense * s / self.radius) - wave(self.start))

    def pieces(
        self, coordinate: int, s: float, v: float, a: float, span: float
    ) -> Iterator[tuple[float, float, float, float]]:
        """Approximate a coordinate by parabolas over the next `span` seconds.

        Yield of each parabola its start time, and the offset, velocity and acceleration there. At time 0 the distance
        along the arc is `s`, the speed `v` and the acceleration along the arc `a`.
        """
        here = self.offset(coordinate, s)
        t = 0.0
        for step in _steps(self.radius, v, a, span):
            middle, end = t + 0.5 * step, t + step
            acceleration = self._acceleration(coordinate, s + (v + 0.5 * a * middle) * middle, v + a * middle, a)
            there = self.offset(coordinate, s + (v + 0.5 * a * end) * end)
            yield t, here, (there - here) / step - 0.5 * acceleration * step, acceleration
            t, here = end, there

    def quadratics(self, v: float, a: float, span: float) -> float:
        """Return an upper estimate of the number of quadratics for `span` seconds from the speed `v` on."""
        if span <= 0.0 or (v == 0.0 and a == 0.0):
            return 1.0
        return 1.0 + span / _longest(self.radius, v, a, span)

    @property
    def _sense(self) -> float:
        return 1.0 if self.turn > 0.0 else -1.0

    def _acceleration(self, coordinate: int, s: float, v: float, a: float) -> float:
        angle = self.start + self._sense * s / self.radius
        along, inward = (cos(angle), -sin(angle)) if coordinate == Y else (-sin(angle), -cos(angle))
        return self._sense * a * along + v * v / self.radius * inward


def _steps(radius: float, v: float, a: float, span: float) -> Iterator[float]:
    """Yield the durations of quadratics that stay within the tolerance, `span` [s] in all."""
    if a == 0.0:
        count = ceil(span / _longest(radius, v, a, span))
        yield from repeat(span / count, count)
        return
    left = span
    while left > 0.0:
        step = left
        for _ in range(4):
            step = sqrt(step * _longest(radius, v, a, step))
        step = min(left, step, _longest(radius, v, a, step))
        if left - step < 1e-3 * step:
            step = left
        yield step
        v = max(0.0, v + a * step)
        left -= step


def _longest(radius: float, v: float, a: float, step: float) -> float:
    """Return the longest duration of a quadratic at the largest speed of a step [s]; at rest, that of the step."""
    w = max(v, v + a * step) / radius
    jerk = radius * w * (w * w + 3.0 * abs(a) / radius)
    return (48.0 * TOLERANCE / jerk) ** (1.0 / 3.0) if jerk > 0.0 else step


_ROUNDING = 1e-11
"""Squares of speeds count as equal if they differ by less than this fraction of the terms they come from."""


class PathSegment(NamedTuple):
    """One LI, VP or CR: counts of every coordinate, length along it, and its speeds [counts/s].

    `speed` is None without `<o` (VS applies) and negative for VV; `end` is None without `>p`. `arc` is None for a
    straight segment.
    """

    deltas: tuple[float, ...]
    length: float
    speed: float | None
    end: float | None
    arc: Arc | None = None

    @staticmethod
    def of(deltas: tuple[float, ...], speed: float | None = None, end: float | None = None) -> PathSegment:
        """Return the straight segment with its computed length."""
        return PathSegment(deltas, hypot(*deltas), speed, end)

    @staticmethod
    def along(arc: Arc, speed: float | None = None, end: float | None = None) -> PathSegment:
        """Return the segment along an arc."""
        deltas = (arc.offset(X, arc.length), arc.offset(Y, arc.length))
        return PathSegment(deltas, arc.length, speed, end, arc)


class PathSpan(NamedTuple):
    """From time `t` [s] on: `s` counts into segment number `segment`, speed `v`, constant acceleration `a`."""

    t: float
    segment: int
    s: float
    v: float
    a: float


class VectorRates(NamedTuple):
    """VA and VD [counts/s²]."""

    acceleration: float
    deceleration: float


class SequencePath(NamedTuple):
    """Stretches in order of time, the time when the sequence ends [s], and its speed there [counts/s].

    The time is infinite if the sequence never ends.
    """

    stretches: list[PathSpan]
    end: float
    speed: float = 0.0


class PathLeg(NamedTuple):
    """One segment of the path: number, length, target speed, and the largest speed at its end."""

    number: int
    length: float
    target: float
    bound: float


def plan(
    segments: Sequence[PathSegment], speeds: Sequence[float], start: PathSpan, rates: VectorRates, ended: bool
) -> SequencePath:
    """Return the speed along `segments` from the state `start` on (its `a` does not matter).

    `speeds` are the target speeds of the segments [counts/s]; `ended` means that LE closed the sequence. A target
    of 0 brakes to rest in its segment and stays there.
    """
    bounds: list[float] = []
    bound(segments, bounds, rates.deceleration, ended)
    numbers = range(start.segment, len(segments))
    return walk((PathLeg(i, segments[i].length, speeds[i], bounds[i]) for i in numbers), start, rates)


def walk(legs: Iterable[PathLeg], start: PathSpan, rates: VectorRates) -> SequencePath:
    """Return the speed along `legs` from the state `start` on, which lies in the first of them."""
    stretches: list[PathSpan] = []
    t, s, v = start.t, start.s, start.v
    for number, length, target, end in legs:
        rest = max(0.0, length - s)
        state = _Segment(stretches, t, number, s, v).run(rest, target, end, rates)
        if state is None:
            return SequencePath(stretches, inf)
        t, v = state
        s = 0.0
    return SequencePath(stretches, t, v)


def brake(segments: Sequence[PathSegment], start: PathSpan, deceleration: float, first: int = 0) -> SequencePath:
    """Return the plan to rest along the path at a constant `deceleration`, or to the path's abrupt end.

    `first` is the number of the first of the segments.
    """
    stretches: list[PathSpan] = []
    t, s, v = start.t, start.s, start.v
    for index in range(start.segment - first, len(segments)):
        rest = max(0.0, segments[index].length - s)
        leg = _Segment(stretches, t, first + index, s, v)
        if v * v <= 2.0 * deceleration * rest:
            leg.change(0.0, deceleration)
            return SequencePath(stretches or [PathSpan(t, first + index, s, 0.0, 0.0)], leg.t)
        leg.change(sqrt(v * v - 2.0 * deceleration * rest), deceleration)
        t, v = leg.t, leg.v
        s = 0.0
    # A stop at the very end leaves no distance to brake: the sequence rests there.
    last = len(segments) - 1
    return SequencePath(stretches or [PathSpan(t, first + last, segments[last].length, 0.0, 0.0)], t)


def bound(segments: Sequence[PathSegment], bounds: list[float], deceleration: float, ended: bool) -> int:
    """Update `bounds`, the largest speed allowed at the end of every segment [counts/s].

    On entry `bounds` are those of the segments that existed before; return the first index that has changed.
    `deceleration` is that of the path [counts/s²]; `ended` means that LE or VE closed the sequence.
    """
    known = len(bounds)
    bounds += [inf] * (len(segments) - known)
    limit = 0.0 if ended else inf
    for index in range(len(segments) - 1, -1, -1):
        segment = segments[index]
        if segment.end is not None and segment.end < limit:
            limit = segment.end
        if index < known and bounds[index] == limit:
            return index + 1
        bounds[index] = limit
        limit = sqrt(limit * limit + 2.0 * deceleration * segment.length)
    return 0


class _Segment:
    """Plans (the rest of) one segment and writes its stretches."""

    __slots__ = ("_index", "_stretches", "s", "t", "v")

    def __init__(self, stretches: list[PathSpan], t: float, index: int, s: float, v: float) -> None:
        self._stretches = stretches
        self._index = index
        self.t, self.s, self.v = t, s, v

    def change(self, wanted: float, rate: float) -> None:
        """Change to the speed `wanted` at a constant rate."""
        v = self.v
        if wanted == v:
            return
        duration = abs(wanted - v) / rate
        self._stretches.append(PathSpan(self.t, self._index, self.s, v, rate if wanted > v else -rate))
        self.t += duration
        self.s += 0.5 * (v + wanted) * duration
        self.v = wanted

    def run(self, rest: float, target: float, bound: float, rates: VectorRates) -> tuple[float, float] | None:
        """Plan `rest` counts to the end of the segment; return time and speed there, None if it is not reached."""
        acceleration, deceleration = rates
        v = self.v
        length = self.s + rest
        if v > target:
            slowest = sqrt(max(0.0, v * v - 2.0 * deceleration * rest))
            if slowest >= target and slowest > 0.0:
                self.change(slowest, deceleration)
                return self.t, self.v
            self.change(target, deceleration)
        elif v < target:
            self.change(_crest(v, rest, target, bound, rates), acceleration)
        if self.v == 0.0 and rest > 0.0:
            self._stretches.append(PathSpan(self.t, self._index, self.s, 0.0, 0.0))
            return None
        self._slew(length, bound, deceleration)
        return self.t, self.v

    def _slew(self, length: float, bound: float, deceleration: float) -> None:
        """Keep the speed for as long as the bound at the segment's end allows, then brake to the bound.

        A bound that came too late (a segment or LE appended late) is met as nearly as VD allows. A bound that is missed
        only by the rounding of squares counts as met: the root of such a difference would be a speed that takes long to
        pass.
        """
        v = self.v
        rest = length - self.s
        excess = v * v - 2.0 * deceleration * rest
        if v > bound and excess - bound * bound > _ROUNDING * (v * v + 2.0 * deceleration * length):
            bound = sqrt(excess)
        braking = (v * v - bound * bound) / (2.0 * deceleration) if v > bound else 0.0
        way = rest - braking
        if way > 1e-9 * (1.0 + length):
            self._stretches.append(PathSpan(self.t, self._index, self.s, v, 0.0))
            self.t += way / v
            self.s += way
        if v > bound:
            self.change(bound, deceleration)


def _crest(v: float, rest: float, target: float, bound: float, rates: VectorRates) -> float:
    """Return the peak speed: the target, unless the segment's length or the braking to `bound` allows less."""
    acceleration, deceleration = rates
    square = min(target * target, v * v + 2.0 * acceleration * rest)
    if bound < inf:
        work = 2.0 * acceleration * deceleration * rest
        meeting = (work + deceleration * v * v + acceleration * bound * bound) / (acceleration + deceleration)
        square = min(square, meeting)
    return sqrt(max(square, v * v))
