"""The course of a sequence: where each segment begins, and when a member axis is where.

A new plan replaces the old one from some time on. Of a plan with long arcs only a part becomes timelines at once, up
to `reach`; at `horizon`, somewhat before, the next part is due.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from math import atan2, degrees, inf, sqrt
from operator import add
from typing import NamedTuple

from dmc41x3.twin.motion.path import TANGENT, PathSegment, PathSpan, SequencePath
from dmc41x3.twin.timeline import TimelinePiece


class SegmentStart(NamedTuple):
    """Where a segment begins: coordinates [counts], way along the sequence [counts], direction [degrees]."""

    place: tuple[float, ...]
    way: float
    heading: float


class Route:
    """Segments end to end; `first` is the number of the first one kept, `tip` the coordinates where they end.

    `length` is the way along all that were ever appended [counts], `curved` tells whether arcs were among them;
    `heading` the direction in which they end [degrees], None before the first.
    """

    def __init__(self, coordinates: int) -> None:
        self.segments: list[PathSegment] = []
        self.starts: list[SegmentStart] = []
        self.first = 0
        self.tip = (0.0,) * coordinates
        self.length = 0.0
        self.curved = False
        self.heading: float | None = None

    def append(self, segment: PathSegment, turning: bool) -> None:
        """Add a segment; `turning` tells whether its direction matters, which only vector sequences have."""
        heading = self._turned(segment) if turning else 0.0
        self.segments.append(segment)
        self.starts.append(SegmentStart(self.tip, self.length, heading))
        self.tip = tuple(map(add, self.tip, segment.deltas))
        self.heading = heading + (degrees(segment.arc.turn) if segment.arc else 0.0)
        self.length += segment.length
        self.curved = self.curved or segment.arc is not None

    def drop(self, number: int) -> int:
        """Forget the segments before a number; return how many they were."""
        gone = number - self.first
        del self.segments[:gone], self.starts[:gone]
        self.first = number
        return gone

    def at(self, number: int) -> tuple[PathSegment, SegmentStart]:
        """Return a segment by its number."""
        return self.segments[number - self.first], self.starts[number - self.first]

    def coordinate(self, coordinate: int, number: int, s: float) -> float:
        """Return a coordinate at the way `s` along a segment."""
        segment, start = self.at(number)
        arc = segment.arc
        if coordinate == TANGENT:
            return start.heading + (arc.bend * s if arc else 0.0)
        if arc is not None:
            return start.place[coordinate] + arc.offset(coordinate, s)
        return start.place[coordinate] + segment.deltas[coordinate] / segment.length * s

    def end(self, coordinate: int) -> float:
        """Return a coordinate where the last segment ends."""
        return (self.heading or 0.0) if coordinate == TANGENT else self.tip[coordinate]

    def _turned(self, segment: PathSegment) -> float:
        """Return the direction at a new segment's start [degrees], within half a turn of the one before."""
        dx, dy = segment.deltas
        heading = segment.arc.heading if segment.arc else degrees(atan2(dy, dx))
        before = self.heading or 0.0
        return before + 180.0 - (180.0 - (heading - before)) % 360.0


class RouteAxis(NamedTuple):
    """One axis on a route: which coordinate it has, the motor counts of a unit of it, and of its zero."""

    coordinate: int
    factor: float
    origin: int

    def position(self, coordinate: float) -> float:
        """Return the motor counts of a coordinate."""
        return self.origin + self.factor * coordinate

    def pieces(self, route: Route, stretches: list[tuple[PathSpan, float]]) -> tuple[list[TimelinePiece], float]:
        """Return the timeline over `stretches`, each with its end [s], and the largest speed [counts/s]."""
        pieces: list[TimelinePiece] = []
        peak, resting = 0.0, False
        known, base, unit, size = -1, 0.0, 0.0, 0.0
        for stretch, until in stretches:
            t, number, s, v, a = stretch
            if number != known:  # several stretches lie on one segment
                segment, start = route.at(number)
                if segment.arc is not None and self.coordinate != TANGENT:
                    pieces += self._curved(segment, start, stretch, until)
                    peak, resting = max(peak, abs(self.factor) * v), False
                    continue
                known = number
                base, unit = self._line(segment, start)
                size = abs(unit)
            if unit == 0.0 and resting and base == pieces[-1].p:
                continue
            resting = unit == 0.0
            peak = max(peak, size * v)
            pieces.append(TimelinePiece(t, base + unit * s, unit * v, unit * a))
        return pieces, peak

    def _line(self, segment: PathSegment, start: SegmentStart) -> tuple[float, float]:
        """Return the position at the start of a segment, and how it changes with the way along it."""
        if self.coordinate == TANGENT:
            return self.position(start.heading), self.factor * (segment.arc.bend if segment.arc else 0.0)
        coordinate, factor = self.coordinate, self.factor
        unit = factor * segment.deltas[coordinate] / segment.length
        return self.origin + factor * start.place[coordinate], unit

    def _curved(
        self, segment: PathSegment, start: SegmentStart, stretch: PathSpan, until: float
    ) -> Iterator[TimelinePiece]:
        """Yield the pieces along an arc, from `stretch` on `until` a time [s]."""
        arc = segment.arc
        assert arc is not None
        base, factor = self.position(start.place[self.coordinate]), self.factor
        t, _, s, v, a = stretch
        if v == 0.0 and a == 0.0:
            yield TimelinePiece(t, base + factor * arc.offset(self.coordinate, s), 0.0, 0.0)
            return
        for after, p, speed, acceleration in arc.pieces(self.coordinate, s, v, a, until - t):
            yield TimelinePiece(t + after, base + factor * p, factor * speed, factor * acceleration)


