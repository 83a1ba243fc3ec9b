"""Execute commands of hosts and statements of programs: assignments, jumps, conditions, calls.

A program is prepared once, when it is first run after a change. An error in a statement is found then and
reported when the statement is executed. Not in Galil's manual: a thread ends after the last line.

Not in Galil's manual: a variable passed by reference gets its value when the subroutine returns.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.commands import FORMS, TOO_LONG, ArgumentForm
from dmc41x3.language.hardware import ALIASES
from dmc41x3.twin import trippoints
from dmc41x3.twin.commands import TABLE
from dmc41x3.twin.context import Answer, CallerContext
from dmc41x3.twin.expressions import (
    AXIS_NAMES,
    KEYWORDS,
    ONE,
    QUERY,
    Rejection,
    Value,
    axis_letter,
    compiled,
    evaluate,
    is_name,
    split,
    unpack,
    whole,
)
from dmc41x3.twin.program import AT_ONCE, STACK_DEPTH, Frame, Program, Thread
from dmc41x3.twin.unit import LOCKED_COMMANDS, MOST_VARIABLES

_PLAIN = re.compile(r"([A-Za-z][A-Za-z0-9_]*|[~^][a-h])\s*=(?!=)\s*(.*)")
_ELEMENT = re.compile(r"(?:[A-Za-z][A-Za-z0-9_]*|\^[a-h])\[")
_LIKE_A_COMMAND = re.compile(r"[A-Z]{2}(?![A-Z*]\s*=)[A-Za-z0-9_]+\s*(?:\[[^=]*\]\s*)?=(?!=)")
_WITH_A_LETTER = re.compile(r"[A-Z]{3}\s*=(?!=)")
_COMPARING = frozenset({"IF", "MG", "NO", "PW"})
"""Commands whose text may contain `=` after a name; a text that begins with one of them is never an assignment."""

_LETTERED = frozenset({"HS", "IH", "MB"})
"""Commands besides those of axes that take a letter and a `=`: `IHA=`."""

_MASK = re.compile(
    r"(?:A[LMS]|B[GT]|C[MS]|F[EI]|HM|LM|M[CO]|Q[HRS]|R[LP]|S[CHT]|T[DEPSTV]|VM)(?:[A-Z ]|~[a-h])*",
)
"""A command whose arguments are letters; after all others `~a` alone is a number."""

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
    """Return the target of an assignment and the text after the `=`, None for any other text.

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
    """Return whether a text assigns to a variable that resembles a command (`CD0=0`, `READY=0`, but not `CDA=0`)."""
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
    """Return the value of an axis variable for a number, or for a letter in quotes; raises `Rejection` (6)."""
    number = whole(value)
    if 0 <= number < len(AXIS_NAMES):
        return number
    letter = unpack(value).translate(ALIASES)
    if len(letter) != 1 or letter not in AXIS_NAMES:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    return AXIS_NAMES.index(letter)


def _closing(text: str, start: int) -> int:
    """Return the place after the bracket that closes the one before `start`; raises `Rejection` (55)."""
    depth = 1
    for place in range(start, len(text)):
        depth += (text[place] == "[") - (text[place] == "]")
        if not depth:
            return place + 1
    raise Rejection(ErrorCode.MISSING_BRACKET)


CallOperation = Callable[[CallerContext, Thread], None]
Goal = Callable[[CallerContext], int]
"""Returns the statement to jump to."""

_CALLED_LABEL = re.compile(r"#(\w+)\s*(.*)", re.ASCII)
_CALL = re.compile(r"(#?\w+(?:\s*[-+]\s*\w+)*)\s*\((.*)\)", re.ASCII)
_STACK = "abcdefgh"


def goal(program: Program, text: str) -> tuple[Goal, str]:
    """Return the goal of a destination (`#a`, `#a+i`, `n`), and the expression on which it depends."""
    found = _CALLED_LABEL.fullmatch(text)
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
    """Return the condition after a destination, None if it has none."""
    if len(parts) > 1:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    return compiled(parts[0]) if parts else None


def ahead(act: CallOperation) -> CallOperation:
    """Return a jump during which `_XQn` of its own thread is the next line, so that `_XQ0-1` is the jump itself.

    Galil's command reference shows this for JP: `JP _XQ0-1,(TIME<(t+1000))` waits in its line. For JS it is inferred.
    """

    def jump(context: CallerContext, thread: Thread) -> None:
        thread.line += 1
        try:
            act(context, thread)
        finally:
            thread.line -= 1

    return jump


def _call(program: Program, text: str) -> CallOperation:
    """JS: call a subroutine, always or if a condition is not 0: `#a(1,v,&v,"array"),condition`."""
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
    """Return the stack variables of a subroutine, and the names of the variables passed by reference."""
    values: dict[str, int] = {}
    references: dict[str, str] = {}
    for letter, argument in zip(_STACK, arguments, strict=False):
        if argument.startswith("&"):
            references[letter] = argument[1:].strip()
            values[letter] = context.names.variable(references[letter])
        elif argument:
            values[letter] = compiled(argument)(context.names)
    return values, references


def _end(_: Program, text: str) -> CallOperation:
    """EN m,n,r: end the thread, or return; 1 as m or n resumes the interrupted wait, r is the value of `_JS`."""
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


def _return(_: Program, text: str) -> CallOperation:
    """RE, RI: return from an automatic subroutine; 1 resumes the interrupted wait. Elsewhere refused (8)."""
    parts = split(text)
    resume = compiled(parts[0]) if parts[0] else None

    def act(context: CallerContext, thread: Thread) -> None:
        if not thread.stack or not thread.stack[-1].routine:
            raise Rejection(ErrorCode.NOT_WHILE_NOT_RUNNING)
        _leave(thread, resume=resume is not None and resume(context.names) != 0)

    return act


