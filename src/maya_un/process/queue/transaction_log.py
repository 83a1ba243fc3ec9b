"""Written before announced: every change of the queue goes through here, one after the other.

A beginning is written first, or does not happen. An event that has happened anyway (a step that ended) stays in memory
if it cannot be written; it is written and announced as soon as the storage works again.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import NamedTuple

from maya_un.errors import StorageFailed
from maya_un.events import EventLog, StorageChanged
from maya_un.process.journal.protocol import ClearedJobs, JobRow, Journal, QueueRow, StepRow

RETRY = 2.0
"""A failed write is repeated after this time [s]."""

Change = JobRow | QueueRow | ClearedJobs | tuple[int, StepRow]
"""A record of the journal: a job, the queue's mode, a step of a job, the end of many jobs."""


def _nothing() -> None:
    """Do nothing."""


class Transaction(NamedTuple):
    """A change: its rows, how it is made in memory once they are written, how it is told then.

    One that is `sure` has happened already: where it cannot be written it is made in memory all the same, and told once
    it is written.
    """

    rows: tuple[Change, ...]
    make: Callable[[], None] = _nothing
    tell: Callable[[], None] = _nothing
    sure: bool = False


class TransactionLog:
    """Writes changes to a journal, in order, and tells of them in `events`.

    `on_failure` is called where something that has happened, or is about to begin, cannot be written, `on_success`
    when it can again.
    """

    def __init__(self, journal: Journal, events: EventLog) -> None:
        self.journal = journal
        self.on_failure: Callable[[], None] = _nothing
        self.on_success: Callable[[], None] = _nothing
        self._events = events
        self._turn = asyncio.Lock()
        self._unwritten: list[Transaction] = []
        self._failing = ""
        self._closed = False
        self._retry: asyncio.TimerHandle | None = None
        self._task: asyncio.Task[None] | None = None

    @property
    def failing(self) -> str:
        """Why the last change could not be written, "" where it was."""
        return self._failing

    async def write(self, propose: Callable[[], Sequence[Transaction]]) -> None:
        """Write what `propose` returns, all of it or none, make it so, and tell it.

        `propose` is called when it is this change's turn: what it looks at does not change before it is written.
        Raises what `propose` raises, and `StorageFailed`; entries that are sure are kept then, the others are not made.
        """
        async with self._turn:
            entries = propose()
            if entries or self._unwritten:
                await self._write(entries)

    async def flush(self) -> None:
        """Write what is still unwritten; raises `StorageFailed`."""
        await self.write(tuple)

    async def check(self) -> None:
        """Check whether the journal can be written; if not, pause the queue as after any such failure."""
        if self._closed:
            return
        async with self._turn:
            try:
                await self.journal.probe()
            except StorageFailed as error:
                self._failed((), error)
                return
            if self._failing and not self._unwritten:
                self._works()
                self.on_success()
        if self._failing:
            with suppress(StorageFailed):
                await self.flush()

    async def close(self) -> None:
        """Write what can be written; what cannot is lost with this run."""
        self._closed = True
        if self._task is not None:
            await asyncio.wait({self._task})
        with suppress(StorageFailed):
            await self.flush()
        self._set_retry(None)

    async def _write(self, entries: Sequence[Transaction]) -> None:
        older = tuple(self._unwritten)
        rows = [row for entry in (*older, *entries) for row in entry.rows]
        try:
            if rows:
                await self.journal.save(*rows)
        except StorageFailed as error:
            self._failed(entries, error)
            raise
        del self._unwritten[: len(older)]
        for entry in entries:
            entry.make()
        worked = not self._failing
        self._works()
        for entry in (*older, *entries):
            entry.tell()
        if not worked:
            self.on_success()

    def _failed(self, entries: Sequence[Transaction], error: StorageFailed) -> None:
        for entry in entries:
            if entry.sure:
                entry.make()
                self._unwritten.append(entry)
        before, self._failing = self._failing, str(error.details["reason"])
        if not before:
            self._events.emit(StorageChanged("failing", self._failing, code=error.code))
        self.on_failure()
        if self._unwritten and self._retry is None:
            self._set_retry(RETRY)

    def soon(self, entry: Transaction) -> None:
        """Have a change written that is made already, without waiting for it."""
        self._unwritten.append(entry)
        if self._retry is None and self._task is None and not self._closed:
            self._try_again()

    def _works(self) -> None:
        self._set_retry(None)
        if self._failing:
            self._failing = ""
            self._events.emit(StorageChanged("working"))

    def _set_retry(self, delay: float | None) -> None:
        if self._retry is not None:
            self._retry.cancel()
        loop = asyncio.get_running_loop()
        self._retry = None if delay is None or self._closed else loop.call_later(delay, self._try_again)

    def _try_again(self) -> None:
        self._set_retry(None)
        self._task = asyncio.get_running_loop().create_task(self._tried(), name="journal once more")

    async def _tried(self) -> None:
        try:
            while self._unwritten:
                await self.flush()
        except StorageFailed:
            self._set_retry(RETRY)
        finally:
            self._task = None
