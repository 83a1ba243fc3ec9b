"""Commands that ask: positions, errors, switches, codes, who and what the controller is, the data record."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from dmc41x3.language.codes import ERROR_TEXTS, ErrorCode
from dmc41x3.language.numbers import format_value, join_positions
from dmc41x3.twin import status
from dmc41x3.twin.context import Answer, CallerContext, Handler
from dmc41x3.twin.expressions import QUERY, Rejection, mask
from dmc41x3.twin.motion.axis import Axis

_Reader = Callable[[CallerContext, Axis], float]

_BLOCKS = "STI"


def _positions(read: _Reader, context: CallerContext, text: str) -> Answer:
    axes = context.axes(mask(text, context.unit.letters))
    return context.unit.position_text([read(context, axis) for axis in axes])


def _codes(read: _Reader, context: CallerContext, text: str) -> Answer:
    """Answer as TS and SC do: three digits, whatever PF says."""
    axes = context.axes(mask(text, context.unit.letters))
    return context.unit.fixed_text([read(context, axis) for axis in axes], 0)


def _torque(context: CallerContext, text: str) -> Answer:
    axes = context.axes(mask(text, context.unit.letters))
    values = [context.core.torque(axis) for axis in axes]
    return join_positions([format_value(value, 1, 4) for value in values])


def _error_code(context: CallerContext, text: str) -> Answer:
    """TC: the code of the last refusal, which this clears; with 1 also its words."""
    words = False if text.strip() in ("", QUERY) else context.integer(text, 0, 1) == 1
    code, context.unit.error_code = context.unit.error_code, 0
    if words and code:
        return f"{code} {ERROR_TEXTS.get(code, '')}".rstrip()
    return context.unit.fixed_text([code], 0)


def _byte(read: Callable[[CallerContext, int], int], most: int, context: CallerContext, text: str) -> Answer:
    number = context.integer(text, 0, most) if text.strip() not in ("", QUERY) else 0
    return context.unit.fixed_text([read(context, number)], 0)


def _inputs(context: CallerContext, text: str) -> Answer:
    """TI n: eight inputs as one number."""
    bank = context.integer(text, 0, status.INPUT_BANKS[-1]) if text.strip() not in ("", QUERY) else 0
    if bank not in status.INPUT_BANKS:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    return context.unit.fixed_text([status.input_bank(context.unit, bank)], 0)


def _record(context: CallerContext, text: str) -> Answer:
    blocks = text.replace(" ", "")
    if any(block not in context.unit.letters + _BLOCKS for block in blocks):
        raise Rejection(ErrorCode.INVALID_AXIS)
    return status.record(context.unit, blocks)


def _layout(context: CallerContext, _: str) -> Answer:
    return f" {len(context.unit.axes)}, {status.GENERAL}, {status.COORDINATE}, {status.AXIS}"


def _identity(context: CallerContext, _: str) -> Answer:
    return f"FW, {context.unit.identity.firmware}\r\nDMC, 4103, Rev 11"


def _firmware(context: CallerContext, _: str) -> Answer:
    return context.unit.identity.firmware


TABLE: dict[str, Handler] = {
    "TP": partial(_positions, lambda context, axis: context.core.position(axis)),
    "RP": partial(_positions, lambda context, axis: axis.reference(context.core.now)),
    "TE": partial(_positions, lambda context, axis: context.core.error(axis)),
    "TD": partial(_positions, lambda context, axis: context.core.auxiliary(axis)),
    "TV": partial(_positions, lambda context, axis: round(context.core.velocity(axis))),
    "RL": partial(_positions, lambda _, axis: axis.latched),
    "TS": partial(_codes, lambda context, axis: status.switches_byte(context.unit, axis)),
    "SC": partial(_codes, lambda context, axis: context.core.stop_code(axis)),
    "TT": _torque,
    "TC": _error_code,
    "TB": partial(_byte, lambda context, _: status.program_byte(context.unit), 0),
    "TI": _inputs,
    "TA": partial(_byte, lambda context, number: status.amplifier_byte(context.unit, number), 3),
    "QR": _record,
    "QZ": _layout,
    "ID": _identity,
    "\x12\x16": _firmware,
}
