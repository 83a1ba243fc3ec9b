"""Failures that the controller looks for: a dead encoder (OA, OT, OV), a stepper out of step (YS), selective aborts.

A motor that is commanded more than OV for OT samples while its encoder does not move has no encoder. A stepper whose
encoder is more than three full steps from where it was sent is out of step. With CN ,,,1 the inputs 5 to 8 and 13 to
16 each abort one axis while they are low; where the manual is silent, the axis stops at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from dmc41x3.language.codes import StopCode
from dmc41x3.twin.motion.axis import Axis, ProgramTrigger
from dmc41x3.twin.motion.core import ERROR_LOOK, SAMPLE, MotionCore

STILL = 4.0
"""An encoder that moves by less than this many counts does not move."""

FULL_STEPS = 3.0
"""A stepper may be off by this many full steps."""

IN_STEP, OUT_OF_STEP = 1.0, 2.0
"""YS: watching, and tripped."""


@dataclass(slots=True)
class _Push:
    """Since when a motor pushes though its encoder stays [s, counts]."""

    since: float
    place: float


class Failures:
    """What is looked for on every axis, an `Activity`; `inputs` are the levels of the general inputs, from input 1."""

    def __init__(self, core: MotionCore, inputs: list[bool]) -> None:
        self._core = core
        self._inputs = inputs
        self._pushes: dict[int, _Push] = {}

    @property
    def active(self) -> bool:
        """Whether a register asks for any of it, or a motor pushed when one did."""
        return self.watching or bool(self._pushes) or self._core.cn[3] == 1

    @property
    def watching(self) -> bool:
        """Whether a stepper or an encoder is to be watched while axes move."""
        return bool([axis for axis in self._core.axes if axis.registers["OA"] or axis.registers["YS"] == IN_STEP])

    def next_event(self) -> float:
        """Return when it wants to look at motors that push, or at steppers that move [s]."""
        core = self._core
        pushing = any(axis.on and axis.registers["OA"] and (axis.moving or self._pushes) for axis in core.axes)
        stepping = any(axis.moving and axis.stepper and axis.registers["YS"] == IN_STEP for axis in core.axes)
        return core.now + ERROR_LOOK if pushing or stepping else inf

    def look(self, now: float) -> None:
        """See to the axes that have failed."""
        for axis in self._core.axes:
            self._look_at_encoder(axis, now)
            self._look_at_steps(axis)
            self._look_at_abort(axis)

    def reset(self) -> None:
        """Forget what was seen."""
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
    """Return by how many microsteps a stepper's encoder is behind its commanded place (QS)."""
    registers = axis.registers
    microsteps = registers["YA"] * registers["YB"] / registers["YC"]
    return core.auxiliary(axis) - core.position(axis) * microsteps if axis.stepper else 0.0
