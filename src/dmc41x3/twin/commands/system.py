"""Commands of the controller itself: outputs, variables, formats, handles, burning, reset."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin import burn, status
from dmc41x3.twin.context import Answer, CallerContext, Handler
from dmc41x3.twin.expressions import QUERY, Rejection, split
from dmc41x3.twin.unit import Format, Unit

_COPYRIGHT = "Virtual DMC-41x3 of Maya-UN, Apache License 2.0"


def _bit(on: bool, context: CallerContext, text: str) -> Answer:
    context.unit.set_output(context.integer(text, 1, len(context.unit.outputs)), on)
    return None


def _bit_by_value(context: CallerContext, text: str) -> Answer:
    """OB n,expression: the output follows whether the expression is nonzero."""
    arguments = split(text)
    if len(arguments) != 2:
        raise Rejection(ErrorCode.NOT_ENOUGH_FIELDS)
    bit = context.integer(arguments[0], 1, len(context.unit.outputs))
    context.unit.set_output(bit, context.number(arguments[1]) != 0.0)
    return None


def _port(context: CallerContext, text: str) -> Answer:
    """OP: all outputs of a bank of eight at once."""
    unit = context.unit
    arguments = split(text)
    if 8 * len(arguments) > len(unit.outputs):
        raise Rejection(ErrorCode.OPERAND_ERROR)
    if QUERY in arguments:
        banks = [bank for bank, argument in enumerate(arguments) if argument == QUERY]
        return unit.position_text([status.output_bank(unit, bank) for bank in banks])
    masks = [context.integer(argument, 0, 255) if argument else None for argument in arguments]
    for bank, bits in enumerate(masks):
        for bit in range(8 if bits is not None else 0):
            unit.set_output(8 * bank + bit + 1, bool((bits or 0) >> bit & 1))
    return None


def _flag(read: Callable[[Unit], int], write: Callable[[Unit, int], None], context: CallerContext, text: str) -> Answer:
    """Set or tell a flag of 0 or 1."""
    if text.strip() == QUERY:
        return context.unit.position_text([read(context.unit)])
    write(context.unit, context.integer(text, 0, 1))
    return None


def _set_echo(unit: Unit, value: int) -> None:
    unit.echo = value  # honoured on serial ports only: Ethernet never echoes


def _set_zeros(unit: Unit, value: int) -> None:
    unit.suppress_zeros = value


def _copyright(context: CallerContext, text: str) -> Answer:
    """CW: 1 marks unsolicited characters by bit 7, 2 does not; else the copyright.

    The second number, whether a full serial port discards, concerns no Ethernet handle and is only kept.
    """
    arguments = split(text)
    if arguments[0] in ("", "0", QUERY):
        return _COPYRIGHT
    outlet = context.unit.outlet
    mark = context.integer(arguments[0], 1, 2) if arguments[0] else outlet.mark
    if len(arguments) > 1 and arguments[1]:
        outlet.discarding = context.integer(arguments[1], 0, 1)
    outlet.mark = mark
    return None


def _message_port(context: CallerContext, text: str) -> Answer:
    """CF: where a program's messages go; `I` is the port that asks."""
    name = text.strip()
    if name == QUERY:
        return context.unit.position_text([ord(context.unit.outlet.port)])
    if len(name) != 1 or name not in "ABCDEFGHIST":
        raise Rejection(ErrorCode.OPERAND_ERROR)
    if name == "I":
        if context.caller is None:
            raise Rejection(ErrorCode.NOT_IN_PROGRAM)
        name = context.caller.letter
    context.unit.outlet.port = name
    return None


def _format(name: str, context: CallerContext, text: str) -> Answer:
    """PF, VF: digits before and after the point, negative for hexadecimal."""
    unit = context.unit
    present = unit.position_format if name == "PF" else unit.value_format
    if text.strip() == QUERY:
        return f" {present.code:.1f}"
    value = context.number(text)
    digits = round(abs(value) * 10)
    before, after = divmod(digits, 10)
    if before > (8 if value < 0 else 10) or after > 4:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    form = Format(before, after, value < 0)
    if name == "PF":
        unit.position_format = form
    else:
        unit.value_format = form
    return None


def _reset(context: CallerContext, text: str) -> Answer:
    """RS: 0 comes up with what is burned, -1 as from the factory this once.

    The prompt still goes out, then all links end; the manual leaves open whether there is a reply.
    """
    burn.reset(context.unit, factory=bool(text.strip()) and context.integer(text, -1, 0) == -1)
    return None


def _master_reset(context: CallerContext, text: str) -> Answer:
    """^R^S: a reset that also erases what is burned."""
    _bare(text)
    burn.master_reset(context.unit)
    return None


def _burn(what: Callable[[Unit], None], context: CallerContext, text: str) -> Answer:
    """BN, BP, BV: keep parameters, program, or variables and arrays without power.

    A host is refused BN and BP while a program runs, and anybody BP while an axis moves.
    """
    _bare(text)
    unit = context.unit
    if what is not burn.burn_variables and context.thread is None and unit.threads.mask:
        raise Rejection(ErrorCode.NOT_WHILE_PROGRAM_RUNS)
    if what is burn.burn_program and any(axis.moving for axis in unit.axes):
        raise Rejection(ErrorCode.NOT_WHILE_RUNNING)
    what(unit)
    return None


def _bare(text: str) -> None:
    if text.strip():
        raise Rejection(ErrorCode.OPERAND_ERROR)


TABLE: dict[str, Handler] = {
    "SB": partial(_bit, True),
    "CB": partial(_bit, False),
    "OB": _bit_by_value,
    "OP": _port,
    "EO": partial(_flag, lambda unit: unit.echo, _set_echo),
    "LZ": partial(_flag, lambda unit: unit.suppress_zeros, _set_zeros),
    "CW": _copyright,
    "CF": _message_port,
    "PF": partial(_format, "PF"),
    "VF": partial(_format, "VF"),
    "RS": _reset,
    "\x12\x13": _master_reset,
    "BN": partial(_burn, burn.burn_parameters),
    "BP": partial(_burn, burn.burn_program),
    "BV": partial(_burn, burn.burn_variables),
}
