"""Runs the threads of the program, one statement of each in a sample, and its automatic subroutines.

Automatic subroutines run on thread 0, even if it is idle, and need only their label in the program (Galil DMC-41x3). A
subroutine that is due while another runs waits, unless it has a higher rank. Each responds to an event, not to a
state, so none repeats by itself. Without #CMDERR an error ends every thread. Not in Galil's manual: an input interrupt
requires a change of an input; with #CMDERR an erring thread continues after its error only with EN 1.
"""

from __future__ import annotations

from math import ceil, floor, inf

from dmc41x3.twin.context import CallerContext, OperandScope
from dmc41x3.twin.execution import Need, Statement, prepared
from dmc41x3.twin.expressions import Rejection
from dmc41x3.twin.motion.axis import ProgramTrigger
from dmc41x3.twin.program import AT_ONCE, NEVER, Frame, Thread
from dmc41x3.twin.unit import Unit

_HAPPENINGS = {
    ProgramTrigger.LIMIT: "LIMSWI",
    ProgramTrigger.POSITION_ERROR: "POSERR",
    ProgramTrigger.AMPLIFIER: "AMPERR",
}
_ERROR = "CMDERR"
_INPUT = "ININT"
_RANKS = {_INPUT: 0, _ERROR: 2}
_USUAL_RANK = 1


class Automatic:
    """Watches a unit for events for which its program has a subroutine, and calls the subroutine."""

    def __init__(self, unit: Unit) -> None:
        self._unit = unit
        self._threads = unit.threads
        self._seen = 0
        self._aborted = False
        self._inputs = list(unit.inputs)
        unit.on_tcp_error = lambda _: self._threads.call("TCPERR")

    @property
    def watching(self) -> bool:
        """Whether the program has a subroutine for an event of an axis."""
        labels = self._unit.program.labels
        return any(label in labels for label in _HAPPENINGS.values())

    def look(self) -> None:
        """Record the events of the axes and the inputs since the last look."""
        self._seen = 0
        core = self._unit.core
        core.errors_matter = "POSERR" in self._unit.program.labels
        if core.abort_active and not self._aborted and not core.cn[4]:
            self._threads.halt_all()
        self._aborted = core.abort_active
        self._look_at_inputs()
        self.serve()

    def serve(self) -> None:
        """Call the subroutines that are due and may interrupt thread 0."""
        happened = self._unit.core.happened
        for happening, _ in happened[self._seen :]:
            self._threads.call(_HAPPENINGS[happening])
        self._seen = len(happened)
        if not self._threads.due_routines:
            return
        waiting, self._threads.due_routines = self._threads.due_routines, []
        for label in sorted(waiting, key=_rank, reverse=True):
            if label not in self._unit.program.labels:
                continue
            if _rank(label) > _rank(self._threads.all[0].routine):
                self._interrupt(label)
            else:
                self._threads.due_routines.append(label)

    def failed(self, thread: Thread, statement: Statement, refused: Rejection) -> None:
        """Handle a refused statement: call #CMDERR, or else end all threads and send a message to the port of CF."""
        threads = self._threads
        self._unit.error_code = int(refused.code)
        threads.error_line, threads.error_thread = statement.line, thread.number
        first = threads.all[0]
        if _ERROR in self._unit.program.labels and first.routine != _ERROR:
            self._interrupt(_ERROR, thread)
            return
        threads.halt_all()
        self._unit.outlet.say(f"?{statement.line} {statement.text}\r\n".encode("ascii", "replace"))

    def reset(self) -> None:
        """Store the inputs at power-up."""
        self._aborted, self._inputs = self._unit.core.abort_active, list(self._unit.inputs)

    def _interrupt(self, label: str, culprit: Thread | None = None) -> None:
        """Make thread 0 execute a subroutine and then continue where it was."""
        thread = self._threads.all[0]
        frame = Frame(thread.at, label, thread.running, thread.waiting, thread.earliest, culprit, thread.locals)
        if culprit is not None:
            culprit.running = False
        if not frame.ran:
            thread.stack = []
        thread.stack.append(frame)
        thread.locals, thread.waiting, thread.due = {}, None, AT_ONCE
        thread.line = self._unit.program.labels[label]
        thread.at = self._unit.program.start(thread.line)
        thread.running, thread.held = True, False

    def _look_at_inputs(self) -> None:
        """Call #ININT if an input has changed to the level that II names for it; not while #ININT runs."""
        interrupts, before = self._threads.interrupts, self._inputs
        if self._unit.inputs == before:
            return
        self._inputs = list(self._unit.inputs)
        if interrupts is None or self._threads.all[0].routine == _INPUT:
            return
        for bit, (was, now) in enumerate(zip(before, self._inputs, strict=True), 1):
            if was != now and interrupts.get(bit) == now:
                self._threads.call(_INPUT)


def _rank(label: str) -> int:
    return _RANKS.get(label, _USUAL_RANK) if label else -1


LEISURE = 0.05
"""Longest delay of a look at a statement that neither sends data nor changes the machine [s]."""

_SAME = 1e-6
"""Times that differ by less than this fraction of a sample are the same sample."""


