"""Submission of jobs: read the options, check the job, store it, then queue it."""

from __future__ import annotations

import asyncio
import hashlib
import json
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import asdict, dataclass, replace
from reprlib import repr
from typing import NamedTuple

from maya_un.errors import InvalidRequest, InvalidValue, KeyReused, StorageFailed
from maya_un.process.journal.protocol import JobOptions, JobRow, Journal, RequestOwner, StepRow
from maya_un.process.queue.changes import Changes, Dates, failed_dependency
from maya_un.process.queue.entries import QueueEntries, QueueEntry
from maya_un.process.queue.report import JobRecord
from maya_un.process.queue.transaction_log import TransactionLog
from maya_un.process.spec.stored_job import StoredJob
from maya_un.schema.jobs import OnFailure, TaskState
from maya_un.values import Notice

DEFAULT_OPTIONS = JobOptions()
"""The default options."""

MOST_PRIORITY = 100
MOST_RETRIES = 10
LONGEST_NOTES = 2000
MOST_DEPENDENCIES = 100


def read_options(data: Mapping[str, object], old: JobOptions = DEFAULT_OPTIONS) -> JobOptions:
    """Return `old` with what plain data changes in it; raises `InvalidRequest` for another key, `InvalidValue`."""
    changes: dict[str, object] = {}
    for key, value in data.items():
        if key not in _READERS:
            raise InvalidRequest(key=key, reason=f"there is no such key; known are {', '.join(_READERS)}")
        changes[key] = _READERS[key](key, value)
    return replace(old, **changes)  # pyright: ignore[reportArgumentType] - each reader returns its field's type


def checked_options(options: JobOptions) -> JobOptions:
    """Return `options`; raises `InvalidValue` for what lies outside its range."""
    return read_options({key: getattr(options, key) for key in _READERS})


def _whole(low: int, high: int) -> Callable[[str, object], int]:
    def read(key: str, value: object) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise InvalidValue(key=key, value=repr(value), reason=f"it must be a whole number from {low} to {high}")
        return value

    return read


def _flag(key: str, value: object) -> bool:
    if not isinstance(value, bool):
        raise InvalidValue(key=key, value=repr(value), reason="it must be true or false")
    return value


def _notes(key: str, value: object) -> str:
    if not isinstance(value, str) or len(value) > LONGEST_NOTES:
        raise InvalidValue(key=key, value=repr(value), reason=f"it must be a text of at most {LONGEST_NOTES} letters")
    if not all(letter.isprintable() or letter in "\n\t" for letter in value):
        raise InvalidValue(key=key, value=repr(value), reason="it must be printable")
    return value


def _numbers(key: str, value: object) -> tuple[int, ...]:
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) > MOST_DEPENDENCIES:
        reason = f"it must be a list of at most {MOST_DEPENDENCIES} numbers of jobs"
        raise InvalidValue(key=key, value=repr(value), reason=reason)
    number = _whole(1, 2**53)
    return tuple(dict.fromkeys(number(f"{key}.{place}", item) for place, item in enumerate(value)))


def _on_failure(key: str, value: object) -> OnFailure:
    try:
        return OnFailure(str(value))
    except ValueError:
        raise InvalidValue(key=key, value=repr(value), reason=f"it is {' or '.join(OnFailure)}") from None


_READERS: dict[str, Callable[[str, object], object]] = {
    "priority": _whole(-MOST_PRIORITY, MOST_PRIORITY),
    "held": _flag,
    "depends_on": _numbers,
    "notes": _notes,
    "on_failure": _on_failure,
    "retries": _whole(0, MOST_RETRIES),
    "stepwise": _flag,
}


@dataclass(frozen=True, slots=True)
class SubmitRequest:
    """The owner and the options of a submission.

    A `proposal` is held until it is approved, a `direct` one runs at once. `key` is an idempotency key, "" for none.
    """

    owner: RequestOwner
    options: JobOptions
    key: str = ""
    proposal: bool = False
    direct: bool = False


class DependencyStatus(NamedTuple):
    """How the jobs stand on which one depends: those that have not ended, and why it is held where one has failed."""

    waits_for: frozenset[int]
    notice: Notice | None


