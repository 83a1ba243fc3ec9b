"""A coordinate system (S or T): its buffer of segments, its rates, and the sequence that it runs.

A new plan replaces the old one from a certain time on. A plan with long arcs becomes timelines in parts: the present
part ends at `reach`, and the next one is due at `horizon`, somewhat before.

The path is a `Route`; `path` computes its speeds, and `Schedule` stores them. A segment that is appended during the
run changes the plan only from its own start, or from the segment in which braking for it begins.

Not in the manual: a stop, or a limit, empties the buffer, so that a later BG never resumes a stopped sequence; a
tangent axis (TN) turns within arcs and jumps at corners, by the shorter way round.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from math import atan2, degrees, inf, sqrt
from operator import add
from typing import NamedTuple

from dmc41x3.language.codes import ErrorCode, StopCode
from dmc41x3.twin.expressions import Rejection
from dmc41x3.twin.motion import path
from dmc41x3.twin.motion.path import TANGENT, PathLeg, PathSegment, PathSpan, SequencePath
from dmc41x3.twin.timeline import TimelinePiece


class SegmentStart(NamedTuple):
    """The beginning of a segment: coordinates [counts], distance along the sequence [counts], direction [degrees]."""

    place: tuple[float, ...]
    way: float
    heading: float


class Route:
    """Segments end to end; `first` is the number of the first one stored, `tip` the coordinates of their end.

    `length` is the length of all segments ever appended [counts], `curved` whether arcs were among them, `heading` the
    direction at their end [degrees], None before the first.
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
        """Add a segment; `turning` is whether its direction matters, as only in vector sequences."""
        heading = self._turned(segment) if turning else 0.0
        self.segments.append(segment)
        self.starts.append(SegmentStart(self.tip, self.length, heading))
        self.tip = tuple(map(add, self.tip, segment.deltas))
        self.heading = heading + (degrees(segment.arc.turn) if segment.arc else 0.0)
        self.length += segment.length
        self.curved = self.curved or segment.arc is not None

    def drop(self, number: int) -> int:
        """Drop the segments before a number; return how many were dropped."""
        gone = number - self.first
        del self.segments[:gone], self.starts[:gone]
        self.first = number
        return gone

    def at(self, number: int) -> tuple[PathSegment, SegmentStart]:
        """Return a segment and its start by its number."""
        return self.segments[number - self.first], self.starts[number - self.first]

    def coordinate(self, coordinate: int, number: int, s: float) -> float:
        """Return a coordinate at the distance `s` along a segment."""
        segment, start = self.at(number)
        arc = segment.arc
        if coordinate == TANGENT:
            return start.heading + (arc.bend * s if arc else 0.0)
        if arc is not None:
            return start.place[coordinate] + arc.offset(coordinate, s)
        return start.place[coordinate] + segment.deltas[coordinate] / segment.length * s

    def end(self, coordinate: int) -> float:
        """Return a coordinate at the end of the last segment."""
        return (self.heading or 0.0) if coordinate == TANGENT else self.tip[coordinate]

    def _turned(self, segment: PathSegment) -> float:
        """Return the direction at a new segment's start [degrees], within half a turn of the previous one."""
        dx, dy = segment.deltas
        heading = segment.arc.heading if segment.arc else degrees(atan2(dy, dx))
        before = self.heading or 0.0
        return before + 180.0 - (180.0 - (heading - before)) % 360.0


class RouteAxis(NamedTuple):
    """One axis on a route: its coordinate, the motor counts of a unit of it, and those of its zero."""

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
        """Return the position at the start of a segment, and its change per count along it."""
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
"""Approximate number of timeline pieces computed at a time."""


