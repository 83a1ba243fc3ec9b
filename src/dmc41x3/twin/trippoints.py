"""Trippoints: statements that wait (AD AI AM AP AR AS AT AV MC MF MR WT), and their conditions.

If the plan of a motion determines the time, that time is used, and computed again when the plan changes. Encoders are
checked at every sample. Not in Galil's manual: an axis or a plane that does not move ends a wait for a distance, and an
encoder has arrived within 4 counts of its target.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from math import inf

from dmc41x3.language.codes import ErrorCode, StopCode
from dmc41x3.language.hardware import SAMPLES
from dmc41x3.twin.commands.axis import addressed, named
from dmc41x3.twin.context import CallerContext
from dmc41x3.twin.expressions import ONE, Rejection, Value, axes_and_planes, by_axis, compiled, mask, split
from dmc41x3.twin.motion.axis import Axis, MotionKind
from dmc41x3.twin.motion.plane import Plane
from dmc41x3.twin.program import Thread
from dmc41x3.twin.unit import Unit

ARRIVED = 4
"""Greatest distance of an encoder that has arrived from its target, for MC [counts]."""

_FAR = 1e9


@dataclass(frozen=True, slots=True)
class Delay:
    """WT, AT: wait for a number of samples, which the thread counts."""

    timed: bool = True
    moves: bool = False

    def when(self, now: float) -> float:
        """Return `now`: the thread counts the samples itself, and asks only after them."""
        return now


@dataclass(frozen=True, slots=True)
class InputLevel:
    """AI: wait until a general input (from 1) is high, or low."""

    unit: Unit
    bit: int
    high: bool
    timed: bool = False
    moves: bool = False

    def when(self, now: float) -> float:
        """Return `now` at that level, else infinity: the machine looks again when an input changes."""
        return now if self.unit.inputs[self.bit - 1] == self.high else inf


@dataclass(frozen=True, slots=True)
class ProfilesEnded:
    """AM: wait until the profiles of axes and planes end."""

    unit: Unit
    axes: list[Axis]
    planes: list[Plane]
    timed: bool = False
    moves: bool = True

    def when(self, now: float) -> float:
        """Return the end of the last profile as planned."""
        ends = [plane.end for plane in self.planes if plane.running]
        ends += [_end(self.unit, axis) for axis in self.axes if axis.moving]
        return max([now, *ends])


@dataclass(slots=True)
class Arrived:
    """MC: wait until profiles end and encoders arrive, each axis within its TW after the end of its profile."""

    unit: Unit
    axes: list[Axis]
    ended: dict[int, float] = field(default_factory=dict[int, float])
    timed: bool = False
    moves: bool = True

    def when(self, now: float) -> float:
        """Return `now` once all have arrived or their time is over; the latter get stop code 99 and call #MCTIME."""
        return max([now, *(self._when(axis, now) for axis in self.axes)])

    def _when(self, axis: Axis, now: float) -> float:
        if axis.moving:
            return _end(self.unit, axis)
        if not axis.on or abs(self.unit.core.error(axis)) <= ARRIVED:
            return now
        limit = axis.registers["TW"]
        if limit < 0 or now < self.ended.setdefault(axis.index, now) + limit / 1000.0:
            return now + self.unit.period
        if axis.stop_code is not StopCode.MC_TIMEOUT:
            axis.stop_code = StopCode.MC_TIMEOUT
            self.unit.threads.call("MCTIME")
        return now


@dataclass(slots=True)
class EncoderPassed:
    """AP, MF, MR: wait until the encoder of an axis is at a place [motor counts] or beyond.

    `rising` is true if beyond means above; None for the side opposite to the encoder at the first check.
    """

    unit: Unit
    axis: Axis
    place: float
    rising: bool | None
    timed: bool = False
    moves: bool = True

    def when(self, now: float) -> float:
        """Return `now` beyond the place, else when to check again; an encoder does not pass before its reference."""
        here = self.unit.core.plant.position(self.axis.index)
        if self.rising is None:
            self.rising = here < self.place
        if here >= self.place if self.rising else here <= self.place:
            return now
        if not self.axis.moving and abs(self.unit.core.error(self.axis)) <= ARRIVED:
            return inf
        reference = self.axis.timeline.at(now)[0]
        if self.axis.moving and (reference < self.place if self.rising else reference > self.place):
            planned = self.axis.timeline.crossing(self.place, now, now + _FAR, self.rising)
            return inf if planned is None else max(planned, now + self.unit.period)
        return now + self.unit.period


@dataclass(frozen=True, slots=True)
class AnyOf:
    """MF, MR of several axes: wait for one of them."""

    waits: list[EncoderPassed]
    timed: bool = False
    moves: bool = True

    def when(self, now: float) -> float:
        """Return when the first of them is met."""
        return min([wait.when(now) for wait in self.waits])