class JobSubmitter:
    """Takes jobs in. `next_id` is the number of the next."""

    def __init__(self, items: QueueEntries, ledger: TransactionLog, changes: Changes, dates: Dates) -> None:
        self.next_id = 1
        self._items = items
        self._ledger = ledger
        self._changes = changes
        self._dates = dates
        self._coming: dict[tuple[str, str], asyncio.Event] = {}

    @property
    def _journal(self) -> Journal:
        return self._ledger.journal

    def date(self) -> str:
        """Return the date now."""
        return self._dates(0.0)

    async def submit(self, written: StoredJob, asked: SubmitRequest, skipped: int = 0) -> int:
        """Keep a job whose first steps are `skipped`; return its number, or that of the one that came with its key.

        Raises `KeyReused`, `InvalidValue` for options out of range and jobs that do not exist, `StorageFailed`.
        """
        asked = replace(asked, options=checked_options(asked.options))
        if not asked.key:
            return await self._new(written, asked, "", skipped)
        digest = _digest(written, asked)
        async with self._turn_of(asked):
            known = await self._journal.keyed(asked.owner.name, asked.key)
            if known is None:
                return await self._new(written, asked, digest, skipped)
            if known.digest != digest:
                raise KeyReused(key=asked.key)
            return known.id

    @asynccontextmanager
    async def _turn_of(self, asked: SubmitRequest) -> AsyncIterator[None]:
        """Let requests of one key in one after the other."""
        place = (asked.owner.name, asked.key)
        while place in self._coming:
            await self._coming[place].wait()
        self._coming[place] = over = asyncio.Event()
        try:
            yield
        finally:
            del self._coming[place]
            over.set()

    async def _new(self, written: StoredJob, asked: SubmitRequest, digest: str, skipped: int) -> int:
        options = asked.options
        standing = await self.standing(options.depends_on)
        row = JobRow(
            id=self._number(),
            name=written.name,
            body=written.body,
            options=options,
            owner=asked.owner,
            state=TaskState.HELD if options.held or asked.proposal or standing.notice else TaskState.QUEUED,
            position=0.0,
            submitted=self.date(),
            steps=len(written.expansion.tasks),
            code=0 if standing.notice is None else standing.notice.code,
            message="" if standing.notice is None else standing.notice.message,
            key=asked.key,
            digest=digest,
            proposal=asked.proposal,
        )
        row = replace(row, position=self._items.order.end(row.id))
        steps = [StepRow(index, TaskState.SKIPPED) for index in range(1, skipped + 1)]
        try:
            await self._write(row, steps)
        except StorageFailed:
            await self._ledger.check()
            raise
        record = JobRecord.kept(written.expansion, steps) if steps else None
        item = QueueEntry(row, record, self.not_done(standing.waits_for), asked.direct)
        self._items.add(item)
        self._changes.tell(row)
        await self.hold_where_failed(item)
        self._items.park(item)
        return row.id

    async def _write(self, row: JobRow, steps: list[StepRow]) -> None:
        if steps:
            await self._journal.save(row, *((row.id, step) for step in steps))
        else:
            await self._journal.add(row)

    async def standing(self, numbers: tuple[int, ...]) -> DependencyStatus:
        """Return how the jobs stand on which a job is to depend; raises `InvalidValue` for those that do not exist."""
        waits_for: set[int] = set()
        notice: Notice | None = None
        for number in numbers:
            state = await self._state_of(number)
            if not state.ended:
                waits_for.add(number)
            elif state is not TaskState.DONE and notice is None:
                notice = failed_dependency(number, state)
        return DependencyStatus(frozenset(waits_for), notice)

    async def _state_of(self, number: int) -> TaskState:
        item = self._items.find(number)
        if item is not None:
            return item.row.state
        known = await self._journal.job(number)
        if known is None:
            raise InvalidValue(key="depends_on", value=number, reason="there is no such job")
        return known[0].state

    def not_done(self, numbers: frozenset[int]) -> frozenset[int]:
        """Return those of `numbers` that are not done now; one that has failed meanwhile is among them."""
        items = {number: self._items.find(number) for number in numbers}
        return frozenset(number for number, item in items.items() if item and item.row.state is not TaskState.DONE)

    async def hold_where_failed(self, item: QueueEntry) -> None:
        """Hold a job where one that it depends on has failed while it was being written."""
        for number in item.waits_for:
            found = self._items.find(number)
            if found is not None and found.row.state.ended and item.row.state is TaskState.QUEUED:
                notice = failed_dependency(number, found.row.state)
                await self._ledger.write(lambda notice=notice: self._changes.job(item, TaskState.HELD, notice))

    def _number(self) -> int:
        self.next_id += 1
        return self.next_id - 1


def _digest(written: StoredJob, asked: SubmitRequest) -> str:
    """Return what tells one request from another."""
    request = {"body": written.body, "options": asdict(asked.options)}
    return hashlib.sha256(json.dumps(request, sort_keys=True).encode()).hexdigest()
