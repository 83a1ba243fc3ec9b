"""The journal in SQLite: in a file, or in memory for a dry run.

A write to the file survives a power cut once its coroutine returns.
"""

from __future__ import annotations

import asyncio
import sqlite3
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeVar

from maya_un.config import StorageConfig
from maya_un.errors import FileUnwritable, StorageFailed
from maya_un.process.journal import file, group_commit, history, tables
from maya_un.process.journal.group_commit import Batches, Outcome, PendingWrite
from maya_un.process.journal.protocol import AuditRow, EventRow, Filter, JobRow, StepRow, UnendedJobs, Unfinished
from maya_un.process.journal.tables import Bodies, Change

T = TypeVar("T")

Work = Callable[[sqlite3.Connection], T]
"""Statements on a connection; the caller begins and ends the transaction."""


class SqlJournal(ABC):
    """The common part of both journals; see `protocol.Journal` for the meaning of each method."""

    def __init__(self) -> None:
        self._bodies = Bodies()

    @abstractmethod
    async def write(self, work: Work[T]) -> T:
        """Do `work` within a transaction and return its result, once it is on the disk.

        All of it is stored or nothing: raises `StorageFailed` if the database fails, and the errors of `work`. Other
        modules use it for their tables in this file. A caller that is cancelled while it waits cannot know whether the
        data was stored.
        """

    @abstractmethod
    async def read(self, work: Work[T]) -> T:
        """Return the result of `work` on written data; never waits for a write. Raises `StorageDamaged`."""

    @abstractmethod
    def note(self, *rows: EventRow | AuditRow) -> None:
        """Store events and audit entries soon, before any later `save`."""

    @abstractmethod
    def look(self, work: Work[T]) -> T:
        """Return the result of `work` at once, in the loop: one row, or a few. Raises `StorageDamaged`."""

    async def left(self) -> UnendedJobs:
        """Return unfinished jobs; of waiting jobs, only their places."""
        return await self.read(tables.unended_jobs)

    def waiting_job(self, number: int) -> JobRow | None:
        """Return a waiting job without suspending; None without one."""
        return self.look(lambda connection: tables.waiting_job(connection, number))

    def waiting_of(self, owner: str) -> list[int]:
        """Return the numbers of an owner's waiting jobs without suspending."""
        return self.look(lambda connection: tables.waiting_of(connection, owner))

    async def names_of(self, numbers: Sequence[int]) -> list[tuple[int, str, str]]:
        """Return numbers, names and owners of jobs."""
        return await self.read(lambda connection: tables.names_of(connection, numbers))

    async def probe(self) -> None:
        """Write a row and roll it back, to check whether the file can be written; raises `StorageFailed`."""
        await self.write(tables.probe)

    async def unfinished(self) -> Unfinished:
        """Return the queue's mode and every job that has not ended; call it before anything is written."""
        return await self.read(tables.unfinished)

    async def add(self, *jobs: JobRow) -> None:
        """Store new jobs, all of them or none."""
        await self.write(lambda connection: tables.add(connection, self._bodies, jobs))

    async def save(self, *changes: Change) -> None:
        """Store newer versions, all of them or none; a job's body is written only if it is another object."""
        await self.write(lambda connection: tables.save(connection, self._bodies, changes))

    async def job(self, number: int) -> tuple[JobRow, tuple[StepRow, ...]] | None:
        """Return a job and its steps, None if it does not exist."""
        return await self.read(lambda connection: tables.job(connection, number))

    async def keyed(self, owner: str, key: str) -> JobRow | None:
        """Return the job of an owner's idempotency key, None without one."""
        return await self.read(lambda connection: tables.keyed(connection, owner, key))

    async def page(self, which: Filter) -> list[JobRow]:
        """Return a page of jobs without their bodies, at most `history.LONGEST_PAGE`."""
        return await self.read(lambda connection: history.page(connection, which))

    async def events(self, run: int, above: int, limit: int) -> list[EventRow]:
        """Return events of a run above a number, oldest first."""
        return await self.read(lambda connection: tables.events(connection, run, above, limit))

    async def audit(self, below: int | None, limit: int) -> Sequence[tuple[int, AuditRow]]:
        """Return numbered audit entries below a number, newest first."""
        return await self.read(lambda connection: tables.audit(connection, below, limit))