AHEAD = 5000
"""About how many pieces of a timeline are worked out at a time."""


class Schedule:
    """A plan that is empty at time `t` [s]; `end` is when the sequence ends, infinite where it never does."""

    def __init__(self, t: float) -> None:
        self.end = t
        self.reach = self.horizon = inf
        self._stretches: list[PathSpan] = []
        self._times: list[float] = []
        self._exit = 0.0
        self._fresh = 0

    def state(self, t: float) -> PathSpan:
        """Return where on the path the sequence is at time `t`."""
        at, segment, s, v, a = self._stretches[self._index(t)]
        span = min(t, self.end) - at
        return PathSpan(t, segment, s + (v + 0.5 * a * span) * span, max(0.0, v + a * span), a)

    def entry(self, number: int) -> PathSpan:
        """Return the state at the start of a segment that is still to come, or to be appended to the path."""
        index = bisect_left(self._stretches, number, key=lambda stretch: stretch.segment)
        if index == len(self._stretches):
            return PathSpan(self.end, number, 0.0, self._exit, 0.0)
        return self._stretches[index]

    def last(self, t: float) -> bool:
        """Tell whether the last stretch is under way at time `t`."""
        return bool(self._times) and t >= self._times[-1]

    def reaches(self, distance: float, t: float, route: Route) -> float:
        """Return when after `t` the way along the route is `distance` [counts], the end where it never is [s]."""
        for index in range(self._index(t), len(self._stretches)):
            at, number, s, v, a = self._stretches[index]
            rest = distance - route.at(number)[1].way - s
            square = v * v + 2.0 * a * rest
            if square >= 0.0 and v + sqrt(square) > 0.0:
                there = at + 2.0 * rest / (v + sqrt(square))
                if there <= self._until(index):
                    return max(t, there)
        return self.end

    def steady(self, t: float) -> float:
        """Return when the acceleration under way at time `t` ends [s]."""
        index = self._index(t)
        while index < len(self._stretches) and self._stretches[index].a > 0.0:
            index += 1
        return max(t, self._times[index] if index < len(self._times) else self.end)

    def splice(self, new: SequencePath, t: float, route: Route) -> None:
        """Let a new path replace the old one from time `t` on; one without any way left rests there."""
        if not new.stretches and self._stretches and t <= self._times[0]:
            new = new._replace(stretches=[self.state(t)._replace(a=0.0)])
        self._fresh = bisect_left(self._times, t)
        self._stretches[self._fresh :] = new.stretches
        self._times[self._fresh :] = [stretch.t for stretch in new.stretches]
        self.end, self._exit = new.end, new.speed
        self._look_ahead(t, route)

    def extend(self, route: Route) -> float:
        """Have the next part laid out; return from when on."""
        t = self.reach
        index = self._index(t)
        if self._times[index] < t:
            index += 1
            self._stretches.insert(index, self.state(t))
            self._times.insert(index, t)
        self._fresh = index
        self._look_ahead(t, route)
        return t

    def drop(self, t: float) -> None:
        """Forget what is over at time `t`."""
        gone = self._index(t)
        del self._stretches[:gone], self._times[:gone]

    def fresh(self) -> list[tuple[PathSpan, float]]:
        """Return the stretches of the part that is to be laid out, each with its end [s]."""
        first = self._fresh
        ends = [*self._times[first + 1 :], self.end]
        laid = zip(self._stretches[first:], ends, strict=False)  # a plan without any way has but its end
        return [(stretch, min(end, self.reach)) for stretch, end in laid if stretch.t < self.reach]

    def _look_ahead(self, t: float, route: Route) -> None:
        """Choose how far from `t` on the timelines are worked out now."""
        self.reach = self.horizon = inf
        if not route.curved and len(self._stretches) - self._fresh <= AHEAD:
            return
        left = float(AHEAD)
        for index in range(self._fresh, len(self._stretches)):
            at, number, _, v, a = self._stretches[index]
            arc = route.at(number)[0].arc
            span = self._until(index) - at
            count = arc.quadratics(v, a, span) if arc else 1.0
            if count > left and span < inf:
                self.reach = at + span * min(1.0, max(left, 100.0) / count)
                self.horizon = t + 0.75 * (self.reach - t)
                return
            left -= count

    def _index(self, t: float) -> int:
        return max(0, bisect_right(self._times, t) - 1)

    def _until(self, index: int) -> float:
        """Return when a stretch ends [s]."""
        return self._times[index + 1] if index + 1 < len(self._times) else self.end
