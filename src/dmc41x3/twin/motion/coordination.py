"""Shared motion of axes: contour mode (CM, CD, DT), PVT (PV, BT), and how axes join and leave it.

Vector sequences are shared motion too; see `plane`.

Records are planned as soon as they arrive, so a new record never changes the existing plan. A record without duration
ends the motion. If the records run out before such a record, the axes stop abruptly on the last count, and the motion
ends.

Not in the manual: a contour begins with its first CD, or with the DT that ends a pause; CD with =t sets DT for the
records that follow, but does not end a pause; if data come too late (42), the axes have stopped abruptly on the last
count and left the contour, but the mode remains, so that the next CD begins again; ST, a limit or a fault ends the
mode.

Between two records the position is the cubic that has position and velocity of both. It is replaced by quadratics that
agree with it at both ends and have its acceleration in the middle. The error over a time h is |p'''| h³/(72 √3).

Not in the manual: a PVT sequence whose records run out at speed stops abruptly; ST brakes at DC (a limit at SD) and
empties the buffer.

A vector sequence stops along its path. A contour and a PVT sequence have no speed along their path, so each of their
axes leaves it and brakes at its DC (SD at a limit), and the rest of the buffer is dropped.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Mapping, Sequence
from math import ceil, inf, nextafter, sqrt
from typing import NamedTuple, Protocol

from dmc41x3.language.codes import ErrorCode, StopCode
from dmc41x3.language.hardware import LETTERS
from dmc41x3.twin import timeline
from dmc41x3.twin.expressions import Rejection
from dmc41x3.twin.motion import independent
from dmc41x3.twin.motion.axis import Axis, IndependentMotion, MotionKind
from dmc41x3.twin.motion.plane import Plane
from dmc41x3.twin.timeline import TimelinePiece


class FeedRecord(NamedTuple):
    """Distance of each member [counts], its speed at the end [counts/s], and the duration of the record [s].

    A duration of 0 ends the motion; None stands for the duration that is set when the record is planned.
    """

    deltas: tuple[int, ...]
    speed: float
    duration: float | None


class PlacedRecord(NamedTuple):
    """A planned record: from `start` to `end` [s], from `places` [motor counts] at `speed` [counts/s]."""

    start: float
    end: float
    places: tuple[int, ...]
    speed: float
    record: FeedRecord


class Feed(ABC):
    """Planned and waiting records; `letter` is the value of `Axis.plane` for its axes.

    `paused` holds the axes at the end of the current record. Subclasses define the shape of a record.
    """

    capacity = 0
    running_code = StopCode.RUNNING
    done_code = StopCode.COMMANDED
    starved_code = StopCode.COMMANDED

    def __init__(self, letter: str, members: tuple[int, ...] = ()) -> None:
        self.letter = letter
        self.members = members
        self.running = self.stopping = self.stale = self.paused = False
        self._waiting: list[FeedRecord] = []
        self._laid: list[PlacedRecord] = []
        self._closed = self._cut = False
        self._places: tuple[int, ...] = ()
        self._speed = 0.0
        self._end = 0.0
        self._done = self._fresh = 0

    @property
    def end(self) -> float:
        """Time when the planned records end [s]; infinite during a pause."""
        return inf if self.paused else self._end

    @property
    def horizon(self) -> float:
        """Time when `replan` must extend the plan: never."""
        return inf

    @property
    def empty(self) -> bool:
        """Whether no records wait."""
        return not self._waiting

    def free(self, t: float) -> int:
        """Return the places left in the buffer at time `t`; the current record still takes one."""
        return self.capacity - len(self._waiting) - len(self._laid) + self._past(t)

    def count(self, t: float) -> int:
        """Return the number of records done since the motion last began, including its end."""
        return self._done + self._past(t)

    def append(self, record: FeedRecord, t: float) -> None:
        """Add a record at time `t`; refused (32) with a full buffer."""
        if self.free(t) <= 0:
            raise Rejection(ErrorCode.SEGMENT_BUFFER_FULL)
        self._waiting.append(record)
        self.stale = True

    def clear(self, t: float) -> None:
        """Drop all records at time `t` except the current one."""
        self._drop(t)
        self._cut = self._take_back() < inf or self._cut
        self._waiting.clear()
        self._closed = False
        self.stale = True

    def heading(self, place: int) -> int:
        """Return the direction in which a member will begin to move: 1, -1, or 0."""
        delta = next((record.deltas[place] for record in self._waiting if record.deltas[place]), 0)
        return (delta > 0) - (delta < 0)

    def begin(self, t: float, places: Sequence[int]) -> None:
        """Start at rest at time `t` with the members at `places` [motor counts]."""
        self.running, self.stopping, self._closed = True, False, False
        self._laid = []
        self._done = self._fresh = 0
        self._places, self._speed, self._end = tuple(places), 0.0, t
        self.replan(t)

    def replan(self, t: float) -> float:
        """Plan the waiting records, or take back those after a pause; return the time from which the plan is new."""
        self.stale = False
        self._drop(t)
        cut, self._cut = self._cut, False
        if self.paused:
            back = self._take_back()
            return self._end if cut else back
        start = max(t, self._end)
        self._fresh = len(self._laid)
        while self._waiting and not self._closed:
            self._lay(self._waiting.pop(0), start if len(self._laid) == self._fresh else self._end)
        return start if cut or len(self._laid) > self._fresh else inf

    def pieces(self, place: int) -> tuple[list[TimelinePiece], float]:
        """Return the newest part of one member's timeline, and its largest speed [counts/s]."""
        pieces: list[TimelinePiece] = []
        for laid in self._laid[self._fresh :]:
            pieces += self._shape(laid, place)
        peak = max((abs(piece.v) for piece in pieces), default=0.0)
        pieces.append(TimelinePiece(self._end, self._places[place], 0.0, 0.0))
        return pieces, peak

    def brake(self, t: float) -> bool:
        """Return False: the records have no path to brake along."""
        return False

    def finish(self, t: float) -> StopCode:
        """End the motion at time `t`, drop its records, and return the stop code of the members."""
        self._done += self._past(t) + self._closed
        result = self.done_code if self._closed else self.starved_code
        self.running = self.stopping = self.stale = self._closed = self._cut = False
        self._waiting, self._laid = [], []
        return result

    def reset(self) -> None:
        """Clear everything, as power-up does."""
        self.finish(self._end)
        self._done = 0

    def _duration(self, record: FeedRecord) -> float:
        return record.duration or 0.0

    @abstractmethod
    def _shape(self, laid: PlacedRecord, place: int) -> list[TimelinePiece]:
        """Return the motion of one member during a record."""

    def _lay(self, record: FeedRecord, start: float) -> None:
        duration = self._duration(record)
        if duration == 0.0:
            self._closed = True
            return
        self._end = start + duration
        self._laid.append(PlacedRecord(start, self._end, self._places, self._speed, record))
        self._places = tuple(at + delta for at, delta in zip(self._places, record.deltas, strict=True))
        self._speed = record.speed

    def _take_back(self) -> float:
        """Move records planned after the current one back to the waiting ones; return their start [s], or infinity."""
        kept = min(1, len(self._laid))
        back = self._laid[kept:]
        if not back:
            return inf
        end = [FeedRecord(back[0].record.deltas, 0.0, 0.0)] * self._closed
        self._waiting[:0] = [laid.record for laid in back] + end
        self._closed = False
        del self._laid[kept:]
        self._fresh = kept
        _, _, self._places, self._speed, _ = back[0]
        self._end = back[0].start
        return self._end

    def _past(self, t: float) -> int:
        return bisect_right(self._laid, t, key=lambda laid: laid.end)

    def _drop(self, t: float) -> None:
        gone = self._past(t)
        self._done += gone
        del self._laid[:gone]


