"""A coordinate system (S or T): its buffer of segments, its rates, and the sequence it runs.

The path is kept as exact whole counts, segment by segment; speeds come from `path`. What the manual leaves open is
settled here: a stop, or a limit, empties the buffer, so that a later BG never resumes what somebody stopped.
"""

from __future__ import annotations

from bisect import bisect_right
from math import inf

from maya_un.galil.codes import ErrorCode, StopCode
from maya_un.virtual import path
from maya_un.virtual.path import Path, Segment, Stretch
from maya_un.virtual.refusal import Refused
from maya_un.virtual.timeline import Piece

CAPACITY = 511
"""Segments that the buffer holds."""


class Plane:
    """State of one coordinate system; `registers` hold VS, VA, VD, VR, VV [counts and seconds]."""

    def __init__(self, letter: str, registers: dict[str, float]) -> None:
        self.letter = letter
        self.registers = registers
        self.members: tuple[int, ...] = ()
        self.segments: list[Segment] = []
        self.ended = False
        self.running = False
        self.stopping = False
        self.result = StopCode.SEQUENCE_DONE
        self.stale = False
        self._done = 0
        self._distance = 0.0
        self._total = 0.0
        self._origin: tuple[int, ...] = ()
        self._path = Path([], 0.0)
        self._times: list[float] = []

    @property
    def end(self) -> float:
        """When the running sequence ends [s]; infinite where it does not."""
        return self._path.end

    @property
    def total(self) -> float:
        """Length of the sequence [counts] (`_LE`)."""
        return self._total

    def free(self, t: float) -> int:
        """Return the places left in the buffer at time `t` (`_LM`); a segment under way still takes one."""
        return CAPACITY - len(self.segments) + (self.state(t).segment if self.running else 0)

    def select(self, members: tuple[int, ...]) -> None:
        """Choose the axes of the plane (LM) and empty its buffer; refused while it runs with other axes."""
        if self.running:
            if members != self.members:
                raise Refused(ErrorCode.NOT_WHILE_RUNNING)
            return
        self.members = members
        self.clear()

    def clear(self) -> None:
        """Empty the buffer (CS); refused while the sequence runs."""
        if self.running:
            raise Refused(ErrorCode.NOT_WHILE_RUNNING)
        self.segments = []
        self.ended = False
        self._done = 0
        self._distance = self._total = 0.0

    def append(self, segment: Segment, t: float) -> None:
        """Add a segment (LI) at time `t`; refused without length, with a full buffer, or behind LE of a run."""
        if self.ended and self.running:
            raise Refused(ErrorCode.NOT_WHILE_RUNNING)
        if segment.length == 0.0:
            raise Refused(ErrorCode.SEGMENT_TOO_SHORT)
        if self._total + segment.length > 2_147_483_647:
            raise Refused(ErrorCode.SEQUENCE_TOO_LONG)
        if self.free(t) <= 0:
            raise Refused(ErrorCode.SEGMENT_BUFFER_FULL)
        if not self.running and not self.segments:
            self.clear()
        self.segments.append(segment)
        self.ended = False
        self._total += segment.length
        self.stale = True

    def close(self) -> None:
        """Mark the end of the sequence (LE): it will come to rest there."""
        self.ended = bool(self.segments) or self.running
        self.stale = True

    def begin(self, t: float, origin: tuple[int, ...]) -> None:
        """Start the sequence at rest at time `t` with the members at `origin` [motor counts]."""
        self.running, self.stopping, self.stale = True, False, False
        self.result = StopCode.SEQUENCE_DONE
        self._done, self._distance = 0, 0.0
        self._origin = origin
        self._adopt(self._planned(Stretch(t, 0, 0.0, 0.0, 0.0)))

    def replan(self, t: float) -> None:
        """Work the speeds out again from time `t` on, after a change of rates or segments."""
        self.stale = False
        if self.running and not self.stopping:
            self._adopt(self._planned(self._drop(t)))

    def brake(self, t: float) -> None:
        """Stop along the path at VD; what is left of the sequence is forgotten when it rests."""
        state = self._drop(t)
        self.stopping, self.stale = True, False
        self.result = StopCode.STOPPED
        self._adopt(path.brake(self.segments, state, self.registers["VD"]))

    def finish(self, t: float) -> StopCode:
        """End the run at time `t`, empty the buffer, and return the stop code of the members."""
        done = self._drop(t)
        result = self.result
        if not self.ended and not self.stopping:
            result = StopCode.COMMANDED
        self._distance += done.s
        self._done += len(self.segments) if not self.stopping else 0
        self.running = self.stopping = self.ended = self.stale = False
        self.segments = []
        self._path, self._times = Path([], t), []
        return result

    def pieces(self, member: int, t: float) -> tuple[list[Piece], float]:
        """Return the timeline of one member (by its place) from time `t` on, and its largest speed [counts/s]."""
        pieces: list[Piece] = []
        peak = 0.0
        index, base, unit = -1, self._origin[member], 0.0
        resting = False
        for at, segment, s, v, a in self._path.stretches:
            while index < segment:
                base += self.segments[index].deltas[member] if index >= 0 else 0
                index += 1
                unit = self.segments[index].deltas[member] / self.segments[index].length
            if unit == 0.0 and resting:
                continue
            resting = unit == 0.0
            peak = max(peak, abs(unit) * v)
            pieces.append(Piece(at, base + unit * s, unit * v, unit * a))
        if self._path.end < inf:
            pieces.append(Piece(self._path.end, self._final(member), 0.0, 0.0))
        if not pieces or pieces[0].t > t:
            pieces.insert(0, Piece(t, base, 0.0, 0.0))
        return pieces, peak

    def turns(self, member: int, t: float) -> list[float]:
        """Return the times after `t` at which a member begins to move, or to move the other way."""
        found: list[float] = []
        heading, last = 0, -1
        for stretch in self._path.stretches:
            if stretch.segment == last:
                continue
            last = stretch.segment
            delta = self.segments[last].deltas[member]
            sign = (delta > 0) - (delta < 0)
            if sign and sign != heading:
                heading = sign
                found.append(stretch.t)
        return [turn for turn in found if turn > t]

    def heading(self, member: int) -> int:
        """Return the direction in which a member will begin to move: 1, -1, or 0."""
        delta = self.segments[0].deltas[member]
        return (delta > 0) - (delta < 0)

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
        return self._done + (self.state(t).segment if self.running else 0)

    def distance(self, t: float) -> float:
        """Return the way along the path since the sequence began [counts] (`_AV`)."""
        if not self.running:
            return self._distance
        state = self.state(t)
        return self._distance + sum(one.length for one in self.segments[: state.segment]) + state.s

    def state(self, t: float) -> Stretch:
        """Return where on the path the sequence is at time `t`."""
        stretches = self._path.stretches
        at, segment, s, v, a = stretches[max(0, bisect_right(self._times, t) - 1)]
        span = min(t, self._path.end) - at
        return Stretch(t, segment, s + (v + 0.5 * a * span) * span, max(0.0, v + a * span), a)

    def _planned(self, start: Stretch) -> Path:
        registers = self.registers
        ratio = registers["VR"]
        usual = registers["VS"]
        speeds = [ratio * self._target(segment.speed, usual) for segment in self.segments]
        rates = path.Rates(registers["VA"], registers["VD"])
        return path.plan(self.segments, speeds, start, rates, self.ended)

    def _target(self, speed: float | None, usual: float) -> float:
        if speed is None:
            return usual
        return self.registers["VV"] if speed < 0.0 else speed

    def _adopt(self, new: Path) -> None:
        self._path = new
        self._times = [stretch.t for stretch in new.stretches]

    def _drop(self, t: float) -> Stretch:
        """Forget the segments that are done at time `t`; return the state as seen from the first one kept."""
        state = self.state(t)
        gone = self.segments[: state.segment]
        if gone:
            self._origin = tuple(
                start + sum(segment.deltas[member] for segment in gone) for member, start in enumerate(self._origin)
            )
            self._distance += sum(segment.length for segment in gone)
            self._done += len(gone)
            del self.segments[: len(gone)]
            kept = bisect_right(self._times, t) - 1
            stretches = [one._replace(segment=one.segment - len(gone)) for one in self._path.stretches[kept:]]
            self._adopt(Path(stretches, self._path.end))
        return state._replace(segment=0)

    def _final(self, member: int) -> int:
        """Return the whole count at which a member rests."""
        if not self.stopping:
            return self._origin[member] + sum(segment.deltas[member] for segment in self.segments)
        state = self.state(self._path.end)
        base = self._origin[member] + sum(segment.deltas[member] for segment in self.segments[: state.segment])
        segment = self.segments[state.segment]
        return round(base + segment.deltas[member] / segment.length * state.s)
