"""The path of a sequence: its segments end to end, where each of them begins, and what a member axis makes of it."""

from __future__ import annotations

from collections.abc import Iterator
from math import atan2, degrees
from operator import add
from typing import NamedTuple

from dmc41x3.twin.motion.arc import TANGENT
from dmc41x3.twin.motion.path import PathSegment, PathSpan
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
