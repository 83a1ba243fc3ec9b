"""Group commit: writes that arrive during a commit form the next batch, and share its commit."""

from __future__ import annotations

import asyncio
import sqlite3
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from maya_un.errors import StorageFailed
from maya_un.process.journal import file

FLUSH = 0.25
"""Longest delay of writes that no task awaits [s]."""

RETRY = 2.0
"""Time between a failed write and the next attempt [s]."""

MOST_NOTES = 20_000
"""Most notes in memory while nothing can be written; beyond it the oldest are dropped."""

Outcome = tuple[Any, BaseException | None]
"""The result of a piece of work, or its error."""


@dataclass(frozen=True, slots=True, eq=False)
class PendingWrite:
    """Work to be written; `done` is the future of the caller, None for a note."""

    work: Callable[[sqlite3.Connection], Any]
    done: asyncio.Future[Any] | None = None


Commit = Callable[[Sequence[PendingWrite]], list[Outcome]]
"""Writes a batch in its thread; raises `StorageFailed` if nothing of it was stored."""


class Batches:
    """Collects work in the loop, and writes it in a separate thread, one batch after the other, in order."""

    def __init__(self, commit: Commit) -> None:
        self._commit = commit
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="journal")
        self._asked: list[PendingWrite] = []
        self._writing = False
        self._timer: asyncio.TimerHandle | None = None
        self._idle = asyncio.Event()
        self._closed = False
        self.failing = ""
        self.commits = 0

    async def write(self, work: Callable[[sqlite3.Connection], Any]) -> Any:
        """Return the result of `work` once its batch is on the disk; raises the error of `work`, or `StorageFailed`."""
        if self._closed:
            raise StorageFailed(reason="the journal is closed")
        asked = PendingWrite(work, asyncio.get_running_loop().create_future())
        self._asked.append(asked)
        self._begin_soon()
        assert asked.done is not None
        return await asked.done

    def note(self, work: Callable[[sqlite3.Connection], Any]) -> None:
        """Schedule `work` for the next batch; the loop's exception handler gets its error."""
        if self._closed:
            return
        self._asked.append(PendingWrite(work))
        self._flush_after(FLUSH)

    async def close(self, last: Callable[[], None]) -> None:
        """Write all pending work, then call `last` in the thread, and end the thread."""
        self._closed = True
        self._flush_after(None)
        try:
            while self._writing or self._asked:
                self._begin_soon()
                self._idle.clear()
                await self._idle.wait()
        finally:
            await asyncio.get_running_loop().run_in_executor(self._thread, last)
            self._thread.shutdown()

    def _flush_after(self, delay: float | None) -> None:
        """Start the timer unless it runs; None cancels it."""
        if delay is None and self._timer is not None:
            self._timer.cancel()
            self._timer = None
        elif delay is not None and self._timer is None and not self._writing:
            self._timer = asyncio.get_running_loop().call_later(delay, self._begin)

    def _begin_soon(self) -> None:
        """Start the next batch after the tasks that are ready now have added their work."""
        if not self._writing:
            self._writing = True
            self._flush_after(None)
            asyncio.get_running_loop().call_soon(self._begin)

    def _begin(self) -> None:
        self._flush_after(None)
        self._writing = True
        batch, self._asked = self._asked, []
        written = asyncio.get_running_loop().run_in_executor(self._thread, self._commit, batch)
        written.add_done_callback(lambda future: self._ended(batch, future))

    def _ended(self, batch: list[PendingWrite], written: asyncio.Future[list[Outcome]]) -> None:
        """Return results to the waiting callers, and start the next batch if more work has come."""
        self._writing = False
        failure = written.exception()
        if failure is None:
            self.failing = ""
            self.commits += 1
            _tell(batch, written.result())
        else:
            self._failed(batch, failure)
        if any(asked.done is not None for asked in self._asked):
            self._begin_soon()
        elif self._asked:
            self._flush_after(FLUSH if failure is None else RETRY)
        if not self._writing:
            self._idle.set()

    def _failed(self, batch: list[PendingWrite], failure: BaseException) -> None:
        """Return the error to the waiting callers, and keep the notes for the next attempt, unless closed."""
        self.failing = str(failure.details["reason"]) if isinstance(failure, StorageFailed) else repr(failure)
        waiting = [asked for asked in batch if asked.done is not None]
        _tell(waiting, [(None, failure)] * len(waiting))
        notes = [asked for asked in batch if asked.done is None]
        if not self._closed:
            self._asked[:0] = notes[-MOST_NOTES:]


def _tell(batch: Sequence[PendingWrite], outcomes: Sequence[Outcome]) -> None:
    for asked, (result, error) in zip(batch, outcomes, strict=True):
        if asked.done is None:
            if error is not None:
                context = {"message": "a note could not be written", "exception": error}
                asyncio.get_running_loop().call_exception_handler(context)
        elif asked.done.done():
            continue
        elif error is None:
            asked.done.set_result(result)
        else:
            asked.done.set_exception(error)


def commit(connection: sqlite3.Connection, batch: Sequence[PendingWrite]) -> list[Outcome]:
    """Do a batch in one transaction, each piece of work as a whole or not at all; raises `sqlite3.Error`.

    After a disk error SQLite may have ended the transaction by itself; then nothing was stored.
    """
    connection.execute("BEGIN IMMEDIATE")
    try:
        outcomes = [_one(connection, asked) for asked in batch]
        connection.execute("COMMIT")
    except BaseException:
        if connection.in_transaction:
            connection.execute("ROLLBACK")
        raise
    return outcomes


def _one(connection: sqlite3.Connection, asked: PendingWrite) -> Outcome:
    connection.execute("SAVEPOINT one")
    try:
        result = asked.work(connection)
    except Exception as error:
        if not connection.in_transaction:
            raise
        connection.execute("ROLLBACK TO one")
        connection.execute("RELEASE one")
        return None, file.writing_error(error) if isinstance(error, sqlite3.Error) else error
    connection.execute("RELEASE one")
    return result, None
