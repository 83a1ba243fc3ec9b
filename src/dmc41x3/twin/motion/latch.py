"""Position latches (AL, RL) and output compare (OC): where an axis is when something happens.

General inputs 1 to 4 latch axes A to D, 9 to 12 axes E to H, on the edge that CN n2 chooses. An index latch keeps the
place of the index itself, however late the machine looks. Nothing turns an auxiliary encoder, so that its latch keeps
what DE set.
"""

from __future__ import annotations

from math import ceil, floor, inf

from dmc41x3.twin.motion.axis import Axis, Latch
from dmc41x3.twin.motion.core import MotionCore
from dmc41x3.twin.motion.homing import INDEX_PITCH

RISING = 1


def input_of(axis: Axis) -> int:
    """Return the number of the general input that latches an axis, from 1."""
    return axis.index + 1 if axis.index < 4 else axis.index + 5


class Latches:
    """The latches of all axes, an `Activity`; `inputs` are the levels of the general inputs, from input 1."""

    def __init__(self, core: MotionCore, inputs: list[bool]) -> None:
        self._core = core
        self._inputs = inputs
        self._levels = list(inputs)
        self._places = [0.0] * len(core.axes)
        self._compared: dict[int, int] = {}
        self._armed = False

    @property
    def active(self) -> bool:
        """Whether a latch is armed or a position compared, as the last look, AL or OC left it."""
        return self._armed

    @property
    def watching(self) -> bool:
        """Whether an axis' index or a compared position may come by at any time."""
        return bool(self._compared) or any(axis.latch_armed and axis.latch is Latch.INDEX for axis in self._core.axes)

    def next_event(self) -> float:
        """Return infinity: a latch has no time of its own."""
        return inf

    def look(self, now: float) -> None:
        """Trip the latches whose input, index or position has come by since the last look."""
        compared = self._compared
        concerned = [axis for axis in self._core.axes if axis.latch_armed or axis.index in compared]
        self._armed = bool(concerned)
        for axis in concerned:
            before, here = self._places[axis.index], self._core.plant.position(axis.index)
            self._places[axis.index] = here
            if axis.latch_armed:
                self._look_at(axis, before, here)
            self._compare(axis, before, here)
        self._levels[:] = self._inputs

    def reset(self) -> None:
        """Forget what is compared."""
        self._compared.clear()

    def arm(self, axis: Axis, latch: Latch) -> None:
        """Arm a latch (AL)."""
        axis.latch, axis.latch_armed, axis.latch_tripped = latch, True, False
        self._begin(axis)

    def compare(self, axis: Axis, position: int) -> None:
        """Wait for an axis to pass `position` [controller counts] (OC)."""
        self._compared[axis.index] = position
        self._begin(axis)

    def _begin(self, axis: Axis) -> None:
        """Take the present place as the one that was seen last."""
        self._places[axis.index] = self._core.plant.position(axis.index)
        if not self._armed:
            self._levels[:] = self._inputs
            self._armed = True

    def compared(self, axis: Axis) -> bool:
        """Return whether nothing is waited for any more, or at all (`_OC`)."""
        return axis.index not in self._compared

    def _look_at(self, axis: Axis, before: float, here: float) -> None:
        if axis.latch is Latch.INDEX:
            index = _index(before, here)
            if index is not None:
                _trip(axis, index + axis.offset)
        elif self._edge(input_of(axis) - 1):
            position = self._core.position(axis)
            _trip(axis, position if axis.latch is Latch.INPUT else self._core.auxiliary(axis))

    def _edge(self, place: int) -> bool:
        if place >= len(self._inputs):
            return False
        rising = self._core.cn[2] == RISING
        return self._inputs[place] != self._levels[place] and self._inputs[place] == rising

    def _compare(self, axis: Axis, before: float, here: float) -> None:
        wanted = self._compared.get(axis.index)
        if wanted is not None and min(before, here) <= wanted - axis.offset <= max(before, here) and before != here:
            del self._compared[axis.index]


def _trip(axis: Axis, position: int) -> None:
    axis.latched, axis.latch_armed, axis.latch_tripped = position, False, True


def _index(before: float, here: float) -> int | None:
    """Return the first index between two places [motor counts]."""
    if here > before:
        index = (floor(before / INDEX_PITCH) + 1) * INDEX_PITCH
        return index if index <= here else None
    index = (ceil(before / INDEX_PITCH) - 1) * INDEX_PITCH
    return index if here < before and index >= here else None
