"""Commands of the program in memory: download, upload, list, edit, execute, halt, trace, step."""

from __future__ import annotations

from functools import partial

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.context import Answer, CallerContext, Handler
from dmc41x3.twin.expressions import Rejection, split
from dmc41x3.twin.network import Download
from dmc41x3.twin.program import AT_ONCE, COUNT, MOST_LINES, Downloading, ProgramEdit, Thread

_END = "\x1a"
_IN_PROGRAMS = "AD AI AM AP AR AS AT AV EL EN IF JP JS MC MF MR RE RI WT ZS"
_LAST = MOST_LINES - 1
"""Last line of LS by default: the last possible one, since LS may begin after line 1999."""


def _program_only(context: CallerContext, text: str) -> Answer:
    raise Rejection(ErrorCode.PROGRAM_ONLY)


def _resting(context: CallerContext) -> None:
    """Raise `Rejection` (17) while a thread runs."""
    if context.unit.threads.mask:
        raise Rejection(ErrorCode.NOT_WHILE_PROGRAM_RUNS)


def _begin_input(context: CallerContext, download: Download) -> None:
    if context.caller is None:
        raise Rejection(ErrorCode.NOT_IN_PROGRAM)
    context.caller.download = download


def _line(context: CallerContext, text: str) -> int:
    """Return the line that a destination names: `#label`, `#label+1`, `n`."""
    program = context.unit.program
    name, plus, more = text.partition("+")
    if not name.startswith("#"):
        return int(context.number(text))
    line = program.line_of(name[1:].strip())
    return line + int(context.number(more)) if plus else line


def _download(context: CallerContext, text: str) -> Answer:
    """DL: a new program; `DL #` appends to the present one, `DL #label` or `DL n` replaces it from that line on."""
    _resting(context)
    program = context.unit.program
    where = text.strip()
    keep = len(program.lines) if where == "#" else _line(context, where) if where else 0
    if not 0 <= keep <= len(program.lines):
        raise Rejection(ErrorCode.INVALID_LABEL)
    _begin_input(context, Downloading(program, keep, partial(_resting, context)))
    return None


def _edit(context: CallerContext, text: str) -> Answer:
    """ED n: the lines that follow replace those from line n on, by default from the last one; `^Q` ends it."""
    _resting(context)
    program = context.unit.program
    line = _line(context, text.strip()) if text.strip() else max(0, len(program.lines) - 1)
    if not 0 <= line <= len(program.lines):
        raise Rejection(ErrorCode.INVALID_LABEL)
    _begin_input(context, ProgramEdit(program, line, partial(_resting, context)))
    return None


def _upload(context: CallerContext, _: str) -> Answer:
    """UL: the program and Ctrl-Z. An empty program is sent as a line end, without which the EPICS driver fails."""
    return ((context.unit.program.text() or "\r\n") + _END).encode("ascii")


def _list(context: CallerContext, text: str) -> Answer:
    """LS n,m: lines with their numbers."""
    first, last = (part.strip() for part in [*split(text), ""][:2])
    lines = context.unit.program.lines
    begin = _line(context, first) if first else 0
    end = _line(context, last) if last else _LAST
    if begin < 0 or end < begin:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    rows = [f"{number} {lines[number]}" for number in range(begin, min(end + 1, len(lines)))]
    return "\r\n".join(rows) or b""


def _labels(context: CallerContext, _: str) -> Answer:
    """LL: labels in alphabetical order, each with its line."""
    labels = sorted(context.unit.program.labels.items())
    return "\r\n".join(f"#{name}={line}" for name, line in labels) or b""


def _thread(context: CallerContext, text: str) -> Thread:
    return context.unit.threads.all[context.integer(text, 0, COUNT - 1) if text else 0]


def _execute(context: CallerContext, text: str) -> Answer:
    """XQ #label,thread: start a thread, by default thread 0 at line 0."""
    parts = split(text)
    if len(parts) > 3:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    thread = _thread(context, parts[1] if len(parts) > 1 else "")
    program = context.unit.program
    line = _line(context, parts[0]) if parts[0] else 0
    if not program.lines:
        raise Rejection(ErrorCode.UNDEFINED_LABEL)
    at = program.start(line)
    if at >= len(program.layout.statements):
        raise Rejection(ErrorCode.UNDEFINED_LABEL)
    if thread.running:
        raise Rejection(ErrorCode.THREAD_EXECUTING)
    thread.start(at, line)
    return None


def _halt(context: CallerContext, text: str) -> Answer:
    """HX n: end a thread, or all of them."""
    if text.strip():
        _thread(context, text.strip()).halt()
    else:
        context.unit.threads.halt_all()
    return None


def _trace(context: CallerContext, text: str) -> Answer:
    """TR n,mask: send the lines of these threads as they are executed; 0 or no number ends it."""
    parts = split(text)
    on = context.integer(parts[0], 0, 1) if parts[0] else 0
    mask = context.integer(parts[1], 0, 255) if len(parts) > 1 and parts[1] else 255
    context.unit.threads.trace = mask if on else 0
    return None


def _break(context: CallerContext, text: str) -> Answer:
    """BK line,thread: hold a thread before a line, and release all held threads; without a line only release them."""
    threads = context.unit.threads
    parts = split(text)
    threads.breakpoint = None if not parts[0] else _breakpoint(context, parts)
    for thread in threads.all:
        thread.steps = None
        _release(thread)
    return None


def _breakpoint(context: CallerContext, parts: list[str]) -> tuple[int, int]:
    line = _line(context, parts[0])
    context.unit.program.start(line)
    return line, _thread(context, parts[1] if len(parts) > 1 else "").number


def _step(context: CallerContext, text: str) -> Answer:
    """SL n: execute n lines of every held thread; refused (8) if none is held."""
    count = context.integer(text, 1, 255) if text.strip() else 1
    held = [thread for thread in context.unit.threads.all if thread.held]
    if not held:
        raise Rejection(ErrorCode.NOT_WHILE_NOT_RUNNING)
    for thread in held:
        thread.steps = count
        _release(thread)
    return None


def _release(thread: Thread) -> None:
    if thread.held:
        thread.held, thread.due = False, AT_ONCE


def _interrupts(context: CallerContext, text: str) -> Answer:
    """II first,last,mask,levels: the inputs that call #ININT, by range or mask, and the level of each (bit 1: high)."""
    parts = [*split(text), "", "", ""]
    count = len(context.unit.inputs)
    first = context.integer(parts[0], 0, count) if parts[0] else 0
    last = context.integer(parts[1], first, count) if parts[1] else first
    mask = context.integer(parts[2], 0, (1 << count) - 1) if parts[2] else 0
    levels = context.integer(parts[3], 0, (1 << count) - 1) if parts[3] else 0
    chosen = [bit for bit in range(1, count + 1) if first <= bit <= last or mask >> (bit - 1) & 1]
    context.unit.threads.interrupts = {bit: bool(levels >> (bit - 1) & 1) for bit in chosen} or None
    return None


def _nothing(context: CallerContext, text: str) -> Answer:
    return None


TABLE: dict[str, Handler] = {
    "DL": _download,
    "UL": _upload,
    "LS": _list,
    "LL": _labels,
    "ED": _edit,
    "XQ": _execute,
    "HX": _halt,
    "TR": _trace,
    "BK": _break,
    "SL": _step,
    "II": _interrupts,
    "NO": _nothing,
    **dict.fromkeys(_IN_PROGRAMS.split(), _program_only),
}
