"""What the controller reads of a main encoder: position, and velocity over a quarter of a second.

The encoder is the reference less the following error. The reference is known at any time; the error is remembered
from the instants at which the machine looked, and taken as straight between them.
"""

from __future__ import annotations

from collections import deque

from dmc41x3.twin.motion.axis import Axis
from dmc41x3.twin.plant import Plant

WINDOW = 0.25
"""Time over which TV averages [s]."""

SPACING = WINDOW / 64.0
"""Errors that were seen closer together than this [s] are not all kept."""


class Encoder:
    """The main encoder of one axis.

    With a servo motor its counts are the motor's. A stepper turns an encoder of YC counts while it makes YA * YB
    microsteps, which are then what the plant counts.
    """

    def __init__(self, axis: Axis, plant: Plant) -> None:
        self._axis = axis
        self._plant = plant
        self._errors: deque[tuple[float, float]] = deque([(0.0, 0.0)])

    @property
    def position(self) -> int:
        """TP [counts]."""
        axis = self._axis
        if axis.stepper:
            return round(self._plant.position(axis.index) * self.counts_per_step) + axis.encoder_offset
        return round(self._plant.position(axis.index)) + axis.offset

    @property
    def counts_per_step(self) -> float:
        """Encoder counts in a microstep."""
        registers = self._axis.registers
        return registers["YC"] / (registers["YA"] * registers["YB"])

    def note(self, t: float) -> None:
        """Remember the following error at time `t` [s], which is the present."""
        self._note(t, self._axis.timeline.at(t)[0] - self._plant.position(self._axis.index))

    def velocity(self, t: float) -> float:
        """Return TV at time `t` [s], the present: the mean over the last quarter of a second [counts/s]."""
        return self.reading(t, self._axis.timeline.at(t)[0])[1]

    def reading(self, t: float, reference: float) -> tuple[int, float]:
        """Return TP [counts] and TV [counts/s] at time `t` [s], the present, at which the reference is `reference`."""
        axis = self._axis
        here = self._plant.position(axis.index)
        self._note(t, reference - here)
        before = axis.timeline.at(t - WINDOW)[0] - self._error(t - WINDOW)
        if axis.stepper:
            scale = self.counts_per_step
            return round(here * scale) + axis.encoder_offset, (here - before) / WINDOW * scale
        return round(here) + axis.offset, (here - before) / WINDOW

    def _note(self, t: float, error: float) -> None:
        errors = self._errors
        if len(errors) > 1 and t - errors[-2][0] < SPACING:
            errors.pop()
        errors.append((t, error))
        while len(errors) > 2 and errors[1][0] <= t - WINDOW:
            errors.popleft()

    def _error(self, t: float) -> float:
        before = self._errors[0]
        for after in self._errors:
            if after[0] > t:
                span = after[0] - before[0]
                share = min(1.0, max(0.0, (t - before[0]) / span)) if span else 1.0
                return before[1] + share * (after[1] - before[1])
            before = after
        return before[1]
