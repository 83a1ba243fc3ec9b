"""The journal of a dry run: the same tables in memory, for as long as it lives."""

from __future__ import annotations

import sqlite3
from typing import TypeVar

from maya_un.errors import StorageFailed
from maya_un.process.journal import faults, schema, tables
from maya_un.process.journal.journal import SqlJournal, Work
from maya_un.process.journal.rows import AuditRow, EventRow

T = TypeVar("T")


class MemoryJournal(SqlJournal):
    """Keeps everything in memory, in the caller's thread: no write ever waits."""

    def __init__(self) -> None:
        super().__init__()
        self._connection = sqlite3.connect(":memory:", isolation_level=None)
        schema.migrate(self._connection, ":memory:")
        self._run = tables.begin_run(self._connection)
        self._closed = False

    async def write(self, work: Work[T]) -> T:
        """Do `work` within a transaction."""
        if self._closed:
            raise StorageFailed(reason="the journal is closed")
        self._connection.execute("BEGIN")
        try:
            result = work(self._connection)
            self._connection.execute("COMMIT")
        except BaseException as error:
            self._bodies.forget()
            self._connection.execute("ROLLBACK")
            if isinstance(error, sqlite3.Error):
                raise faults.at_writing(error) from error
            raise
        return result

    async def read(self, work: Work[T]) -> T:
        """Return what `work` reads."""
        return work(self._connection)

    def look(self, work: Work[T]) -> T:
        """Return what `work` reads."""
        return work(self._connection)

    def note(self, *rows: EventRow | AuditRow) -> None:
        """Keep events and audit entries."""
        if not self._closed:
            tables.note(self._connection, rows)

    @property
    def run(self) -> int:
        """Always the first."""
        return self._run

    @property
    def failing(self) -> str:
        """Memory does not fail."""
        return ""

    async def close(self) -> None:
        """Forget everything."""
        self._closed = True
        self._connection.close()
