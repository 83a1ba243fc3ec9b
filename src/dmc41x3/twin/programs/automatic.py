"""The automatic subroutines of a program: #LIMSWI, #POSERR, #AMPERR, #MCTIME, #CMDERR, #ININT, #TCPERR.

They run on thread 0, also where nothing runs there, and need no more than their label in the program (Galil DMC-41x3).
One that is due while another runs waits for its turn, unless it is of a higher rank; each answers an event, not a
state, so that none begins again by itself. Without #CMDERR an error ends every thread. Where Galil's manual is silent:
an input interrupt needs the change of an input; with #CMDERR an erring thread goes on behind its error after EN 1 only.
"""

from __future__ import annotations

from dmc41x3.twin.motion.happening import ProgramTrigger
from dmc41x3.twin.programs.flow import Statement
from dmc41x3.twin.refusal import Rejection
from dmc41x3.twin.thread import AT_ONCE, Frame, Thread
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
    """Watches a unit for what its program has a subroutine for, and calls that."""

    def __init__(self, unit: Unit) -> None:
        self._unit = unit
        self._threads = unit.threads
        self._seen = 0
        self._aborted = False
        self._inputs = list(unit.inputs)
        unit.on_tcp_error = lambda _: self._threads.call("TCPERR")

    @property
    def watching(self) -> bool:
        """Whether there is a subroutine for what may befall an axis."""
        labels = self._unit.program.labels
        return any(label in labels for label in _HAPPENINGS.values())

    def look(self) -> None:
        """Take note of what has befallen the axes and the inputs since the machine looked last."""
        self._seen = 0
        core = self._unit.core
        core.errors_matter = "POSERR" in self._unit.program.labels
        if core.abort_active and not self._aborted and not core.cn[4]:
            self._threads.halt_all()
        self._aborted = core.abort_active
        self._look_at_inputs()
        self.serve()

    def serve(self) -> None:
        """Call what is due, as far as it may interrupt thread 0."""
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
        """See to a statement that was refused: #CMDERR, or else all threads end and the port of CF is told."""
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
        """Take the inputs as they are at power-up."""
        self._aborted, self._inputs = self._unit.core.abort_active, list(self._unit.inputs)

    def _interrupt(self, label: str, culprit: Thread | None = None) -> None:
        """Have thread 0 go through a subroutine and then on from where it is."""
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
        """Call #ININT where an input has gone to the level that II names for it; off until RI."""
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
