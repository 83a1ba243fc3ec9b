"""The eight threads of a program: where each is, what it waits for, and from where it was called."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

COUNT = 8
"""Threads 0 to 7."""

STACK_DEPTH = 16
"""How deep subroutines may nest."""

AT_ONCE = -1
"""A thread that is due then is given the next sample by whoever runs it."""

NEVER = 1 << 62
"""A sample that does not come."""


class Trippoint(Protocol):
    """What a thread waits for. Times are seconds of the machine's clock."""

    @property
    def timed(self) -> bool:
        """Whether it is only a matter of time, which the thread's `due` holds."""
        ...

    @property
    def moves(self) -> bool:
        """Whether a motion decides, so that it may come sooner or later than planned."""
        ...

    def when(self, now: float) -> float:
        """Return when it is over as things stand, `now` where it is, infinity where nothing points to it."""
        ...


@dataclass(slots=True)
class Frame:
    """Where a subroutine returns to: statement `back`.

    `routine` is the label of an automatic subroutine, empty for JS; such a one keeps what the thread waited for and
    whether it ran. `culprit` is the thread whose error called #CMDERR. `locals` are the caller's stack variables,
    `references` the variables that it passed as `&v`, by the stack variable that stands for each.
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
    which is never before `earliest`. `returned` is what the last subroutine returned (`_JS`, raw fixed point).
    `reference` is the sample that AT counts from, `marks` where the motion of an axis began and where the last AD or AR
    was met [motor counts]. `held` is a thread at a breakpoint, `steps` how many lines it may execute before it is held
    again, None for as many as come.
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
        """Begin at a statement, in the next sample."""
        self.halt()
        self.at, self.line = at, line
        self.running = True

    def halt(self) -> None:
        """End, wherever it is; a thread that does not run stays as it is."""
        self.running = self.held = False
        self.due, self.waiting, self.steps = AT_ONCE, None, None
        self.stack, self.locals, self.marks = [], {}, {}

    @property
    def place(self) -> int:
        """What `_XQn` says: the line it executes, -1 where it does not run."""
        return self.line if self.running else -1

    @property
    def status(self) -> int:
        """What `_HXn` says: 0 it does not run, 1 it runs, 2 it waits."""
        if not self.running:
            return 0
        return 2 if self.waiting is not None or self.held else 1

    @property
    def routine(self) -> str:
        """The automatic subroutine it is in, the innermost; empty for none."""
        return next((frame.routine for frame in reversed(self.stack) if frame.routine), "")


class Threads:
    """All of them, with what concerns them together.

    `error_line` and `error_thread` tell where a program last went wrong (`_ED0`, `_ED1`), `trace` is TR's mask of
    threads, `breakpoint` a line and a thread. `due_routines` are automatic subroutines that wait for their turn,
    `interrupts` the level of each input that calls #ININT (II), None without.
    """

    def __init__(self) -> None:
        self.all = tuple(Thread(number) for number in range(COUNT))
        self.reset()

    def reset(self) -> None:
        """Set what power-up sets."""
        self.halt_all()
        self.error_line, self.error_thread = 0, 0
        self.trace = 0
        self.breakpoint: tuple[int, int] | None = None
        self.interrupts: dict[int, bool] | None = None

    def halt_all(self) -> None:
        """End every thread, and what waits for its turn."""
        self.due_routines: list[str] = []
        for thread in self.all:
            thread.halt()

    def call(self, label: str) -> None:
        """Have an automatic subroutine run on thread 0 if the program has it, once however often it is called for."""
        if label not in self.due_routines:
            self.due_routines.append(label)

    @property
    def breakpoint_state(self) -> int:
        """What `_BK` says: -2147483648 not armed, minus the line where it is armed, the line where a thread met it."""
        if self.breakpoint is None:
            return -(1 << 31)
        line, number = self.breakpoint
        return line if self.all[number].held else -line

    @property
    def busy(self) -> bool:
        """Whether any of them runs."""
        return True in [thread.running for thread in self.all]

    @property
    def mask(self) -> int:
        """Which threads run, one bit for each (`_NO`)."""
        return sum(thread.running << thread.number for thread in self.all)
