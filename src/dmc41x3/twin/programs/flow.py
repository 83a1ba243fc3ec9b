"""Statements made ready to run: jumps, conditions and assignments; others go the way of any command.

A program is prepared once, when it is first run after a change. What is wrong with a statement is found then and
said when it is executed. Where Galil's manual is silent: a thread that runs past the last line ends.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.commands import TABLE
from dmc41x3.twin.context import Answer, CallerContext
from dmc41x3.twin.execution import assignment, execute, is_assignment, with_axes
from dmc41x3.twin.expressions import QUERY, Rejection, compiled, is_name, split
from dmc41x3.twin.program import Program, Thread
from dmc41x3.twin.programs import calls, trippoints

HOST_ONLY = frozenset({"BK", "DL", "ED", "LS", "QD", "RS", "SL", "UL", "WH"})
"""Commands that a program may not give."""

Operation = Callable[[CallerContext, Thread], Answer]

_NOWHERE = -1
_LONG = ("ELSE", "ENDIF")
_OF_THE_MACHINE = ("_", "@", "TIME")


class Need(IntEnum):
    """What of the machine a statement needs."""

    NOTHING = 0
    """Variables only: it may be executed before the axes are brought to its sample."""
    STATE = 1
    """The machine as it is at the sample."""
    ALL = 2
    """It may change the machine, or wait for it."""


@dataclass(frozen=True, slots=True)
class Statement:
    """One statement of a program; `opens` is the first one of its line."""

    line: int
    text: str
    opens: bool
    act: Operation
    need: Need = Need.ALL


def prepared(program: Program) -> list[Statement]:
    """Return the statements of a program, ready to run."""
    places = _branches([text for _, text in program.layout.statements])
    code: list[Statement] = []
    for (line, text), place in zip(program.layout.statements, places, strict=True):
        try:
            act, need = _prepared(program, text, place)
        except Rejection as refused:
            act, need = _refuse(refused.code), Need.ALL
        code.append(Statement(line, text, not code or code[-1].line != line, act, need))
    return code


def word_of(text: str) -> str:
    """Return the mnemonic that a statement begins with."""
    return next((word for word in _LONG if text.startswith(word)), text[:2])


def _branches(texts: list[str]) -> list[int]:
    """Return, for every IF and ELSE, the statement behind the ELSE or ENDIF that belongs to it, if there is one."""
    places = [_NOWHERE] * len(texts)
    waiting: list[int] = []
    for index, text in enumerate(texts):
        word = word_of(text)
        if word in _LONG and waiting:
            places[waiting.pop()] = index + 1
        if word in ("IF", "ELSE"):
            waiting.append(index)
    # An ELSE that nothing closes leaves its IF open, too.
    behind = {index + 1 for index in waiting}
    return [_NOWHERE if place in behind else place for place in places]


def _prepared(program: Program, text: str, branch: int) -> tuple[Operation, Need]:
    if "=" in text and is_assignment(text):
        return _assignment(text) or (_command(text), Need.ALL)
    word = word_of(text)
    rest = text[len(word) :]
    act: Operation
    if word in _FLOW:
        return _FLOW[word](program, rest, branch)
    if word in calls.TABLE:
        act, need = calls.TABLE[word](program, rest), Need.ALL
    elif word in trippoints.TABLE:
        act, need = _trippoint(word, rest)
    elif word in HOST_ONLY:
        raise Rejection(ErrorCode.NOT_IN_PROGRAM)
    else:
        act, need = (None if word in TABLE else _assignment(text)) or (_command(text), Need.ALL)
    return act, need


def _command(text: str) -> Operation:
    return lambda context, _: execute(context, text)


def _trippoint(word: str, text: str) -> tuple[Operation, Need]:
    if word in trippoints.TIMED:
        return trippoints.TABLE[word](text), _need(text)
    if "~" not in text:
        return trippoints.TABLE[word](text), Need.ALL

    def act(context: CallerContext, thread: Thread) -> None:
        trippoints.TABLE[word](with_axes(context, word + text)[len(word) :])(context, thread)

    return act, Need.ALL


def _assignment(text: str) -> tuple[Operation, Need] | None:
    """Return an assignment or interrogation, None for anything else; the machine has no part in either."""
    found = assignment(text)
    if found is None:
        return None
    name, expression = found
    if not is_name(name) or name == "TIME" or expression in ("", QUERY):
        return _command(text), _need(text)
    value = compiled(expression)

    def assign(context: CallerContext, _: Thread) -> Answer:
        variables = context.unit.variables
        if name not in variables:
            return execute(context, text)
        variables[name] = value(context.names)
        return None

    return assign, _need(expression)


def _need(*texts: str) -> Need:
    return Need.STATE if any(mark in text for text in texts for mark in _OF_THE_MACHINE) else Need.NOTHING


def _refuse(code: ErrorCode) -> Operation:
    def act(_: CallerContext, _thread: Thread) -> None:
        raise Rejection(code)

    return act


def _nothing(_: Program, _text: str, _branch: int) -> tuple[Operation, Need]:
    return lambda _context, _thread: None, Need.NOTHING


def _jump(program: Program, text: str, _: int) -> tuple[Operation, Need]:
    """JP: go elsewhere, always or where a condition is not 0."""
    first, *others = split(text)
    where, depends = calls.goal(program, first)
    test = calls.condition(others)

    def act(context: CallerContext, thread: Thread) -> None:
        if test is None or test(context.names):
            thread.at = where(context)

    return calls.ahead(act) if "_XQ" in text else act, _need(depends, *others)


def _if(_: Program, text: str, branch: int) -> tuple[Operation, Need]:
    test = compiled(text.strip())
    if branch == _NOWHERE:
        raise Rejection(ErrorCode.IF_WITHOUT_ENDIF)

    def act(context: CallerContext, thread: Thread) -> None:
        if not test(context.names):
            thread.at = branch

    return act, _need(text)


def _else(_: Program, _text: str, branch: int) -> tuple[Operation, Need]:
    """ELSE is met where the IF was true: go behind the ENDIF."""
    if branch == _NOWHERE:
        raise Rejection(ErrorCode.IF_WITHOUT_ENDIF)

    def act(_: CallerContext, thread: Thread) -> None:
        thread.at = branch

    return act, Need.NOTHING


_FLOW: dict[str, Callable[[Program, str, int], tuple[Operation, Need]]] = {
    "JP": _jump,
    "IF": _if,
    "ELSE": _else,
    "ENDIF": _nothing,
    "NO": _nothing,
}
