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
"""Writes that nobody waits for are written after at most this time [s]."""

RETRY = 2.0
"""After a failure it is tried again after so long [s]."""

MOST_NOTES = 20_000
"""So many notes are held while nothing can be written; then the oldest are dropped."""

Outcome = tuple[Any, BaseException | None]
"""The result of a piece of work, or its error."""


@dataclass(frozen=True, slots=True, eq=False)
class PendingWrite:
    """Work to be written; `done` is who waits for it, None for a note."""

    work: Callable[[sqlite3.Connection], Any]
    done: asyncio.Future[Any] | None = None


Commit = Callable[[Sequence[PendingWrite]], list[Outcome]]
"""Writes a batch in its thread; raises `StorageFailed` where nothing of it was kept."""


class Batches:
    """Collects work in the loop, and has it written in a thread of its own, one batch after the other, in order."""

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
        """Return what `work` returned, once its batch is on the disk; raises what it raised, or `StorageFailed`."""
        if self._closed:
            raise StorageFailed(reason="the journal is closed")
        asked = PendingWrite(work, asyncio.get_running_loop().create_future())
        self._asked.append(asked)
        self._begin_soon()
        assert asked.done is not None
        return await asked.done

    def note(self, work: Callable[[sqlite3.Connection], Any]) -> None:
        """Have `work` written with the next batch; what it raises is told to the loop, for nobody waits."""
        if self._closed:
            return
        self._asked.append(PendingWrite(work))
        self._flush_after(FLUSH)

    async def close(self, last: Callable[[], None]) -> None:
        """Write what was asked for, then call `last` in the thread, and end it."""
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
        """Set the timer, where none is set; None takes it away."""
        if delay is None and self._timer is not None:
            self._timer.cancel()
            self._timer = None
        elif delay is not None and self._timer is None and not self._writing:
            self._timer = asyncio.get_running_loop().call_later(delay, self._begin)

    def _begin_soon(self) -> None:
        """Begin when everybody who is ready now has asked too."""
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
        """Tell everybody who waits, and begin the next batch where somebody asked meanwhile."""
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
        """Tell everybody who waits, and keep the notes for another time, unless this was the last."""
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
    """Do all of a batch in one transaction, each piece of work whole or not at all; raises `sqlite3.Error`.

    After an error of the disk SQLite may have ended the transaction by itself; then nothing was kept.
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
