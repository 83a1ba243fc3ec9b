"""What a program may wait for: a time, the end of a motion, a place on the way, an input.

Where the plan of a motion tells when, that time is used, and looked up again whenever the plan changes; the rest is
looked at in every sample. Where Galil's manual is silent: an axis without a motion does not hold up AD, AR, AV, MF
and MR; AS is over at once for one that is no longer accelerating.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from math import inf

from maya_un.galil.codes import ErrorCode, StopCode
from maya_un.virtual.arguments import axes_and_planes, by_axis, mask, split
from maya_un.virtual.arithmetic import ONE
from maya_un.virtual.axis import Axis
from maya_un.virtual.context import Context
from maya_un.virtual.expressions import Value, compiled
from maya_un.virtual.plane import Plane
from maya_un.virtual.refusal import Refused
from maya_un.virtual.thread import Thread
from maya_un.virtual.unit import Unit

_FAR = 1e9
_LONGEST = 2147483646
_ARRIVED = 4
"""An encoder this near to its target has arrived, for MC [counts]; the manual names no window."""

Operation = Callable[[Context, Thread], None]


@dataclass(frozen=True, slots=True)
class Delay:
    """WT, AT: a number of samples, which the thread counts itself."""

    timed: bool = True
    moves: bool = False

    def when(self, now: float) -> float:
        """Return `now`: the thread is not asked before its sample."""
        return now


@dataclass(slots=True)
class Level:
    """AI: an input to be high (or low)."""

    unit: Unit
    bit: int
    high: bool
    timed: bool = False
    moves: bool = False

    def when(self, now: float) -> float:
        """Return `now`, or the next sample for another look."""
        return now if self.unit.inputs[self.bit - 1] == self.high else now + self.unit.period


@dataclass(slots=True)
class Ended:
    """AM: the profiles of axes and planes to end."""

    axes: list[Axis]
    planes: list[Plane]
    timed: bool = False
    moves: bool = True

    def when(self, now: float) -> float:
        """Return the end of the last profile as planned."""
        ends = [plane.end for plane in self.planes if plane.running]
        for axis in self.axes:
            if axis.moving:
                ends.append(now + _FAR if axis.motion is None else axis.motion.profile.end)
        return max([now, *ends])


@dataclass(slots=True)
class Arrived:
    """MC: profiles to end and encoders to arrive, each axis within its own time from the end of its profile (TW)."""

    unit: Unit
    axes: list[Axis]
    ended: dict[int, float] = field(default_factory=dict[int, float])
    timed: bool = False
    moves: bool = True

    def when(self, now: float) -> float:
        """Return `now` once all have arrived or are given up; the latter get stop code 99 and are noted."""
        return max([now, *(self._when(axis, now) for axis in self.axes)])

    def _when(self, axis: Axis, now: float) -> float:
        if axis.moving:
            return now + _FAR if axis.motion is None else axis.motion.profile.end
        if abs(self.unit.core.error(axis)) <= _ARRIVED or not axis.on:
            return now
        began = self.ended.setdefault(axis.index, now)
        limit = axis.registers["TW"]
        if limit < 0 or now < began + limit / 1000.0:
            return now + self.unit.period
        axis.stop_code = StopCode.MC_TIMEOUT
        self.unit.threads.call("MCTIME")
        return now


@dataclass(slots=True)
class Crossed:
    """AP, MF, MR, AD, AR: an axis to pass a place [motor counts], upwards, downwards, or whichever it comes from.

    With `encoder` it is the encoder that must pass, which only a look at it tells.
    """

    unit: Unit
    axis: Axis
    level: float
    rising: bool | None
    encoder: bool = False
    timed: bool = False
    moves: bool = True
    _version: int = -1
    _time: float = inf

    def when(self, now: float) -> float:
        """Return when the place is passed by the present plan; a rest beyond it has passed it, too."""
        here = self.unit.core.plant.position(self.axis.index) if self.encoder else self.axis.timeline.at(now)[0]
        if self._beyond(here):
            return now
        if not self.axis.moving:
            return now + self.unit.period if self.encoder else now
        if self.encoder:
            return max(now + self.unit.period, self._planned(now))
        return self._planned(now)

    def _beyond(self, here: float) -> bool:
        if self.rising is None:
            # Whoever waits for a place waits from one side of it.
            self.rising = here < self.level
        return here >= self.level if self.rising else here <= self.level

    def _planned(self, now: float) -> float:
        line = self.axis.timeline
        if line.version != self._version:
            self._version = line.version
            found = line.crossing(self.level, now, now + _FAR, bool(self.rising))
            self._time = now + _FAR if found is None else found
        return self._time


@dataclass(slots=True)
class Travelled:
    """AV: a plane to have gone a distance along its path [counts]."""

    plane: Plane
    distance: float
    timed: bool = False
    moves: bool = True

    def when(self, now: float) -> float:
        """Return when the plane is there by its present plan."""
        return now if not self.plane.running else self.plane.reaches(self.distance, now)


@dataclass(slots=True)
class AtSpeed:
    """AS: axes and planes to have stopped accelerating."""

    axes: list[Axis]
    planes: list[Plane]
    timed: bool = False
    moves: bool = True

    def when(self, now: float) -> float:
        """Return the end of the first acceleration as planned."""
        times = [_steady(axis, now) for axis in self.axes if axis.moving]
        times += [plane.steady(now) for plane in self.planes if plane.running]
        return max([now, *times])


def _steady(axis: Axis, now: float) -> float:
    """Return when the acceleration under way ends."""
    pieces = axis.timeline.pieces
    for piece, following in pairwise(pieces):
        if following.t > now:
            speeding = piece.a * (piece.v + piece.a * (now - piece.t)) > 0.0 or (piece.a and now == piece.t)
            return following.t if speeding and piece.t <= now else now
    return now


def _axes(context: Context, text: str) -> list[Axis]:
    return context.axes(mask(text, context.unit.letters))


def _axes_and_planes(context: Context, text: str) -> tuple[list[Axis], list[Plane]]:
    places, letters = axes_and_planes(text, context.unit.letters)
    if not places and not letters:
        places, letters = mask("", context.unit.letters), ["S", "T"]
    return context.axes(places), [context.core.planes[letter] for letter in letters]


def samples(context: Context, milliseconds: int) -> int:
    """Return the samples that last at least so many milliseconds."""
    return -(-milliseconds * 1_000_000 // round(context.unit.period * 1e9))


def _wait(text: str) -> Operation:
    """WT n: milliseconds in steps of 2; WT n,1: samples."""
    time, unit = _time_and_unit(text)

    def act(context: Context, thread: Thread) -> None:
        duration = int(time(context.names) / ONE)
        if not 0 <= duration <= _LONGEST:
            raise Refused(ErrorCode.OUT_OF_RANGE)
        duration -= duration % 2
        count = duration if unit(context.names) else samples(context, duration)
        _sleep(thread, thread.due - 1 + count)

    return act


def _sleep(thread: Thread, until: int) -> None:
    """Have a thread go on in a sample, or at once where that is over."""
    if until > thread.due:
        thread.waiting, thread.due = DELAY, until


def _time_and_unit(text: str) -> tuple[Value, Value]:
    parts = split(text)
    if not parts[0]:
        raise Refused(ErrorCode.NO_TIME)
    if len(parts) > 2:
        raise Refused(ErrorCode.OPERAND_ERROR)
    return compiled(parts[0]), compiled(parts[1] if len(parts) > 1 and parts[1] else "0")


def _at_time(text: str) -> Operation:
    """AT 0 sets the reference; AT n waits until n behind it; AT -n also moves it there. AT n,1: samples."""
    time, unit = _time_and_unit(text)

    def act(context: Context, thread: Thread) -> None:
        duration = int(time(context.names) / ONE)
        here = thread.due - 1
        if not duration:
            thread.reference = here
            return
        span = abs(duration) - abs(duration) % 2
        until = thread.reference + (span if unit(context.names) else samples(context, span))
        if duration < 0:
            thread.reference = until
        _sleep(thread, until)

    return act


def _input(text: str) -> Operation:
    bit = compiled(text)

    def act(context: Context, thread: Thread) -> None:
        number = int(bit(context.names) / ONE)
        if not 1 <= abs(number) <= len(context.unit.inputs):
            raise Refused(ErrorCode.OUT_OF_RANGE)
        thread.waiting = Level(context.unit, abs(number), number > 0)

    return act


def _after_motion(text: str) -> Operation:
    def act(context: Context, thread: Thread) -> None:
        thread.waiting = Ended(*_axes_and_planes(context, text))

    return act


def _at_speed(text: str) -> Operation:
    def act(context: Context, thread: Thread) -> None:
        thread.waiting = AtSpeed(*_axes_and_planes(context, text))

    return act


def _motion_complete(text: str) -> Operation:
    def act(context: Context, thread: Thread) -> None:
        thread.waiting = Arrived(context.unit, _axes(context, text))

    return act


def _one(context: Context, text: str) -> tuple[Axis, float]:
    """Return the one axis of a trippoint and its number; raises `Refused` for several."""
    given = by_axis(text, context.unit.letters)
    if len(given) != 1:
        raise Refused(ErrorCode.OPERAND_ERROR)
    place, argument = given[0]
    return context.unit.axes[place], context.integer(argument, -(1 << 31), (1 << 31) - 1)


def _position(rising: bool | None, text: str) -> Operation:
    """AP, MF, MR: an absolute position of the encoder."""

    def act(context: Context, thread: Thread) -> None:
        axis, value = _one(context, text)
        thread.waiting = Crossed(context.unit, axis, value - axis.offset, rising, encoder=True)

    return act


def _distance(relative: bool, text: str) -> Operation:
    """AD, AR: a distance of the reference from where the motion began, or with AR from the last AR or AD."""

    def act(context: Context, thread: Thread) -> None:
        axis, distance = _one(context, text)
        start = thread.marks.get(axis.index) if relative else None
        if start is None:
            start = float(axis.last_stop - axis.offset)
        way = 1 if axis.timeline.at(context.core.now + 1e-6)[1] >= 0.0 else -1
        level = start + way * abs(distance)
        thread.marks[axis.index] = level
        if axis.moving:
            thread.waiting = Crossed(context.unit, axis, level, rising=way > 0)

    return act


def _vector(text: str) -> Operation:
    """AV s,t: a distance along the path of a plane."""

    def act(context: Context, thread: Thread) -> None:
        given = by_axis(text, "ST")
        if len(given) != 1:
            raise Refused(ErrorCode.OPERAND_ERROR)
        place, argument = given[0]
        thread.waiting = Travelled(context.core.planes["ST"[place]], float(context.integer(argument, 0, 1 << 31)))

    return act


DELAY = Delay()

TIMED = frozenset({"AT", "WT"})
"""Trippoints that a thread settles without a look at the machine."""

TABLE: dict[str, Callable[[str], Operation]] = {
    "AD": partial(_distance, False),
    "AI": _input,
    "AM": _after_motion,
    "AP": partial(_position, None),
    "AR": partial(_distance, True),
    "AS": _at_speed,
    "AT": _at_time,
    "AV": _vector,
    "MC": _motion_complete,
    "MF": partial(_position, True),
    "MR": partial(_position, False),
    "WT": _wait,
}
"""What waits: mnemonic -> the operation of the text behind it."""