class MemoryJournal(SqlJournal):
    """Stores everything in memory, in the caller's thread: no write ever waits."""

    def __init__(self) -> None:
        super().__init__()
        self._connection = sqlite3.connect(":memory:", isolation_level=None)
        tables.migrate(self._connection, ":memory:")
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
                raise file.writing_error(error) from error
            raise
        return result

    async def read(self, work: Work[T]) -> T:
        """Return what `work` reads."""
        return work(self._connection)

    def look(self, work: Work[T]) -> T:
        """Return what `work` reads."""
        return work(self._connection)

    def note(self, *rows: EventRow | AuditRow) -> None:
        """Store events and audit entries."""
        if not self._closed:
            tables.note(self._connection, rows)

    @property
    def run(self) -> int:
        """Always 1."""
        return self._run

    @property
    def failing(self) -> str:
        """Always "": memory does not fail."""
        return ""

    async def close(self) -> None:
        """Drop everything."""
        self._closed = True
        self._connection.close()


_PRUNE_EVERY = 1000
"""Number of notes between two prunings of the file."""


class _Opened(NamedTuple):
    """The resources of an open file."""

    lock: file.JournalLock
    writer: sqlite3.Connection
    reader: sqlite3.Connection
    looker: sqlite3.Connection
    seen: file.FileIdentity
    run: int


class SqliteJournal(SqlJournal):
    """Stores everything in one file, in WAL mode; a write returns after its commit is on the disk.

    One thread writes, another reads; both are outside the loop, so that neither a commit nor a page blocks it.
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
        """Open the file at `path`, create it if missing, and lock it until `close`; `keep` limits the history in it.

        Raises `StorageInUse`, `StorageDamaged`, `StorageTooNew`, `FileNotOurs`, `FileUnwritable`, `StorageUnavailable`;
        a refused file stays unchanged.
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
            raise file.reading_error(error, self.path) from error

    def note(self, *rows: EventRow | AuditRow) -> None:
        """Store events and audit entries with the next batch, at the latest after `group_commit.FLUSH`."""
        if rows:
            self._batches.note(partial(self._note, rows))

    @property
    def run(self) -> int:
        """Number of times that the file was opened, this time included."""
        return self._run

    @property
    def failing(self) -> str:
        """Why the last batch could not be written, "" if it was; while notes wait, writing is retried automatically."""
        return self._batches.failing

    @property
    def commits(self) -> int:
        """Number of written batches."""
        return self._batches.commits

    async def close(self) -> None:
        """Write pending notes, close the file, and release its lock."""
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
            outcomes = group_commit.commit(self._writer, batch)
            self._seen.require()
        except (sqlite3.Error, OSError) as error:
            self._bodies.forget()
            raise file.writing_error(error) from error
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
            raise file.reading_error(error, self.path) from error


def _open(path: Path, keep: StorageConfig) -> _Opened:
    """Lock and check the file, and count the run; after an error nothing stays open."""
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
            raise file.opening_error(error, path) from error
        except FileUnwritable as error:
            if isinstance(error.__cause__, OSError) and file.is_passing(error.__cause__, path):
                raise file.opening_error(error.__cause__, path) from error
            raise
        undo.pop_all()
        return opened


def _counted(writer: sqlite3.Connection, keep: StorageConfig) -> int:
    """Write that the file was opened once more, which also shows whether it can be written; return the run's number."""
    writer.execute("BEGIN IMMEDIATE")
    run = tables.begin_run(writer)
    tables.prune(writer, keep)
    writer.execute("COMMIT")
    return run
