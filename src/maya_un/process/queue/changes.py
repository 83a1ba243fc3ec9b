"""Changes of jobs, of steps and of the queue's pause, as transactions.

A pause holds at once, and is stored and announced after that. The queue resumes only after the change is stored.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from typing import Any

from maya_un.errors import DependencyFailed
from maya_un.events import EventLog, JobAdvanced, QueueChanged, StepAdvanced
from maya_un.process.journal.protocol import ClearedJobs, JobRow, QueueRow, StepRow
from maya_un.process.queue.entries import QueueEntries, QueueEntry
from maya_un.process.queue.report import StepRecord
from maya_un.process.queue.transaction_log import Transaction, TransactionLog
from maya_un.schema.jobs import TaskState, advance
from maya_un.values import Notice


class Changes:
    """Makes entries for the ledger; nothing changes before they are written."""

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
        """Return the change of a job to `row`; one that is not `sure` must be written to be true."""

        def make() -> None:
            if row.state.ended and item.record is not None:
                item.record.skip_rest()
            self._items.replace(item, row)

        def tell() -> None:
            self.tell(row)
            if row.state.ended:
                item.finish()

        return Transaction((row,), make, tell, sure)

    def cleared(self, row: ClearedJobs) -> Transaction:
        """Return the end of many waiting jobs; `tell_cleared` announces it, except of those in memory by then."""
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
        """Return the change of a step to `row`; a `quiet` one is no event."""

        def make() -> None:
            record.row = row

        def tell() -> None:
            if not quiet:
                self.tell_step(item, record, row)

        return Transaction(((item.number, row),), make, tell, sure)

    def tell(self, row: JobRow) -> None:
        """Announce how a job stands."""
        self._events.emit(JobAdvanced(row.id, row.name, row.state.value, row.owner.name, code=row.code))

    def tell_step(self, item: QueueEntry, record: StepRecord, row: StepRow, attempt: int | None = None) -> None:
        """Announce how a step stands."""
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
    """Return why a job is held that depends on one that ended in `state`."""
    error = DependencyFailed(number=number, state=state.value)
    return Notice(error.code, str(error))


Dates = Callable[[float], str]
"""Tells the date (ISO 8601, UTC) so many seconds of real time from now."""

AUTOMATIC_REASONS = frozenset({"stop", "fault", "restart", "driver", "storage", "failure"})
"""Reasons for which nobody asked for a pause: it protects what waits, and ends where nothing does any more."""


class QueuePauser:
    """The queue's mode; `row` is how it is now."""

    def __init__(self, ledger: TransactionLog, events: EventLog, dates: Dates) -> None:
        self.row = QueueRow()
        self._ledger = ledger
        self._events = events
        self._dates = dates

    @property
    def paused(self) -> bool:
        """Whether no job and no step of one begins."""
        return self.row.paused

    @property
    def by_itself(self) -> bool:
        """Whether it is paused, and nobody asked for it."""
        return self.row.paused and self.row.reason in AUTOMATIC_REASONS

    def pause(self, reason: str, by: str = "") -> None:
        """Begin nothing more from now on; where it is paused already, its reason stays as it is."""
        if self.row.paused:
            self.row = replace(self.row)
        else:
            self.row = QueueRow(True, reason, by, self._dates(0.0))
            self._ledger.soon(self._entry())

    def resume(self, by: str) -> Transaction:
        """Return the change after which jobs begin again, unless a pause is asked for before it is written."""
        before, row = self.row, QueueRow()

        def make() -> None:
            if self.row is before:
                self.row = row
            else:
                self._ledger.soon(self._entry())

        return Transaction((row,), make, lambda: self._tell(row, by))

    def take_up(self, row: QueueRow) -> None:
        """Go on with what an earlier run left."""
        self.row = row

    def _entry(self) -> Transaction:
        row = self.row
        return Transaction((row,), tell=lambda: self._tell(row))

    def _tell(self, row: QueueRow, by: str = "") -> None:
        state = "paused" if row.paused else "running"
        self._events.emit(QueueChanged(state, row.reason, by or row.by))
