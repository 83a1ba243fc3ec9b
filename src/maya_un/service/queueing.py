"""Operations of the queue and of its history.

History contains ended jobs, reports, events, the audit log, and recordings. The queue has views, pauses, order, and
decisions about interrupted jobs. The gate has checked the caller's role; this module checks the owner of the job.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

from dmc41x3.i18n import phrase
from maya_un.errors import EventsForgotten, InvalidRequest, InvalidValue, JobChanged, NotFound
from maya_un.events import EventLog
from maya_un.process.journal.protocol import AuditRow, EventRow, Filter, JobRow, RequestOwner
from maya_un.process.lease import ControlLease
from maya_un.process.process import Process
from maya_un.process.queue.editing import DEFAULT_OPTIONS, SubmitRequest
from maya_un.process.spec.stored import version_of
from maya_un.recorder.recorder import Recorder
from maya_un.recorder.recording import SavingCause, TimeSpan
from maya_un.recorder.scope import require_columns, sampled
from maya_un.schema.choices import PauseTime, QueueEnd
from maya_un.schema.jobs import JobLine, JobReport, QueueView
from maya_un.schema.people import AuditLine
from maya_un.schema.recordings import ScopeView
from maya_un.schema.robot import EventMessage, Kept
from maya_un.service.access.operations import LOCAL, Caller, Operation, Role, require, require_over
from maya_un.service.computing import Computing
from maya_un.workers import Workers


class RecordingService:
    """Access to the flight recorder; without one, or with one that stores no files, no recordings exist."""

    def __init__(self, recorder: Recorder | None = None, workers: Workers | None = None) -> None:
        self._recorder = recorder
        self._computing = Computing(workers)

    def list(self) -> list[Kept]:
        """Return the stored recordings, newest first, each with name, date, reason and size [bytes]."""
        store = None if self._recorder is None else self._recorder.store
        return [] if store is None else store.list()

    async def save(self, by: Caller = LOCAL) -> Kept:
        """Save the last minutes now and return the entry of the recording.

        Raises `FileUnwritable`, and `InvalidRequest` if no recorder runs (`recorder.enabled`, dry runs).
        """
        cause = SavingCause(message=f"asked by {by.name}")
        kept = None if self._recorder is None else await self._recorder.save(cause=cause)
        if kept is None:
            raise InvalidRequest(key="recorder", reason="nothing is recorded here")
        return kept

    async def scope(self, seconds: float, rate: float = 20.0, names: Sequence[str] = ()) -> ScopeView:
        """Return the states of the last `seconds` [s, loop time] as columns, at most `rate` a second.

        `names` are the columns, all without names. Raises `UnknownName`, and `InvalidRequest` if no recorder runs.
        """
        if self._recorder is None:
            raise InvalidRequest(key="recorder", reason="nothing is recorded here")
        require_columns(names)
        loop, ring = asyncio.get_running_loop(), self._recorder.ring
        now = loop.time()
        states = ring.states_since(now - seconds)
        columns = await loop.run_in_executor(None, sampled, states, rate, names)
        return ScopeView(max(now - seconds, ring.oldest), now, self._recorder.speed, columns)

    def path(self, name: str) -> Path:
        """Return the file of a recording (MCAP); raises `NotFound`."""
        store = None if self._recorder is None else self._recorder.store
        if store is None:
            raise NotFound(what="recording", number=name)
        return store.path(name)

    async def states(self, name: str, span: TimeSpan, rate: float | None, by: Caller = LOCAL) -> bytes:
        """Return the `RecordedStates` of a `span` [s, loop time] as JSON, with at most `rate` states a second.

        This and the next two raise `NotFound`, `FileUnreadable` and the errors of `Computing`.
        """
        from maya_un.recorder import viewing  # noqa: PLC0415 - only a reader needs the library

        return await self._computing.pieces(by, viewing.states, self.path(name), span, rate)

    async def events(self, name: str, span: TimeSpan, by: Caller = LOCAL) -> bytes:
        """Return the events of a `span` of a recording as JSON."""
        from maya_un.recorder import viewing  # noqa: PLC0415

        return await self._computing.pieces(by, viewing.events, self.path(name), span)

    async def table(self, name: str, span: TimeSpan, rate: float | None, by: Caller = LOCAL) -> bytes:
        """Return the states of a `span` of a recording as CSV, with at most `rate` a second."""
        from maya_un.recorder import viewing  # noqa: PLC0415

        return await self._computing.pieces(by, viewing.table, self.path(name), span, rate)


MOST_EVENTS = 1000
"""Maximum number of events in one answer."""


class HistoryService:
    """Reads the journal of `process`, with the current state of running jobs, and the `events` in memory."""

    def __init__(self, process: Process, events: EventLog) -> None:
        self._process = process
        self._journal = process.journal
        self._slices = process.views.slices
        self._events = events

    async def page(self, which: Filter) -> list[JobLine]:
        """Return a page of jobs, in the order of the filter."""
        return await self._process.views.page(which)

    async def job(self, number: int) -> JobReport:
        """Return the report of a job, also of an ended one; raises `NotFound`."""
        return await self._process.views.report(number)

    async def body(self, number: int) -> dict[str, Any]:
        """Return a job as it was submitted, or its command; raises `NotFound`."""
        return await self._process.views.body(number)

    async def events(self, run: int, above: int = 0, limit: int = MOST_EVENTS) -> list[EventMessage]:
        """Return events of a run numbered above `above`, oldest first; raises `EventsForgotten`.

        The events of an ended run may have been deleted; then none are returned.
        """
        limit = max(0, min(limit, MOST_EVENTS))
        if run == self._events.run and above + 1 >= self._events.oldest:
            return await self._slices.each(EventMessage.of, self._events.since(above)[:limit])
        rows = await self._journal.events(run, above, limit)
        first = rows[0].seq if rows else above + 1
        if first != above + 1 or (not rows and run == self._events.run):
            raise EventsForgotten(since=above, oldest=first if rows else self._events.oldest)
        return await self._slices.each(_message, rows)

    async def audit(self, below: int | None = None, limit: int = 100) -> list[AuditLine]:
        """Return operations and their outcome, newest first, numbered below `below`."""
        rows = await self._journal.audit(below, max(0, min(limit, 1000)))
        return await self._slices.each(_line, rows)


def _message(row: EventRow) -> EventMessage:
    return EventMessage(row.seq, row.time, row.kind, row.code, row.detail)


def _line(numbered: tuple[int, AuditRow]) -> AuditLine:
    number, row = numbered
    return AuditLine(number, row.date, row.who, row.role, row.source, row.operation, row.code, row.detail)


_WHEN: tuple[PauseTime, ...] = get_args(PauseTime)
_ENDS: tuple[QueueEnd, ...] = get_args(QueueEnd)


class QueueService:
    """Reads and changes the queue of `process`; methods that change it return its new state.

    A job of a user without the role operator is a proposal, unless the user holds the `lease`.
    """

    def __init__(self, process: Process, lease: ControlLease) -> None:
        self._process = process
        self._lease = lease

    def view(self) -> QueueView:
        """Return the queue now, with the first 50 waiting jobs."""
        return self._process.views.view()

    async def pause(self, by: Caller = LOCAL, *, when: str = "after step") -> QueueView:
        """Pause the queue: `when` is "after step", or "now" to brake on the path and hold the running step too.

        Raises `InvalidValue` for another `when`; for "now" `CannotPause` while the robot homes, `NotConnected` and
        `Faulted`; `StorageFailed` if the pause cannot be stored, but then it still takes effect.
        """
        if when not in _WHEN:
            raise InvalidValue(
                key="when", value=repr(when), reason=phrase("it must be one of {choices}", choices=", ".join(_WHEN))
            )
        await self._process.scheduler.pause(by.name, now=when == "now")
        return self.view()

    async def resume(self, by: Caller = LOCAL) -> QueueView:
        """Resume the queue and a held step; raises `AnswerNeeded` while an interrupted job waits for a decision."""
        await self._process.scheduler.resume(by.name)
        return self.view()

    async def step(self, by: Caller = LOCAL) -> QueueView:
        """Do one step and pause; while the queue runs, pause after the running step.

        Raises `AnswerNeeded` as `resume` does.
        """
        await self._process.scheduler.step(by.name)
        return self.view()

    async def clear(self, by: Caller = LOCAL) -> QueueView:
        """Cancel all waiting jobs, held ones included; the running job continues. Raises `StorageFailed`."""
        del by  # the audit log contains the caller's name
        await self._process.clear()
        return self.view()

    async def hold(self, number: int, by: Caller = LOCAL) -> JobLine:
        """Hold a waiting job; raises `NotFound`, `WrongState`, `NotAllowed`."""
        await self.require_over(number, Operation.CHANGE_JOB, by)
        await self._process.hold(number)
        return self._process.views.line(number)

    async def release(self, number: int, by: Caller = LOCAL, *, version: str = "") -> JobLine:
        """Release a held job to the queue; for a proposal, this is the approval.

        `version` is that of the report which the caller has seen: a changed job is not approved. Raises `NotFound`,
        `WrongState`, `NotAllowed`, `JobChanged`.
        """

        def allowed(job: JobLine | JobRow) -> None:
            if job.proposal and not job.approved_by:
                require(by, Operation.APPROVE)

        def require_allowed(job: JobRow) -> None:
            allowed(job)
            _require_version(job, version)

        line = await self._process.views.found_line(number)
        allowed(line)
        require_over(by, Operation.CHANGE_JOB, line.owner)
        await self._process.release(number, by.name, require_allowed)
        return self._process.views.line(number)

    async def move(
        self,
        number: int,
        *,
        before: int | None = None,
        after: int | None = None,
        to: str | None = None,
        by: Caller = LOCAL,
    ) -> JobLine:
        """Move a job `before` or `after` another waiting job, or `to` "first" or "last"; give exactly one of the three.

        The job gets the priority that this position requires. Raises `NotFound`, `WrongState`, `InvalidRequest`,
        `InvalidValue`, and `NotAllowed`, because jobs of other users then wait longer.
        """
        require(by, Operation.CHANGE_JOB)
        if sum(one is not None for one in (before, after, to)) != 1:
            raise InvalidRequest(key="to", reason="give one of before, after and to")
        if to is not None:
            if to not in _ENDS:
                raise InvalidValue(
                    key="to", value=repr(to), reason=phrase("it must be one of {choices}", choices=", ".join(_ENDS))
                )
            await self._process.move_to(number, last=to == "last")
        else:
            beside = before if before is not None else after
            assert beside is not None
            await self._process.move(number, beside, behind=after is not None)
        return self._process.views.line(number)

    async def change(
        self, number: int, changes: Mapping[str, object], by: Caller = LOCAL, *, version: str = ""
    ) -> JobLine:
        """Change a job before its start: priority, notes, depends_on, on_failure, retries, stepwise, job (its body).

        In a job that is paused between two steps, or interrupted, steps that have not started may be replaced. An
        approved job becomes a proposal again if a student changes it; once it has begun, a student cannot change it.
        `version` is that of the report which the caller has seen: a job that was changed since is left as it is. Raises
        `NotFound`, `WrongState`, `InvalidRequest`, `InvalidValue`, `InvalidJob`, `UnknownName`, `NotAllowed`,
        `JobChanged`.
        """
        line = await self._process.views.found_line(number)
        require_over(by, Operation.CHANGE_JOB, line.owner)
        await self._process.change(
            number, changes, lambda job: _require_version(job, version), approved=not self.proposes(by)
        )
        return self._process.views.line(number)

    async def again(self, number: int, *, from_step: int | None = None, by: Caller = LOCAL, key: str = "") -> JobLine:
        """Queue an ended job again as a new job, from `from_step` (from 1), by default the first step not done.

        A repeated request with the same `key` and owner returns the new job of the first one. Raises `NotFound`,
        `WrongState`, `InvalidValue`, `KeyReused`; `NotConnected` and `Faulted` while nothing can run.
        """
        asked = SubmitRequest(RequestOwner(by.name, by.source), DEFAULT_OPTIONS, key, proposal=self.proposes(by))
        new = await self._process.again(number, asked, from_step)
        return await self._process.views.found_line(new)

    async def recover(
        self,
        choice: str,
        holding: bool | None = None,
        *,
        resume_queue: bool = True,
        job: int | None = None,
        by: Caller = LOCAL,
    ) -> QueueView:
        """Decide about the interrupted job: resume, redo, skip or abort; `holding`: whether the gripper holds a part.

        `job` is the number of the job that was read.

        The rest of the job is checked as a whole from the current position, and refused like a motion (`NotHomed`,
        `PathRefused` and others); then the job still waits. With `resume_queue`, the queue continues, except after
        abort. Raises `NotFound` if no job is interrupted, or another one, `InvalidValue` for an unknown choice or an
        answer that contradicts the machine, `AnswerNeeded`.
        """
        await self._process.recover(choice, holding, resume_queue=resume_queue, job=job, by=by.name)
        return self.view()

    async def answer(
        self, answer: str, job: int | None = None, index: int | None = None, by: Caller = LOCAL
    ) -> QueueView:
        """Answer the question of the running job by one of its choices; the answer `cancel` ends the job.

        `job` and `index` name the question that was read. Raises `NotFound` if no question is open, or another one;
        `InvalidValue` for another answer, `StorageFailed`.
        """
        del by  # the audit log contains the caller's name
        await self._process.answer(answer, job, index)
        return self.view()

    def proposes(self, by: Caller) -> bool:
        """Return whether a job of `by` needs approval."""
        holder = self._lease.holder
        drives = holder is not None and holder.name == by.name and not holder.implicit
        return by.role < Role.OPERATOR and not drives  # a user whose job is running does not thereby drive

    async def require_over(self, number: int, operation: Operation, by: Caller) -> None:
        """Raise `NotAllowed` if `by` may not perform the operation on the job, `NotFound` for an unknown job."""
        line = await self._process.views.found_line(number)
        require_over(by, operation, line.owner)


def _require_version(job: JobRow, version: str) -> None:
    """Raise `JobChanged` if a client has seen another version; without one ("") any version will do."""
    if version and version != version_of(job):
        raise JobChanged(number=job.id)