def _leave(thread: Thread, *, resume: bool) -> None:
    """Return from an automatic subroutine; `resume` resumes the wait of the interrupted thread.

    A thread that handled its own error continues after the erring statement only with `resume`.
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


def _zero_stack(_: Program, text: str) -> CallOperation:
    """ZS n: drop the places to return to: 0 all, 1 the innermost one."""
    levels = compiled(text.strip() or "0")

    def act(context: CallerContext, thread: Thread) -> None:
        count = levels(context.names) // ONE
        if count not in (0, 1):
            raise Rejection(ErrorCode.OUT_OF_RANGE)
        del thread.stack[-1 if count else 0 :]

    return act


CALLS: dict[str, Callable[[Program, str], CallOperation]] = {
    "JS": _call,
    "EN": _end,
    "RE": _return,
    "RI": _return,
    "ZS": _zero_stack,
}
"""Functions that prepare the text after a mnemonic."""


HOST_ONLY = frozenset({"BK", "DL", "ED", "LS", "QD", "RS", "SL", "UL", "WH"})
"""Commands that a program may not contain."""

StatementOperation = Callable[[CallerContext, Thread], Answer]

_NOWHERE = -1
_LONG = ("ELSE", "ENDIF")
_OF_THE_MACHINE = ("_", "@", "TIME")


class Need(IntEnum):
    """The part of the controller that a statement needs."""

    NOTHING = 0
    """Variables only: the statement may be executed before the axes are advanced to its sample."""
    STATE = 1
    """The state of the machine at the sample."""
    ALL = 2
    """The whole machine: the statement may change it, or wait for it."""


@dataclass(frozen=True, slots=True)
class Statement:
    """One statement of a program; `opens` marks the first one of its line."""

    line: int
    text: str
    opens: bool
    act: StatementOperation
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
    """Return the mnemonic at the beginning of a statement."""
    return next((word for word in _LONG if text.startswith(word)), text[:2])


def _branches(texts: list[str]) -> list[int]:
    """Return, for every IF and ELSE, the index after its ELSE or ENDIF, -1 if there is none."""
    places = [_NOWHERE] * len(texts)
    waiting: list[int] = []
    for index, text in enumerate(texts):
        word = word_of(text)
        if word in _LONG and waiting:
            places[waiting.pop()] = index + 1
        if word in ("IF", "ELSE"):
            waiting.append(index)
    # If an ELSE has no ENDIF, its IF is open, too.
    behind = {index + 1 for index in waiting}
    return [_NOWHERE if place in behind else place for place in places]


def _prepared(program: Program, text: str, branch: int) -> tuple[StatementOperation, Need]:
    if "=" in text and is_assignment(text):
        return _assignment(text) or (_command(text), Need.ALL)
    word = word_of(text)
    rest = text[len(word) :]
    act: StatementOperation
    if word in _FLOW:
        return _FLOW[word](program, rest, branch)
    if word in CALLS:
        act, need = CALLS[word](program, rest), Need.ALL
    elif word in trippoints.TABLE:
        act, need = _trippoint(word, rest)
    elif word in HOST_ONLY:
        raise Rejection(ErrorCode.NOT_IN_PROGRAM)
    else:
        act, need = (None if word in TABLE else _assignment(text)) or (_command(text), Need.ALL)
    return act, need


def _command(text: str) -> StatementOperation:
    return lambda context, _: execute(context, text)


def _trippoint(word: str, text: str) -> tuple[StatementOperation, Need]:
    if word in trippoints.TIMED:
        return trippoints.TABLE[word](text), _need(text)
    if "~" not in text:
        return trippoints.TABLE[word](text), Need.ALL

    def act(context: CallerContext, thread: Thread) -> None:
        trippoints.TABLE[word](with_axes(context, word + text)[len(word) :])(context, thread)

    return act, Need.ALL


def _assignment(text: str) -> tuple[StatementOperation, Need] | None:
    """Return an assignment or interrogation, None for any other text; neither changes the machine."""
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


def _refuse(code: ErrorCode) -> StatementOperation:
    def act(_: CallerContext, _thread: Thread) -> None:
        raise Rejection(code)

    return act


def _nothing(_: Program, _text: str, _branch: int) -> tuple[StatementOperation, Need]:
    return lambda _context, _thread: None, Need.NOTHING


def _jump(program: Program, text: str, _: int) -> tuple[StatementOperation, Need]:
    """JP: jump, always or if a condition is not 0."""
    first, *others = split(text)
    where, depends = goal(program, first)
    test = condition(others)

    def act(context: CallerContext, thread: Thread) -> None:
        if test is None or test(context.names):
            thread.at = where(context)

    return ahead(act) if "_XQ" in text else act, _need(depends, *others)


def _if(_: Program, text: str, branch: int) -> tuple[StatementOperation, Need]:
    test = compiled(text.strip())
    if branch == _NOWHERE:
        raise Rejection(ErrorCode.IF_WITHOUT_ENDIF)

    def act(context: CallerContext, thread: Thread) -> None:
        if not test(context.names):
            thread.at = branch

    return act, _need(text)


def _else(_: Program, _text: str, branch: int) -> tuple[StatementOperation, Need]:
    """ELSE is reached if the IF was true: continue after the ENDIF."""
    if branch == _NOWHERE:
        raise Rejection(ErrorCode.IF_WITHOUT_ENDIF)

    def act(_: CallerContext, thread: Thread) -> None:
        thread.at = branch

    return act, Need.NOTHING


_FLOW: dict[str, Callable[[Program, str, int], tuple[StatementOperation, Need]]] = {
    "JP": _jump,
    "IF": _if,
    "ELSE": _else,
    "ENDIF": _nothing,
    "NO": _nothing,
}