@dataclass(slots=True)
class ReferencePassed:
    """AD, AR: wait until the reference of an axis passes a place [motor counts], or its motion ends."""

    axis: Axis
    place: float
    rising: bool
    timed: bool = False
    moves: bool = True
    _version: int = -1
    _time: float = inf

    def when(self, now: float) -> float:
        """Return when the place is passed by the present plan."""
        line = self.axis.timeline
        here = line.at(now)[0]
        if not self.axis.moving or (here >= self.place if self.rising else here <= self.place):
            return now
        if line.version != self._version:
            self._version = line.version
            found = line.crossing(self.place, now, now + _FAR, self.rising)
            self._time = inf if found is None else found
        return self._time


@dataclass(frozen=True, slots=True)
class Travelled:
    """AV: wait until a plane has travelled a distance along its path [counts]."""

    plane: Plane
    distance: float
    timed: bool = False
    moves: bool = True

    def when(self, now: float) -> float:
        """Return when the plane reaches the distance by its present plan."""
        return self.plane.reaches(self.distance, now) if self.plane.running else now


@dataclass(frozen=True, slots=True)
class AtSpeed:
    """AS: wait until axes and planes have their speed, or already decelerate."""

    axes: list[Axis]
    planes: list[Plane]
    timed: bool = False
    moves: bool = True

    def when(self, now: float) -> float:
        """Return the planned end of the last acceleration under way [s], `now` if there is none."""
        times = [_steady(axis, now) for axis in self.axes if axis.moving]
        times += [plane.steady(now) for plane in self.planes if plane.running]
        return max([now, *times])


def _end(unit: Unit, axis: Axis) -> float:
    """Return when the profile of a moving axis ends by itself."""
    if axis.motion is not None:
        return axis.motion.profile.end
    return unit.core.planes[axis.plane].end if axis.plane in unit.core.planes else inf


def _steady(axis: Axis, now: float) -> float:
    """Return when the change of speed under way ends; in a positioning move only acceleration counts."""
    jogs = axis.motion is not None and axis.motion.kind is MotionKind.JOG
    pieces = axis.timeline.pieces
    for piece, following in pairwise(pieces):
        if following.t > now:
            v = piece.v + piece.a * (max(now, piece.t) - piece.t)
            if piece.a == 0.0 or (not jogs and piece.a * v < 0.0):
                return max(now, piece.t)
    return max(now, pieces[-1].t)


Operation = Callable[[CallerContext, Thread], None]

TIMED = frozenset({"AT", "WT"})
"""Trippoints that a thread handles without a look at the machine."""

_PLANES = "ST"
_LONGEST = (1 << 31) - 2
_SOON = 1e-6
_DELAY = Delay()


