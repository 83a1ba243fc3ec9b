"""Runs the threads of the program: one statement of each in a sample, all of it in the order of time."""

from __future__ import annotations

from math import ceil, floor, inf

from maya_un.virtual.automatic import Automatic
from maya_un.virtual.context import Context
from maya_un.virtual.flow import Need, Statement, prepared
from maya_un.virtual.operands import Names
from maya_un.virtual.refusal import Refused
from maya_un.virtual.thread import AT_ONCE, NEVER, Thread
from maya_un.virtual.unit import Unit

_SAME = 1e-6
"""Times that differ by less than this part of a sample are the same sample."""


class Runner:
    """The activity of the program's threads.

    Statements are executed at the samples of the servo. A run of statements that need nothing but variables is
    executed by `hurry` without a look at the axes in between.
    """

    def __init__(self, unit: Unit) -> None:
        self._unit = unit
        self._threads = unit.threads
        self._contexts = tuple(Context(unit, Names(unit, None, thread), None, thread) for thread in self._threads.all)
        self._automatic = Automatic(unit)
        self._code: list[Statement] = []
        self._revision = -1
        self._next = inf

    @property
    def watching(self) -> bool:
        """Whether the end of a motion, planned or not, matters to the program."""
        return self._automatic.watching or any(
            thread.running and thread.waiting is not None and thread.waiting.moves for thread in self._threads.all
        )

    def next_event(self) -> float:
        """Return the time of the next sample in which a thread does something [s]."""
        return self._next

    def look(self, now: float) -> None:
        """Execute what is due at `now` [s]."""
        if self._threads.mask and self._revision != self._unit.program.revision:
            self._revision = self._unit.program.revision
            self._code = prepared(self._unit.program)
        self._automatic.look()
        sample = self._sample(now)
        for thread in self._threads.all:
            if thread.running:
                self._look_at(thread, sample, now)
        # A statement may have met a limit, or started another thread.
        self._automatic.serve()
        dues = [self._due(thread, sample, now) for thread in self._threads.all if thread.running]
        self._next = min(dues, default=inf)
        if self._automatic.polling:
            self._next = min(self._next, self._time(sample + 1))

    def reset(self) -> None:
        """Do what power-up does: forget what was due."""
        self._automatic.reset()
        self._next = inf

    def hurry(self, until: float) -> None:
        """Execute, up to a time before which nothing happens [s], statements that do not act on the machine."""
        if self._threads.trace or self._threads.breakpoint is not None or self._automatic.polling:
            return
        running = [thread for thread in self._threads.all if thread.running]
        if any(thread.held or thread.steps is not None for thread in running):
            return
        while running:
            sample = min([thread.due for thread in running])
            time = self._time(sample)
            if time >= until:
                break
            due = [thread for thread in running if thread.due == sample]
            needs = max([self._need(thread) for thread in due])
            if needs is Need.ALL:
                break
            if needs is Need.STATE:
                self._unit.core.coast(time)
            for thread in due:
                self._execute(thread, sample)
            running = [thread for thread in running if thread.running]
        self._next = min((self._time(thread.due) for thread in running if thread.due < NEVER), default=inf)

    @property
    def hurries(self) -> bool:
        """Whether `hurry` has something to do."""
        return any(
            thread.running and thread.due != NEVER and self._need(thread) is not Need.ALL
            for thread in self._threads.all
        )

    def _need(self, thread: Thread) -> Need:
        waiting = thread.waiting
        if (waiting is not None and not waiting.timed) or thread.at >= len(self._code) or thread.due == AT_ONCE:
            return Need.ALL
        return self._code[thread.at].need

    def _look_at(self, thread: Thread, sample: int, now: float) -> None:
        if self._due(thread, sample, now) <= now:
            self._execute(thread, sample)

    def _due(self, thread: Thread, sample: int, now: float) -> float:
        """Return when a thread executes its next statement as things stand [s], and note the sample."""
        if thread.due == AT_ONCE:
            thread.due = thread.earliest = sample + 1
        waiting = thread.waiting
        if thread.held:
            thread.due = NEVER
        elif waiting is not None and not waiting.timed:
            when = waiting.when(now)
            thread.due = max(thread.earliest, self._sample_from(when)) if when < inf else NEVER
        return self._time(thread.due) if thread.due < NEVER else inf

    def _execute(self, thread: Thread, sample: int) -> None:
        """Execute the next statement of a thread; past the last one the thread ends."""
        thread.waiting = None
        if thread.at >= len(self._code):
            thread.halt()
            return
        statement = self._code[thread.at]
        thread.line = statement.line
        if statement.opens and self._stops_before(thread, statement):
            return
        thread.at += 1
        thread.due = thread.earliest = sample + 1
        context = self._contexts[thread.number]
        try:
            answer = statement.act(context, thread)
        except Refused as refused:
            self._automatic.failed(thread, statement, refused)
            return
        if answer is not None:
            data = answer if isinstance(answer, bytes) else f"{answer}\r\n".encode("ascii", "replace")
            self._unit.outlet.say(data)

    def _stops_before(self, thread: Thread, statement: Statement) -> bool:
        """Tell whether a thread is held before a line (BK, SL); else say the line where it is traced (TR)."""
        threads = self._threads
        if thread.steps == 0 or (thread.steps is None and threads.breakpoint == (statement.line, thread.number)):
            thread.held, thread.due = True, NEVER
            return True
        if thread.steps is not None:
            thread.steps -= 1
        if threads.trace >> thread.number & 1:
            text = self._unit.program.lines[statement.line]
            self._unit.outlet.say(f"{statement.line} {text}\r\n".encode("ascii", "replace"))
        return False

    def _time(self, sample: int) -> float:
        """Return the time of a sample [s]."""
        return self._unit.started + sample * self._unit.period

    def _sample(self, time: float) -> int:
        """Return the last sample at or before a time [s]."""
        return floor((time - self._unit.started) / self._unit.period + _SAME)

    def _sample_from(self, time: float) -> int:
        """Return the first sample at or after a time [s]."""
        return ceil((time - self._unit.started) / self._unit.period - _SAME)
