"""PVT sequences (PV, BT): one axis through given positions, with given velocities, at given times.

Between two records the position is the cubic that has position and velocity of both. It becomes quadratics that agree
with it at both ends and have its acceleration in the middle. What is missing over a time h is |p'''| h³/(72 √3).

Where the manual is silent: a sequence whose records run out at speed stops dead; ST brakes at DC (a limit at SD) and
empties the buffer.
"""

from __future__ import annotations

from math import ceil, sqrt

from dmc41x3.language.codes import StopCode
from dmc41x3.language.hardware import LETTERS
from dmc41x3.twin.motion.feed import Feed, PlacedRecord
from dmc41x3.twin.timeline import TimelinePiece

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
