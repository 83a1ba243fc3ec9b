"""Whether the queue begins jobs: paused by somebody, or by what happened, and since when.

A pause holds from the instant it is asked for; it is written and announced after that. Going on is written first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from maya_un.events import EventLog, QueueChanged
from maya_un.process.journal.rows import QueueRow
from maya_un.process.ledger import Transaction, TransactionLog

Dates = Callable[[float], str]
"""Tells the date (ISO 8601, UTC) so many seconds of real time from now."""

BY_ITSELF = frozenset({"stop", "fault", "restart", "driver", "storage", "failure"})
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
        return self.row.paused and self.row.reason in BY_ITSELF

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
