"""An arc of a vector sequence (CR), and how its course over time becomes quadratic pieces.

Where the way s along the arc is quadratic in time, a coordinate r cos(s/r) is not. Over a short time h it is replaced
by the quadratic that agrees with it at both ends and has its acceleration in the middle. What is then missing is at
most |p'''| h³/48, and with the angular velocity w and acceleration e

    |p'''| ≤ r (w³ + 3 w |e|)

so the times are chosen for that to stay below `TOLERANCE`. Chords of the same error would be ten times as many, and
their directions would jump.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import repeat
from math import ceil, cos, degrees, radians, sin, sqrt
from typing import NamedTuple

TOLERANCE = 0.15
"""Largest distance of the pieces from the arc [counts]."""

X, Y, TANGENT = 0, 1, -1
"""Coordinates of a vector sequence: those of its plane, and the direction of the path [degrees]."""


class Arc(NamedTuple):
    """Radius [counts], and the angles of its start and of the way along it [radians], counterclockwise positive."""

    radius: float
    start: float
    turn: float

    @classmethod
    def of(cls, radius: float, start: float, turn: float) -> Arc:
        """Return the arc of CR, which has its angles in degrees."""
        return cls(radius, radians(start), radians(turn))

    @property
    def length(self) -> float:
        """Length along the arc [counts]."""
        return self.radius * abs(self.turn)

    @property
    def heading(self) -> float:
        """Direction of the path at its start [degrees]."""
        return degrees(self.start) + (90.0 if self.turn > 0.0 else -90.0)

    @property
    def bend(self) -> float:
        """How much the direction changes for each count along the arc [degrees/count]."""
        return degrees(self._sense / self.radius)

    def offset(self, coordinate: int, s: float) -> float:
        """Return a coordinate at the way `s` along the arc, from its start [counts]."""
        wave = sin if coordinate == Y else cos
        return self.radius * (wave(self.start + self._sense * s / self.radius) - wave(self.start))

    def pieces(
        self, coordinate: int, s: float, v: float, a: float, span: float
    ) -> Iterator[tuple[float, float, float, float]]:
        """Yield (time, offset, velocity, acceleration) of the quadratics of a coordinate over `span` seconds.

        Times count from where the way is `s`, the speed `v` and the acceleration along the arc `a`.
        """
        here = self.offset(coordinate, s)
        t = 0.0
        for step in _steps(self.radius, v, a, span):
            middle, end = t + 0.5 * step, t + step
            acceleration = self._acceleration(coordinate, s + (v + 0.5 * a * middle) * middle, v + a * middle, a)
            there = self.offset(coordinate, s + (v + 0.5 * a * end) * end)
            yield t, here, (there - here) / step - 0.5 * acceleration * step, acceleration
            t, here = end, there

    def quadratics(self, v: float, a: float, span: float) -> float:
        """Return about how many quadratics `span` seconds from the speed `v` on take, rather too many."""
        if span <= 0.0 or (v == 0.0 and a == 0.0):
            return 1.0
        return 1.0 + span / _longest(self.radius, v, a, span)

    @property
    def _sense(self) -> float:
        return 1.0 if self.turn > 0.0 else -1.0

    def _acceleration(self, coordinate: int, s: float, v: float, a: float) -> float:
        angle = self.start + self._sense * s / self.radius
        along, inward = (cos(angle), -sin(angle)) if coordinate == Y else (-sin(angle), -cos(angle))
        return self._sense * a * along + v * v / self.radius * inward


def _steps(radius: float, v: float, a: float, span: float) -> Iterator[float]:
    """Yield the durations of quadratics that stay within the tolerance, `span` [s] in all."""
    if a == 0.0:
        count = ceil(span / _longest(radius, v, a, span))
        yield from repeat(span / count, count)
        return
    left = span
    while left > 0.0:
        step = left
        for _ in range(4):
            step = sqrt(step * _longest(radius, v, a, step))
        step = min(left, step, _longest(radius, v, a, step))
        if left - step < 1e-3 * step:
            step = left
        yield step
        v = max(0.0, v + a * step)
        left -= step


def _longest(radius: float, v: float, a: float, step: float) -> float:
    """Return how long a quadratic may be at the largest speed of a step [s]; at rest, as long as the step."""
    w = max(v, v + a * step) / radius
    jerk = radius * w * (w * w + 3.0 * abs(a) / radius)
    return (48.0 * TOLERANCE / jerk) ** (1.0 / 3.0) if jerk > 0.0 else step
