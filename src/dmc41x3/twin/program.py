"""The program in the controller's memory, and the eight threads that run it.

A line holds statements separated by `;`. A label (`#` and up to seven letters, digits or underscores, a letter first)
stands at the start of a line. An apostrophe outside quotes begins a comment that lasts to the end of the line.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.commands import LINE_LIMIT, TOO_LONG
from dmc41x3.twin.expressions import Rejection

MOST_LINES = 4000
MOST_LABELS = 510

_LABEL = re.compile(r"#([A-Za-z][A-Za-z0-9_]{0,6})(?=[\s;']|$)")
_ENDS = re.compile(r"\r\n|\r|\n")
_TOKEN = re.compile(r"""[^"';]+|"[^"]*"?|[';]""")


@dataclass(frozen=True, slots=True)
class Layout:
    """A parsed program: (line, text) of every statement, and the first statement in or after every line."""

    statements: list[tuple[int, str]] = field(default_factory=list[tuple[int, str]])
    starts: list[int] = field(default_factory=list[int])


class Program:
    """Lines and labels of one program; `revision` counts its changes."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.labels: dict[str, int] = {}
        self.revision = 0
        self._layout: Layout | None = Layout()

    def text(self) -> str:
        """Return the program as it was downloaded, with CR LF after every line (UL)."""
        return "".join(f"{line}\r\n" for line in self.lines)

    def load(self, text: str) -> None:
        """Replace the program; for a bad line, raises `Rejection` (60, 61, 62) and keeps the old program."""
        lines = _ENDS.split(text)
        draft = Draft([])
        for line in lines if lines[-1] else lines[:-1]:
            draft.append(line)
        self.install(draft)

    def install(self, draft: Draft) -> None:
        """Install a draft as the program."""
        self.lines, self.labels = draft.lines, draft.labels
        self.revision += 1
        self._layout = None

    @property
    def layout(self) -> Layout:
        """The statements of the program."""
        if self._layout is None:
            self._layout = _laid_out(self.lines)
        return self._layout

    def line_of(self, label: str) -> int:
        """Return the line of a label (without its `#`); raises `Rejection` (10) if it does not exist."""
        try:
            return self.labels[label]
        except KeyError:
            raise Rejection(ErrorCode.UNDEFINED_LABEL) from None

    def start(self, line: int) -> int:
        """Return the first statement in or after a line; raises `Rejection` (11) if the line does not exist."""
        if not 0 <= line < len(self.lines):
            raise Rejection(ErrorCode.INVALID_LABEL)
        return self.layout.starts[line]


class Draft:
    """A program under construction, checked line by line; `lines` are its initial lines."""

    def __init__(self, lines: list[str]) -> None:
        self.lines: list[str] = []
        self.labels: dict[str, int] = {}
        for line in lines:
            self.append(line)

    def append(self, line: str) -> None:
        """Add a line; raises `Rejection`: 60 if it is too long or one too many, 61 for a bad label, 62 for too many."""
        if len(line) > LINE_LIMIT or line.startswith(TOO_LONG) or len(self.lines) >= MOST_LINES:
            raise Rejection(ErrorCode.DOWNLOAD_ERROR)
        if line.startswith("#"):
            label = label_of(line)
            if label is None or label in self.labels:
                raise Rejection(ErrorCode.BAD_LABEL)
            if len(self.labels) >= MOST_LABELS:
                raise Rejection(ErrorCode.TOO_MANY_LABELS)
            self.labels[label] = len(self.lines)
        self.lines.append(line)


def label_of(line: str) -> str | None:
    """Return the label at the start of a line, without its `#`; None without a valid label."""
    found = _LABEL.match(line)
    return None if found is None else found[1]


def statements(line: str) -> list[str]:
    """Return the statements of a line, without its label, its comment and empty ones."""
    found = _LABEL.match(line)
    parts = [""]
    for token in _TOKEN.findall(line if found is None else line[found.end() :]):
        if token == "'":
            break
        if token == ";":
            parts.append("")
        else:
            parts[-1] += token
    return [part for part in map(str.strip, parts) if part]


def _laid_out(lines: list[str]) -> Layout:
    layout = Layout()
    for number, line in enumerate(lines):
        layout.starts.append(len(layout.statements))
        layout.statements.extend((number, text) for text in statements(line))
    return layout


class Downloading:
    """Receives the lines after DL, which follow the first `keep` lines of the program.

    The program changes when the download ends. After a bad line, only the first `keep` lines of the old program remain,
    so that half a program cannot start. `check` raises `Rejection` if the program runs and must not change.
    """

    def __init__(self, program: Program, keep: int, check: Callable[[], None]) -> None:
        self._program = program
        self._check = check
        self._draft = Draft(program.lines[:keep])
        self._good = True
        program.install(Draft(program.lines[:keep]))

    def line(self, text: str) -> None:
        """Receive one line; raises `Rejection` for a bad one."""
        try:
            self._draft.append(text)
        except Rejection:
            self._good = False
            raise

    def end(self) -> None:
        """Install the received lines; raises `Rejection` while the program runs."""
        self._check()
        if self._good:
            self._program.install(self._draft)


class ProgramEdit:
    """Receives the lines after ED: they replace those from line `number` on, or follow the last one.

    `check` raises `Rejection` if the program runs and must not change.
    """

    def __init__(self, program: Program, number: int, check: Callable[[], None]) -> None:
        self._program = program
        self._check = check
        self._number = number

    def line(self, text: str) -> None:
        """Put one line at its place; raises `Rejection` for a bad line, which is not stored."""
        self._check()
        lines = self._program.lines
        draft = Draft([*lines[: self._number], text, *lines[self._number + 1 :]])
        self._program.install(draft)
        self._number += 1

    def end(self) -> None:
        """Leave the editor; all lines are already stored."""


COUNT = 8
"""Threads 0 to 7."""

STACK_DEPTH = 16
"""Greatest depth of nested subroutines."""

AT_ONCE = -1
"""Value of `due` for a thread that executes in the next sample."""

NEVER = 1 << 62
"""A sample that is never reached."""


class Trippoint(Protocol):
    """The condition that a thread waits for. Times are seconds of the machine's clock."""

    @property
    def timed(self) -> bool:
        """Whether it depends on time only; the thread's `due` then contains that time as a sample number."""
        ...

    @property
    def moves(self) -> bool:
        """Whether it depends on a motion, so that it may come sooner or later than planned."""
        ...

    def when(self, now: float) -> float:
        """Return when it is met by the present plan [s]: `now` if it is met, infinity if that is unknown."""
        ...


@dataclass(slots=True)
class Frame:
    """Return address of a subroutine: statement `back`.

    `routine` is the label of an automatic subroutine, empty for JS; its frame also stores what the thread waited for
    and whether it ran. `culprit` is the thread whose error called #CMDERR. `locals` are the caller's stack variables,
    `references` the variables that it passed as `&v`, by stack variable.
    """

    back: int
    routine: str = ""
    ran: bool = True
    waiting: Trippoint | None = None
    earliest: int = 0
    culprit: Thread | None = None
    locals: dict[str, int] = field(default_factory=dict[str, int])
    references: dict[str, str] = field(default_factory=dict[str, str])


@dataclass(slots=True, eq=False)
class Thread:
    """State of one thread; `running` until it ends.

    `line` is the line it executes, `at` the next statement of the program, `due` the sample in which that is executed,
    which is never before `earliest`. `returned` is the return value of the last subroutine (`_JS`, raw fixed point).
    `reference` is the sample that AT counts from, `marks` where the motion of an axis began and where the last AD or AR
    was met [motor counts]. `held` means that the thread is held at a breakpoint, `steps` is the number of lines that it
    may execute before it is held again, None for no limit.
    """

    number: int
    running: bool = False
    line: int = 0
    at: int = 0
    due: int = AT_ONCE
    earliest: int = 0
    waiting: Trippoint | None = None
    locals: dict[str, int] = field(default_factory=dict[str, int])
    """Stack variables `^a` to `^h` of the subroutine under way (raw fixed point)."""
    stack: list[Frame] = field(default_factory=list[Frame])
    returned: int = 0
    reference: int = 0
    marks: dict[int, tuple[int, float]] = field(default_factory=dict[int, tuple[int, float]])
    held: bool = False
    steps: int | None = None

    def start(self, at: int, line: int) -> None:
        """Start at a statement, in the next sample."""
        self.halt()
        self.at, self.line = at, line
        self.running = True

    def halt(self) -> None:
        """End the thread at any statement; a thread that does not run stays as it is."""
        self.running = self.held = False
        self.due, self.waiting, self.steps = AT_ONCE, None, None
        self.stack, self.locals, self.marks = [], {}, {}

    @property
    def place(self) -> int:
        """`_XQn`: the line that the thread executes, -1 if it does not run."""
        return self.line if self.running else -1

    @property
    def status(self) -> int:
        """`_HXn`: 0 if the thread does not run, 1 if it runs, 2 if it waits."""
        if not self.running:
            return 0
        return 2 if self.waiting is not None or self.held else 1

    @property
    def routine(self) -> str:
        """The innermost automatic subroutine under way; empty if there is none."""
        return next((frame.routine for frame in reversed(self.stack) if frame.routine), "")


class Threads:
    """All threads, and their common state.

    `error_line` and `error_thread` are the place of the last error of a program (`_ED0`, `_ED1`), `trace` is TR's mask
    of threads, `breakpoint` a line and a thread. `due_routines` are automatic subroutines that wait to run,
    `interrupts` is the level of each input that calls #ININT (II), None without any.
    """

    def __init__(self) -> None:
        self.all = tuple(Thread(number) for number in range(COUNT))
        self.reset()

    def reset(self) -> None:
        """Restore the power-up settings."""
        self.halt_all()
        self.error_line, self.error_thread = 0, 0
        self.trace = 0
        self.breakpoint: tuple[int, int] | None = None
        self.interrupts: dict[int, bool] | None = None

    def halt_all(self) -> None:
        """End every thread, and drop the automatic subroutines that wait."""
        self.due_routines: list[str] = []
        for thread in self.all:
            thread.halt()

    def call(self, label: str) -> None:
        """Queue an automatic subroutine for thread 0, at most once; it runs if the program has it."""
        if label not in self.due_routines:
            self.due_routines.append(label)

    @property
    def breakpoint_state(self) -> int:
        """`_BK`: -2147483648 if not armed, minus the line if it is armed, the line if a thread is held there."""
        if self.breakpoint is None:
            return -(1 << 31)
        line, number = self.breakpoint
        return line if self.all[number].held else -line

    @property
    def busy(self) -> bool:
        """Whether any thread runs."""
        return True in [thread.running for thread in self.all]

    @property
    def mask(self) -> int:
        """The threads that run, one bit for each (`_NO`)."""
        return sum(thread.running << thread.number for thread in self.all)
