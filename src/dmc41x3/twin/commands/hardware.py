"""Commands of the hardware of the axes: sample time, commutation, steppers, amplifiers, output compare.

The unit has sinusoidal amplifiers and no Hall sensors, so that what needs Hall sensors is refused with 110. Finding
the phase (BX, BZ) takes no time and moves nothing: the bench's motors have no phases.
"""

from __future__ import annotations

import re

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.commands.setting import addressed, allowed
from dmc41x3.twin.context import Answer, CallerContext, Handler
from dmc41x3.twin.expressions import QUERY, Rejection, mask, split
from dmc41x3.twin.motion.axis import Axis
from dmc41x3.twin.motion.failures import step_error
from dmc41x3.twin.registers import AXIS, POSITION, TM, WriteCondition

MOST_VOLTS = 4.998
"""The largest command of BX and BZ [V]."""

LONGEST_TIME = 32767
"""The longest time of BX and BZ [ms]."""

_TIMES = re.compile("[<>]")


def _sample_period(context: CallerContext, text: str) -> Answer:
    """TM: the sample period [µs]; the least one depends on the number of axes. Speeds keep meaning counts/s."""
    core = context.core
    if text.strip() == QUERY:
        return context.unit.position_text([core.period])
    if any(axis.moving for axis in context.unit.axes):
        raise Rejection(ErrorCode.NOT_WHILE_RUNNING)
    least = TM.minimum * ((len(context.unit.axes) + 1) // 2)
    core.set_period(int(TM._replace(minimum=least).rounded(context.number(text))))
    for axis in (*context.unit.axes, *core.virtual.values()):
        for name, register in AXIS.items():
            if register.power and name in axis.registers:
                sampled = register.sampled(core.period)
                axis.registers[name] = sampled.rounded(max(sampled.minimum, axis.registers[name]))
    return None


def _axes(context: CallerContext, text: str) -> list[Axis]:
    return context.axes(mask(text, context.unit.letters))


def _asked(context: CallerContext, text: str) -> list[Axis]:
    """Return the axes of a mask, or of question marks by place."""
    if QUERY not in text:
        return _axes(context, text)
    axes = [axis for axis, _ in addressed(context, text)]
    if any(axis.virtual for axis in axes):
        raise Rejection(ErrorCode.INVALID_AXIS)
    return axes


def _brushless(context: CallerContext, text: str) -> Answer:
    """BA: the axes that are commutated sinusoidally; `N` for none."""
    axes = [] if text.strip() == "N" else _axes(context, text)
    for axis in context.unit.axes:
        allowed(axis, WriteCondition.RESTING)
    for axis in context.unit.axes:
        axis.initialised = axis.initialised and axis in axes
        axis.commutated = axis in axes
    return None


def _find_phase(context: CallerContext, text: str) -> Answer:
    """BX, BZ: find the phase with so many volts; where they are negative, the motor is off afterwards.

    Times behind `<` and `>` [ms], which may stand alone, are accepted: finding it takes none here.
    """
    plain, *times = _TIMES.split(text)
    for time in times:
        context.integer(time, 0, LONGEST_TIME)
    if times and not plain.strip():
        return None
    asked: list[float] = []
    changes: list[tuple[Axis, float]] = []
    for axis, argument in addressed(context, plain):
        if argument == QUERY:
            asked.append(axis.initialised)
            continue
        allowed(axis, WriteCondition.RESTING)
        allowed(axis, WriteCondition.COMMUTATED)
        volts = context.number(argument)
        if not -MOST_VOLTS <= volts <= MOST_VOLTS:
            raise Rejection(ErrorCode.OUT_OF_RANGE)
        changes.append((axis, volts))
    for axis, volts in changes:
        axis.initialised = True
        context.core.servo(axis, volts >= 0.0)
    return context.unit.position_text(asked) if asked else None


def _hall(context: CallerContext, text: str) -> Answer:
    """BC, BI: the phase from Hall sensors, of which there are none; 0 for BI does without them."""
    for axis, argument in addressed(context, text):
        if argument == QUERY:
            return context.unit.position_text([0])
        allowed(axis, WriteCondition.COMMUTATED)
        if context.number(argument):
            raise Rejection(ErrorCode.NO_HALLS)
    return None


def _refine(context: CallerContext, text: str) -> Answer:
    for axis in _axes(context, text):
        allowed(axis, WriteCondition.COMMUTATED)
    raise Rejection(ErrorCode.NO_HALLS)


def _hall_state(context: CallerContext, text: str) -> Answer:
    """QH: the state of the Hall inputs, 0 without sensors."""
    return context.unit.position_text([0.0 for _ in _asked(context, text)])


def _correct(context: CallerContext, text: str) -> Answer:
    """YR: move a stepper by so many microsteps, as IP does, to make up for lost ones."""
    changes: list[tuple[Axis, int]] = []
    for axis, argument in addressed(context, text):
        if argument == QUERY:
            raise Rejection(ErrorCode.QUESTION_MARK_INVALID)
        if axis.virtual or not axis.stepper:
            raise Rejection(ErrorCode.OPERAND_ERROR)
        allowed(axis, WriteCondition.RESTING)
        changes.append((axis, int(POSITION.rounded(context.number(argument)))))
    for axis, distance in changes:
        context.core.shift(axis, distance)
    return None


def _step_error(context: CallerContext, text: str) -> Answer:
    """QS: by how many microsteps the encoder is behind."""
    return context.unit.position_text([step_error(context.core, axis) for axis in _asked(context, text)])


def _compare(context: CallerContext, text: str) -> Answer:
    """OC: wait for an axis to pass a position; the pulses that follow are on no wire here."""
    name, equals, values = text.partition("=")
    if not equals:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    axes = _axes(context, name)
    position = int(POSITION.rounded(context.number(split(values)[0])))
    for axis in axes:
        context.unit.latches.compare(axis, position)
    return None


def _clear_amplifier(context: CallerContext, text: str) -> Answer:
    """AZ: 1 clears latched amplifier errors; a fault that is still there shows again. 0 and 2 choose the report."""
    context.integer(text, 0, 2)
    return None


TABLE: dict[str, Handler] = {
    "TM": _sample_period,
    "BA": _brushless,
    "BX": _find_phase,
    "BZ": _find_phase,
    "BI": _hall,
    "BC": _refine,
    "QH": _hall_state,
    "YR": _correct,
    "QS": _step_error,
    "OC": _compare,
    "AZ": _clear_amplifier,
}
