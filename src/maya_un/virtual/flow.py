"""Statements made ready to run: jumps, subroutines, conditions, assignments; the rest goes the way of any command.

A program is prepared once, when it is first run after a change. What is wrong with a statement is found then and
said when it is executed. Where Galil's manual is silent: a thread that runs past the last line ends; arguments by
reference are given back when the subroutine returns.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

from maya_un.galil.codes import ErrorCode
from maya_un.virtual import trippoints
from maya_un.virtual.arguments import split
from maya_un.virtual.arithmetic import ONE
from maya_un.virtual.commands import TABLE
from maya_un.virtual.context import Answer, Context
from maya_un.virtual.execution import assignment, execute
from maya_un.virtual.expressions import Value, compiled, is_name
from maya_un.virtual.program import Program
from maya_un.virtual.refusal import Refused
from maya_un.virtual.thread import AT_ONCE, STACK_DEPTH, Frame, Thread

HOST_ONLY = frozenset({"BK", "DL", "ED", "LS", "QD", "RS", "SL", "UL", "WH"})
"""Commands that a program may not give."""

_LONG = ("ELSE", "ENDIF")
_LABEL = re.compile(r"\s*#(\w+)\s*(.*)", re.ASCII)
_CALL = re.compile(r"\s*(#\w+|[^(#][^(]*|\([^)]*\))\s*(?:\((.*)\))?\s*", re.ASCII)
_STACK = "abcdefgh"

Operation = Callable[[Context, Thread], Answer]


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
    texts = [text for _, text in program.layout.statements]
    code: list[Statement] = []
    for index, (line, text) in enumerate(program.layout.statements):
        try:
            act, need = _prepared(program, texts, index)
        except Refused as refused:
            act, need = _refuse(refused.code), Need.ALL
        code.append(Statement(line, text, not index or code[-1].line != line, act, need))
    return code


def _prepared(program: Program, texts: list[str], index: int) -> tuple[Operation, Need]:
    text = texts[index]
    word = next((word for word in _LONG if text.startswith(word)), text[:2])
    rest = text[len(word) :]
    match word:
        case "JP":
            return _jump(program, rest)
        case "IF":
            return _if(rest, texts, index)
        case "ELSE":
            return _go(_closing(texts, index)), Need.NOTHING
        case "ENDIF" | "NO":
            return _nothing, Need.NOTHING
        case _:
            pass
    if word in _FLOW:
        return _FLOW[word](program, rest), Need.ALL
    if word in trippoints.TABLE:
        return trippoints.TABLE[word](rest), Need.NOTHING if word in trippoints.TIMED else Need.ALL
    if word in HOST_ONLY:
        raise Refused(ErrorCode.NOT_IN_PROGRAM)
    return (None if word in TABLE else _assignment(text)) or (_command(text), Need.ALL)


def _command(text: str) -> Operation:
    return lambda context, _: execute(context, text)


def _assignment(text: str) -> tuple[Operation, Need] | None:
    """Return the assignment of a plain variable; None for anything else."""
    found = assignment(text)
    if found is None or not is_name(found[0]) or found[0] == "TIME" or found[1] in ("", "?"):
        return None
    name, value = found[0], compiled(found[1])

    def assign(context: Context, _: Thread) -> None:
        variables = context.unit.variables
        if name in variables:
            variables[name] = value(context.names)
        else:
            execute(context, text)

    return assign, _need(found[1])


def _need(*texts: str) -> Need:
    return Need.STATE if any("_" in text or "@" in text or "TIME" in text for text in texts) else Need.NOTHING


def _nothing(_: Context, _thread: Thread) -> None:
    return None


def _refuse(code: ErrorCode) -> Operation:
    def act(_: Context, _thread: Thread) -> None:
        raise Refused(code)

    return act


def _go(target: int) -> Operation:
    def act(_: Context, thread: Thread) -> None:
        thread.at = target

    return act


def _condition(parts: list[str]) -> Value | None:
    if len(parts) > 1:
        raise Refused(ErrorCode.OPERAND_ERROR)
    return compiled(parts[0]) if parts else None


def _destination(program: Program, text: str) -> int | Value:
    """Return the statement that a destination names, or the line as an expression: `#a`, `#a+i`, `n`."""
    found = _LABEL.fullmatch(text)
    if found is None:
        return compiled(text)
    line = program.line_of(found[1])
    return compiled(f"{line}{found[2]}") if found[2] else program.start(line)


def _target(context: Context, to: int | Value) -> int:
    return to if isinstance(to, int) else context.unit.program.start(to(context.names) // ONE)


def _jump(program: Program, text: str) -> tuple[Operation, Need]:
    """JP: go elsewhere, always or where a condition is not 0."""
    first, *others = split(text)
    to, condition = _destination(program, first), _condition(others)
    if isinstance(to, int) and condition is None:
        return _go(to), Need.NOTHING

    def act(context: Context, thread: Thread) -> None:
        if condition is None or condition(context.names):
            thread.at = to if isinstance(to, int) else _target(context, to)

    return act, _need(first if not isinstance(to, int) else "", *others)


def _if(text: str, texts: list[str], index: int) -> tuple[Operation, Need]:
    condition = compiled(text)
    other = _alternative(texts, index)

    def act(context: Context, thread: Thread) -> None:
        if not condition(context.names):
            thread.at = other

    return act, _need(text)


def _alternative(texts: list[str], index: int) -> int:
    """Return the statement behind the ELSE, or else the ENDIF, of an IF; raises `Refused` (63) where it has none."""
    end = _closing(texts, index)
    depth = 0
    for place in range(index + 1, end - 1):
        depth += _opens(texts[place])
        if not depth and texts[place].startswith("ELSE"):
            return place + 1
    return end


def _closing(texts: list[str], index: int) -> int:
    """Return the statement behind the ENDIF that belongs to an IF or ELSE; raises `Refused` (63) where it has none."""
    depth = 1
    for place in range(index + 1, len(texts)):
        depth += _opens(texts[place])
        if not depth:
            return place + 1
    raise Refused(ErrorCode.IF_WITHOUT_ENDIF)


def _opens(text: str) -> int:
    return text.startswith("IF") - text.startswith("ENDIF")


def _call(program: Program, text: str) -> Operation:
    """JS: call a subroutine, always or where a condition is not 0: `#a(1,v,&v,"array"),condition`."""
    first, *others = split(text)
    found = _CALL.fullmatch(first)
    if found is None:
        raise Refused(ErrorCode.INVALID_LABEL)
    to, condition = _destination(program, found[1]), _condition(others)
    arguments = split(found[2]) if found[2] else []
    if len(arguments) > len(_STACK):
        raise Refused(ErrorCode.OPERAND_ERROR)

    def act(context: Context, thread: Thread) -> None:
        if condition is not None and not condition(context.names):
            return
        target = _target(context, to)
        values, references = _passed(context, arguments)
        push(thread, Frame(thread.at, locals=thread.locals, references=references))
        thread.locals, thread.at = values, target

    return act


def _passed(context: Context, arguments: list[str]) -> tuple[dict[str, int], dict[str, str]]:
    """Return the stack variables of a subroutine, and which variables some of them stand for."""
    values: dict[str, int] = {}
    references: dict[str, str] = {}
    for letter, argument in zip(_STACK, arguments, strict=False):
        if argument.startswith("&"):
            references[letter] = argument[1:].strip()
            values[letter] = context.names.variable(references[letter])
        elif argument:
            values[letter] = compiled(argument)(context.names)
    return values, references


def push(thread: Thread, frame: Frame) -> None:
    """Remember where to return to; raises `Refused` (12) where that is too deep."""
    if len(thread.stack) >= STACK_DEPTH:
        raise Refused(ErrorCode.TOO_DEEP)
    thread.stack.append(frame)


def _end(_: Program, text: str) -> Operation:
    """EN m,n,r: end the thread, or return; 1 resumes what was waited for, `r` is the value of `_JS`."""
    parts = split(text)
    if len(parts) > 3:
        raise Refused(ErrorCode.OPERAND_ERROR)
    given = [compiled(part) if part else None for part in [*parts, "", ""][:3]]

    def act(context: Context, thread: Thread) -> None:
        values = [0 if value is None else value(context.names) for value in given]
        if not thread.stack:
            thread.halt()
            return
        frame = thread.stack[-1]
        if frame.routine:
            leave(thread, resume=bool(values[0] or values[1]))
            return
        thread.returned = values[2]
        thread.stack.pop()
        for letter, name in frame.references.items():
            context.unit.variables[name] = thread.locals.get(letter, 0)
        thread.locals, thread.at = frame.locals, frame.back

    return act


def _return(_: Program, text: str) -> Operation:
    """RE, RI: return from an automatic subroutine; 1 resumes what was waited for."""
    parts = split(text)
    resume = compiled(parts[0]) if parts[0] else None

    def act(context: Context, thread: Thread) -> None:
        if not thread.stack or not thread.stack[-1].routine:
            raise Refused(ErrorCode.NOT_WHILE_NOT_RUNNING)
        leave(thread, resume=resume is not None and bool(resume(context.names)))

    return act


def leave(thread: Thread, *, resume: bool) -> None:
    """Return from an automatic subroutine; `resume` waits on for what the interrupted thread waited for.

    A thread whose own error was dealt with goes on behind the erring statement with `resume` only.
    """
    frame = thread.stack.pop()
    culprit = frame.culprit
    if not frame.ran or (culprit is thread and not resume):
        thread.halt()
    else:
        thread.locals, thread.at = frame.locals, frame.back
        if resume:
            thread.waiting = frame.waiting
            thread.due = max(thread.due, frame.due)
    if culprit is not None and culprit is not thread and resume and not culprit.running:
        culprit.running, culprit.due = True, AT_ONCE


def _zero_stack(_: Program, text: str) -> Operation:
    """ZS: forget where to return to: 0 everything, 1 the innermost."""
    depth = compiled(text) if text.strip() else None

    def act(context: Context, thread: Thread) -> None:
        levels = 0 if depth is None else depth(context.names) // ONE
        if levels not in (0, 1):
            raise Refused(ErrorCode.OUT_OF_RANGE)
        if levels == 0:
            thread.stack.clear()
        elif thread.stack:
            thread.stack.pop()

    return act


_FLOW: dict[str, Callable[[Program, str], Operation]] = {
    "JS": _call,
    "EN": _end,
    "RE": _return,
    "RI": _return,
    "ZS": _zero_stack,
}
