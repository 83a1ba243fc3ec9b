"""Monitors of the axes: position latches (AL, RL), output compare (OC), and failures (OA, YS).

General inputs 1 to 4 latch axes A to D, 9 to 12 axes E to H, on the edge that CN n2 chooses. An index latch stores the
position of the index itself, however late the machine looks. Nothing turns an auxiliary encoder, so its latch stores
the value that DE set.

An encoder has failed if its motor is commanded more than OV for OT samples and the encoder does not move. A stepper is
out of step if its encoder is more than three full steps from the commanded position. With CN ,,,1 the inputs 5 to 8
and 13 to 16 each abort one axis while they are low; the manual does not specify how: here the axis stops at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor, inf

from dmc41x3.language.codes import StopCode
from dmc41x3.twin.motion.axis import Axis, Latch, ProgramTrigger
from dmc41x3.twin.motion.core import ERROR_LOOK, SAMPLE, MotionCore
from dmc41x3.twin.motion.independent import INDEX_PITCH

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
        """Whether a latch is armed or a position compared, as of the last look, AL or OC."""
        return self._armed

    @property
    def watching(self) -> bool:
        """Whether an axis may pass its index or a compared position at any time."""
        return bool(self._compared) or any(axis.latch_armed and axis.latch is Latch.INDEX for axis in self._core.axes)

    def next_event(self) -> float:
        """Return infinity: a latch has no scheduled event."""
        return inf

    def look(self, now: float) -> None:
        """Trip the latches whose input, index or position has occurred since the last look."""
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
        """Clear the compared positions."""
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
        """Store the present position as the last one seen."""
        self._places[axis.index] = self._core.plant.position(axis.index)
        if not self._armed:
            self._levels[:] = self._inputs
            self._armed = True

    def compared(self, axis: Axis) -> bool:
        """Return whether no comparison is pending (`_OC`)."""
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
    """Return the first index between two positions [motor counts], None if there is none."""
    if here > before:
        index = (floor(before / INDEX_PITCH) + 1) * INDEX_PITCH
        return index if index <= here else None
    index = (ceil(before / INDEX_PITCH) - 1) * INDEX_PITCH
    return index if here < before and index >= here else None


STILL = 4.0
"""An encoder that moves by less than this [counts] counts as still."""

FULL_STEPS = 3.0
"""Greatest deviation of a stepper that is in step [full steps]."""

IN_STEP, OUT_OF_STEP = 1.0, 2.0
"""Values of YS: watching, and tripped."""


@dataclass(slots=True)
class _Push:
    """Time [s] and place [counts] from which on a motor pushes while its encoder does not move."""

    since: float
    place: float


class Failures:
    """The failure monitors of all axes, an `Activity`; `inputs` are the levels of the general inputs, from input 1."""

    def __init__(self, core: MotionCore, inputs: list[bool]) -> None:
        self._core = core
        self._inputs = inputs
        self._pushes: dict[int, _Push] = {}

    @property
    def active(self) -> bool:
        """Whether a register enables a monitor, or one times a motor that pushes while its encoder does not move."""
        return self.watching or bool(self._pushes) or self._core.cn[3] == 1

    @property
    def watching(self) -> bool:
        """Whether a stepper or an encoder is monitored while axes move."""
        return bool([axis for axis in self._core.axes if axis.registers["OA"] or axis.registers["YS"] == IN_STEP])

    def next_event(self) -> float:
        """Return when to check pushing motors and moving steppers next [s]."""
        core = self._core
        pushing = any(axis.on and axis.registers["OA"] and (axis.moving or self._pushes) for axis in core.axes)
        stepping = any(axis.moving and axis.stepper and axis.registers["YS"] == IN_STEP for axis in core.axes)
        return core.now + ERROR_LOOK if pushing or stepping else inf

    def look(self, now: float) -> None:
        """Handle the axes that have failed."""
        for axis in self._core.axes:
            self._look_at_encoder(axis, now)
            self._look_at_steps(axis)
            self._look_at_abort(axis)

    def reset(self) -> None:
        """Clear the motors that are being timed."""
        self._pushes.clear()

    def _look_at_encoder(self, axis: Axis, now: float) -> None:
        registers = axis.registers
        if not registers["OA"] or not axis.on or abs(self._core.torque(axis)) <= registers["OV"]:
            self._pushes.pop(axis.index, None)
            return
        place = self._core.plant.position(axis.index)
        push = self._pushes.setdefault(axis.index, _Push(now, place))
        if abs(place - push.place) >= STILL:
            self._pushes[axis.index] = _Push(now, place)
        elif now - push.since >= registers["OT"] * SAMPLE:
            del self._pushes[axis.index]
            self._core.happened.append((ProgramTrigger.POSITION_ERROR, axis))
            self._core.fault(axis, StopCode.ENCODER_FAILURE)

    def _look_at_steps(self, axis: Axis) -> None:
        registers = axis.registers
        if not axis.stepper or registers["YS"] != IN_STEP or not axis.on:
            return
        if abs(step_error(self._core, axis)) > FULL_STEPS * registers["YA"]:
            registers["YS"] = OUT_OF_STEP
            self._core.happened.append((ProgramTrigger.POSITION_ERROR, axis))
            self._core.abort_axis(axis, StopCode.STEPPER_ERROR)

    def _look_at_abort(self, axis: Axis) -> None:
        place = axis.index + 4 if axis.index < 4 else axis.index + 8
        if self._core.cn[3] != 1 or place >= len(self._inputs) or self._inputs[place]:
            return
        if axis.moving or axis.bound:
            self._core.happened.append((ProgramTrigger.POSITION_ERROR, axis))
            self._core.abort_axis(axis, StopCode.SELECTIVE_ABORT)


def step_error(core: MotionCore, axis: Axis) -> float:
    """Return by how many microsteps a stepper's encoder lags its commanded position (QS)."""
    registers = axis.registers
    microsteps = registers["YA"] * registers["YB"] / registers["YC"]
    return core.auxiliary(axis) - core.position(axis) * microsteps if axis.stepper else 0.0
