"""The journal in a file: what a coroutine wrote survives a power cut when it returns."""

from __future__ import annotations

import asyncio
import sqlite3
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeVar

from maya_un.config import StorageConfig
from maya_un.errors import FileUnwritable
from maya_un.process.journal import batches, faults, file, tables
from maya_un.process.journal.batches import Batches, Outcome, PendingWrite
from maya_un.process.journal.journal import SqlJournal, Work
from maya_un.process.journal.rows import AuditRow, EventRow

T = TypeVar("T")

_PRUNE_EVERY = 1000
"""Notes are counted against what is kept once in so many."""


class _Opened(NamedTuple):
    """The resources of an open file."""

    lock: file.JournalLock
    writer: sqlite3.Connection
    reader: sqlite3.Connection
    looker: sqlite3.Connection
    seen: file.FileIdentity
    run: int


class SqliteJournal(SqlJournal):
    """Keeps everything in one file, in WAL mode, with a commit on the disk before anybody goes on.

    One thread writes, another reads; both are outside the loop, so that neither a commit nor a page holds it.
    """

    def __init__(self, path: Path, opened: _Opened, keep: StorageConfig) -> None:
        super().__init__()
        self.path = path
        self._lock, self._writer, self._reader, self._looker, self._seen, self._run = opened
        self._keep = keep
        self._noted = 0
        self._reading = ThreadPoolExecutor(1, thread_name_prefix="journal reader")
        self._batches = Batches(self._commit)

    @classmethod
    async def open(cls, path: Path, keep: StorageConfig | None = None) -> SqliteJournal:
        """Open the file at `path`, or make it, and hold it until `close`; `keep` is how much of the past stays in it.

        Raises `StorageInUse`, `StorageDamaged`, `StorageTooNew`, `FileNotOurs`, `FileUnwritable`,
        `StorageUnavailable`; a file that is refused is left as it is.
        """
        keep = StorageConfig() if keep is None else keep
        return cls(path, await asyncio.get_running_loop().run_in_executor(None, _open, path, keep), keep)

    async def write(self, work: Work[T]) -> T:
        """Do `work` in the next batch."""
        return await self._batches.write(work)

    async def read(self, work: Work[T]) -> T:
        """Do `work` on the connection for reading."""
        return await asyncio.get_running_loop().run_in_executor(self._reading, self._read, work)

    def look(self, work: Work[T]) -> T:
        """Do `work` in the loop, on a separate connection, so other readers do not delay it."""
        try:
            return work(self._looker)
        except sqlite3.Error as error:
            raise faults.at_reading(error, self.path) from error

    def note(self, *rows: EventRow | AuditRow) -> None:
        """Keep events and audit entries with the next batch, within `batches.FLUSH` where there is none."""
        if rows:
            self._batches.note(partial(self._note, rows))

    @property
    def run(self) -> int:
        """How often the file was opened, this time included."""
        return self._run

    @property
    def failing(self) -> str:
        """Why the last batch could not be written, "" where it was; while notes wait it is tried again by itself."""
        return self._batches.failing

    @property
    def commits(self) -> int:
        """How many batches were written."""
        return self._batches.commits

    async def close(self) -> None:
        """Write what is noted, close the file, and let the next one in."""
        try:
            self._looker.close()
            await asyncio.get_running_loop().run_in_executor(self._reading, self._reader.close)
            self._reading.shutdown()
            await self._batches.close(self._writer.close)
        finally:
            self._lock.release()

    def _commit(self, batch: Sequence[PendingWrite]) -> list[Outcome]:
        """Write a batch, in the writer's thread; raises `StorageFailed`."""
        try:
            self._seen.require()
            outcomes = batches.commit(self._writer, batch)
            self._seen.require()
        except (sqlite3.Error, OSError) as error:
            self._bodies.forget()
            raise faults.at_writing(error) from error
        if any(error for _, error in outcomes):
            self._bodies.forget()
        return outcomes

    def _note(self, rows: Sequence[EventRow | AuditRow], connection: sqlite3.Connection) -> None:
        tables.note(connection, rows)
        self._noted += len(rows)
        if self._noted >= _PRUNE_EVERY:
            self._noted = 0
            tables.prune(connection, self._keep)

    def _read(self, work: Work[T]) -> T:
        try:
            return work(self._reader)
        except sqlite3.Error as error:
            raise faults.at_reading(error, self.path) from error


def _open(path: Path, keep: StorageConfig) -> _Opened:
    """Lock, check and count; nothing stays open where something is raised."""
    with ExitStack() as undo:
        try:
            file.require_database(path)
            path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            lock = file.JournalLock(path)
            undo.callback(lock.release)
            writer = file.open_for_writing(path)
            undo.callback(writer.close)
            run = _counted(writer, keep)
            reader = file.open_for_reading(path)
            undo.callback(reader.close)
            looker = file.open_for_reading(path)
            undo.callback(looker.close)
            opened = _Opened(lock, writer, reader, looker, file.FileIdentity(path), run)
        except (sqlite3.Error, OSError) as error:
            raise faults.at_opening(error, path) from error
        except FileUnwritable as error:
            if isinstance(error.__cause__, OSError) and faults.is_passing(error.__cause__, path):
                raise faults.at_opening(error.__cause__, path) from error
            raise
        undo.pop_all()
        return opened


def _counted(writer: sqlite3.Connection, keep: StorageConfig) -> int:
    """Write that the file was opened once more, which shows at once whether it can be written."""
    writer.execute("BEGIN IMMEDIATE")
    run = tables.begin_run(writer)
    tables.prune(writer, keep)
    writer.execute("COMMIT")
    return run
