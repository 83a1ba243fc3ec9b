"""Shared motion of axes: contour mode (CM, CD, DT), PVT (PV, BT), and how axes join and leave it.

Vector sequences are shared motion too; see `plane`.

Records are laid out as soon as they are given, so a new one never changes what is planned already. A record without
duration ends the motion; where the records run out before one, the axes stop dead on the last count, and the motion
is over.

Not in the manual: a contour begins with its first CD, or with DT where that paused it before; CD with =t sets
DT from there on, but does not end a pause; data that come too late (42) find the axes stopped dead on the last count,
out of the contour but still in the mode, so that the next CD begins again; ST, a limit or a fault ends the mode.

Between two records the position is the cubic that has position and velocity of both. It becomes quadratics that agree
with it at both ends and have its acceleration in the middle. The error over a time h is |p'''| h³/(72 √3).

Not in the manual: a sequence whose records run out at speed stops dead; ST brakes at DC (a limit at SD) and
empties the buffer.

A vector sequence stops along its path. A contour and a PVT sequence have no speed of their own along theirs, so their
axes leave it and brake each at its DC (SD at a limit), and what is left in the buffer is forgotten.
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
    """How far each member goes [counts], how fast it is at the end [counts/s], and how long it takes [s].

    A duration of 0 ends the motion; None is whatever is set when the record's turn comes.
    """

    deltas: tuple[int, ...]
    speed: float
    duration: float | None


class PlacedRecord(NamedTuple):
    """A record in its place: from `start` to `end` [s], from `places` [motor counts] at `speed` [counts/s]."""

    start: float
    end: float
    places: tuple[int, ...]
    speed: float
    record: FeedRecord


class Feed(ABC):
    """Records under way and waiting; `letter` is what an axis on it has for `Axis.plane`.

    `paused` holds the axes at the end of the record under way. Subclasses say what a record looks like.
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
        """When the records that are there end [s]; infinite while it is paused."""
        return inf if self.paused else self._end

    @property
    def horizon(self) -> float:
        """When more of the plan must be asked for: never."""
        return inf

    @property
    def empty(self) -> bool:
        """Whether nothing waits to be begun."""
        return not self._waiting

    def free(self, t: float) -> int:
        """Return the places left in the buffer at time `t`; a record under way still takes one."""
        return self.capacity - len(self._waiting) - len(self._laid) + self._past(t)

    def count(self, t: float) -> int:
        """Return how many records are done since the motion last began, its end among them."""
        return self._done + self._past(t)

    def append(self, record: FeedRecord, t: float) -> None:
        """Add a record at time `t`; refused (32) with a full buffer."""
        if self.free(t) <= 0:
            raise Rejection(ErrorCode.SEGMENT_BUFFER_FULL)
        self._waiting.append(record)
        self.stale = True

    def clear(self, t: float) -> None:
        """Forget all records at time `t` but the one under way."""
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
        """Lay out the records that wait, or take back those behind a pause; return from when on the plan is new."""
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
        """Tell that there is no way along the records to brake on."""
        return False

    def finish(self, t: float) -> StopCode:
        """End the motion at time `t`, forget its records, and return the stop code of the members."""
        self._done += self._past(t) + self._closed
        result = self.done_code if self._closed else self.starved_code
        self.running = self.stopping = self.stale = self._closed = self._cut = False
        self._waiting, self._laid = [], []
        return result

    def reset(self) -> None:
        """Forget everything, as power-up does."""
        self.finish(self._end)
        self._done = 0

    def _duration(self, record: FeedRecord) -> float:
        return record.duration or 0.0

    @abstractmethod
    def _shape(self, laid: PlacedRecord, place: int) -> list[TimelinePiece]:
        """Return what one member does in a record."""

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
        """Let the records behind the one under way wait again."""
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
"""DT that lets records wait."""


