"""What happened, at the door: jobs of all times, their reports, events, the audit log."""

from __future__ import annotations

from typing import Any

from maya_un.api.messages import AuditLine, EventMessage
from maya_un.process.journal.protocol import Filter
from maya_un.process.report import JobReport
from maya_un.process.view import JobLine


class History:
    """Reads what a journal keeps, with what is under way as it is now."""

    async def page(self, which: Filter) -> list[JobLine]:
        """Return a page of jobs, newest first unless asked otherwise."""
        raise NotImplementedError

    async def job(self, number: int) -> JobReport:
        """Return what is known of a job, also of one long ended; raises `NotFound`."""
        raise NotImplementedError

    async def body(self, number: int) -> dict[str, Any]:
        """Return a job as it was written, or the wish that it is; raises `NotFound`."""
        raise NotImplementedError

    async def events(self, run: int, above: int = 0, limit: int = 1000) -> list[EventMessage]:
        """Return events of a run numbered above `above`, oldest first; raises `EventsForgotten`."""
        raise NotImplementedError

    async def audit(self, below: int | None = None, limit: int = 100) -> list[AuditLine]:
        """Return what was asked for and what came of it, newest first, numbered below `below`."""
        raise NotImplementedError