class ProgramRunner:
    """The activity of the program's threads.

    Statements are executed at the samples of the servo. `hurry` executes statements that do not change the machine,
    without a look at the axes in between.
    """

    def __init__(self, unit: Unit) -> None:
        self._unit = unit
        self._threads = unit.threads
        self._contexts = tuple(
            CallerContext(unit, OperandScope(unit, None, thread), None, thread) for thread in self._threads.all
        )
        self._automatic = Automatic(unit)
        self._code: list[Statement] = []
        self._revision = -1
        self._next = inf

    @property
    def active(self) -> bool:
        """True: events that may call an automatic subroutine are recorded at any time."""
        return True

    @property
    def watching(self) -> bool:
        """Whether the end of a motion, planned or not, affects the program."""
        return self._automatic.watching or any(
            thread.running and thread.waiting is not None and thread.waiting.moves for thread in self._threads.all
        )

    @property
    def hurries(self) -> bool:
        """Whether `hurry` has statements to execute."""
        threads = self._threads
        if threads.trace or threads.breakpoint is not None:
            return False
        running = [thread for thread in threads.all if thread.running]
        return any(self._need(thread) is not Need.ALL for thread in running) and not any(
            thread.steps is not None for thread in running
        )

    def next_event(self) -> float:
        """Return the time of the next sample in which a thread executes a statement [s]."""
        return self._next

    def wake(self) -> float:
        """Return when to look next for output of the program [s].

        A look at statements that only count and compare may be late by `LEISURE`.
        """
        if self._next == inf:
            return inf
        core = self._unit.core
        now, passed, period = core.now, core.samples, core.sample
        times = [
            now + (thread.due - passed) * period + (0.0 if self._need(thread) is Need.ALL else LEISURE)
            for thread in self._threads.all
            if thread.running and thread.due != NEVER
        ]
        return min(times, default=inf)

    def look(self, now: float) -> None:
        """Execute what is due at `now` [s]."""
        self._automatic.look()
        if not self._threads.busy:
            self._next = inf
            return
        self._prepare()
        sample = self._sample()
        for thread in self._threads.all:
            if thread.running and self._due(thread, now) <= sample:
                self._execute(thread, sample)
        # A statement may have met a limit, or started another thread.
        self._automatic.serve()
        self._plan(now)

    def reset(self) -> None:
        """Reset to the state of power-up, with the present inputs."""
        self._automatic.reset()
        self._next = inf

    def hurry(self, until: float) -> None:
        """Execute statements that do not change the machine, up to `until` [s]; nothing else happens before it."""
        core = self._unit.core
        now, passed, period = core.now, core.samples, core.sample
        running = [thread for thread in self._threads.all if thread.running]
        ended = False
        while running and not ended:
            sample = min([thread.due for thread in running])
            time = now + (sample - passed) * period
            if time >= until:
                break
            due = [thread for thread in running if thread.due == sample]
            need = max([self._need(thread) for thread in due])
            if need is Need.ALL:
                break
            if need is Need.STATE:
                core.coast(time)
            for thread in due:
                ended |= not self._execute(thread, sample)
        self._automatic.serve()
        self._plan(core.now)

    def _prepare(self) -> None:
        program = self._unit.program
        if self._revision != program.revision:
            self._revision = program.revision
            self._code = prepared(program)

    def _need(self, thread: Thread) -> Need:
        """Return what a thread needs for its next statement, `Need.ALL` if that is not known yet."""
        waiting = thread.waiting
        if (waiting is not None and not waiting.timed) or thread.at >= len(self._code) or thread.due == AT_ONCE:
            return Need.ALL
        return self._code[thread.at].need

    def _due(self, thread: Thread, now: float) -> int:
        """Set and return the sample in which a thread executes its next statement by the present plan."""
        if thread.held:
            thread.due = NEVER
        elif thread.due == AT_ONCE:
            thread.due = thread.earliest = self._sample() + 1
        elif thread.waiting is not None:
            when = thread.waiting.when(now)
            thread.due = max(thread.earliest, self._sample_from(when)) if when < inf else NEVER
        return thread.due

    def _plan(self, now: float) -> None:
        """Compute the time of the next sample in which a thread executes a statement."""
        due = min([self._due(thread, now) for thread in self._threads.all if thread.running], default=NEVER)
        core = self._unit.core
        self._next = inf if due == NEVER else core.now + (due - core.samples) * core.sample

    def _execute(self, thread: Thread, sample: int) -> bool:
        """Execute the next statement of a thread; return whether the thread then continues by itself."""
        thread.waiting = None
        if thread.at >= len(self._code):
            thread.halt()
            return False
        statement = self._code[thread.at]
        thread.line = statement.line
        if statement.opens and self._stops_before(thread, statement):
            return False
        thread.at += 1
        thread.due = thread.earliest = sample + 1
        try:
            answer = statement.act(self._contexts[thread.number], thread)
        except Rejection as refused:
            self._automatic.failed(thread, statement, refused)
            return False
        if answer is not None:
            self._say(answer)
        return thread.running

    def _stops_before(self, thread: Thread, statement: Statement) -> bool:
        """Return whether a thread is held before a line (BK, SL); if not, send the line if it is traced (TR)."""
        threads = self._threads
        if thread.steps == 0 or (thread.steps is None and threads.breakpoint == (statement.line, thread.number)):
            thread.held, thread.due = True, NEVER
            return True
        if thread.steps is not None:
            thread.steps -= 1
        if threads.trace >> thread.number & 1:
            self._say(f"{statement.line} {self._unit.program.lines[statement.line]}")
        return False

    def _say(self, answer: str | bytes) -> None:
        """Send unsolicited output to the port of CF."""
        data = answer if isinstance(answer, bytes) else f"{answer}\r\n".encode("ascii", "replace")
        self._unit.outlet.say(data)

    def _sample(self) -> int:
        """Return the present sample."""
        return floor(self._unit.core.samples + _SAME)

    def _sample_from(self, time: float) -> int:
        """Return the first sample at or after a time [s]."""
        core = self._unit.core
        return ceil(core.samples + (time - core.now) / core.sample - _SAME)
