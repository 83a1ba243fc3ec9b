"""MG: texts and values, each value in its own format if it has one."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.numbers import format_raw
from dmc41x3.twin.context import Answer, CallerContext, Handler
from dmc41x3.twin.expressions import Rejection, Value, compiled, unpack

_CACHED = 2048
_TOKEN = re.compile(
    r'\s*(?:"(?P<text>[^"]*)"|\{(?P<braces>[^{}]*)\}|(?P<comma>,)'
    r'|(?P<value>[^",{}\s](?:[^",{}]|(?<=[=<>(])"[^"]*")*))\s*'
)
_DIGITS = re.compile(r"([FZ$])([0-9]{1,2})(?:\.([0-9]))?")
_STRING = re.compile(r"S([1-6]?)")

_Print = Callable[[CallerContext], str]


class _Item(NamedTuple):
    """One text or value of a message: what it prints, and the value for which a format may follow."""

    print: _Print
    value: Value | None = None


@dataclass(slots=True)
class _ParsedMessage:
    """A message taken apart; `to` names another port than the one who asks."""

    items: list[_Item] = field(default_factory=list[_Item])
    line_end: bool = True
    to: str = ""
    ahead: str = ""
    """A format that stands before its value."""


def _message(context: CallerContext, text: str) -> Answer:
    message = _parsed(text)
    line = _printed(context, message.items) + ("\r\n" if message.line_end else "")
    data = line.encode("latin-1", "replace")
    if not message.to and context.thread is None:
        return data
    if message.to[:1] != "P" and not context.unit.outlet.say(data, message.to[1:]):
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
    """Take a `{...}`: for the whole message, a character by its code, or the format of a value.

    A format that is `joined` to a value is that value's; any other is that of the next one, or of the last one where
    no more come. Galil's command reference writes both (AC: `MG{Z5.0} "text",v`; @COM: `MG {$8.0} @COM[0]`).
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
        _formatted(lambda _: 0, braces)  # refuses what is no format
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
        # The slot for the sign keeps values apart; where a sign stands in it, a blank does.
        parts.append(f" {text}" if after_value and is_value and text[:1] != " " else text)
        after_value = is_value
    return "".join(parts)


def _constant(text: str) -> _Print:
    return lambda _: text


def _character(code: str) -> _Print:
    return lambda context: chr(context.integer(code, 0, 255))


def _shown(value: Value, form: str) -> _Print:
    """Return what prints a value in a format, without one as VF has it; raises `Rejection` (53)."""
    if form:
        return _formatted(value, form)
    return lambda context: context.unit.raw_text(value(context.names))


def _formatted(value: Value, form: str) -> _Print:
    """Return what prints a value in the format `Fm.n`, `Zm.n`, `$m.n` or `Sn`; raises `Rejection` (53)."""
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


TABLE: dict[str, Handler] = {"MG": _message}
