"""A journal in an SQLite database, whoever runs its statements: in a thread with a commit for many, or at once."""

from __future__ import annotations

import sqlite3
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import TypeVar

from maya_un.process.journal import listing, tables
from maya_un.process.journal.protocol import Filter
from maya_un.process.journal.rows import AuditRow, EventRow, JobRow, StepRow, UnendedJobs, Unfinished
from maya_un.process.journal.tables import Bodies, Change

T = TypeVar("T")

Work = Callable[[sqlite3.Connection], T]
"""Statements on a connection; whoever calls it begins and ends the transaction."""


class SqlJournal(ABC):
    """The common part of both journals; see `protocol.Journal` for the meaning of each method."""

    def __init__(self) -> None:
        self._bodies = Bodies()

    @abstractmethod
    async def write(self, work: Work[T]) -> T:
        """Do `work` within a transaction and return what it returns, once it is on the disk.

        All of it is kept or none: raises `StorageFailed` where the database refuses, and whatever `work` raises itself.
        For neighbours who keep tables of their own in this file. Somebody who is cancelled while he waits does not
        know whether it was kept.
        """

    @abstractmethod
    async def read(self, work: Work[T]) -> T:
        """Return what `work` reads of what was written; it never waits for a write. Raises `StorageDamaged`."""

    @abstractmethod
    def note(self, *rows: EventRow | AuditRow) -> None:
        """Keep events and audit entries soon, before any later `save`."""

    @abstractmethod
    def look(self, work: Work[T]) -> T:
        """Return what `work` reads at once, in the loop: one row, or a few. Raises `StorageDamaged`."""

    async def left(self) -> UnendedJobs:
        """Return unfinished jobs; of waiting jobs, only their places."""
        return await self.read(tables.left)

    def waiting_job(self, number: int) -> JobRow | None:
        """Return a waiting job, at once; None if there is none."""
        return self.look(lambda connection: tables.waiting_job(connection, number))

    def waiting_of(self, owner: str) -> list[int]:
        """Return the numbers of an owner's waiting jobs, at once."""
        return self.look(lambda connection: tables.waiting_of(connection, owner))

    async def names_of(self, numbers: Sequence[int]) -> list[tuple[int, str, str]]:
        """Return numbers, names and owners of jobs."""
        return await self.read(lambda connection: tables.names_of(connection, numbers))

    async def probe(self) -> None:
        """Write a row and roll it back, to check whether the file can be written; raises `StorageFailed`."""
        await self.write(tables.probe)

    async def unfinished(self) -> Unfinished:
        """Return the queue's mode and every job that has not ended; to be asked before anything is written."""
        return await self.read(tables.unfinished)

    async def add(self, *jobs: JobRow) -> None:
        """Keep new jobs, all of them or none."""
        await self.write(lambda connection: tables.add(connection, self._bodies, jobs))

    async def save(self, *changes: Change) -> None:
        """Keep newer versions, all of them or none; the body of a job is written where it is another object."""
        await self.write(lambda connection: tables.save(connection, self._bodies, changes))

    async def job(self, number: int) -> tuple[JobRow, tuple[StepRow, ...]] | None:
        """Return a job and its steps, None where there is none."""
        return await self.read(lambda connection: tables.job(connection, number))

    async def keyed(self, owner: str, key: str) -> JobRow | None:
        """Return the job of an owner's idempotency key, None where there is none."""
        return await self.read(lambda connection: tables.keyed(connection, owner, key))

    async def page(self, which: Filter) -> list[JobRow]:
        """Return a page of jobs without their bodies, at most `listing.MOST`."""
        return await self.read(lambda connection: listing.page(connection, which))

    async def events(self, run: int, above: int, limit: int) -> list[EventRow]:
        """Return events of a run above a number, oldest first."""
        return await self.read(lambda connection: tables.events(connection, run, above, limit))

    async def audit(self, below: int | None, limit: int) -> Sequence[tuple[int, AuditRow]]:
        """Return numbered audit entries below a number, newest first."""
        return await self.read(lambda connection: tables.audit(connection, below, limit))
