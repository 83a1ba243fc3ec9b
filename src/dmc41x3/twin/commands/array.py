"""Commands of variables and arrays: DM, DA, LA, LV, QU, QD, and the recording of RA, RD, RC."""

from __future__ import annotations

import re
from dataclasses import dataclass

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.numbers import fits, join_positions, parse_fixed
from dmc41x3.language.record import VELOCITY_SCALE, VOLTS_SCALE
from dmc41x3.twin.context import Answer, CallerContext, Handler
from dmc41x3.twin.expressions import ONE, QUERY, Rejection, axis_letter, axis_place, is_name, split
from dmc41x3.twin.memory import MOST, MOST_ARRAYS, Source
from dmc41x3.twin.motion.axis import Axis

SLOWEST = 8
"""RC n records every 2^n samples, n up to this."""

END_OF_DATA = "\x1a"

LONGEST_LINE = 1 << 20
"""Longest line of QD, which may contain all elements [characters]."""

_SIZED = re.compile(r"([A-Za-z][A-Za-z0-9_]*)\s*\[(.+)\]")
_WHOLE = re.compile(r"([A-Za-z][A-Za-z0-9_]*|\^[a-h])\[\]")
_ANY = re.compile(r"([A-Za-z][A-Za-z0-9_]*)\[.*\]")
_SOURCE = re.compile(r"_([A-Z]{2})([A-Z0-9]{0,2}|~[a-h])|TIME")
_NO_ARRAY = {"": ErrorCode.NOT_ENOUGH_FIELDS, QUERY: ErrorCode.QUESTION_MARK_INVALID}
_RECORDED = frozenset({"DE", "NO", "OP", "RL", "RP", "SC", "SH", "TD", "TE", "TI", "TP", "TS", "TT", "TV"})
"""Operands that can be recorded, besides TIME. The manual names most of them; SH is another name of RP there."""


def _dimension(context: CallerContext, text: str) -> Answer:
    """DM: create arrays in order until one is refused; `?` returns the number of free elements.

    An array and a variable with the same name are refused in either order; a real controller may accept them.
    """
    if text.strip() == QUERY:
        return context.unit.position_text([context.unit.arrays.free])
    for part in split(text):
        sized = _SIZED.fullmatch(part)
        if sized is None:
            raise Rejection(ErrorCode.MISSING_BRACKET if part else ErrorCode.NOT_ENOUGH_FIELDS)
        if not is_name(sized[1]):
            raise Rejection(ErrorCode.BAD_FUNCTION)
        if sized[1] in context.unit.variables:
            raise Rejection(ErrorCode.VARIABLE_ERROR)
        context.unit.arrays.dimension(sized[1], int(context.number(sized[2])))
    return None


def _deallocate(context: CallerContext, text: str) -> Answer:
    """DA: delete variables or arrays (`a[0]`, `a[]`) by name, or all (`*`, `*[0]`, `*[]`); `?` returns the free places.

    An array that does not exist is no error: the program of M2FS deallocates its arrays before it dimensions them.
    Nothing is deleted if a variable does not exist, or if the recorder uses one of the arrays.
    """
    unit = context.unit
    if text.strip() == QUERY:
        return unit.position_text([MOST_ARRAYS - len(unit.arrays)])
    variables: list[str] = []
    arrays: list[str] = []
    for part in split(text):
        array = _ANY.fullmatch(part)
        if part == "*":
            variables += unit.variables
        elif part in ("*[0]", "*[]"):
            arrays += unit.arrays
        elif array is not None:
            arrays += [array[1]] if array[1] in unit.arrays else []
        elif part in unit.variables:
            variables.append(part)
        else:
            raise Rejection(ErrorCode.VARIABLE_ERROR if part else ErrorCode.NOT_ENOUGH_FIELDS)
    if any(unit.recorder.uses(name) for name in arrays):
        raise Rejection(ErrorCode.RECORDING)
    for name in variables:
        unit.variables.pop(name, None)
    for name in {*arrays}:
        unit.arrays.release(name)
    return None


def _list_arrays(context: CallerContext, text: str) -> Answer:
    _bare(text)
    arrays = context.unit.arrays
    return "\r\n".join(f"{name}[{len(arrays.row(name))}]" for name in arrays) or b""


def _list_variables(context: CallerContext, text: str) -> Answer:
    _bare(text)
    unit = context.unit
    return "\r\n".join(f"{name}={unit.raw_text(unit.variables[name])}" for name in sorted(unit.variables)) or b""


def _upload(context: CallerContext, text: str) -> Answer:
    """QU a[],n0,n1,n2: send elements n0 to n1, separated by CR, or by commas for n2 = 1; Ctrl-Z ends them."""
    name, *arguments = split(text)
    row, first, last = _range(context, name, arguments)
    if len(arguments) > 3:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    commas = len(arguments) == 3 and arguments[2] != "" and context.integer(arguments[2], 0, 1) == 1
    texts = [context.unit.raw_text(raw) for raw in row[first : last + 1]]
    return f"{join_positions(texts) if commas else chr(13).join(texts)}\r\n{END_OF_DATA}".encode("ascii")