NAME = "CM"
"""Value of `Axis.plane` for an axis in a contour."""

PAUSED = -1
"""Value of DT for a pause."""


class Contour(Feed):
    """The contour; `interval` is DT as a power of two of samples, 0 for none; `starved` is called at error 42."""

    capacity = 511
    running_code = StopCode.CONTOUR_RUNNING
    done_code = StopCode.CONTOUR_STOPPED
    starved_code = StopCode.CONTOUR_STOPPED

    def __init__(self) -> None:
        super().__init__(NAME)
        self.interval = 0
        self.starved: Callable[[], None] = lambda: None
        self._usual = 0.0

    def select(self, members: tuple[int, ...], t: float) -> None:
        """Choose the axes (CM) at time `t` and drop the waiting records."""
        self.members = members
        self.clear(t)

    def set_interval(self, interval: int, sample: float) -> None:
        """Set DT, with the sample time [s]; -1 pauses, any other value continues."""
        self.interval = interval
        self.paused = interval == PAUSED
        self._usual = 0.0 if interval <= 0 else 2**interval * sample
        self.stale = True

    def set_time(self, interval: int, sample: float) -> None:
        """Set the duration of the next records (CD with =t), 2**interval * sample [s]; a pause remains in force."""
        if not self.paused:
            self.interval = interval
        self._usual = 2**interval * sample

    @property
    def usual(self) -> float | None:
        """Duration of a new record [s], 0 if none is set; None if DT sets it later."""
        return None if self.paused and not self._usual else self._usual

    def finish(self, t: float) -> StopCode:
        """End the contour at time `t`; if its data ran out, call `starved` and stay in the mode."""
        starved = self.running and not self._closed and not self.stopping
        if not starved:
            self.members = ()
        result = super().finish(t)
        if starved:
            self.starved()
        return result

    def reset(self) -> None:
        """Clear everything, as power-up does."""
        self.stopping = True
        super().reset()
        self.paused, self.interval, self._usual = False, 0, 0.0

    def _duration(self, record: FeedRecord) -> float:
        return self._usual if record.duration is None else record.duration

    def _shape(self, laid: PlacedRecord, place: int) -> list[TimelinePiece]:
        speed = laid.record.deltas[place] / (laid.end - laid.start)
        return [TimelinePiece(laid.start, laid.places[place], speed, 0.0)]


