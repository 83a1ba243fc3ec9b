"""The speed along a sequence of segments (LI; VP, CR), as stretches of constant acceleration.

Within a segment the vector speed goes to the segment's target at VA (or VD, where it comes in faster) and, as late
as possible, brakes at VD to the end speed `>p`. A backward pass over the segments bounds the speed at every
boundary by what lets all later end speeds, and the rest after LE, be met. A target below the speed at which its
segment is entered is met behind the boundary. Without LE the sequence stops abruptly at its end.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import hypot, inf, sqrt
from typing import NamedTuple

from dmc41x3.twin.motion.arc import Arc, X, Y

_ROUNDING = 1e-11
"""Squares of speeds that differ by less than this part of what made them are the same."""


class PathSegment(NamedTuple):
    """One LI, VP or CR: counts of every coordinate, length along it, and its speeds [counts/s].

    `speed` is None where no `<o` was given (VS applies) and negative for VV; `end` is None without `>p`. `arc` is
    None for a straight one.
    """

    deltas: tuple[float, ...]
    length: float
    speed: float | None
    end: float | None
    arc: Arc | None = None

    @staticmethod
    def of(deltas: tuple[float, ...], speed: float | None = None, end: float | None = None) -> PathSegment:
        """Return the straight segment with its length worked out."""
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
    """Stretches in order of time, and when the sequence is at its end [s] and how fast it gets there [counts/s].

    The time is infinite where it never gets there.
    """

    stretches: list[PathSpan]
    end: float
    speed: float = 0.0


class PathLeg(NamedTuple):
    """What is walked: a segment's number and length, its target speed, and the largest speed at its end."""

    number: int
    length: float
    target: float
    bound: float


def plan(
    segments: Sequence[PathSegment], speeds: Sequence[float], start: PathSpan, rates: VectorRates, ended: bool
) -> SequencePath:
    """Return the speed along `segments` from the state `start` on (its `a` does not matter).

    `speeds` are the target speeds of the segments [counts/s]; `ended` tells that LE closed the sequence. A target
    of 0 brakes to rest there and stays.
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
    """Return the way to rest along the path at a constant `deceleration`, or to the path's abrupt end.

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
    # A stop at the very end leaves no way to brake on: there the sequence rests.
    last = len(segments) - 1
    return SequencePath(stretches or [PathSpan(t, first + last, segments[last].length, 0.0, 0.0)], t)


def bound(segments: Sequence[PathSegment], bounds: list[float], deceleration: float, ended: bool) -> int:
    """Bring `bounds`, the largest speed allowed at the end of every segment [counts/s], up to date.

    On entry `bounds` are those of as many segments as were there before; return the first place that has changed.
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
    """Walks through (the rest of) one segment and writes its stretches."""

    __slots__ = ("_index", "_stretches", "s", "t", "v")

    def __init__(self, stretches: list[PathSpan], t: float, index: int, s: float, v: float) -> None:
        self._stretches = stretches
        self._index = index
        self.t, self.s, self.v = t, s, v

    def change(self, wanted: float, rate: float) -> None:
        """Go to the speed `wanted` at a constant rate."""
        v = self.v
        if wanted == v:
            return
        duration = abs(wanted - v) / rate
        self._stretches.append(PathSpan(self.t, self._index, self.s, v, rate if wanted > v else -rate))
        self.t += duration
        self.s += 0.5 * (v + wanted) * duration
        self.v = wanted

    def run(self, rest: float, target: float, bound: float, rates: VectorRates) -> tuple[float, float] | None:
        """Walk `rest` counts to the end of the segment; return time and speed there, None if it is not reached."""
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
        """Keep the speed for as long as the bound at the segment's end allows, then brake to it.

        A bound that came too late (a segment or LE appended behind time) is met as nearly as VD allows. One that is
        missed by the rounding of squares only is met: the root of such a rest is a speed that takes long to pass.
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
    """Return how fast to get: the target, what the segment's length allows, or where the way down to `bound` begins."""
    acceleration, deceleration = rates
    square = min(target * target, v * v + 2.0 * acceleration * rest)
    if bound < inf:
        work = 2.0 * acceleration * deceleration * rest
        meeting = (work + deceleration * v * v + acceleration * bound * bound) / (acceleration + deceleration)
        square = min(square, meeting)
    return sqrt(max(square, v * v))