def _download(context: CallerContext, text: str) -> Answer:
    """QD a[],n0,n1: receive elements from the host until a backslash; by default all elements."""
    if context.caller is None:
        raise Rejection(ErrorCode.NOT_IN_PROGRAM)
    name, *arguments = split(text)
    if len(arguments) > 2:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    row, first, last = _range(context, name, arguments)
    context.caller.download = ArrayDownload(row, first, last)
    context.caller.splitter.limit = LONGEST_LINE
    return None


def _range(context: CallerContext, name: str, arguments: list[str]) -> tuple[list[int], int, int]:
    """Return an array `a[]`, and the first and last element that the two arguments after it name."""
    row = context.unit.arrays.row(_array(context, name))
    first, last = 0, len(row) - 1
    if arguments and arguments[0]:
        first = int(context.number(arguments[0]))
    if len(arguments) > 1 and arguments[1]:
        last = int(context.number(arguments[1]))
    if not 0 <= first <= last < len(row):
        raise Rejection(ErrorCode.INDEX_OUT_OF_RANGE)
    return row, first, last


def _array(context: CallerContext, text: str) -> str:
    found = _WHOLE.fullmatch(text)
    if found is None:
        raise Rejection(_NO_ARRAY.get(text, ErrorCode.MISSING_BRACKET))
    return context.names.array(found[1])


@dataclass(slots=True)
class ArrayDownload:
    """Receives the numbers of QD, from element `at` to element `last`."""

    row: list[int]
    at: int
    last: int

    def line(self, text: str) -> None:
        """Store comma-separated numbers until one is invalid; raises `Rejection`: 83 for no number, 84 for too many."""
        for part in text.removesuffix(",").split(",") if text else ():
            if self.at > self.last:
                raise Rejection(ErrorCode.TOO_MANY_ELEMENTS)
            self.row[self.at] = _number(part)
            self.at += 1

    def end(self) -> None:
        """End the download; elements that were not sent keep their values."""


def _number(text: str) -> int:
    try:
        raw = parse_fixed(text)
    except ValueError:
        raise Rejection(ErrorCode.NOT_A_NUMBER) from None
    if "$" not in text and not fits(float(text)):
        raise Rejection(ErrorCode.NOT_A_NUMBER)
    return raw


def _record_arrays(context: CallerContext, text: str) -> Answer:
    """RA a[],b[]: the arrays to record to."""
    names = [_array(context, part) for part in split(text)]
    if len(names) > MOST:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    context.unit.recorder.choose_arrays(names)
    return None


def _record_sources(context: CallerContext, text: str) -> Answer:
    """RD _TPA,TIME: what to record, in the order of the arrays."""
    parts = split(text)
    if len(parts) > MOST:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    context.unit.recorder.choose_sources([_source(context, part) for part in parts])
    return None


def _source(context: CallerContext, text: str) -> Source:
    found = _SOURCE.fullmatch(text)
    if found is None or (found[1] and found[1] not in _RECORDED):
        raise Rejection(ErrorCode.BAD_OPERAND if text else ErrorCode.NOT_ENOUGH_FIELDS)
    if not found[1]:
        return lambda: context.names.operand("TIME")
    which = axis_letter(context.names, found[2]) if found[2][:1] == "~" else found[2]
    name = f"{'RP' if found[1] == 'SH' else found[1]}{which}"
    context.names.operand(name)
    if found[1] not in ("TV", "TT"):
        return lambda: context.names.operand(name)
    axis = context.unit.axes[axis_place(which, context.unit.letters)]
    return _velocity(context, axis) if found[1] == "TV" else _torque(context, axis)


def _velocity(context: CallerContext, axis: Axis) -> Source:
    """Return a source of the velocity in the unit of the data record: counts/s times 64."""
    return lambda: round(VELOCITY_SCALE * context.core.velocity(axis)) * ONE


def _torque(context: CallerContext, axis: Axis) -> Source:
    """Return a source of the motor command in the unit of the data record: 32767 is 10 V."""
    return lambda: round(VOLTS_SCALE * context.core.torque(axis)) * ONE


def _record(context: CallerContext, text: str) -> Answer:
    """RC n0,n1: record every 2^n0 samples, n1 times, or cyclically for a negative n1; n0 = 0 ends it.

    The sample time at the start applies: a TM during the recording takes effect at the next RC.
    """
    unit = context.unit
    if text.strip() == QUERY:
        return unit.position_text([unit.recorder.recording])
    arguments = split(text)
    if len(arguments) > 2:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    power = context.integer(arguments[0], 0, SLOWEST) if arguments[0] else 0
    count = int(context.number(arguments[1])) if len(arguments) == 2 and arguments[1] else 0
    if power:
        core = context.core
        started = core.now - core.samples * core.sample
        unit.recorder.begin(core.now, started, core.sample, 1 << power, count)
    else:
        unit.recorder.stop()
    return None


def _bare(text: str) -> None:
    if text.strip():
        raise Rejection(ErrorCode.OPERAND_ERROR)


TABLE: dict[str, Handler] = {
    "DM": _dimension,
    "DA": _deallocate,
    "LA": _list_arrays,
    "LV": _list_variables,
    "QU": _upload,
    "QD": _download,
    "RA": _record_arrays,
    "RD": _record_sources,
    "RC": _record,
}
