"""The machine that the motors drive, as the controller senses it, and two benches for tests.

A sensor fault changes only the values that the controller reads. It does not change the motion of the plant, and a
record of the plant contains the true values.

`ServoBench` is the plant of a twin without a robot. Everything is closed-form: a first-order lag follows each quadratic
piece of its reference by a quadratic and an exponential, a delay by the same piece shifted in time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from math import exp
from typing import Protocol

from dmc41x3.twin.timeline import Timeline

INPUTS = ("forward", "reverse", "home")
"""Inputs of an axis, in the order in which a plant returns them."""


class Sensing:
    """The sensor faults of one plant; positions are motor counts."""

    def __init__(self) -> None:
        self._lost: dict[int, float] = {}
        self._shift: dict[int, float] = {}
        self._forced: dict[tuple[int, str], bool] = {}

    def fail_encoder(self, axis: int, position: float, on: bool) -> None:
        """Stop the count of an encoder, with the axis at `position`; or let it continue from where it stopped."""
        if on:
            self._lost.setdefault(axis, self.position(axis, position))
        elif axis in self._lost:
            self._shift[axis] = self._lost.pop(axis) - position

    def force_inputs(self, axis: int, levels: dict[str, bool | None]) -> None:
        """Hold inputs of an axis at an electrical level, true for high, or release them (None).

        Raises `ValueError` for a name other than forward, reverse, home.
        """
        for name, level in levels.items():
            if name not in INPUTS:
                raise ValueError(f"an axis has the inputs {', '.join(INPUTS)}, and not {name}")
            if level is None:
                self._forced.pop((axis, name), None)
            else:
                self._forced[axis, name] = level

    def resume(self, axis: int) -> None:
        """Remove the offset of an encoder: the reference restarts at its position, and the plant is the reference."""
        self._shift.pop(axis, None)

    def lost(self, axis: int) -> bool:
        """Return whether the count of an encoder has stopped."""
        return axis in self._lost

    def position(self, axis: int, position: float) -> float:
        """Return the encoder reading of an axis at `position`."""
        lost = self._lost.get(axis)
        return position + self._shift.get(axis, 0.0) if lost is None else lost

    def velocity(self, axis: int, velocity: float) -> float:
        """Return the velocity reading of an axis that moves at `velocity`."""
        return 0.0 if axis in self._lost else velocity

    def inputs(self, axis: int, levels: tuple[bool, bool, bool]) -> tuple[bool, bool, bool]:
        """Return the reading of inputs that are at `levels`."""
        if not self._forced:
            return levels
        forward, reverse, home = (
            self._forced.get((axis, name), level) for name, level in zip(INPUTS, levels, strict=True)
        )
        return forward, reverse, home


TORQUE_LIMIT = 9.9982
"""The largest motor command of a DMC-41x3 [V] (TL 9.9982)."""

CONTACT_STEP = 0.002
"""Interval between looks of the machine while an axis is blocked [s]."""


class Plant(Protocol):
    """The physical side of the motors. Positions are motor counts since power-up; time only goes forward.

    The machine plans the `timelines`; the plant follows them. Its values (`position`, `inputs`, ...) are those of
    the present time, that of the last `advance`.
    """

    @property
    def timelines(self) -> Sequence[Timeline]:
        """The reference of every axis, planned by the machine."""
        ...

    def advance(self, t: float) -> None:
        """Advance the physical state, and its own record, to time `t` [s]."""
        ...

    def next_event(self, until: float) -> float | None:
        """Return the earliest time in (now, until] at which the machine must look, None if there is none.

        At that time a switch changes its level, or an axis meets an obstacle; while an axis is blocked, it is every 2
        ms.
        """
        ...

    def position(self, axis: int) -> float:
        """Return the actual position [counts], not rounded."""
        ...

    def velocity(self, axis: int) -> float:
        """Return the actual velocity [counts/s]."""
        ...

    def torque(self, axis: int) -> float:
        """Return the motor command [V], within ±9.9982, with the sign of the push; 0 with the motor off."""
        ...

    def inputs(self, axis: int) -> tuple[bool, bool, bool]:
        """Return the electrical level (true = high) of forward limit, reverse limit and home input."""
        ...

    def power(self, axis: int, on: bool) -> None:
        """Switch a motor on or off at the present time."""
        ...

    def limit_torque(self, axis: int, volts: float) -> None:
        """Limit a motor to `volts` [V] from now on (TL, TK); a weak motor may not follow its reference."""
        ...

    def output(self, bit: int, on: bool) -> None:
        """Set digital output `bit` (from 1) at the present time."""
        ...

    def fail_encoder(self, axis: int, on: bool) -> None:
        """Stop the count of an encoder while its axis continues; or let it continue from where it stopped."""
        ...

    def force_inputs(self, axis: int, **levels: bool | None) -> None:
        """Hold the inputs `forward`, `reverse`, `home` of an axis at an electrical level, or release them (None).

        Inputs that are not named stay as they are. Like `fail_encoder` this causes no event: call `look` of the
        machine.
        """
        ...


class BenchPlant:
    """Ideal axes on a bench: the position is the reference, the inputs idle high.

    A test may set the level of an input and hold a shaft; the machine notices it at its next look.
    """

    def __init__(self, axes: int = 3) -> None:
        self.timelines: Sequence[Timeline] = tuple(Timeline() for _ in range(axes))
        self.outputs: dict[int, bool] = {}
        self.powered = [False] * axes
        self._levels = [(True, True, True)] * axes
        self._held: dict[int, float] = {}
        self._sensing = Sensing()
        self._now = 0.0

    def advance(self, t: float) -> None:
        """Advance the bench to time `t` [s]."""
        self._now = max(self._now, t)

    def next_event(self, until: float) -> float | None:
        """Return the time of the next look, 2 ms later, while a shaft is held, else None."""
        if not self._held or until <= self._now:
            return None
        return min(until, self._now + CONTACT_STEP)

    def position(self, axis: int) -> float:
        """Return the reference, or the place where the shaft is held [counts]."""
        held = self._held.get(axis)
        return self._sensing.position(axis, self.timelines[axis].at(self._now)[0] if held is None else held)

    def velocity(self, axis: int) -> float:
        """Return the velocity of the reference [counts/s], 0 while held."""
        return 0.0 if axis in self._held else self._sensing.velocity(axis, self.timelines[axis].at(self._now)[1])

    def torque(self, axis: int) -> float:
        """Return 0, or the full command [V] toward the reference if a held shaft or failed encoder deviates."""
        if not self.powered[axis] or not (axis in self._held or self._sensing.lost(axis)):
            return 0.0
        error = self.timelines[axis].at(self._now)[0] - self.position(axis)
        return TORQUE_LIMIT * ((error > 0.0) - (error < 0.0))

    def inputs(self, axis: int) -> tuple[bool, bool, bool]:
        """Return the levels that were set, high by default."""
        return self._sensing.inputs(axis, self._levels[axis])

    def power(self, axis: int, on: bool) -> None:
        """Store whether the motor is on."""
        self.powered[axis] = on
        if on:
            self._sensing.resume(axis)

    def limit_torque(self, axis: int, volts: float) -> None:
        """Change nothing: ideal axes need no torque."""

    def output(self, bit: int, on: bool) -> None:
        """Store the level of a digital output."""
        self.outputs[bit] = on

    def set_inputs(self, axis: int, *, forward: bool = True, reverse: bool = True, home: bool = True) -> None:
        """Set the electrical level of the three inputs of an axis."""
        self._levels[axis] = (forward, reverse, home)

    def fail_encoder(self, axis: int, on: bool) -> None:
        """Stop the count of an encoder, or let it continue from where it stopped."""
        self._sensing.fail_encoder(axis, self.timelines[axis].at(self._now)[0], on)

    def force_inputs(self, axis: int, **levels: bool | None) -> None:
        """Hold inputs at a level that overrides the set one, or release them (None)."""
        self._sensing.force_inputs(axis, levels)

    def hold(self, axis: int) -> None:
        """Hold the shaft of an axis at its present place."""
        self._held[axis] = self.position(axis)

    def release(self, axis: int) -> None:
        """Release a held shaft: it is at its reference again."""
        self._held.pop(axis, None)


_KEPT = 1.0
_SETTLED = 0.5


class LagModel(Enum):
    """How an axis lags its reference."""

    FIRST_ORDER = "approaches its reference with a time constant"
    DELAY = "is where its reference was"


@dataclass(slots=True)
class _Shaft:
    """One motor: position and velocity of its shaft [counts, counts/s], and its state.

    `shift` is the error of its encoder when the motor was last switched.
    """

    timeline: Timeline
    position: float = 0.0
    velocity: float = 0.0
    powered: bool = False
    held: bool = False
    shift: float = 0.0
    since: float = 0.0


class ServoBench:
    """A `Plant` of `axes` motors.

    `lag` is the time constant or delay of every axis, or of each of them [s]; `stiffness` is the ratio of motor command
    to following error [V/count]. Inputs idle high. The machine sees a changed value at its next check.
    """

    def __init__(
        self,
        axes: int = 3,
        lag: float | Sequence[float] = 0.01,
        law: LagModel = LagModel.FIRST_ORDER,
        stiffness: float = TORQUE_LIMIT / 2000.0,
    ) -> None:
        self._lags = tuple(lag) if isinstance(lag, Sequence) else (lag,) * axes
        if len(self._lags) != axes or min(self._lags) < 0.0:
            raise ValueError("a lag is needed for each axis, and none is negative")
        self.outputs: dict[int, bool] = {}
        self.law = law
        self.stiffness = stiffness
        self._shafts = tuple(_Shaft(Timeline()) for _ in range(axes))
        self._levels = [(True, True, True)] * axes
        self._sensing = Sensing()
        self._now = 0.0

    @property
    def timelines(self) -> Sequence[Timeline]:
        """The references of the axes."""
        return tuple(shaft.timeline for shaft in self._shafts)

    def advance(self, t: float) -> None:
        """Advance the bench to time `t` [s]."""
        if t <= self._now:
            return
        for shaft, lag in zip(self._shafts, self._lags, strict=True):
            if shaft.held or not shaft.powered:
                shaft.velocity = 0.0
            elif self.law is LagModel.DELAY or lag == 0.0:
                _delayed(shaft, t, lag)
            else:
                _approached(shaft, self._now, t, lag)
            shaft.timeline.forget(t - lag - _KEPT)
        self._now = t

    def next_event(self, until: float) -> float | None:
        """Return the time of the next look, 2 ms later, while a powered motor is held off its reference, else None."""
        blocked = any(shaft.held and shaft.powered and self._error(shaft) for shaft in self._shafts)
        return min(until, self._now + CONTACT_STEP) if blocked and until > self._now else None

    def position(self, axis: int) -> float:
        """Return the encoder reading [counts]."""
        return self._sensing.position(axis, self._shafts[axis].position)

    def velocity(self, axis: int) -> float:
        """Return the velocity reading of the encoder [counts/s]."""
        return self._sensing.velocity(axis, self._shafts[axis].velocity)

    def torque(self, axis: int) -> float:
        """Return the motor command [V], in proportion to the following error by the encoder."""
        shaft = self._shafts[axis]
        if not shaft.powered:
            return 0.0
        error = shaft.timeline.at(self._now)[0] - self.position(axis)
        return max(-TORQUE_LIMIT, min(TORQUE_LIMIT, self.stiffness * error))

    def inputs(self, axis: int) -> tuple[bool, bool, bool]:
        """Return the levels of forward limit, reverse limit and home input."""
        return self._sensing.inputs(axis, self._levels[axis])

    def power(self, axis: int, on: bool) -> None:
        """Switch a motor; without power the shaft stays at its place."""
        shaft = self._shafts[axis]
        shaft.shift = self.position(axis) - shaft.position
        shaft.powered, shaft.since, shaft.velocity = on, self._now, 0.0

    def limit_torque(self, axis: int, volts: float) -> None:
        """Change nothing: these shafts carry no load."""

    def output(self, bit: int, on: bool) -> None:
        """Store the level of a digital output."""
        self.outputs[bit] = on

    def fail_encoder(self, axis: int, on: bool) -> None:
        """Stop the count of an encoder, or let it continue from there; the motor still follows its reference."""
        self._sensing.fail_encoder(axis, self._shafts[axis].position, on)

    def force_inputs(self, axis: int, **levels: bool | None) -> None:
        """Hold inputs at a level that overrides the set one, or release them (None)."""
        self._sensing.force_inputs(axis, levels)

    def set_inputs(self, axis: int, *, forward: bool = True, reverse: bool = True, home: bool = True) -> None:
        """Set the electrical level of the three inputs of an axis."""
        self._levels[axis] = (forward, reverse, home)

    def hold(self, axis: int) -> None:
        """Hold a shaft at its present place."""
        self._shafts[axis].held = True

    def release(self, axis: int) -> None:
        """Release a held shaft; it catches up with a first-order lag, and is at its place at once with a delay."""
        self._shafts[axis].held = False

    def turn(self, axis: int, counts: float) -> None:
        """Turn a shaft by hand; a powered motor turns it back."""
        self._shafts[axis].position += counts

    def true_position(self, axis: int) -> float:
        """Return the true position of a shaft, independent of its encoder [counts]."""
        return self._shafts[axis].position

    def _error(self, shaft: _Shaft) -> bool:
        return abs(shaft.timeline.at(self._now)[0] - shaft.shift - shaft.position) > _SETTLED


def _delayed(shaft: _Shaft, t: float, lag: float) -> None:
    position, velocity = shaft.timeline.at(max(t - lag, shaft.since))
    shaft.position, shaft.velocity = position - shaft.shift, velocity if t - lag >= shaft.since else 0.0


def _approached(shaft: _Shaft, now: float, t: float, lag: float) -> None:
    """Follow the reference from `now` to `t` [s] by lag * y' = r - y, exactly, piece by piece."""
    edges = [*shaft.timeline.boundaries(now, t), t]
    y, begin = shaft.position, now
    for edge in edges:
        piece = shaft.timeline.ahead(begin)[0]
        span = edge - begin
        offset = lag * (lag * piece.a - piece.v)  # of the motion it settles into: r - lag * r' + lag² * r''
        settled = piece.p - shaft.shift + offset
        y = settled + (piece.v - lag * piece.a + 0.5 * piece.a * span) * span + (y - settled) * exp(-span / lag)
        begin = edge
    shaft.velocity = (shaft.timeline.at(t)[0] - shaft.shift - y) / lag
    shaft.position = y