class Contour(Feed):
    """The contour; `interval` is DT as a power of two of samples, 0 for none, and `starved` is called at error 42."""

    capacity = 511
    running_code = StopCode.CONTOUR_RUNNING
    done_code = starved_code = StopCode.CONTOUR_STOPPED

    def __init__(self) -> None:
        super().__init__(NAME)
        self.interval = 0
        self.starved: Callable[[], None] = lambda: None
        self._usual = 0.0

    def select(self, members: tuple[int, ...], t: float) -> None:
        """Choose the axes (CM) at time `t` and forget what waits."""
        self.members = members
        self.clear(t)

    def set_interval(self, interval: int, sample: float) -> None:
        """Set DT, with the sample time [s]; -1 pauses, any other goes on."""
        self.interval = interval
        self.paused = interval == PAUSED
        self._usual = 0.0 if interval <= 0 else 2**interval * sample
        self.stale = True

    def set_time(self, interval: int, sample: float) -> None:
        """Set the time of the records to come (CD with =t); a pause remains one."""
        if not self.paused:
            self.interval = interval
        self._usual = 2**interval * sample

    @property
    def usual(self) -> float | None:
        """How long a record takes that is given now [s], 0 where nobody said; None where DT is to tell later."""
        return None if self.paused and not self._usual else self._usual

    def finish(self, t: float) -> StopCode:
        """End the contour at time `t`; where its data ran out, report that and stay in the mode."""
        starved = self.running and not self._closed and not self.stopping
        if not starved:
            self.members = ()
        result = super().finish(t)
        if starved:
            self.starved()
        return result

    def reset(self) -> None:
        """Forget everything, as power-up does."""
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
    """The PVT sequence of the axis with a certain index; `samples` is how long its last record takes."""

    capacity = 255
    running_code = StopCode.PVT_RUNNING
    done_code = StopCode.PVT_DONE
    starved_code = StopCode.PVT_STARVED

    def __init__(self, axis: int) -> None:
        super().__init__("PV" + LETTERS[axis], (axis,))
        self.samples = 0

    def reset(self) -> None:
        """Forget everything, as power-up does."""
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
    """A motion that axes take part in, as the motion core runs it. Times are seconds, positions motor counts.

    `letter` is what an axis on it has for `Axis.plane`; `members` are the indices of its axes. `running_code` is their
    stop code while it runs; `stale` tells that its plan must be made again.
    """

    letter: str
    members: tuple[int, ...]
    running: bool
    stopping: bool
    stale: bool
    running_code: StopCode

    @property
    def end(self) -> float:
        """When the run ends [s]; infinite where it does not."""
        ...

    @property
    def horizon(self) -> float:
        """When more of the plan must be asked for, by `replan` [s]; infinite where all of it is known."""
        ...

    def replan(self, t: float) -> float:
        """Make the plan again at time `t`; return from when on it differs from the old one, infinity for nowhere."""
        ...

    def pieces(self, place: int) -> tuple[list[TimelinePiece], float]:
        """Return the newest part of the plan for one member (by its place), and its largest speed [counts/s]."""
        ...

    def brake(self, t: float) -> bool:
        """Stop along the way; False where it cannot, so that each axis must brake by itself."""
        ...

    def finish(self, t: float) -> StopCode:
        """End the run at time `t`, forget what is left of it, and return the stop code of the members."""
        ...

    def reset(self) -> None:
        """Forget everything, as power-up does."""
        ...


def begin_plane(axes: Mapping[int, Axis], plane: Plane, now: float) -> None:
    """Start a sequence at `now` [s] from where its axes are."""
    members = [axes[i] for i in plane.members]
    places = [round(axis.timeline.at(now)[0]) for axis in members]
    plane.begin(now, places, [axis.offset for axis in members])
    join(axes, plane, now)


def begin_feed(axes: Mapping[int, Axis], feed: Feed, now: float) -> None:
    """Start a contour or a PVT sequence at `now` [s] from where its axes are."""
    feed.begin(now, [round(axes[i].timeline.at(now)[0]) for i in feed.members])
    join(axes, feed, now)


def join(axes: Mapping[int, Axis], course: SharedMotion, now: float) -> None:
    """Let the axes of a course that has begun follow it from `now` [s] on."""
    for i in course.members:
        axes[i].plane = course.letter
        axes[i].stop_code = course.running_code
    follow(axes, course, now, now)


def refresh(axes: Mapping[int, Axis], course: SharedMotion, now: float) -> None:
    """Carry out the new plan of a course whose data or rates were changed at this instant."""
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
    """Decelerate a course (ST); one that stops already goes on doing so."""
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
    """Tell whether no axis is left on a course."""
    return not any(axes[i].plane == course.letter for i in course.members)


def _release(axis: Axis, now: float) -> None:
    """Take an axis off its course and let it brake by itself at DC."""
    p, v = axis.timeline.at(now)
    way = timeline.stop_profile(now, p, v, axis.registers["DC"])
    axis.plane = ""
    axis.motion = IndependentMotion(MotionKind.RELATIVE, way, result=StopCode.STOPPED, stopping=True)
    axis.stop_code = StopCode.STOPPED
    axis.peak, axis.turns = way.peak, []
    axis.timeline.plan(now, way.pieces)
    independent.watch_limits(axis, now)


def _turns(pieces: list[TimelinePiece], before: float) -> list[float]:
    """Return the times at which an axis begins to move or to move the other way; `before` is its velocity so far."""
    found: list[float] = []
    heading = (before > 0.0) - (before < 0.0)
    for index, piece in enumerate(pieces):
        t, _, v, a = piece
        sign = (v > 0.0) - (v < 0.0) or (a > 0.0) - (a < 0.0)
        if sign and sign != heading:
            heading = sign
            found.append(t)
        if v * a >= 0.0:  # it goes on as it goes
            continue
        turn = piece.turn(t, pieces[index + 1].t if index + 1 < len(pieces) else inf)
        if turn is not None:
            heading = -heading
            found.append(turn)
    return found