TOLERANCE = 0.05
"""Largest distance of the pieces from the cubic [counts]."""


class Pvt(Feed):
    """The PVT sequence of one axis, given by its index; `samples` is the duration of the last record."""

    capacity = 255
    running_code = StopCode.PVT_RUNNING
    done_code = StopCode.PVT_DONE
    starved_code = StopCode.PVT_STARVED

    def __init__(self, axis: int) -> None:
        super().__init__("PV" + LETTERS[axis], (axis,))
        self.samples = 0

    def reset(self) -> None:
        """Clear everything, as power-up does."""
        super().reset()
        self.samples = 0

    def heading(self, place: int) -> int:
        """Return the direction in which the axis will begin to move: 1, -1, or 0."""
        first = self._waiting[0]
        way = 3.0 * first.deltas[place] - first.speed * self._duration(first) or first.deltas[place]
        return (way > 0.0) - (way < 0.0)

    def _shape(self, laid: PlacedRecord, place: int) -> list[TimelinePiece]:
        duration = laid.end - laid.start
        way, v, w = laid.record.deltas[place], laid.speed, laid.record.speed
        square = (3.0 * way - (2.0 * v + w) * duration) / duration**2
        cube = ((v + w) * duration - 2.0 * way) / duration**3
        error = 6.0 * abs(cube) * duration**3 / (72.0 * sqrt(3.0))
        count = max(1, ceil((error / TOLERANCE) ** (1.0 / 3.0)))
        step = duration / count
        pieces: list[TimelinePiece] = []
        before = 0.0
        for index in range(count):
            end = (index + 1) * step
            after = (v + (square + cube * end) * end) * end
            a = 2.0 * square + 6.0 * cube * (index + 0.5) * step
            speed = (after - before) / step - 0.5 * a * step
            pieces.append(TimelinePiece(laid.start + index * step, laid.places[place] + before, speed, a))
            before = after
        return pieces


class SharedMotion(Protocol):
    """A motion shared by axes, as the motion core runs it. Times are seconds, positions motor counts.

    `letter` is the value of `Axis.plane` for its axes; `members` are their indices. `running_code` is their stop code
    while it runs; `stale` means that its plan must be computed again.
    """

    letter: str
    members: tuple[int, ...]
    running: bool
    stopping: bool
    stale: bool
    running_code: StopCode

    @property
    def end(self) -> float:
        """Time when the run ends [s]; infinite if it does not end."""
        ...

    @property
    def horizon(self) -> float:
        """Time when `replan` must extend the plan [s]; infinite if the plan is complete."""
        ...

    def replan(self, t: float) -> float:
        """Compute the plan again at time `t`; return the time from which it differs [s], infinity if it does not."""
        ...

    def pieces(self, place: int) -> tuple[list[TimelinePiece], float]:
        """Return the newest part of the plan for one member (by its place), and its largest speed [counts/s]."""
        ...

    def brake(self, t: float) -> bool:
        """Stop along the path; return False if that is impossible, so that each axis must brake by itself."""
        ...

    def finish(self, t: float) -> StopCode:
        """End the run at time `t`, drop the rest of it, and return the stop code of the members."""
        ...

    def reset(self) -> None:
        """Clear everything, as power-up does."""
        ...


