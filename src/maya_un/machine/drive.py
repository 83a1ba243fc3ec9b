"""One motor with its load: follows its reference with a delay, trips switches, ends at hard stops.

All positions are motor counts since power-up.
"""

from __future__ import annotations

from math import inf

import numpy as np

from dmc41x3.twin.timeline import Timeline
from maya_un.machine.truth import MOTOR_LIMIT, Floats, TrueConstants

GIVE = 1.0
"""An axis may be past an obstacle by this much before it counts as contact: an encoder count."""

_EDGE = 0.01
"""Half-width of a switch's hysteresis [counts], far above rounding, far below measured distances."""


class AxisDrive:
    """Axis number `axis` of a machine that was switched on with the axis at `start` [rad or m].

    `position` and `velocity` hold at the last evaluated time. While its motor is on, the commanded position of the axis
    is its reference `lag` ago, less the `shift` by which its encoder was wrong when it was switched on; with the motor
    off it is the actual position. `limit` is the largest motor command [V], `pressed` the switches that a hand presses.
    """

    __slots__ = (
        "_lag",
        "_since",
        "active_high",
        "fitted",
        "friction",
        "limit",
        "position",
        "powered",
        "pressed",
        "scale",
        "shift",
        "start",
        "stiffness",
        "stops",
        "switches",
        "timeline",
        "velocity",
        "wanted",
    )

    def __init__(self, truth: TrueConstants, axis: int, start: float) -> None:
        self.timeline = Timeline()
        self.powered = False
        self.pressed = {"reverse": False, "forward": False}
        self.limit = MOTOR_LIMIT
        self.position = self.velocity = self.wanted = self.shift = 0.0
        self.start = start
        self.scale = truth.scale[axis]
        self.friction = truth.friction[axis]
        self.stiffness = truth.stall_stiffness[axis]
        self.active_high = truth.active_high[axis]
        self.fitted = truth.fitted[axis]
        reverse, forward = truth.switches[axis]
        gap = truth.gaps[axis]
        self.switches = self.counts(reverse), self.counts(forward)
        self.stops = self.counts(reverse - gap), self.counts(forward + gap)
        self._lag = 0.0 if truth.wiring.closed_apart(axis) else truth.lag[axis]
        self._since = 0.0

    def counts(self, q: float) -> float:
        """Return the motor counts at the true angle or length `q` [rad or m]."""
        return (q - self.start) * self.scale

    @property
    def q(self) -> float:
        """The true angle or length [rad or m]."""
        return self.start + self.position / self.scale

    def power(self, t: float, on: bool) -> None:
        """Switch the motor at time `t` [s]; its reference counts from then on only."""
        self.powered = on
        self._since = t

    def source(self, t: float) -> float:
        """Return the time of the reference which the axis obeys at time `t` [s]."""
        return max(t - self._lag, self._since)

    def desired(self, t: float) -> tuple[float, float]:
        """Return the commanded position [counts] and velocity [counts/s] at time `t` [s], without obstacles."""
        if not self.powered:
            return self.position, 0.0
        source = t - self._lag
        if source < self._since:
            return self.timeline.at(self._since)[0] - self.shift, 0.0
        position, velocity = self.timeline.at(source)
        return position - self.shift, velocity

    def follow(self, t: float) -> None:
        """Move to the commanded position at time `t` [s]."""
        self.position, self.velocity = self.desired(t)
        self.wanted = self.position

    def sample(self, ts: Floats) -> Floats:
        """Return the true angle or length [rad or m] at the times `ts` [s] of free motion."""
        if not self.powered:
            return self.start + 0.0 * ts + self.position / self.scale
        return self.start + (self.timeline.sample(self._sources(ts)) - self.shift) / self.scale

    def motion(self, ts: Floats) -> tuple[Floats, Floats, Floats]:
        """Return commanded position, velocity, acceleration [counts, s] at the times `ts` [s]."""
        if not self.powered:
            still = 0.0 * ts
            return still + self.position, still, still
        p, v, a = self.timeline.motion(self._sources(ts))
        early = ts - self._lag < self._since
        if early.any():
            v[early] = a[early] = 0.0
        return p - self.shift, v, a

    def _sources(self, ts: Floats) -> Floats:
        sources = ts - self._lag
        sources[sources < self._since] = self._since
        return sources

    def boundaries(self, t0: float, t1: float) -> list[float]:
        """Return the times in (t0, t1] at which the commanded motion changes its law [s]."""
        if not self.powered:
            return []
        lag = self._lag
        times = [t + lag for t in self.timeline.boundaries(self.source(t0), self.source(t1))]
        if t0 < self._since + lag <= t1:
            times.append(self._since + lag)
        return times

    def changes(self, t0: float, t1: float) -> Floats:
        """Return the `boundaries`, and the times in [t0, t1] at which the commanded motion turns within one law [s]."""
        if not self.powered:
            return np.empty(0)
        since = self._since + self._lag
        times = self.timeline.changes(self.source(t0), self.source(t1)) + self._lag
        return np.append(times, since) if t0 < since <= t1 else times

    def rest(self) -> float:
        """Return when the commanded motion ends [s]; infinite if the axis jogs."""
        if not self.powered:
            return 0.0
        return inf if self.timeline.jogs else self.timeline.end + self._lag

    def bounds(self, t0: float, t1: float) -> tuple[float, float]:
        """Return bounds of the commanded position in [t0, t1] [counts]; they may be a little wide."""
        if not self.powered:
            return self.position, self.position
        low, high = self.timeline.bounds(self.source(t0), self.source(t1))
        return low - self.shift, high - self.shift

    def _reaches(self, level: float, t0: float, t1: float, rising: bool) -> float | None:
        if not self.powered:
            return None
        met = self.timeline.crossing(level + self.shift, self.source(t0), self.source(t1), rising)
        return None if met is None else met + self._lag

    def levels(self) -> tuple[bool, bool]:
        """Return whether the inputs of the reverse and the forward switch are electrically high; an open one is."""
        inputs = zip(self.sensed(), self.active_high, self.fitted, strict=True)
        reverse, forward = (not fitted or active == high for active, high, fitted in inputs)
        return reverse, forward

    def active(self) -> tuple[bool, bool]:
        """Return whether the reverse and the forward switch are active."""
        reverse, forward = self.switches
        return self.position <= reverse + _EDGE, self.position >= forward - _EDGE

    def sensed(self) -> tuple[bool, bool]:
        """Return whether the reverse and the forward switch are active, by the axis or by a hand."""
        reverse, forward = self.active()
        return reverse or self.pressed["reverse"], forward or self.pressed["forward"]

    def switching(self, t0: float, t1: float) -> float | None:
        """Return the first time in (t0, t1] of free motion at which a switch changes [s]."""
        reverse, forward = self.switches
        at_reverse, at_forward = self.active()
        edge = 1.5 * _EDGE if at_reverse else 0.5 * _EDGE
        times = (
            self._reaches(reverse + edge, t0, t1, rising=at_reverse),
            self._reaches(forward - (1.5 * _EDGE if at_forward else 0.5 * _EDGE), t0, t1, rising=not at_forward),
        )
        return min((t for t in times if t is not None), default=None)

    def collision(self, t0: float, t1: float) -> float | None:
        """Return the first time in [t0, t1] of free motion at which a hard stop is met [s]."""
        low, high = self.stops
        lowest, highest = self.bounds(t0, t1)
        if low - GIVE <= lowest and highest <= high + GIVE:
            return None
        if not low - GIVE <= self.desired(t0)[0] <= high + GIVE:
            return t0
        times = (
            self._reaches(low - GIVE, t0, t1, rising=False),
            self._reaches(high + GIVE, t0, t1, rising=True),
        )
        return min((t for t in times if t is not None), default=None)

    def leaving(self, t0: float, t1: float) -> float | None:
        """Return the first time in [t0, t1] of free motion at which the axis leaves its present position [s]."""
        low, high = self.position - GIVE, self.position + GIVE
        lowest, highest = self.bounds(t0, t1)
        if low <= lowest and highest <= high:
            return None
        times = self._reaches(low, t0, t1, rising=False), self._reaches(high, t0, t1, rising=True)
        return min((t for t in times if t is not None), default=None)

    def held_back(self) -> float:
        """Return how far the commanded position is beyond the actual one [counts], 0 without an obstacle."""
        error = self.wanted - self.position
        return error if abs(error) > GIVE else 0.0

    def forget(self, t: float) -> None:
        """Drop the part of the reference that time `t` [s] and later no longer need."""
        self.timeline.forget(t - self._lag - 1.0)
