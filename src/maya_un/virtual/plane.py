"""A coordinate system (S or T): its buffer of segments, its rates, and the sequence it runs.

The path is kept segment by segment, linear ones (LI) as exact whole counts; speeds come from `path`. A segment that is
appended on the way changes the plan only from where it can matter: from its own start, or from the segment in which
braking for it begins.

What the manual leaves open is settled here: a stop, or a limit, empties the buffer, so that a later BG never resumes
what somebody stopped; a tangent axis (TN) turns within arcs and jumps at corners, by the shorter way round.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from math import atan2, degrees, inf, sqrt
from typing import NamedTuple

from maya_un.galil.codes import ErrorCode, StopCode
from maya_un.virtual import path
from maya_un.virtual.arc import TANGENT
from maya_un.virtual.path import Leg, Path, Segment, Stretch
from maya_un.virtual.refusal import Refused
from maya_un.virtual.timeline import Piece

CAPACITY = 511
"""Segments that the buffer holds."""

LINEAR, VECTOR = "LM", "VM"
"""What kind of sequence a plane is set up for."""

_SHORTEST = 1e-6
_LONGEST_SEQUENCE = 2_147_483_647


class _Start(NamedTuple):
    """Where a segment begins: coordinates [counts], way along the sequence [counts], direction [degrees]."""

    place: tuple[float, ...]
    way: float
    heading: float


class Plane:
    """State of one coordinate system; `registers` hold VS, VA, VD, VR, VV [counts and seconds].

    `mode` is what `select` was last told, empty before. `scale` is ES as factors of the two coordinates of a vector
    sequence, `tangent` the two numbers of TN: counts per degree, and the place of the tangent axis at 0 degrees.
    """

    running_code = StopCode.SEQUENCE_RUNNING

    def __init__(self, letter: str, registers: dict[str, float]) -> None:
        self.letter = letter
        self.registers = registers
        self.reset()

    def reset(self) -> None:
        """Forget everything but the rates, as power-up does."""
        self.mode = ""
        self.members: tuple[int, ...] = ()
        self.scale = (1.0, 1.0)
        self.tangent: tuple[float, int] = (0.0, 0)
        self.running = self.stopping = self.stale = False
        self._coordinates: tuple[int, ...] = ()
        self._factors: tuple[float, ...] = ()
        self._origins: tuple[int, ...] = ()
        self._result = StopCode.SEQUENCE_DONE
        self._whole = False
        self._adopt(Path([], 0.0), 0)
        self.clear()

    @property
    def end(self) -> float:
        """When the running sequence ends [s]; infinite where it does not."""
        return self._end

    @property
    def total(self) -> float:
        """Length of the sequence [counts] (`_LE`)."""
        return self._total

    @property
    def tip(self) -> tuple[float, ...]:
        """Coordinates of the end of the last segment, from the start of the sequence [counts]."""
        return self._tip

    @property
    def tangent_start(self) -> float:
        """Where the tangent axis belongs at the start of the sequence [counts] (`_TN`)."""
        factor, zero = self.tangent
        return zero + factor * (self._starts[0].heading if self._starts else 0.0)

    def free(self, t: float) -> int:
        """Return the places left in the buffer at time `t` (`_LM`); a segment under way still takes one."""
        done = self.state(t).segment - self._first if self.running else 0
        return CAPACITY - len(self.segments) + done

    def select(self, mode: str, members: tuple[int, ...], coordinates: tuple[int, ...]) -> None:
        """Choose the axes of the plane (LM, VM), and which coordinate each has, and empty the buffer.

        While it runs, the same LM changes nothing and all else is refused.
        """
        if self.running:
            if mode != LINEAR or (mode, members) != (self.mode, self.members):
                raise Refused(ErrorCode.NOT_WHILE_RUNNING)
            return
        self.mode, self.members, self._coordinates = mode, members, coordinates
        self.clear()

    def clear(self) -> None:
        """Empty the buffer (CS); refused while the sequence runs."""
        if self.running:
            raise Refused(ErrorCode.NOT_WHILE_RUNNING)
        self.segments: list[Segment] = []
        self.ended = False
        self._starts: list[_Start] = []
        self._bounds: list[float] = []
        self._tip = (0.0,) * (2 if self.mode == VECTOR else len(self.members))
        self._heading: float | None = None
        self._first = self._done = 0
        self._distance = self._total = 0.0

    def append(self, segment: Segment, t: float) -> None:
        """Add a segment at time `t`; refused without length, with a full buffer, or behind the end of a run."""
        if self.ended and self.running:
            raise Refused(ErrorCode.NOT_WHILE_RUNNING)
        if segment.length < _SHORTEST:
            raise Refused(ErrorCode.SEGMENT_TOO_SHORT)
        if not self.running and not self.segments:
            self.clear()
        if self._total + segment.length > _LONGEST_SEQUENCE:
            raise Refused(ErrorCode.SEQUENCE_TOO_LONG)
        if self.free(t) <= 0:
            raise Refused(ErrorCode.SEGMENT_BUFFER_FULL)
        heading = self._turned(segment) if self.mode == VECTOR else 0.0
        self.segments.append(segment)
        self._starts.append(_Start(self._tip, self._total, heading))
        self._tip = tuple(at + delta for at, delta in zip(self._tip, segment.deltas, strict=True))
        self._heading = heading + (degrees(segment.arc.turn) if segment.arc else 0.0)
        self._total += segment.length
        self.ended = False
        self.stale = True

    def close(self) -> None:
        """Mark the end of the sequence (LE, VE): it will come to rest there."""
        self.ended = bool(self.segments) or self.running
        self.stale = True

    def rates_changed(self) -> None:
        """Have the speeds of the whole sequence worked out again."""
        self.stale = self._whole = True

    def begin(self, t: float, places: Sequence[int], offsets: Sequence[int]) -> None:
        """Start the sequence at rest at time `t` with the members at `places` [motor counts].

        `offsets` are what the controller adds to motor counts; a tangent axis has an absolute place of its own.
        """
        self.running, self.stopping = True, False
        self._result = StopCode.SEQUENCE_DONE
        self._factors = tuple(map(self._factor, self._coordinates))
        self._origins = tuple(
            self.tangent[1] - offset if coordinate == TANGENT else place
            for coordinate, place, offset in zip(self._coordinates, places, offsets, strict=True)
        )
        self._bounds.clear()
        self._adopt(Path([], t), 0)
        self._bound()
        self._plan(Stretch(t, self._first, 0.0, 0.0, 0.0))
        self.stale = self._whole = False

    def replan(self, t: float) -> float:
        """Work the speeds out again after a change of rates or segments; return from when on they differ."""
        whole = self._whole or self._end == inf
        self.stale = self._whole = False
        if not self.running or self.stopping:
            return inf
        state = self._drop(t)
        changed = self._bound()
        start = state if whole or changed <= state.segment else self._entry(changed)
        self._plan(start)
        return start.t

    def brake(self, t: float) -> bool:
        """Stop along the path at VD; what is left of the sequence is forgotten when it rests."""
        state = self._drop(t)
        self.stopping, self.stale = True, False
        self._result = StopCode.STOPPED
        self._splice(path.brake(self.segments, state, self.registers["VD"], self._first), t)
        return True

    def finish(self, t: float) -> StopCode:
        """End the run at time `t`, empty the buffer, and return the stop code of the members."""
        done = self._drop(t)
        result = self._result
        if not self.ended and not self.stopping:
            result = StopCode.COMMANDED
        self._distance = self._starts[0].way + done.s
        self._done = done.segment if self.stopping else self._first + len(self.segments)
        self.running = self.stopping = self.ended = self.stale = self._whole = False
        self.segments, self._starts, self._bounds = [], [], []
        self._adopt(Path([], t), 0)
        return result

    def pieces(self, place: int) -> tuple[list[Piece], float]:
        """Return the newest part of one member's timeline, and its largest speed [counts/s]."""
        pieces: list[Piece] = []
        coordinate, factor = self._coordinates[place], self._factors[place]
        peak, resting = 0.0, False
        for index in range(self._fresh, len(self._stretches)):
            stretch = self._stretches[index]
            segment, start = self._at(stretch.segment)
            if segment.arc is not None and coordinate != TANGENT:
                until = self._times[index + 1] if index + 1 < len(self._times) else self._end
                base = self._origins[place] + factor * start.place[coordinate]
                pieces += _curved(segment, coordinate, base, factor, stretch, until)
                peak, resting = max(peak, abs(factor) * stretch.v), False
                continue
            base, unit = self._line(place, segment, start)
            if unit == 0.0 and resting and base == pieces[-1].p:
                continue
            resting = unit == 0.0
            peak = max(peak, abs(unit) * stretch.v)
            pieces.append(Piece(stretch.t, base + unit * stretch.s, unit * stretch.v, unit * stretch.a))
        if self._end < inf:
            pieces.append(Piece(self._end, self._rest(place), 0.0, 0.0))
        return pieces, peak

    def heading(self, place: int) -> int:
        """Return the direction in which a member will begin to move: 1, -1, or 0."""
        coordinate, (segment, start) = self._coordinates[place], self._at(self._first)
        way = self._coordinate(coordinate, segment, start, 1e-3 * segment.length)
        way -= start.heading if coordinate == TANGENT else start.place[coordinate]
        return (way > 0.0) - (way < 0.0)

    def speed(self, t: float) -> float:
        """Return the vector speed at time `t` [counts/s] (`_VM`)."""
        return self.state(t).v if self.running else 0.0

    def slewing(self, t: float) -> tuple[bool, bool]:
        """Tell whether the sequence keeps its speed at time `t`, and whether it is in its last deceleration."""
        state = self.state(t)
        last = bool(self._times) and t >= self._times[-1]
        return state.a == 0.0, self.ended and not self.stopping and last and state.a < 0.0

    def count(self, t: float) -> int:
        """Return the number of the segment under way, from 0, or of those done (`_CS`)."""
        return self.state(t).segment if self.running else self._done

    def distance(self, t: float) -> float:
        """Return the way along the path since the sequence began [counts] (`_AV`)."""
        if not self.running:
            return self._distance
        state = self.state(t)
        return self._at(state.segment)[1].way + state.s

    def reaches(self, distance: float, t: float) -> float:
        """Return when, from `t` on, the way along the path is `distance` [counts] by the present plan (AV) [s].

        A sequence that is shorter, or rests before, is there at its end.
        """
        if self.distance(t) >= distance:
            return t
        for index in range(max(0, bisect_right(self._times, t) - 1), len(self._stretches)):
            at, number, s, v, a = self._stretches[index]
            rest = distance - self._at(number)[1].way - s
            until = self._times[index + 1] if index + 1 < len(self._times) else self._end
            square = v * v + 2.0 * a * rest
            if square >= 0.0 and v + sqrt(square) > 0.0:
                there = at + 2.0 * rest / (v + sqrt(square))
                if there <= until:
                    return max(t, there)
        return self._end

    def steady(self, t: float) -> float:
        """Return when the acceleration under way at time `t` ends (AS) [s]."""
        index = max(0, bisect_right(self._times, t) - 1)
        while index < len(self._stretches) and self._stretches[index].a > 0.0:
            index += 1
        following = self._times[index] if index < len(self._times) else self._end
        return max(t, following)

    def corner(self, axis: int, t: float) -> int:
        """Return where a member was, or will be, at the start of the segment under way [motor counts] (`_VP`)."""
        place = self.members.index(axis)
        segment, start = self._at(self.state(t).segment)
        coordinate = self._coordinate(self._coordinates[place], segment, start, 0.0)
        return round(self._origins[place] + self._factors[place] * coordinate)

    def state(self, t: float) -> Stretch:
        """Return where on the path the sequence is at time `t`."""
        at, segment, s, v, a = self._stretches[max(0, bisect_right(self._times, t) - 1)]
        span = min(t, self._end) - at
        return Stretch(t, segment, s + (v + 0.5 * a * span) * span, max(0.0, v + a * span), a)

    def _turned(self, segment: Segment) -> float:
        """Return the direction at a new segment's start [degrees], within half a turn of the one before."""
        dx, dy = segment.deltas
        heading = segment.arc.heading if segment.arc else degrees(atan2(dy, dx))
        before = self._heading or 0.0
        return before + 180.0 - (180.0 - (heading - before)) % 360.0

    def _factor(self, coordinate: int) -> float:
        """Return the motor counts of a unit of a coordinate."""
        if coordinate == TANGENT:
            return self.tangent[0]
        return self.scale[coordinate] if self.mode == VECTOR else 1.0

    def _bound(self) -> int:
        """Bring the speeds at the segments' ends up to date; return the number of the first that changed."""
        return self._first + path.bound(self.segments, self._bounds, self.registers["VD"], self.ended)

    def _entry(self, number: int) -> Stretch:
        """Return the state at the start of a segment that is still to come, or to be appended to the path."""
        index = bisect_left(self._stretches, number, key=lambda stretch: stretch.segment)
        if index == len(self._stretches):
            return Stretch(self._end, number, 0.0, self._exit, 0.0)
        return self._stretches[index]

    def _plan(self, start: Stretch) -> None:
        rates = path.Rates(self.registers["VA"], self.registers["VD"])
        self._splice(path.walk(self._legs(start.segment), start, rates), start.t)

    def _legs(self, number: int) -> Iterator[Leg]:
        ratio, usual = self.registers["VR"], self.registers["VS"]
        for index in range(number - self._first, len(self.segments)):
            segment = self.segments[index]
            target = ratio * self._target(segment.speed, usual)
            yield Leg(self._first + index, segment.length, target, self._bounds[index])

    def _target(self, speed: float | None, usual: float) -> float:
        if speed is None:
            return usual
        return self.registers["VV"] if speed < 0.0 else speed

    def _adopt(self, new: Path, fresh: int) -> None:
        self._stretches = new.stretches
        self._times = [stretch.t for stretch in new.stretches]
        self._end, self._exit = new.end, new.speed
        self._fresh = fresh

    def _splice(self, new: Path, t: float) -> None:
        """Let a new path replace the old one from time `t` on."""
        self._fresh = bisect_left(self._times, t)
        self._stretches[self._fresh :] = new.stretches
        self._times[self._fresh :] = [stretch.t for stretch in new.stretches]
        self._end, self._exit = new.end, new.speed

    def _drop(self, t: float) -> Stretch:
        """Forget what is done at time `t`; return the state then."""
        state = self.state(t)
        gone = state.segment - self._first
        del self.segments[:gone], self._starts[:gone], self._bounds[:gone]
        self._first = state.segment
        kept = max(0, bisect_right(self._times, t) - 1)
        del self._stretches[:kept], self._times[:kept]
        return state

    def _at(self, number: int) -> tuple[Segment, _Start]:
        index = number - self._first
        return self.segments[index], self._starts[index]

    def _line(self, place: int, segment: Segment, start: _Start) -> tuple[float, float]:
        """Return a member's position at the start of a segment, and how it changes with the way along it."""
        coordinate, factor, origin = self._coordinates[place], self._factors[place], self._origins[place]
        if coordinate == TANGENT:
            return origin + factor * start.heading, factor * (segment.arc.bend if segment.arc else 0.0)
        return origin + factor * start.place[coordinate], factor * segment.deltas[coordinate] / segment.length

    def _coordinate(self, coordinate: int, segment: Segment, start: _Start, s: float) -> float:
        """Return a coordinate at the way `s` along a segment."""
        arc = segment.arc
        if coordinate == TANGENT:
            return start.heading + (arc.bend * s if arc else 0.0)
        if arc is not None:
            return start.place[coordinate] + arc.offset(coordinate, s)
        return start.place[coordinate] + segment.deltas[coordinate] / segment.length * s

    def _rest(self, place: int) -> int:
        """Return the whole count at which a member rests."""
        coordinate = self._coordinates[place]
        if self.stopping:
            state = self.state(self._end)
            at = self._coordinate(coordinate, *self._at(state.segment), state.s)
        else:
            at = (self._heading or 0.0) if coordinate == TANGENT else self._tip[coordinate]
        return round(self._origins[place] + self._factors[place] * at)


def _curved(
    segment: Segment, coordinate: int, base: float, factor: float, stretch: Stretch, until: float
) -> Iterator[Piece]:
    """Yield the pieces of a member along an arc, from `stretch` on `until` a time [s]."""
    arc = segment.arc
    assert arc is not None
    t, _, s, v, a = stretch
    if v == 0.0 and a == 0.0:
        yield Piece(t, base + factor * arc.offset(coordinate, s), 0.0, 0.0)
        return
    for after, p, speed, acceleration in arc.pieces(coordinate, s, v, a, until - t):
        yield Piece(t + after, base + factor * p, factor * speed, factor * acceleration)
