"""A bench of servo motors without mechanics: each follows its reference late, pushes by its error, and can be held.

This is the plant of a twin that is not Maya. Everything is closed-form: a first-order lag follows each quadratic
piece of its reference by a quadratic and an exponential, a delay follows it as it was.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from math import exp

from dmc41x3.twin.plant import CONTACT_STEP, TORQUE_LIMIT
from dmc41x3.twin.sensing import Sensing
from dmc41x3.twin.timeline import Timeline

_KEPT = 1.0
_SETTLED = 0.5


class LagModel(Enum):
    """How an axis is late."""

    FIRST_ORDER = "approaches its reference with a time constant"
    DELAY = "is where its reference was"


@dataclass(slots=True)
class _Shaft:
    """One motor: where it is and goes [counts, counts/s], and what it does there.

    `shift` is by how much its encoder was wrong when it was switched on.
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

    `lag` is the time constant or delay of every axis, or of each of them [s]; `stiffness` how the motor command grows
    with the following error [V/count]. Inputs idle high. What is set or held is seen when the machine looks next.
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
        """Bring the bench to time `t` [s]."""
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
        """Return the next look of 2 ms while a motor that is on is held off its reference, else None."""
        blocked = any(shaft.held and shaft.powered and self._error(shaft) for shaft in self._shafts)
        return min(until, self._now + CONTACT_STEP) if blocked and until > self._now else None

    def position(self, axis: int) -> float:
        """Return what the encoder tells [counts]."""
        return self._sensing.position(axis, self._shafts[axis].position)

    def velocity(self, axis: int) -> float:
        """Return the velocity that the encoder tells [counts/s]."""
        return self._sensing.velocity(axis, self._shafts[axis].velocity)

    def torque(self, axis: int) -> float:
        """Return the motor command [V]: in proportion to the following error that the encoder tells."""
        shaft = self._shafts[axis]
        if not shaft.powered:
            return 0.0
        error = shaft.timeline.at(self._now)[0] - self.position(axis)
        return max(-TORQUE_LIMIT, min(TORQUE_LIMIT, self.stiffness * error))

    def inputs(self, axis: int) -> tuple[bool, bool, bool]:
        """Return the levels of forward limit, reverse limit and home input."""
        return self._sensing.inputs(axis, self._levels[axis])

    def power(self, axis: int, on: bool) -> None:
        """Switch a motor; without it the shaft stays where it is."""
        shaft = self._shafts[axis]
        shaft.shift = self.position(axis) - shaft.position
        shaft.powered, shaft.since, shaft.velocity = on, self._now, 0.0

    def limit_torque(self, axis: int, volts: float) -> None:
        """Change nothing: these shafts carry no load."""

    def output(self, bit: int, on: bool) -> None:
        """Note the level of a digital output."""
        self.outputs[bit] = on

    def fail_encoder(self, axis: int, on: bool) -> None:
        """Let an encoder count no more, or count on from where it stopped; the motor follows its reference still."""
        self._sensing.fail_encoder(axis, self._shafts[axis].position, on)

    def force_inputs(self, axis: int, **levels: bool | None) -> None:
        """Hold inputs at a level whatever is set, or let them go (None)."""
        self._sensing.force_inputs(axis, levels)

    def set_inputs(self, axis: int, *, forward: bool = True, reverse: bool = True, home: bool = True) -> None:
        """Set the electrical level of the three inputs of an axis."""
        self._levels[axis] = (forward, reverse, home)

    def hold(self, axis: int) -> None:
        """Hold a shaft fast where it is."""
        self._shafts[axis].held = True

    def release(self, axis: int) -> None:
        """Let a held shaft go; a lag of first order catches up, a delay is there at once."""
        self._shafts[axis].held = False

    def turn(self, axis: int, counts: float) -> None:
        """Turn a shaft by hand; its motor, where it is on, turns it back."""
        self._shafts[axis].position += counts

    def true_position(self, axis: int) -> float:
        """Return where a shaft really is, whatever its encoder tells [counts]."""
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
