"""One command, from whoever sent it: a mnemonic with its arguments, or an assignment."""

from __future__ import annotations

import re

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.commands import FORMS, TOO_LONG, ArgumentForm
from dmc41x3.language.hardware import ALIASES
from dmc41x3.twin.commands import TABLE
from dmc41x3.twin.context import Answer, CallerContext
from dmc41x3.twin.expressions import (
    AXIS_NAMES,
    KEYWORDS,
    ONE,
    QUERY,
    Rejection,
    axis_letter,
    evaluate,
    is_name,
    unpack,
    whole,
)
from dmc41x3.twin.unit import LOCKED_COMMANDS, MOST_VARIABLES

_PLAIN = re.compile(r"([A-Za-z][A-Za-z0-9_]*|[~^][a-h])\s*=(?!=)\s*(.*)")
_ELEMENT = re.compile(r"(?:[A-Za-z][A-Za-z0-9_]*|\^[a-h])\[")
_LIKE_A_COMMAND = re.compile(r"[A-Z]{2}(?![A-Z*]\s*=)[A-Za-z0-9_]+\s*(?:\[[^=]*\]\s*)?=(?!=)")
_WITH_A_LETTER = re.compile(r"[A-Z]{3}\s*=(?!=)")
_COMPARING = frozenset({"IF", "MG", "NO", "PW"})
"""Commands whose text may hold a `=` behind a name; what begins like one of them is never an assignment."""

_LETTERED = frozenset({"HS", "IH", "MB"})
"""Commands besides those of axes that take a letter and a `=`: `IHA=`."""

_MASK = re.compile(
    r"(?:A[LMS]|B[GT]|C[MS]|F[EI]|HM|LM|M[CO]|Q[HRS]|R[LP]|S[CHT]|T[DEPSTV]|VM)(?:[A-Z ]|~[a-h])*",
)
"""A command whose arguments are letters; behind all others `~a` alone is a number."""

_EXPLICIT = re.compile(r"(..\s*)(~[a-h])(\s*=.*)")
_VARIABLE_AXIS = re.compile(r"~[a-h]")


def execute(context: CallerContext, text: str) -> Answer:
    """Execute one command; raises `Rejection`."""
    handler = TABLE.get(text[:2])
    if context.unit.peripherals.locked and text[:2] in LOCKED_COMMANDS:
        raise Rejection(ErrorCode.PRIVILEGE)
    if handler is None or ("=" in text and is_assignment(text)):
        return _other(context, text)
    if "~" in text:
        text = with_axes(context, text)
    return handler(context, text[2:])


def assignment(text: str) -> tuple[str, str] | None:
    """Return the target of an assignment and the text behind the `=`, None for a text that is none.

    The target is a variable, `~a`, `^a`, or an array with its index in brackets.
    """
    found = _PLAIN.fullmatch(text)
    if found is not None:
        return found[1], found[2]
    found = _ELEMENT.match(text)
    if found is None:
        return None
    end = _closing(text, found.end())
    rest = text[end:].lstrip()
    return (text[:end], rest[1:].strip()) if rest[:1] == "=" != rest[1:2] else None


def with_axes(context: CallerContext, text: str) -> str:
    """Return a command with letters in place of the axis variables that name its axes; raises `Rejection`."""
    if _MASK.fullmatch(text):
        return _VARIABLE_AXIS.sub(lambda found: axis_letter(context.names, found[0]), text)
    found = _EXPLICIT.fullmatch(text) if FORMS.get(text[:2]) is ArgumentForm.AXES else None
    return text if found is None else f"{found[1]}{axis_letter(context.names, found[2])}{found[3]}"


def is_assignment(text: str) -> bool:
    """Tell a variable whose name begins like a command (`CD0=0`, `READY=0`) from a command with an axis (`CDA=0`)."""
    word = text[:2]
    if _LIKE_A_COMMAND.match(text) is not None:
        return word not in _COMPARING
    if FORMS.get(word) is ArgumentForm.AXES or word in _LETTERED or word in _COMPARING:
        return False
    return _WITH_A_LETTER.match(text) is not None


def _other(context: CallerContext, text: str) -> Answer:
    if not text or text[0] == "'":
        return None
    if text.startswith(TOO_LONG):
        raise Rejection(ErrorCode.INPUT_BUFFER_FULL)
    parts = assignment(text)
    if parts is None:
        raise Rejection(ErrorCode.UNRECOGNIZED_COMMAND)
    target, value = parts
    if value in ("", QUERY):
        return context.unit.raw_text(evaluate(target, context.names))
    _assign(context, target, evaluate(value, context.names))
    return None


def _assign(context: CallerContext, target: str, value: int) -> None:
    variables = context.unit.variables
    if target in variables:
        variables[target] = value
    elif target[-1] == "]":
        name, _, index = target[:-1].partition("[")
        if not index.strip():
            raise Rejection(ErrorCode.INDEX_OUT_OF_RANGE)
        context.unit.arrays.assign(context.names.array(name), whole(evaluate(index, context.names)), value)
    elif target[0] == "~":
        context.unit.axis_variables[target] = ONE * _axis_number(value)
    elif target[0] == "^":
        _set_local(context, target[1:], value)
    else:
        _create(context, target, value)


def _create(context: CallerContext, name: str, value: int) -> None:
    if not is_name(name) or name in KEYWORDS:
        raise Rejection(ErrorCode.VARIABLE_ERROR)
    if name in context.unit.arrays:
        raise Rejection(ErrorCode.MISSING_BRACKET)
    if len(context.unit.variables) >= MOST_VARIABLES:
        raise Rejection(ErrorCode.TOO_MANY_VARIABLES)
    context.unit.variables[name] = value


def _set_local(context: CallerContext, letter: str, value: int) -> None:
    if context.thread is None:
        raise Rejection(ErrorCode.PROGRAM_ONLY)
    context.thread.locals[letter] = value


def _axis_number(value: int) -> int:
    """Return what an axis variable keeps of a number, or of a letter in quotes; raises `Rejection` (6)."""
    number = whole(value)
    if 0 <= number < len(AXIS_NAMES):
        return number
    letter = unpack(value).translate(ALIASES)
    if len(letter) != 1 or letter not in AXIS_NAMES:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    return AXIS_NAMES.index(letter)


def _closing(text: str, start: int) -> int:
    """Return the place behind the bracket that closes the one before `start`; raises `Rejection` (55)."""
    depth = 1
    for place in range(start, len(text)):
        depth += (text[place] == "[") - (text[place] == "]")
        if not depth:
            return place + 1
    raise Rejection(ErrorCode.MISSING_BRACKET)
