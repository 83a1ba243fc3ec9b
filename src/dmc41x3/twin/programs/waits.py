"""What a thread waits for: a time, the end of a motion, a place on the way, an input.

Where the plan of a motion tells when, that time is used, and looked up again whenever the plan changes; for encoders,
which only a look tells, every sample is looked at. Where Galil's manual is silent: an axis or a plane that does not
move holds up nobody who waits for a distance, and an encoder has arrived within 4 counts of its target.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from math import inf

from dmc41x3.language.codes import StopCode
from dmc41x3.twin.motion.axis import Axis, MotionKind
from dmc41x3.twin.motion.plane import Plane
from dmc41x3.twin.unit import Unit

ARRIVED = 4
"""An encoder this near to its target has arrived, for MC [counts]."""

_FAR = 1e9


@dataclass(frozen=True, slots=True)
class Delay:
    """WT, AT: samples, which the thread counts itself."""

    timed: bool = True
    moves: bool = False

    def when(self, now: float) -> float:
        """Return `now`: the thread is not asked before its sample."""
        return now


@dataclass(frozen=True, slots=True)
class InputLevel:
    """AI: a general input (from 1) to be high, or low."""

    unit: Unit
    bit: int
    high: bool
    timed: bool = False
    moves: bool = False

    def when(self, now: float) -> float:
        """Return `now` at that level; nothing points to when an input will change, the machine is told then."""
        return now if self.unit.inputs[self.bit - 1] == self.high else inf


@dataclass(frozen=True, slots=True)
class ProfilesEnded:
    """AM: the profiles of axes and planes to end."""

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
    """MC: profiles to end and encoders to arrive, each axis within its own time from the end of its profile (TW)."""

    unit: Unit
    axes: list[Axis]
    ended: dict[int, float] = field(default_factory=dict[int, float])
    timed: bool = False
    moves: bool = True

    def when(self, now: float) -> float:
        """Return `now` once all have arrived or have had their time; the latter get stop code 99 and call #MCTIME."""
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
    """AP, MF, MR: the encoder of an axis to be at a place [motor counts] or beyond.

    `rising` says on which side is beyond; None for the side where the encoder is not when it is first looked at.
    """

    unit: Unit
    axis: Axis
    place: float
    rising: bool | None
    timed: bool = False
    moves: bool = True

    def when(self, now: float) -> float:
        """Return `now` beyond the place, else the next sample; an encoder does not pass before its reference."""
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
    """MF, MR of several axes: one of them is enough."""

    waits: list[EncoderPassed]
    timed: bool = False
    moves: bool = True

    def when(self, now: float) -> float:
        """Return when the first of them is over."""
        return min([wait.when(now) for wait in self.waits])


@dataclass(slots=True)
class ReferencePassed:
    """AD, AR: the reference of an axis to pass a place [motor counts], or its motion to end."""

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
    """AV: a plane to have gone a distance along its path [counts]."""

    plane: Plane
    distance: float
    timed: bool = False
    moves: bool = True

    def when(self, now: float) -> float:
        """Return when the plane is there by its present plan."""
        return self.plane.reaches(self.distance, now) if self.plane.running else now


@dataclass(frozen=True, slots=True)
class AtSpeed:
    """AS: axes and planes to have their speed, or to slow down already."""

    axes: list[Axis]
    planes: list[Plane]
    timed: bool = False
    moves: bool = True

    def when(self, now: float) -> float:
        """Return the end of the last acceleration under way as planned."""
        times = [_steady(axis, now) for axis in self.axes if axis.moving]
        times += [plane.steady(now) for plane in self.planes if plane.running]
        return max([now, *times])


def _end(unit: Unit, axis: Axis) -> float:
    """Return when the profile of a moving axis ends by itself."""
    if axis.motion is not None:
        return axis.motion.profile.end
    return unit.core.planes[axis.plane].end if axis.plane in unit.core.planes else inf


def _steady(axis: Axis, now: float) -> float:
    """Return when the change of speed under way ends; of a positioning only speeding up counts."""
    jogs = axis.motion is not None and axis.motion.kind is MotionKind.JOG
    pieces = axis.timeline.pieces
    for piece, following in pairwise(pieces):
        if following.t > now:
            v = piece.v + piece.a * (max(now, piece.t) - piece.t)
            if piece.a == 0.0 or (not jogs and piece.a * v < 0.0):
                return max(now, piece.t)
    return max(now, pieces[-1].t)
