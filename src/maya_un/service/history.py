"""History for the service: ended jobs, reports, events, the audit log, and recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from maya_un.errors import EventsForgotten, InvalidRequest, NotFound
from maya_un.events import EventLog
from maya_un.process.journal.protocol import AuditRow, EventRow, Filter
from maya_un.process.process import Process
from maya_un.recorder.recorder import Recorder
from maya_un.recorder.recording import SavingCause
from maya_un.schema.jobs import JobLine, JobReport
from maya_un.schema.people import AuditLine
from maya_un.schema.robot import EventMessage, Kept
from maya_un.service.access.operations import LOCAL, Caller


class RecordingService:
    """Asks the flight recorder; without one, or with one that keeps no files, there are no recordings."""

    def __init__(self, recorder: Recorder | None = None) -> None:
        self._recorder = recorder

    def list(self) -> list[Kept]:
        """Return the recordings that are kept, newest first; a line each: name, date, reason, size in bytes."""
        shelf = None if self._recorder is None else self._recorder.shelf
        return [] if shelf is None else shelf.list()

    async def save(self, by: Caller = LOCAL) -> Kept:
        """Save the last minutes now and return the line of the recording.

        Raises `FileUnwritable`, and `InvalidRequest` where no recorder runs (`recorder.enabled`, dry runs).
        """
        cause = SavingCause(message=f"asked by {by.name}")
        kept = None if self._recorder is None else await self._recorder.save("asked", cause)
        if kept is None:
            raise InvalidRequest(key="recorder", reason="nothing is recorded here")
        return kept

    def path(self, name: str) -> Path:
        """Return the file of a recording (MCAP); raises `NotFound`."""
        shelf = None if self._recorder is None else self._recorder.shelf
        if shelf is None:
            raise NotFound(what="recording", number=name)
        return shelf.path(name)


MOST_EVENTS = 1000
"""So many events are answered at once."""


class HistoryService:
    """Reads what the journal of `process` keeps, with what is under way as it is now, and the `events` in memory."""

    def __init__(self, process: Process, events: EventLog) -> None:
        self._process = process
        self._journal = process.journal
        self._slices = process.shown.slices
        self._events = events

    async def page(self, which: Filter) -> list[JobLine]:
        """Return a page of jobs, newest first unless asked otherwise."""
        return await self._process.shown.page(which)

    async def job(self, number: int) -> JobReport:
        """Return what is known of a job, also of one long ended; raises `NotFound`."""
        return await self._process.shown.report(number)

    async def body(self, number: int) -> dict[str, Any]:
        """Return a job as it was submitted, or its command; raises `NotFound`."""
        return await self._process.shown.body(number)

    async def events(self, run: int, above: int = 0, limit: int = MOST_EVENTS) -> list[EventMessage]:
        """Return events of a run numbered above `above`, oldest first; raises `EventsForgotten`.

        Of a run that is over there may be none any more, then none are returned.
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
        """Return what was asked for and what came of it, newest first, numbered below `below`."""
        rows = await self._journal.audit(below, max(0, min(limit, 1000)))
        return await self._slices.each(_line, rows)


def _message(row: EventRow) -> EventMessage:
    return EventMessage(row.seq, row.time, row.kind, row.code, row.detail)


def _line(numbered: tuple[int, AuditRow]) -> AuditLine:
    number, row = numbered
    return AuditLine(number, row.date, row.who, row.role, row.source, row.operation, row.code, row.detail)
