"""Commands that set or tell a register of each axis (SP, AC, OE, ...), and CN."""

from __future__ import annotations

import re
from functools import partial

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.context import Answer, CallerContext, Handler
from dmc41x3.twin.expressions import QUERY, Rejection, by_axis, split
from dmc41x3.twin.motion.axis import VIRTUAL, Axis
from dmc41x3.twin.registers import AXIS, STEPPER_FASTEST, Register, WriteCondition

_OF_VIRTUAL = re.compile(r"\s*([MN])\s*=\s*(.+)")
_STEPPER = frozenset({"MT", "YA", "YB", "YC"})
_SPEEDS = frozenset({"SP", "JG", "HV"})


def addressed(context: CallerContext, text: str) -> list[tuple[Axis, str]]:
    """Return axes and their arguments, in any form; a virtual axis is named alone, as in `SPN=2000`."""
    virtual = _OF_VIRTUAL.fullmatch(text)
    if virtual is not None:
        return [(context.core.virtual[virtual[1]], virtual[2].strip())]
    return [(context.unit.axes[place], argument) for place, argument in by_axis(text, context.unit.letters)]


def named(context: CallerContext, text: str) -> tuple[str, list[Axis]]:
    """Return what is left of a mask without M and N, and the virtual axes that it names."""
    return "".join(name for name in text if name not in VIRTUAL), [
        context.core.virtual[name] for name in VIRTUAL if name in text
    ]


def kept(context: CallerContext, axis: Axis, name: str, register: Register, value: float) -> float:
    """Return a value as a register of an axis keeps it, at the present sample period; raises `Rejection`."""
    if name in _SPEEDS and axis.stepper and abs(value) > STEPPER_FASTEST:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    return register.sampled(context.core.period).rounded(value)


def allowed(axis: Axis, when: WriteCondition) -> None:
    """Raise `Rejection` where a register may not be changed in the present state of the axis."""
    if when is WriteCondition.ALWAYS:
        return
    if when is WriteCondition.COMMUTATED and not axis.commutated:
        raise Rejection(ErrorCode.NOT_BRUSHLESS)
    if when is WriteCondition.BRAKING:
        if axis.motion is not None and axis.motion.positions and not axis.motion.stopping:
            raise Rejection(ErrorCode.NOT_WHILE_RUNNING)
        return
    if axis.moving:
        raise Rejection(ErrorCode.NOT_WHILE_RUNNING)
    if when is WriteCondition.OFF and axis.on:
        raise Rejection(ErrorCode.MOTOR_MUST_BE_OFF)


def _register(name: str, register: Register, context: CallerContext, text: str) -> Answer:
    asked: list[float] = []
    changes: list[tuple[Axis, float]] = []
    for axis, argument in addressed(context, text):
        if name not in axis.registers:
            raise Rejection(ErrorCode.INVALID_AXIS)
        if argument == QUERY:
            asked.append(axis.registers[name])
            continue
        allowed(axis, register.when)
        value = kept(context, axis, name, register, context.number(argument))
        changes.append((axis, abs(value) if name == "SP" else value))
    for axis, value in changes:
        counter = context.core.position(axis)
        axis.registers[name] = value
        if name in _STEPPER and axis.stepper:
            axis.encoder_offset += counter - context.core.position(axis)
        context.core.settings_changed(axis, name)
    if not asked:
        return None
    unit = context.unit
    return unit.fixed_text(asked, register.places) if register.places else unit.position_text(asked)


def _polarity(context: CallerContext, text: str) -> Answer:
    """CN: polarity of limits, home and latch; selective abort; whether the abort input ends the program."""
    cn, asked = list(context.core.cn), list[float]()
    arguments = split(text)
    if len(arguments) > len(cn):
        raise Rejection(ErrorCode.OPERAND_ERROR)
    for place, argument in enumerate(arguments):
        if argument == QUERY:
            asked.append(cn[place])
        elif argument:
            cn[place] = context.integer(argument, -1 if place < 3 else 0, 1)
            if place < 3 and cn[place] == 0:
                raise Rejection(ErrorCode.OUT_OF_RANGE)
    context.core.cn = cn
    context.core.look()
    return context.unit.position_text(asked) if asked else None


TABLE: dict[str, Handler] = {name: partial(_register, name, register) for name, register in AXIS.items()}
TABLE["CN"] = _polarity
