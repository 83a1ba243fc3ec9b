"""MG: texts and values, each value in its own format if it has one."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from maya_un.galil.codes import ErrorCode
from maya_un.galil.numbers import format_value
from maya_un.virtual.context import Answer, Context, Handler
from maya_un.virtual.expressions import ONE, evaluate, unpack
from maya_un.virtual.refusal import Refused

_TOKEN = re.compile(r'\s*(?:"(?P<text>[^"]*)"|\{(?P<braces>[^{}]*)\}|(?P<comma>,)|(?P<value>[^",{}\s][^",{}]*))\s*')
_DIGITS = re.compile(r"([FZ$])([0-9]{1,2})(?:\.([0-9]))?")
_STRING = re.compile(r"S([1-6]?)")


@dataclass(slots=True)
class _Item:
    """One text or value of a message, and the format behind it."""

    body: str
    is_text: bool
    form: str = ""


@dataclass(slots=True)
class _Message:
    """A message taken apart; `to` names another port than the one who asks."""

    items: list[_Item] = field(default_factory=list[_Item])
    line_end: bool = True
    to: str = ""


def _message(context: Context, text: str) -> Answer:
    message = _parse(context, text)
    line = _printed(context, message.items) + ("\r\n" if message.line_end else "")
    data = line.encode("ascii", "replace")
    if not message.to and context.thread is None:
        return data
    if message.to[:1] != "P" and not context.unit.outlet.say(data, message.to[1:]):
        raise Refused(ErrorCode.HANDLE_CLOSED)
    return None


def _parse(context: Context, text: str) -> _Message:
    message = _Message()
    at = 0
    while at < len(text) and text[at:].strip():
        token = _TOKEN.match(text, at)
        if token is None:
            raise Refused(ErrorCode.BAD_STRING if text[at:].lstrip()[0] == '"' else ErrorCode.BAD_BRACES)
        at = token.end()
        match token.lastgroup:
            case "text":
                message.items.append(_Item(token["text"], True))
            case "value":
                message.items.append(_Item(token["value"], False))
            case "braces":
                _apply(context, message, token["braces"])
            case _:
                continue
    return message


def _apply(context: Context, message: _Message, braces: str) -> None:
    """Take a `{...}`: for the whole message, a character by its code, or the format of the value before it."""
    if braces == "N":
        message.line_end = False
    elif braces[:1] == "^":
        message.items.append(_Item(chr(context.integer(braces[1:], 0, 127)), True))
    elif braces[:1] in ("E", "P") and len(braces) == 2:
        message.to = braces
    elif not message.items or message.items[-1].is_text:
        raise Refused(ErrorCode.BAD_BRACES)
    else:
        message.items[-1].form = braces


def _printed(context: Context, items: list[_Item]) -> str:
    parts: list[str] = []
    after_value = False
    for item in items:
        text = item.body if item.is_text else _value(context, item)
        # The slot for the sign keeps values apart; where a sign stands in it, a blank does.
        parts.append(f" {text}" if after_value and not item.is_text and text[:1] != " " else text)
        after_value = not item.is_text
    return "".join(parts)


def _value(context: Context, item: _Item) -> str:
    value = evaluate(item.body, context.names)
    if not item.form:
        return context.unit.value_text(value / ONE)
    string = _STRING.fullmatch(item.form)
    if string is not None:
        return unpack(value, int(string[1] or 6))
    digits = _DIGITS.fullmatch(item.form)
    if digits is None:
        raise Refused(ErrorCode.BAD_BRACES)
    kind, before, after = digits[1], int(digits[2]), int(digits[3] or 0)
    if not 0 < before <= (8 if kind == "$" else 10) or after > 4:
        raise Refused(ErrorCode.BAD_BRACES)
    return format_value(value / ONE, before, after, kind != "Z", kind == "$")


TABLE: dict[str, Handler] = {"MG": _message}