class Schedule:
    """A plan that is empty at time `t` [s]; `end` is the time when the sequence ends, infinite if it never does."""

    def __init__(self, t: float) -> None:
        self.end = t
        self.reach = self.horizon = inf
        self._stretches: list[PathSpan] = []
        self._times: list[float] = []
        self._exit = 0.0
        self._fresh = 0

    def state(self, t: float) -> PathSpan:
        """Return the state of the sequence on its path at time `t`."""
        at, segment, s, v, a = self._stretches[self._index(t)]
        span = min(t, self.end) - at
        return PathSpan(t, segment, s + (v + 0.5 * a * span) * span, max(0.0, v + a * span), a)

    def entry(self, number: int) -> PathSpan:
        """Return the state at the start of a later segment, or of a segment to be appended to the path."""
        index = bisect_left(self._stretches, number, key=lambda stretch: stretch.segment)
        if index == len(self._stretches):
            return PathSpan(self.end, number, 0.0, self._exit, 0.0)
        return self._stretches[index]

    def last(self, t: float) -> bool:
        """Return whether the last stretch is under way at time `t`."""
        return bool(self._times) and t >= self._times[-1]

    def reaches(self, distance: float, t: float, route: Route) -> float:
        """Return when after `t` the distance along the route is `distance` [counts], the end if it never is [s]."""
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
        """Replace the path from time `t` on by a new one; a new path without stretches rests there."""
        if not new.stretches and self._stretches and t <= self._times[0]:
            new = new._replace(stretches=[self.state(t)._replace(a=0.0)])
        self._fresh = bisect_left(self._times, t)
        self._stretches[self._fresh :] = new.stretches
        self._times[self._fresh :] = [stretch.t for stretch in new.stretches]
        self.end, self._exit = new.end, new.speed
        self._look_ahead(t, route)

    def extend(self, route: Route) -> float:
        """Make the next part ready for the timelines; return its start [s]."""
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
        """Drop the stretches that are over at time `t`."""
        gone = self._index(t)
        del self._stretches[:gone], self._times[:gone]

    def fresh(self) -> list[tuple[PathSpan, float]]:
        """Return the stretches of the part that is ready for the timelines, each with its end [s]."""
        first = self._fresh
        ends = [*self._times[first + 1 :], self.end]
        laid = zip(self._stretches[first:], ends, strict=False)  # a plan without stretches has only its end
        return [(stretch, min(end, self.reach)) for stretch, end in laid if stretch.t < self.reach]

    def _look_ahead(self, t: float, route: Route) -> None:
        """Choose how far from `t` on the timelines are computed now."""
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


CAPACITY = 511
"""Segments that the buffer holds."""

LINEAR, VECTOR = "LM", "VM"
"""Kinds of sequences of a plane."""

_SHORTEST = 1e-6
_LONGEST_SEQUENCE = 2_147_483_647


