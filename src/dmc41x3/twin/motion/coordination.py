"""Shared motion of several axes: they begin, follow, stop and leave it.

A vector sequence stops along its path. A contour and a PVT sequence have no speed of their own along theirs, so their
axes leave it and brake each at its DC (SD at a limit), and what is left in the buffer is forgotten.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping
from math import inf, nextafter
from typing import Protocol

from dmc41x3.language.codes import StopCode
from dmc41x3.twin.motion import limits, profile
from dmc41x3.twin.motion.axis import Axis, IndependentMotion, MotionKind
from dmc41x3.twin.motion.feed import Feed
from dmc41x3.twin.motion.plane import Plane
from dmc41x3.twin.timeline import TimelinePiece


class SharedMotion(Protocol):
    """A motion that axes take part in, as the motion core runs it. Times are seconds, positions motor counts.

    `letter` is what an axis on it has for `Axis.plane`; `members` are the indices of its axes. `running_code` is their
    stop code while it runs; `stale` tells that its plan must be made anew.
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
        """Make the plan anew at time `t`; return from when on it differs from the old one, infinity for nowhere."""
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
            limits.watch(axis, now, max(now, start))


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
    way = profile.stop(now, p, v, axis.registers["DC"])
    axis.plane = ""
    axis.motion = IndependentMotion(MotionKind.RELATIVE, way, result=StopCode.STOPPED, stopping=True)
    axis.stop_code = StopCode.STOPPED
    axis.peak, axis.turns = way.peak, []
    axis.timeline.plan(now, way.pieces)
    limits.watch(axis, now)


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
