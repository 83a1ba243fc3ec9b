"""Change entries of the queue, each change written to the journal before it is announced.

Changes are written one after the other. A start is written first, or does not happen. An event that has already
happened (a step that ended) stays in memory if it cannot be written; it is written and announced as soon as the storage
works again.

Changes of jobs, of steps and of the queue's pause are transactions.

A pause takes effect at once, and is stored and announced after that. The queue resumes only after the change is stored.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, NamedTuple

from maya_un.errors import DependencyFailed, StorageFailed
from maya_un.events import EventLog, JobAdvanced, QueueChanged, StepAdvanced, StorageChanged
from maya_un.process.journal.protocol import ClearedJobs, JobRow, Journal, QueueRow, StepRow
from maya_un.process.queue.entries import QueueEntries, QueueEntry
from maya_un.process.queue.report import StepRecord
from maya_un.schema.jobs import PauseReason, TaskState, advance
from maya_un.values import Notice

RETRY = 2.0
"""A failed write is repeated after this time [s]."""

Change = JobRow | QueueRow | ClearedJobs | tuple[int, StepRow]
"""A record of the journal: a job, the queue's mode, a step of a job, the end of many jobs."""


def _nothing() -> None:
    """Do nothing."""


class Transaction(NamedTuple):
    """A change: its rows, `make` to apply it in memory after the write, `tell` to announce it after that.

    A `sure` change has already happened: if it cannot be written, it is applied in memory all the same, and announced
    once it is written.
    """

    rows: tuple[Change, ...]
    make: Callable[[], None] = _nothing
    tell: Callable[[], None] = _nothing
    sure: bool = False


class TransactionLog:
    """Writes changes to a journal, in order, and announces them in `events`.

    Calls `on_failure` when a write fails, `on_success` when writing works again.
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
        """Why the last change could not be written, "" if it was."""
        return self._failing

    async def write(self, propose: Callable[[], Sequence[Transaction]]) -> None:
        """Write all that `propose` returns, or nothing of it; then apply and announce it.

        `propose` is called at this change's turn: the data that it reads cannot change before the write. Raises the
        errors of `propose`, and `StorageFailed`; then sure entries still take effect and are written later, the others
        have no effect.
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
        """Write all that can be written; the rest is lost with this run."""
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
        """Schedule the write of a change that is already applied."""
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