class Plane:
    """State of one coordinate system; `registers` hold VS, VA, VD, VR, VV [counts and seconds].

    `mode` is that of the last `select`, empty before. `scale` is ES as factors of the two coordinates of a vector
    sequence, `tangent` the two numbers of TN: counts per degree, and the position of the tangent axis at 0 degrees.
    """

    running_code = StopCode.SEQUENCE_RUNNING

    def __init__(self, letter: str, registers: dict[str, float]) -> None:
        self.letter = letter
        self.registers = registers
        self.reset()

    def reset(self) -> None:
        """Clear everything but the rates, as power-up does."""
        self.mode = ""
        self.members: tuple[int, ...] = ()
        self.scale = (1.0, 1.0)
        self.tangent: tuple[float, int] = (0.0, 0)
        self.running = self.stopping = self.stale = False
        self._coordinates: tuple[int, ...] = ()
        self._parts: tuple[RouteAxis, ...] = ()
        self._result = StopCode.SEQUENCE_DONE
        self._whole = False
        self._schedule = Schedule(0.0)
        self.clear()

    @property
    def end(self) -> float:
        """Time when the running sequence ends [s]; infinite if it does not end."""
        return self._schedule.end

    @property
    def horizon(self) -> float:
        """Time when `replan` must extend the timelines [s]; infinite if they are complete."""
        return self._schedule.horizon

    @property
    def segments(self) -> list[PathSegment]:
        """The segments of the buffer, the current one first."""
        return self._route.segments

    @property
    def total(self) -> float:
        """Length of the sequence [counts] (`_LE`)."""
        return self._route.length

    @property
    def tip(self) -> tuple[float, ...]:
        """Coordinates of the end of the last segment, from the start of the sequence [counts]."""
        return self._route.tip

    @property
    def tangent_start(self) -> float:
        """Position of the tangent axis at the start of the sequence [counts] (`_TN`)."""
        factor, zero = self.tangent
        return zero + factor * (self._route.starts[0].heading if self._route.starts else 0.0)

    def free(self, t: float) -> int:
        """Return the places left in the buffer at time `t` (`_LM`); the current segment still takes one."""
        done = self.state(t).segment - self._route.first if self.running else 0
        return CAPACITY - len(self._route.segments) + done

    def select(self, mode: str, members: tuple[int, ...], coordinates: tuple[int, ...]) -> None:
        """Choose the axes of the plane (LM, VM) and the coordinate of each, and empty the buffer.

        While the sequence runs, the same LM changes nothing and everything else is refused.
        """
        if self.running:
            if mode != LINEAR or (mode, members) != (self.mode, self.members):
                raise Rejection(ErrorCode.NOT_WHILE_RUNNING)
            return
        self.mode, self.members, self._coordinates = mode, members, coordinates
        self.clear()

    def clear(self) -> None:
        """Empty the buffer (CS); raises `Rejection` while the sequence runs."""
        if self.running:
            raise Rejection(ErrorCode.NOT_WHILE_RUNNING)
        self.ended = False
        self._route = Route(2 if self.mode == VECTOR else len(self.members))
        self._bounds: list[float] = []
        self._done = 0
        self._distance = 0.0

    def append(self, segment: PathSegment, t: float) -> None:
        """Add a segment at time `t`; refused without length, with a full buffer, or after LE during the run."""
        if self.ended and self.running:
            raise Rejection(ErrorCode.NOT_WHILE_RUNNING)
        if segment.length < _SHORTEST:
            raise Rejection(ErrorCode.SEGMENT_TOO_SHORT)
        if not self.running and not self._route.segments:
            self.clear()
        if self._route.length + segment.length > _LONGEST_SEQUENCE:
            raise Rejection(ErrorCode.SEQUENCE_TOO_LONG)
        if self.free(t) <= 0:
            raise Rejection(ErrorCode.SEGMENT_BUFFER_FULL)
        self._route.append(segment, self.mode == VECTOR)
        self.ended = False
        self.stale = True

    def close(self) -> None:
        """Mark the end of the sequence (LE, VE), where it comes to rest."""
        self.ended = bool(self.segments) or self.running
        self.stale = True

    def rates_changed(self) -> None:
        """Mark the speeds of the whole sequence for a new computation."""
        self.stale = self._whole = True

    def begin(self, t: float, places: Sequence[int], offsets: Sequence[int]) -> None:
        """Start the sequence at rest at time `t` with the members at `places` [motor counts].

        The controller adds `offsets` to motor counts; a tangent axis has an absolute position.
        """
        self.running, self.stopping = True, False
        self._result = StopCode.SEQUENCE_DONE
        self._parts = tuple(
            RouteAxis(one, self._factor(one), self.tangent[1] - offset if one == TANGENT else place)
            for one, place, offset in zip(self._coordinates, places, offsets, strict=True)
        )
        self._bounds.clear()
        self._schedule = Schedule(t)
        self._bound()
        self._plan(PathSpan(t, self._route.first, 0.0, 0.0, 0.0))
        self.stale = self._whole = False

    def replan(self, t: float) -> float:
        """Compute the speeds again after a change of rates or segments, or extend the plan; return from when on [s].

        Segments after the planned part wait for their turn.
        """
        schedule = self._schedule
        whole = self._whole or schedule.end == inf
        changed = self.stale
        self.stale = self._whole = False
        if not self.running or (self.stopping and changed):
            return inf
        state = self._drop(t)
        if changed:
            first = self._bound()
            start = state if whole or first <= state.segment else schedule.entry(first)
            reach, horizon = schedule.reach, schedule.horizon
            self._plan(start)
            if start.t < reach:
                return start.t
            schedule.reach, schedule.horizon = reach, horizon
        return schedule.extend(self._route) if t >= schedule.horizon else inf

    def brake(self, t: float) -> bool:
        """Stop along the path at VD and return True; the rest of the sequence is dropped when it rests."""
        state = self._drop(t)
        self.stopping, self.stale = True, False
        self._result = StopCode.STOPPED
        way = path.brake(self.segments, state, self.registers["VD"], self._route.first)
        self._schedule.splice(way, t, self._route)
        return True

    def finish(self, t: float) -> StopCode:
        """End the run at time `t`, empty the buffer, and return the stop code of the members."""
        done = self._drop(t)
        result = self._result
        if not self.ended and not self.stopping:
            result = StopCode.COMMANDED
        self._distance = self._route.starts[0].way + done.s
        self._done = done.segment if self.stopping else self._route.first + len(self.segments)
        self.running = self.stopping = self.ended = self.stale = self._whole = False
        self._route.drop(self._route.first + len(self.segments))
        self._bounds = []
        self._schedule = Schedule(t)
        return result

    def pieces(self, place: int) -> tuple[list[TimelinePiece], float]:
        """Return the newest part of one member's timeline, and its largest speed [counts/s]."""
        member = self._parts[place]
        pieces, peak = member.pieces(self._route, self._schedule.fresh())
        if self.end < inf and self.end <= self._schedule.reach:
            pieces.append(TimelinePiece(self.end, self._rest(member), 0.0, 0.0))
        return pieces, peak

    def heading(self, place: int) -> int:
        """Return the direction in which a member will begin to move: 1, -1, or 0."""
        coordinate, first = self._coordinates[place], self._route.first
        there = self._route.coordinate(coordinate, first, 1e-3 * self.segments[0].length)
        way = self._factor(coordinate) * (there - self._route.coordinate(coordinate, first, 0.0))
        return (way > 0.0) - (way < 0.0)

    def speed(self, t: float) -> float:
        """Return the vector speed at time `t` [counts/s] (`_VM`)."""
        return self.state(t).v if self.running else 0.0

    def slewing(self, t: float) -> tuple[bool, bool]:
        """Return whether the sequence keeps its speed at time `t`, and whether it is in its last deceleration."""
        state = self.state(t)
        final = self.ended and not self.stopping and self._schedule.last(t) and state.a < 0.0
        return state.a == 0.0, final

    def count(self, t: float) -> int:
        """Return the number of the current segment, from 0, or of those done (`_CS`)."""
        return self.state(t).segment if self.running else self._done

    def distance(self, t: float) -> float:
        """Return the distance along the path since the sequence began [counts] (`_AV`)."""
        if not self.running:
            return self._distance
        state = self.state(t)
        return self._route.at(state.segment)[1].way + state.s

    def reaches(self, distance: float, t: float) -> float:
        """Return when, from `t` on, the distance along the path is `distance` [counts] by the present plan (AV) [s].

        For a sequence that is shorter, or rests before, this is its end.
        """
        return t if self.distance(t) >= distance else self._schedule.reaches(distance, t, self._route)

    def steady(self, t: float) -> float:
        """Return when the acceleration under way at time `t` ends (AS) [s]."""
        return self._schedule.steady(t)

    def corner(self, axis: int, t: float) -> int:
        """Return where a member was at the start of the current segment [motor counts] (`_VP`)."""
        member = self._parts[self.members.index(axis)]
        return round(member.position(self._route.coordinate(member.coordinate, self.state(t).segment, 0.0)))

    def state(self, t: float) -> PathSpan:
        """Return the state of the sequence on its path at time `t`."""
        return self._schedule.state(t)

    def _factor(self, coordinate: int) -> float:
        """Return the motor counts of a unit of a coordinate."""
        if coordinate == TANGENT:
            return self.tangent[0]
        return self.scale[coordinate] if self.mode == VECTOR else 1.0

    def _bound(self) -> int:
        """Update the speeds at the segments' ends; return the number of the first that changed."""
        return self._route.first + path.bound(self.segments, self._bounds, self.registers["VD"], self.ended)

    def _plan(self, start: PathSpan) -> None:
        rates = path.VectorRates(self.registers["VA"], self.registers["VD"])
        self._schedule.splice(path.walk(self._legs(start.segment), start, rates), start.t, self._route)

    def _legs(self, number: int) -> Iterator[PathLeg]:
        ratio, usual, first = self.registers["VR"], self.registers["VS"], self._route.first
        segments = self._route.segments
        for index in range(number - first, len(segments)):
            segment = segments[index]
            target = ratio * self._target(segment.speed, usual)
            yield PathLeg(first + index, segment.length, target, self._bounds[index])

    def _target(self, speed: float | None, usual: float) -> float:
        if speed is None:
            return usual
        return self.registers["VV"] if speed < 0.0 else speed

    def _drop(self, t: float) -> PathSpan:
        """Drop the segments done at time `t`; return the state then."""
        state = self.state(t)
        del self._bounds[: self._route.drop(state.segment)]
        self._schedule.drop(t)
        return state

    def _rest(self, member: RouteAxis) -> int:
        """Return the whole count at which a member rests."""
        if self.stopping:
            state = self.state(self.end)
            return round(member.position(self._route.coordinate(member.coordinate, state.segment, state.s)))
        return round(member.position(self._route.end(member.coordinate)))