def begin_plane(axes: Mapping[int, Axis], plane: Plane, now: float) -> None:
    """Start a sequence at `now` [s] from the present positions of its axes."""
    members = [axes[i] for i in plane.members]
    places = [round(axis.timeline.at(now)[0]) for axis in members]
    plane.begin(now, places, [axis.offset for axis in members])
    join(axes, plane, now)


def begin_feed(axes: Mapping[int, Axis], feed: Feed, now: float) -> None:
    """Start a contour or a PVT sequence at `now` [s] from the present positions of its axes."""
    feed.begin(now, [round(axes[i].timeline.at(now)[0]) for i in feed.members])
    join(axes, feed, now)


def join(axes: Mapping[int, Axis], course: SharedMotion, now: float) -> None:
    """Make the axes of a course that has started follow it from `now` [s] on."""
    for i in course.members:
        axes[i].plane = course.letter
        axes[i].stop_code = course.running_code
    follow(axes, course, now, now)


def refresh(axes: Mapping[int, Axis], course: SharedMotion, now: float) -> None:
    """Apply the new plan of a course whose data or rates have just changed."""
    start = course.replan(now)
    if start < inf:
        follow(axes, course, now, start)


def follow(axes: Mapping[int, Axis], course: SharedMotion, now: float, start: float) -> None:
    """Put the newest part of a plan, which begins at `start` [s], into the timelines of its axes."""
    for place, i in enumerate(course.members):
        axis = axes[i]
        if axis.plane != course.letter:
            continue
        pieces, peak = course.pieces(place)
        kept = axis.turns[: bisect_left(axis.turns, start)]
        before = axis.timeline.at(nextafter(start, -inf))[1] if start > now else 0.0
        axis.peak = max(axis.peak, peak) if start > now else peak
        axis.turns = kept + [turn for turn in _turns(pieces, before) if turn > now]
        axis.timeline.plan(start, pieces)
        if start <= now or axis.soft_limit is None or axis.soft_limit >= start:
            independent.watch_limits(axis, now, max(now, start))


def stop(axes: Mapping[int, Axis], course: SharedMotion, now: float) -> None:
    """Decelerate a course (ST); a course that is stopping already continues to do so."""
    if not course.running or course.stopping:
        return
    members = [axes[i] for i in course.members if axes[i].plane == course.letter]
    if course.brake(now):
        for axis in members:
            axis.stop_code = StopCode.STOPPED
        follow(axes, course, now, now)
        return
    for axis in members:
        _release(axis, now)
    course.stopping = True
    course.finish(now)


def finish(axes: Mapping[int, Axis], course: SharedMotion, now: float) -> None:
    """End the run of a course at `now` [s] and give its axes their stop code."""
    members = course.members
    result = course.finish(now)
    for i in members:
        axis = axes[i]
        if axis.plane == course.letter:
            axis.plane = ""
            axis.last_stop = axis.reference(now)
            if axis.stop_code is course.running_code:
                axis.stop_code = result


def abandoned(axes: Mapping[int, Axis], course: SharedMotion) -> bool:
    """Return whether a course has no axes left."""
    return not any(axes[i].plane == course.letter for i in course.members)


def _release(axis: Axis, now: float) -> None:
    """Remove an axis from its course and brake it at its DC."""
    p, v = axis.timeline.at(now)
    way = timeline.stop_profile(now, p, v, axis.registers["DC"])
    axis.plane = ""
    axis.motion = IndependentMotion(MotionKind.RELATIVE, way, result=StopCode.STOPPED, stopping=True)
    axis.stop_code = StopCode.STOPPED
    axis.peak, axis.turns = way.peak, []
    axis.timeline.plan(now, way.pieces)
    independent.watch_limits(axis, now)


def _turns(pieces: list[TimelinePiece], before: float) -> list[float]:
    """Return the times at which an axis starts or reverses; `before` is its velocity so far."""
    found: list[float] = []
    heading = (before > 0.0) - (before < 0.0)
    for index, piece in enumerate(pieces):
        t, _, v, a = piece
        sign = (v > 0.0) - (v < 0.0) or (a > 0.0) - (a < 0.0)
        if sign and sign != heading:
            heading = sign
            found.append(t)
        if v * a >= 0.0:  # the direction stays the same
            continue
        turn = piece.turn(t, pieces[index + 1].t if index + 1 < len(pieces) else inf)
        if turn is not None:
            heading = -heading
            found.append(turn)
    return found
