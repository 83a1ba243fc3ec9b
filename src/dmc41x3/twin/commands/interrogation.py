"""Commands that report: positions (TP), errors (TC), switches (TS), the data record (QR), values (MG)."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache, partial
from typing import NamedTuple

from dmc41x3.language.codes import ERROR_TEXTS, ErrorCode
from dmc41x3.language.numbers import format_raw, format_value, join_positions
from dmc41x3.twin.context import (
    AXIS,
    COORDINATE,
    GENERAL,
    INPUT_BANKS,
    Answer,
    CallerContext,
    Handler,
    amplifier_byte,
    input_bank,
    program_byte,
    record,
    switches_byte,
)
from dmc41x3.twin.expressions import QUERY, Rejection, Value, compiled, mask, unpack
from dmc41x3.twin.motion.axis import Axis

_Reader = Callable[[CallerContext, Axis], float]

_BLOCKS = "STI"


def _positions(read: _Reader, context: CallerContext, text: str) -> Answer:
    axes = context.axes(mask(text, context.unit.letters))
    return context.unit.position_text([read(context, axis) for axis in axes])


def _codes(read: _Reader, context: CallerContext, text: str) -> Answer:
    """Answer as TS and SC do: three digits, independent of PF."""
    axes = context.axes(mask(text, context.unit.letters))
    return context.unit.fixed_text([read(context, axis) for axis in axes], 0)


def _torque(context: CallerContext, text: str) -> Answer:
    axes = context.axes(mask(text, context.unit.letters))
    values = [context.core.torque(axis) for axis in axes]
    return join_positions([format_value(value, 1, 4) for value in values])


def _error_code(context: CallerContext, text: str) -> Answer:
    """TC: return the code of the last refusal and clear it; with 1 also return its text."""
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
    bank = context.integer(text, 0, INPUT_BANKS[-1]) if text.strip() not in ("", QUERY) else 0
    if bank not in INPUT_BANKS:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    return context.unit.fixed_text([input_bank(context.unit, bank)], 0)


def _record(context: CallerContext, text: str) -> Answer:
    blocks = text.replace(" ", "")
    if any(block not in context.unit.letters + _BLOCKS for block in blocks):
        raise Rejection(ErrorCode.INVALID_AXIS)
    return record(context.unit, blocks)


def _layout(context: CallerContext, _: str) -> Answer:
    return f" {len(context.unit.axes)}, {GENERAL}, {COORDINATE}, {AXIS}"


def _identity(context: CallerContext, _: str) -> Answer:
    return f"FW, {context.unit.identity.firmware}\r\nDMC, 4103, Rev 11"


def _firmware(context: CallerContext, _: str) -> Answer:
    return context.unit.identity.firmware


INQUIRY_TABLE: dict[str, Handler] = {
    "TP": partial(_positions, lambda context, axis: context.core.position(axis)),
    "RP": partial(_positions, lambda context, axis: axis.reference(context.core.now)),
    "TE": partial(_positions, lambda context, axis: context.core.error(axis)),
    "TD": partial(_positions, lambda context, axis: context.core.auxiliary(axis)),
    "TV": partial(_positions, lambda context, axis: round(context.core.velocity(axis))),
    "RL": partial(_positions, lambda _, axis: axis.latched),
    "TS": partial(_codes, lambda context, axis: switches_byte(context.unit, axis)),
    "SC": partial(_codes, lambda context, axis: context.core.stop_code(axis)),
    "TT": _torque,
    "TC": _error_code,
    "TB": partial(_byte, lambda context, _: program_byte(context.unit), 0),
    "TI": _inputs,
    "TA": partial(_byte, lambda context, number: amplifier_byte(context.unit, number), 3),
    "QR": _record,
    "QZ": _layout,
    "ID": _identity,
    "\x12\x16": _firmware,
}


_CACHED = 2048
_TOKEN = re.compile(
    r'\s*(?:"(?P<text>[^"]*)"|\{(?P<braces>[^{}]*)\}|(?P<comma>,)'
    r'|(?P<value>[^",{}\s](?:[^",{}]|(?<=[=<>(])"[^"]*")*))\s*'
)
_DIGITS = re.compile(r"([FZ$])([0-9]{1,2})(?:\.([0-9]))?")
_STRING = re.compile(r"S([1-6]?)")

_SERIAL_PORTS = {"P1": "S", "P2": "T"}
"""Ports of CF that MG names by number: the main serial port and the auxiliary one."""

_Print = Callable[[CallerContext], str]


class _Item(NamedTuple):
    """One text or value of a message: its print function, and the value to which a format may apply."""

    print: _Print
    value: Value | None = None


@dataclass(slots=True)
class _ParsedMessage:
    """A parsed message; `to` names a port other than the caller's."""

    items: list[_Item] = field(default_factory=list[_Item])
    line_end: bool = True
    to: str = ""
    ahead: str = ""
    """A format that precedes its value."""


