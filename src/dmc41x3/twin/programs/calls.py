"""Statements that call subroutines and return from them: JS EN RE RI ZS. They are for programs only.

Where Galil's manual is silent: a variable passed by reference gets its value when the subroutine returns.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.context import CallerContext
from dmc41x3.twin.expressions import ONE, Rejection, Value, compiled, split
from dmc41x3.twin.program import AT_ONCE, STACK_DEPTH, Frame, Program, Thread

Operation = Callable[[CallerContext, Thread], None]
Goal = Callable[[CallerContext], int]
"""Tells the statement to go to."""

_LABEL = re.compile(r"#(\w+)\s*(.*)", re.ASCII)
_CALL = re.compile(r"(#?\w+(?:\s*[-+]\s*\w+)*)\s*\((.*)\)", re.ASCII)
_STACK = "abcdefgh"


def goal(program: Program, text: str) -> tuple[Goal, str]:
    """Return what a destination (`#a`, `#a+i`, `n`) leads to, and the expression that this depends on."""
    found = _LABEL.fullmatch(text)
    if found is None:
        expression = text
    elif found[2]:
        expression = f"{program.line_of(found[1])}{found[2]}"
    else:
        start = program.start(program.line_of(found[1]))
        return lambda _: start, ""
    line = compiled(expression)
    return lambda context: program.start(line(context.names) // ONE), expression


def condition(parts: list[str]) -> Value | None:
    """Return the condition behind a destination, None where there is none."""
    if len(parts) > 1:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    return compiled(parts[0]) if parts else None


def ahead(act: Operation) -> Operation:
    """Return a jump in which `_XQn` of its own thread is the line behind it, so that `_XQ0-1` is the jump itself.

    Galil's command reference shows that for JP: `JP _XQ0-1,(TIME<(t+1000))` waits in its line. For JS it is inferred.
    """

    def jump(context: CallerContext, thread: Thread) -> None:
        thread.line += 1
        try:
            act(context, thread)
        finally:
            thread.line -= 1

    return jump


def _call(program: Program, text: str) -> Operation:
    """JS: call a subroutine, always or where a condition is not 0: `#a(1,v,&v,"array"),condition`."""
    first, *others = split(text)
    found = _CALL.fullmatch(first)
    name, given = found.groups() if found is not None else (first, "")
    where, _ = goal(program, name)
    test = condition(others)
    arguments = split(given) if given.strip() else []
    if len(arguments) > len(_STACK):
        raise Rejection(ErrorCode.OPERAND_ERROR)

    def act(context: CallerContext, thread: Thread) -> None:
        if test is not None and not test(context.names):
            return
        target = where(context)
        values, references = _passed(context, arguments)
        if len(thread.stack) >= STACK_DEPTH:
            raise Rejection(ErrorCode.TOO_DEEP)
        thread.stack.append(Frame(thread.at, locals=thread.locals, references=references))
        thread.locals, thread.at = values, target

    return ahead(act) if "_XQ" in text else act


def _passed(context: CallerContext, arguments: list[str]) -> tuple[dict[str, int], dict[str, str]]:
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


def _end(_: Program, text: str) -> Operation:
    """EN m,n,r: end the thread, or return; 1 as m or n resumes what was waited for, r is the value of `_JS`."""
    parts = split(text)
    if len(parts) > 3:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    given = [compiled(part) if part else None for part in parts]

    def act(context: CallerContext, thread: Thread) -> None:
        values = [0 if value is None else value(context.names) for value in given]
        if not thread.stack:
            thread.halt()
        elif thread.stack[-1].routine:
            _leave(thread, resume=any(values[:2]))
        else:
            _back(context, thread)
            thread.returned = values[2] if len(values) > 2 else 0

    return act


def _back(context: CallerContext, thread: Thread) -> None:
    """Return from a subroutine."""
    frame = thread.stack.pop()
    for letter, name in frame.references.items():
        context.unit.variables[name] = thread.locals.get(letter, 0)
    thread.locals, thread.at = frame.locals, frame.back


def _return(_: Program, text: str) -> Operation:
    """RE, RI: return from an automatic subroutine; 1 resumes what was waited for. Elsewhere refused (8)."""
    parts = split(text)
    resume = compiled(parts[0]) if parts[0] else None

    def act(context: CallerContext, thread: Thread) -> None:
        if not thread.stack or not thread.stack[-1].routine:
            raise Rejection(ErrorCode.NOT_WHILE_NOT_RUNNING)
        _leave(thread, resume=resume is not None and resume(context.names) != 0)

    return act


def _leave(thread: Thread, *, resume: bool) -> None:
    """Return from an automatic subroutine; `resume` waits on for what the interrupted thread waited for.

    A thread whose error was dealt with goes on behind the erring statement with `resume` only.
    """
    frame = thread.stack.pop()
    culprit = frame.culprit
    if not frame.ran or (culprit is thread and not resume):
        thread.halt()
    else:
        thread.locals, thread.at = frame.locals, frame.back
        if resume:
            thread.waiting = frame.waiting
            thread.due = thread.earliest = max(thread.earliest, frame.earliest)
    if culprit is not None and culprit is not thread and resume and not culprit.running:
        culprit.running, culprit.due = True, AT_ONCE


def _zero_stack(_: Program, text: str) -> Operation:
    """ZS n: forget where to return to: 0 everything, 1 the innermost subroutine."""
    levels = compiled(text.strip() or "0")

    def act(context: CallerContext, thread: Thread) -> None:
        count = levels(context.names) // ONE
        if count not in (0, 1):
            raise Rejection(ErrorCode.OUT_OF_RANGE)
        del thread.stack[-1 if count else 0 :]

    return act


TABLE: dict[str, Callable[[Program, str], Operation]] = {
    "JS": _call,
    "EN": _end,
    "RE": _return,
    "RI": _return,
    "ZS": _zero_stack,
}
"""The operation of the text behind a mnemonic."""