class Changes:
    """Makes the transactions of changes; nothing changes before they are written."""

    def __init__(self, items: QueueEntries, events: EventLog) -> None:
        self._items = items
        self._events = events

    def job(
        self,
        item: QueueEntry,
        state: TaskState,
        notice: Notice | None = None,
        among: Collection[QueueEntry] = (),
        **fields: Any,
    ) -> list[Transaction]:
        """Return the changes that take a job to `state`, because of `notice`, with other `fields` of its row.

        If a job does not end as done, the jobs that depend on it are held too, unless they are `among` those that end
        by the same change.
        """
        code, message = (0, "") if notice is None else (notice.code, notice.message)
        old = item.row
        if item.record is not None:
            fields.setdefault("done", item.record.done)
        row = replace(old, state=advance(old.state, state), code=code, message=message, **fields)
        entries = [self.row(item, row)]
        if state.ended:
            entries += self._dependents(row, among)
        return entries

    def row(self, item: QueueEntry, row: JobRow, *, sure: bool = True) -> Transaction:
        """Return the change of a job to `row`; unless it is `sure`, it takes effect only if it is written."""

        def make() -> None:
            self._items.replace(item, row)

        def tell() -> None:
            self.tell(row)
            if row.state.ended:
                item.finish()

        return Transaction((row,), make, tell, sure)

    def cleared(self, row: ClearedJobs) -> Transaction:
        """Return the end of many waiting jobs; it wakes the waiting tasks, and `tell_cleared` announces the ends."""
        seen: list[QueueEntry] = []

        def make() -> None:
            seen.extend(self._items.cleared(row))

        def tell() -> None:
            for item in seen:
                item.finish()

        return Transaction((row,), make, tell)

    def tell_cleared(self, row: ClearedJobs, jobs: Sequence[tuple[int, str, str]]) -> None:
        """Announce the end of jobs, given by number, name and owner."""
        for number, name, owner in jobs:
            self._events.emit(JobAdvanced(number, name, row.state.value, owner, code=row.code))

    def step(
        self, item: QueueEntry, record: StepRecord, row: StepRow, *, sure: bool = True, quiet: bool = False
    ) -> Transaction:
        """Return the change of a step to `row`; a `quiet` change emits no event."""

        def make() -> None:
            record.row = row

        def tell() -> None:
            if not quiet:
                self.tell_step(item, record, row)

        return Transaction(((item.number, row),), make, tell, sure)

    def tell(self, row: JobRow) -> None:
        """Announce a job's state."""
        self._events.emit(JobAdvanced(row.id, row.name, row.state.value, row.owner.name, code=row.code))

    def tell_step(self, item: QueueEntry, record: StepRecord, row: StepRow, attempt: int | None = None) -> None:
        """Announce a step's state."""
        task = record.task
        self._events.emit(StepAdvanced(item.number, task.index, task.label, row.state.value, attempt, code=row.code))

    def _dependents(self, row: JobRow, among: Collection[QueueEntry]) -> list[Transaction]:
        dependents = [one for one in self._items.dependents(row.id) if one not in among]
        if row.state is TaskState.DONE:
            return [self._freed(dependent, row.id) for dependent in dependents]
        notice = failed_dependency(row.id, row.state)
        return [entry for dependent in dependents for entry in self._held(dependent, notice)]

    def _freed(self, dependent: QueueEntry, number: int) -> Transaction:
        return Transaction((), lambda: self._items.depend(dependent, dependent.waits_for - {number}), sure=True)

    def _held(self, dependent: QueueEntry, notice: Notice) -> Sequence[Transaction]:
        if dependent.row.state is TaskState.QUEUED:
            return self.job(dependent, TaskState.HELD, notice)
        return [self.row(dependent, replace(dependent.row, code=notice.code, message=notice.message))]


def failed_dependency(number: int, state: TaskState) -> Notice:
    """Return why a job is held that depends on a job that ended in `state`."""
    error = DependencyFailed(number=number, state=state.value)
    return Notice(error.code, str(error))


Dates = Callable[[float], str]
"""Returns the date (ISO 8601, UTC) a number of seconds of real time from now."""


class QueuePauser:
    """The queue's mode; `row` is the present one."""

    def __init__(self, transactions: TransactionLog, events: EventLog, dates: Dates) -> None:
        self.row = QueueRow()
        self._transactions = transactions
        self._events = events
        self._dates = dates

    @property
    def paused(self) -> bool:
        """Whether the queue is paused: no job and no step begins."""
        return self.row.paused

    @property
    def by_itself(self) -> bool:
        """Whether the queue is paused without a user's request."""
        return self.row.automatic

    def pause(self, reason: PauseReason, by: str = "") -> None:
        """Pause the queue from now on; a pause under way keeps its reason, unless only the new one is a user's."""
        if self.row.paused and (reason.automatic or not self.row.automatic):
            self.row = replace(self.row)
        else:
            self.row = QueueRow(True, reason, by, self._dates(0.0))
            self._transactions.soon(self._entry())

    def resume(self, by: str) -> Transaction:
        """Return the change that resumes the queue, unless a pause is requested before it is written."""
        before, row = self.row, QueueRow()

        def make() -> None:
            if self.row is before:
                self.row = row
            else:
                self._transactions.soon(self._entry())

        return Transaction((row,), make, lambda: self._tell(row, by))

    def take_up(self, row: QueueRow) -> None:
        """Restore the mode of an earlier run."""
        self.row = row

    def _entry(self) -> Transaction:
        row = self.row
        return Transaction((row,), tell=lambda: self._tell(row))

    def _tell(self, row: QueueRow, by: str = "") -> None:
        state = "paused" if row.paused else "running"
        self._events.emit(QueueChanged(state, str(row.reason), by or row.by))