def _message(context: CallerContext, text: str) -> Answer:
    message = _parsed(text)
    line = _printed(context, message.items) + ("\r\n" if message.line_end else "")
    data = line.encode("latin-1", "replace")
    if not message.to and context.thread is None:
        return data
    if not context.unit.outlet.say(data, _SERIAL_PORTS.get(message.to, message.to[1:])):
        raise Rejection(ErrorCode.HANDLE_CLOSED)
    return None


@lru_cache(_CACHED)
def _parsed(text: str) -> _ParsedMessage:
    message = _ParsedMessage()
    at = 0
    joined = False
    while at < len(text) and text[at:].strip():
        token = _TOKEN.match(text, at)
        if token is None:
            raise Rejection(ErrorCode.BAD_STRING if text[at:].lstrip()[0] == '"' else ErrorCode.BAD_BRACES)
        at = token.end()
        match token.lastgroup:
            case "text":
                message.items.append(_Item(_constant(token["text"])))
            case "value":
                value = compiled(token["value"].rstrip())
                message.items.append(_Item(_shown(value, message.ahead), value))
                message.ahead = ""
            case "braces":
                _apply(message, token["braces"], joined)
            case _:
                pass
        joined = token.lastgroup == "value"
    if message.ahead:
        _format_last(message, message.ahead)
    return message


def _apply(message: _ParsedMessage, braces: str, joined: bool) -> None:
    """Apply a `{...}`: to the whole message, as a character by its code, or as the format of a value.

    A format that is `joined` to a value applies to that value; any other applies to the next value, or to the last one
    if none follows. Galil's command reference writes both (AC: `MG{Z5.0} "text",v`; @COM: `MG {$8.0} @COM[0]`).
    """
    if braces == "N":
        message.line_end = False
    elif braces[:1] == "^":
        message.items.append(_Item(_character(braces[1:])))
    elif braces[:1] in ("E", "P") and len(braces) == 2:
        message.to = braces
    elif joined:
        _format_last(message, braces)
    else:
        _formatted(lambda _: 0, braces)  # refuses an invalid format
        message.ahead = braces


def _format_last(message: _ParsedMessage, braces: str) -> None:
    if not message.items or message.items[-1].value is None:
        raise Rejection(ErrorCode.BAD_BRACES)
    value = message.items[-1].value
    message.items[-1] = _Item(_formatted(value, braces), value)


def _printed(context: CallerContext, items: list[_Item]) -> str:
    if len(items) == 1:
        return items[0].print(context)
    parts: list[str] = []
    after_value = False
    for item in items:
        text, is_value = item.print(context), item.value is not None
        # The slot for the sign separates values; if it contains a sign, a blank is added.
        parts.append(f" {text}" if after_value and is_value and text[:1] != " " else text)
        after_value = is_value
    return "".join(parts)


def _constant(text: str) -> _Print:
    return lambda _: text


def _character(code: str) -> _Print:
    return lambda context: chr(context.integer(code, 0, 255))


def _shown(value: Value, form: str) -> _Print:
    """Return the function that prints a value in a format, by default that of VF; raises `Rejection` (53)."""
    if form:
        return _formatted(value, form)
    return lambda context: context.unit.raw_text(value(context.names))


def _formatted(value: Value, form: str) -> _Print:
    """Return the function that prints a value as `Fm.n`, `Zm.n`, `$m.n` or `Sn`; raises `Rejection` (53)."""
    string = _STRING.fullmatch(form)
    if string is not None:
        length = int(string[1] or 6)
        return lambda context: unpack(value(context.names), length)
    digits = _DIGITS.fullmatch(form)
    if digits is None:
        raise Rejection(ErrorCode.BAD_BRACES)
    kind, before, after = digits[1], int(digits[2]), int(digits[3] or 0)
    if not 0 < before <= (8 if kind == "$" else 10) or after > 4:
        raise Rejection(ErrorCode.BAD_BRACES)
    return lambda context: format_raw(value(context.names), before, after, kind != "Z", kind == "$")


MESSAGE_TABLE: dict[str, Handler] = {"MG": _message}
