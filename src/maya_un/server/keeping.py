"""The paths of what is kept for administrators: the audit log, and a backup of the journal."""

from __future__ import annotations

import asyncio
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

from fastapi import Query, Response
from starlette.background import BackgroundTask
from starlette.responses import FileResponse

from maya_un.api.access.operations import Operation
from maya_un.api.service import Service
from maya_un.errors import FileUnwritable, NotFound, StorageDamaged
from maya_un.process.journal import backup
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.schema.people import AuditLine
from maya_un.server.asking import Ask
from maya_un.server.bridge import Bridge
from maya_un.server.dates import now
from maya_un.server.exchange import answer
from maya_un.server.numbers import MOST
from maya_un.server.routes import AT_REST, Routes

_TAG = "keeping"
_SQLITE = "application/vnd.sqlite3"


def add_keeping(routes: Routes, bridge: Bridge) -> None:
    """Add the paths."""

    @routes.add("GET", "/v1/audit", Operation.AUDIT, tag=_TAG, gives=list[AuditLine], client="history.audit")
    async def audit(
        ask: Ask,
        below: Annotated[int | None, Query(ge=0, le=MOST, description="numbered below")] = None,
        limit: Annotated[int, Query(ge=1, le=1000, description="so many at most")] = 100,
    ) -> Response:
        """Return requests and their results, newest first, numbered below `below`."""
        return answer(await ask(lambda service: service.history.audit(below, limit)))

    refuses = (NotFound, FileUnwritable, StorageDamaged)

    @routes.add(
        "POST", "/v1/backup", Operation.BACKUP, tag=_TAG, gives=bytes, media=_SQLITE, refuses=refuses, patience=AT_REST
    )
    async def back_up(ask: Ask) -> Response:
        """Send a copy of the journal's file as it is at this instant: the queue, its history, users, the audit log."""

        async def kept(_service: Service) -> Path:
            if not isinstance(bridge.journal, SqliteJournal):
                raise NotFound(what="journal", number="in a file")
            return bridge.journal.path

        return await _copied(await ask(kept))


async def _copied(journal: Path) -> Response:
    folder = TemporaryDirectory(prefix="maya-backup-")
    copy = Path(folder.name) / journal.name
    try:
        await asyncio.get_running_loop().run_in_executor(None, backup.make, journal, copy)
    except BaseException:
        folder.cleanup()
        raise
    name = f"maya-{now()[:19].replace(':', '-')}.db"
    return FileResponse(copy, media_type=_SQLITE, filename=name, background=BackgroundTask(folder.cleanup))