def _samples(context: CallerContext, milliseconds: int) -> int:
    """Return the number of samples that last at least `milliseconds`."""
    return -(-milliseconds * SAMPLES // context.core.period)


def _span(context: CallerContext, value: Value, unit: Value) -> int:
    """Return a signed time in samples: even milliseconds, or an even number of samples if `unit` is 1."""
    time = int(value(context.names) / ONE)
    if abs(time) > _LONGEST:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    size = abs(time) & ~1
    if not unit(context.names):
        size = _samples(context, size)
    return size if time >= 0 else -size


def _time(text: str) -> tuple[Value, Value]:
    """Return the number of WT or AT, and its unit; raises `Rejection` (39) without a number."""
    parts = split(text)
    if not parts[0]:
        raise Rejection(ErrorCode.NO_TIME)
    if len(parts) > 2:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    return compiled(parts[0]), compiled(parts[1] if len(parts) > 1 and parts[1] else "0")


def _sleep(thread: Thread, until: int) -> None:
    """Make a thread continue in a sample, or at once if that has passed."""
    if until > thread.earliest:
        thread.waiting = _DELAY
        thread.due = thread.earliest = until


def _wait(text: str) -> Operation:
    """WT n: milliseconds in steps of 2; WT n,1: samples."""
    value, unit = _time(text)

    def act(context: CallerContext, thread: Thread) -> None:
        span = _span(context, value, unit)
        if span < 0:
            raise Rejection(ErrorCode.OUT_OF_RANGE)
        _sleep(thread, thread.earliest - 1 + span)

    return act


def _at_time(text: str) -> Operation:
    """AT 0 sets the reference; AT n waits until n after it; AT -n also moves the reference there."""
    value, unit = _time(text)

    def act(context: CallerContext, thread: Thread) -> None:
        span = _span(context, value, unit)
        if span == 0:
            thread.reference = thread.earliest - 1
            return
        until = thread.reference + abs(span)
        if span < 0:
            thread.reference = until
        _sleep(thread, until)

    return act


def _input(text: str) -> Operation:
    """AI n: input n high; AI -n: input n low."""
    value = compiled(text)

    def act(context: CallerContext, thread: Thread) -> None:
        bit = int(value(context.names) / ONE)
        if not 1 <= abs(bit) <= len(context.unit.inputs):
            raise Rejection(ErrorCode.OUT_OF_RANGE)
        thread.waiting = InputLevel(context.unit, abs(bit), bit > 0)

    return act


def _axes_and_planes(context: CallerContext, text: str) -> tuple[list[Axis], list[Plane]]:
    """Return the axes, also virtual ones, and the planes that a mask names, all of them for an empty mask."""
    text, virtual = named(context, text)
    places, letters = axes_and_planes(text, context.unit.letters)
    if not places and not letters and not virtual:
        places, letters = mask("", context.unit.letters), list(_PLANES)
        virtual = list(context.core.virtual.values())
    return [*context.axes(places), *virtual], [context.core.planes[letter] for letter in letters]


def _after_motion(text: str) -> Operation:
    def act(context: CallerContext, thread: Thread) -> None:
        thread.waiting = ProfilesEnded(context.unit, *_axes_and_planes(context, text))

    return act


def _at_speed(text: str) -> Operation:
    def act(context: CallerContext, thread: Thread) -> None:
        thread.waiting = AtSpeed(*_axes_and_planes(context, text))

    return act


def _motion_complete(text: str) -> Operation:
    def act(context: CallerContext, thread: Thread) -> None:
        thread.waiting = Arrived(context.unit, context.axes(mask(text, context.unit.letters)))

    return act


def _places(context: CallerContext, text: str) -> list[tuple[Axis, int]]:
    """Return the axes and their places or distances."""
    given = addressed(context, text)
    return [(axis, context.integer(argument, -(1 << 31), (1 << 31) - 1)) for axis, argument in given]


def _one_axis(context: CallerContext, text: str) -> tuple[Axis, int]:
    """Return the only axis that has a place or distance, with its number; raises `Rejection` for several."""
    given = _places(context, text)
    if len(given) != 1:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    return given[0]


def _position(rising: bool | None, text: str) -> Operation:
    """AP, MF, MR: an absolute position of the encoder, from either side, from below, from above.

    MF and MR accept several axes, of which one is enough (Galil's command reference).
    """

    def act(context: CallerContext, thread: Thread) -> None:
        given = [_one_axis(context, text)] if rising is None else _places(context, text)
        if any(axis.virtual for axis, _ in given):
            raise Rejection(ErrorCode.INVALID_AXIS)
        thread.waiting = AnyOf(
            [EncoderPassed(context.unit, axis, place - axis.offset, rising) for axis, place in given]
        )

    return act


def _distance(relative: bool, text: str) -> Operation:
    """AD, AR: a distance of the reference from the start of the motion; with AR from the last AD or AR, if any."""

    def act(context: CallerContext, thread: Thread) -> None:
        axis, distance = _one_axis(context, text)
        began = axis.last_stop - axis.offset
        origin = float(began)
        if relative and axis.index in thread.marks and thread.marks[axis.index][0] == began:
            origin = thread.marks[axis.index][1]
        rising = _rises(axis, context.core.now)
        place = origin + abs(distance) * (1 if rising else -1)
        thread.marks[axis.index] = began, place
        thread.waiting = ReferencePassed(axis, place, rising)

    return act


def _rises(axis: Axis, now: float) -> bool:
    """Return whether a motion goes upwards; if it rests for a moment, by its final position."""
    velocity = axis.timeline.at(now + _SOON)[1]
    return velocity > 0.0 if velocity else axis.timeline.pieces[-1].p >= axis.timeline.at(now)[0]


def _along_path(text: str) -> Operation:
    """AV s,t: a distance along the path of a plane."""

    def act(context: CallerContext, thread: Thread) -> None:
        given = by_axis(text, _PLANES)
        if len(given) != 1:
            raise Rejection(ErrorCode.OPERAND_ERROR)
        place, argument = given[0]
        distance = context.integer(argument, 0, (1 << 31) - 1)
        thread.waiting = Travelled(context.core.planes[_PLANES[place]], distance)

    return act


TABLE: dict[str, Callable[[str], Operation]] = {
    "AD": partial(_distance, False),
    "AI": _input,
    "AM": _after_motion,
    "AP": partial(_position, None),
    "AR": partial(_distance, True),
    "AS": _at_speed,
    "AT": _at_time,
    "AV": _along_path,
    "MC": _motion_complete,
    "MF": partial(_position, True),
    "MR": partial(_position, False),
    "WT": _wait,
}
"""Functions that prepare the text after a mnemonic."""
