"""Submit jobs to the queue, and edit waiting ones.

Submission: read the options, check the job, store it, then queue it.

Edits by users: hold, release, reorder, edit, clear, cancel.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
from collections import Counter
from collections.abc import AsyncIterator, Callable, Collection, Iterable, Mapping, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple, get_type_hints

from pydantic import ConfigDict, TypeAdapter, ValidationError

from dmc41x3.i18n import phrase
from maya_un.errors import (
    InvalidJob,
    InvalidRequest,
    InvalidValue,
    JobAction,
    KeyReused,
    MayaError,
    StorageFailed,
    WrongState,
)
from maya_un.process.computation import JobComputer
from maya_un.process.journal.protocol import ClearedJobs, JobOptions, JobRow, Journal, RequestOwner, StepRow
from maya_un.process.queue.changes import Changes, Dates, Transaction, TransactionLog, failed_dependency
from maya_un.process.queue.entries import QueueEntries, QueueEntry
from maya_un.process.queue.report import JobRecord
from maya_un.process.spec.stored import StoredJob
from maya_un.process.spec.tasks import Expansion, Task
from maya_un.schema.jobs import TaskState
from maya_un.validation import refusal_of
from maya_un.values import Notice

DEFAULT_OPTIONS = JobOptions()
"""The default options."""

_OPTIONS: dict[str, TypeAdapter[Any]] = {
    key: TypeAdapter(kind, config=ConfigDict(strict=True))
    for key, kind in get_type_hints(JobOptions, include_extras=True).items()
}


def read_options(data: Mapping[str, object], old: JobOptions = DEFAULT_OPTIONS) -> JobOptions:
    """Return `old` with the changes in `data`; raises `InvalidRequest` for an unknown key, `InvalidValue`."""
    changes: dict[str, Any] = {}
    for key, value in data.items():
        if key not in _OPTIONS:
            raise InvalidRequest(
                key=key, reason=phrase("there is no such key; known are {names}", names=", ".join(_OPTIONS))
            )
        try:
            changes[key] = _OPTIONS[key].validate_python(value)
        except ValidationError as error:
            raise refusal_of(error, key) from error
    return replace(old, **changes)


def checked_options(options: JobOptions) -> JobOptions:
    """Return `options`; raises `InvalidValue` for values out of range."""
    return read_options({key: getattr(options, key) for key in _OPTIONS})


@dataclass(frozen=True, slots=True)
class SubmitRequest:
    """The owner and the options of a submission.

    A `proposal` is held until it is approved, a `direct` job runs at once. `key` is an idempotency key, "" for none.
    `revocations` counts how often the owner had lost the right to queue jobs when the request came.
    """

    owner: RequestOwner
    options: JobOptions
    key: str = ""
    proposal: bool = False
    direct: bool = False
    revocations: int = 0


class DependencyStatus(NamedTuple):
    """The dependencies of a job: those that have not ended, and the notice that holds it if one has failed."""

    waits_for: frozenset[int]
    notice: Notice | None


class JobSubmitter:
    """Submits jobs. `next_id` is the number of the next job.

    `revocations` counts by owner how often the right to queue jobs ended; a job requested before that is a proposal.
    """

    def __init__(self, items: QueueEntries, transactions: TransactionLog, changes: Changes, dates: Dates) -> None:
        self.next_id = 1
        self.revocations: Counter[str] = Counter()
        self._items = items
        self._transactions = transactions
        self._changes = changes
        self._dates = dates
        self._coming: dict[tuple[str, str], asyncio.Event] = {}

    @property
    def _journal(self) -> Journal:
        return self._transactions.journal

    def date(self) -> str:
        """Return the present date."""
        return self._dates(0.0)

    async def submit(self, written: StoredJob, asked: SubmitRequest, skipped: Sequence[StepRow] = ()) -> int:
        """Store a job with `skipped` steps; return its number, or that of an earlier job with the same key.

        Raises `KeyReused`, `InvalidValue` for options out of range and dependencies that do not exist, `StorageFailed`.
        """
        asked = replace(asked, options=checked_options(asked.options))
        if not asked.key:
            return await self._new(written, asked, "", skipped)
        digest = _digest(written, asked, skipped)
        async with self._turn_of(asked):
            known = await self._journal.keyed(asked.owner.name, asked.key)
            if known is None:
                return await self._new(written, asked, digest, skipped)
            if known.digest != digest:
                raise KeyReused(key=asked.key)
            return known.id

    @asynccontextmanager
    async def _turn_of(self, asked: SubmitRequest) -> AsyncIterator[None]:
        """Serialize requests with the same key."""
        place = (asked.owner.name, asked.key)
        while place in self._coming:
            await self._coming[place].wait()
        self._coming[place] = over = asyncio.Event()
        try:
            yield
        finally:
            del self._coming[place]
            over.set()

    async def _new(self, written: StoredJob, asked: SubmitRequest, digest: str, skipped: Sequence[StepRow]) -> int:
        options = asked.options
        standing = await self.standing(options.depends_on)
        proposal = asked.proposal or self._revoked(asked)
        row = JobRow(
            id=self._number(),
            name=written.name,
            body=written.body,
            options=options,
            owner=asked.owner,
            state=TaskState.HELD if options.held or proposal or standing.notice else TaskState.QUEUED,
            position=0.0,
            submitted=self.date(),
            steps=len(written.expansion.tasks),
            code=0 if standing.notice is None else standing.notice.code,
            message="" if standing.notice is None else standing.notice.message,
            key=asked.key,
            digest=digest,
            proposal=proposal,
        )
        row = replace(row, position=self._items.order.end(row.id))
        steps = list(skipped)
        try:
            await self._write(row, steps)
        except StorageFailed:
            await self._transactions.check()
            raise
        late = self._revoked(asked) and not row.proposal
        if late:
            row = replace(row, state=TaskState.HELD, proposal=True)
        record = JobRecord.kept(written.expansion, steps) if steps else None
        item = QueueEntry(row, record, self.not_done(standing.waits_for), asked.direct)
        self._items.add(item)
        self._changes.tell(row)
        if late:
            with suppress(StorageFailed):  # the job is accepted, and its row is written again
                await self._transactions.write(lambda: [self._changes.row(item, item.row)])
        await self.hold_where_failed(item)
        self._items.park(item)
        return row.id

    def _revoked(self, asked: SubmitRequest) -> bool:
        """Return whether the owner has lost the right to queue jobs since the request came."""
        return self.revocations[asked.owner.name] != asked.revocations

    async def _write(self, row: JobRow, steps: list[StepRow]) -> None:
        if steps:
            await self._journal.save(row, *((row.id, step) for step in steps))
        else:
            await self._journal.add(row)

    async def standing(self, numbers: tuple[int, ...]) -> DependencyStatus:
        """Return the status of the jobs on which a job is to depend; raises `InvalidValue` if one does not exist."""
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
        """Return those of `numbers` that are not done now, including jobs that have failed meanwhile."""
        items = {number: self._items.find(number) for number in numbers}
        return frozenset(number for number, item in items.items() if item and item.row.state is not TaskState.DONE)

    async def hold_where_failed(self, item: QueueEntry) -> None:
        """Hold a job if one of its dependencies has failed while it was being written."""
        for number in item.waits_for:
            found = self._items.find(number)
            if found is not None and found.row.state.ended and item.row.state is TaskState.QUEUED:
                notice = failed_dependency(number, found.row.state)
                await self._transactions.write(lambda notice=notice: self._changes.job(item, TaskState.HELD, notice))

    def _number(self) -> int:
        self.next_id += 1
        return self.next_id - 1


def _digest(written: StoredJob, asked: SubmitRequest, skipped: Sequence[StepRow]) -> str:
    """Return a digest that identifies a request."""
    request: dict[str, object] = {"body": written.body, "options": asdict(asked.options)}
    if skipped:
        request["skipped"] = [step.index for step in skipped]
    return hashlib.sha256(json.dumps(request, sort_keys=True).encode()).hexdigest()


_WAITING = frozenset({TaskState.QUEUED, TaskState.HELD})
_AT_A_TIME = 200
_READ_AT_A_TIME = 50  # a job that only the journal has takes 0.2 ms
_BETWEEN = frozenset({TaskState.PAUSED, TaskState.INTERRUPTED})


class JobEditor:
    """Edits jobs that have not begun, and the remaining steps of those that have."""

    def __init__(
        self,
        items: QueueEntries,
        transactions: TransactionLog,
        changes: Changes,
        submitting: JobSubmitter,
        computer: JobComputer,
    ) -> None:
        self._items = items
        self._transactions = transactions
        self._changes = changes
        self._submitting = submitting
        self._computer = computer

    async def hold(self, number: int) -> None:
        """Hold a waiting job; raises `NotFound`, `WrongState`, `StorageFailed`."""

        def propose() -> list[Transaction]:
            item = self._waiting(number, "held")
            if item.row.state is TaskState.HELD:
                return []
            return _unsure(self._changes.job(item, TaskState.HELD))

        await self._transactions.write(propose)

    async def release(self, number: int, by: str, require: Callable[[JobRow], None]) -> None:
        """Queue a held job; it then waits only for dependencies that have not ended.

        `require` checks the job at the time of its release: an approved job may have been changed just before. Raises
        the errors of `require`, `NotFound`, `WrongState`, `StorageFailed`.
        """

        def propose() -> list[Transaction]:
            item = self._waiting(number, "released")
            if item.row.state is TaskState.QUEUED:
                return []
            require(item.row)
            approved = by if item.row.proposal else item.row.approved_by
            alive = frozenset(one for one in item.waits_for if self._items.alive(one))
            entries = self._changes.job(item, TaskState.QUEUED, approved_by=approved)
            return _unsure([Transaction((), lambda: self._items.depend(item, alive)), *entries])

        await self._transactions.write(propose)

    async def move(self, number: int, beside: int, *, behind: bool) -> None:
        """Move a job before or `behind` the job `beside`; raises `NotFound`, `WrongState`, `StorageFailed`."""
        await self._transactions.write(lambda: self._moved(number, beside, behind=behind))

    async def move_to(self, number: int, *, last: bool) -> None:
        """Move a job to the first place, or with `last` to the last; raises as `move` does."""

        def propose() -> list[Transaction]:
            self._waiting(number, "moved")
            beside = self._items.order.outermost(number, last=last)
            return [] if beside is None else self._moved(number, beside, behind=last)

        await self._transactions.write(propose)

    async def change(
        self, number: int, changes: Mapping[str, object], require: Callable[[JobRow], None], *, approved: bool
    ) -> None:
        """Change the options of a job, or its body (`job`); without `approved` it becomes a proposal.

        A job that has begun cannot become a proposal: nobody could approve it before it goes on. `require` checks the
        job at the time of its change.

        Raises the errors of `require`, `NotFound`, `WrongState`, `InvalidRequest`, `InvalidValue`, `InvalidJob`,
        `UnknownName`, `StorageFailed`.
        """
        item = self._changeable(number, approved=approved, body="job" in changes)
        rest = {key: value for key, value in changes.items() if key != "job"}
        if "held" in rest:
            raise InvalidRequest(key="held", reason="hold and release a job by the operations for it")
        asked = read_options(rest, item.row.options).depends_on
        standing = await self._submitting.standing(asked) if "depends_on" in rest else None

        written = await self._computer.written(changes["job"], whose=item.row.owner.name) if "job" in changes else None
        begun = await self._computer.expanded(item.row.body) if written is not None and item.begun else None

        def propose() -> list[Transaction]:
            self._changeable(number, approved=approved, body=written is not None)
            require(item.row)
            options = read_options(rest, item.row.options)
            if written is not None:
                self._require_same(item, written, begun)
            self._require_no_loop(number, options.depends_on)
            depends_anew = options.depends_on != item.row.options.depends_on
            changed = self._changed(item, options, written, standing if depends_anew else None, approved=approved)
            return _unsure(changed)

        await self._transactions.write(propose)
        await self._submitting.hold_where_failed(item)

    async def unapprove(self, owner: str) -> None:
        """Make all waiting jobs of an owner proposals, even if the write fails; started jobs stay.

        The owner may no longer queue jobs. The first change is that of the jobs in memory, because the next to begin is
        one of them; the others change some at a time, so other tasks can run. Raises `StorageFailed`.
        """

        def proposals(items: Iterable[QueueEntry | None]) -> list[Transaction]:
            rows = [(item, item.row) for item in items if item is not None and not item.begun]
            return [
                self._changes.row(item, replace(row, state=TaskState.HELD, proposal=True, approved_by=""))
                for item, row in rows
                if row.owner.name == owner and row.state in _WAITING and (row.approved_by or not row.proposal)
            ]

        failed: StorageFailed | None = None
        numbers = self._transactions.journal.waiting_of(owner)
        slices = [numbers[begin : begin + _READ_AT_A_TIME] for begin in range(0, len(numbers), _READ_AT_A_TIME)]
        changes = [
            lambda: proposals({*self._items}),
            *(lambda some=some: proposals(map(self._items.find, some)) for some in slices),
        ]
        for change in changes:
            try:
                await self._transactions.write(change)
            except StorageFailed as error:
                failed = error
        if failed is not None:
            raise failed

    async def cancel(self, number: int, error: MayaError, unless: Callable[[], bool] = lambda: False) -> None:
        """End a job that is not under way, unless `unless` returns True; has no effect on an ended job.

        Raises `StorageFailed`.
        """

        def propose() -> list[Transaction]:
            item = self._items.get(number)
            return [] if item.row.state.ended or unless() else _unsure(self.cancelled(item, error))

        await self._transactions.write(propose)

    async def clear(self, error: MayaError) -> ClearedJobs | None:
        """End all waiting jobs, held ones too; return those that remain to be announced. Raises `StorageFailed`.

        Most end by one change. Those in memory end some at a time, so other tasks can run.
        """
        cleared: ClearedJobs | None = None

        def at_once() -> list[Transaction]:
            nonlocal cleared
            numbers = tuple(number for number in self._items.parked if not self._items.needed(number))
            if not numbers:
                return []
            notice = Notice(error.code, str(error))
            cleared = ClearedJobs(numbers, TaskState.CANCELLED, notice.code, notice.message, self._submitting.date())
            return [self._changes.cleared(cleared)]

        await self._transactions.write(at_once)
        await self._clear_rest(error)
        return cleared

    async def tell_cleared(self, row: ClearedJobs) -> None:
        """Announce the end of every job of `row`, some at a time, so other tasks can run."""
        numbers = sorted(row.numbers)
        for begin in range(0, len(numbers), _AT_A_TIME):
            some = await self._transactions.journal.names_of(numbers[begin : begin + _AT_A_TIME])
            self._changes.tell_cleared(row, some)

    async def _clear_rest(self, error: MayaError) -> None:
        numbers = list(self._items.order)
        for begin in range(0, len(numbers), _AT_A_TIME):
            some = numbers[begin : begin + _AT_A_TIME]

            def propose(some: list[int] = some) -> list[Transaction]:
                items = {self._items.get(number): None for number in some if number in self._items.order}
                return [entry for item in items for entry in _unsure(self.cancelled(item, error, items.keys()))]

            await self._transactions.write(propose)

    def cancelled(self, item: QueueEntry, error: MayaError, among: Collection[QueueEntry] = ()) -> list[Transaction]:
        """Return the changes that end a job which is not under way, `among` others that end with it."""
        notice = Notice(error.code, str(error))
        steps = [] if item.record is None else item.record.steps
        interrupted = [step for step in steps if step.state is TaskState.INTERRUPTED]
        entries = [
            self._changes.step(item, step, step.become(TaskState.CANCELLED, notice), sure=False) for step in interrupted
        ]
        ended = self._submitting.date()
        return [*entries, *self._changes.job(item, TaskState.CANCELLED, notice, among, ended=ended)]

    def _moved(self, number: int, beside: int, *, behind: bool) -> list[Transaction]:
        self._waiting(number, "moved")
        self._waiting(beside, "a reference for `queue move`")
        if number == beside:
            return []
        places = self._items.order.moved(number, beside, behind=behind)
        return [self._placed(place.number, place.priority, place.position) for place in places]

    def _waiting(self, number: int, action: JobAction) -> QueueEntry:
        item = self._items.get(number)
        if item.row.state not in _WAITING or item.begun:
            raise WrongState(number=number, state=item.row.state.value, action=action)
        return item

    def _changeable(self, number: int, *, approved: bool, body: bool) -> QueueEntry:
        """Return a job whose options, with `body` also its steps, may change now; raises `NotFound`, `WrongState`."""
        item = self._items.get(number)
        state = item.row.state
        if state not in _WAITING | _BETWEEN:
            raise WrongState(number=number, state=state.value, action="changed")
        if body and item.under_way and state is TaskState.PAUSED:  # its runner goes on with the steps that it has
            raise WrongState(number=number, state="paused within a step", action="changed")
        if item.begun and not approved:
            raise WrongState(number=number, state=state.value, action="changed without approval")
        return item

    def _placed(self, number: int, priority: int, position: float) -> Transaction:
        item = self._items.get(number)
        options = replace(item.row.options, priority=priority)
        return self._changes.row(item, replace(item.row, options=options, position=position), sure=False)

    def _require_same(self, item: QueueEntry, written: StoredJob, before: Expansion | None) -> None:
        """Raise `InvalidJob` if a new body changes steps that have begun or are left out; `before` is the old body."""
        if not item.begun and item.record is None:
            return
        old = before if item.record is None else item.record.expansion
        if old is None:  # the job has started just now
            raise WrongState(number=item.number, state=item.row.state.value, action="changed")
        steps = [] if item.record is None else item.record.steps
        begun = max((step.row.index for step in steps if step.state is not TaskState.QUEUED), default=0)
        if list(map(_effect, written.expansion.tasks[:begun])) != list(map(_effect, old.tasks[:begun])):
            raise InvalidJob(
                key="steps",
                reason=phrase("steps up to {begun} have begun or are left out, and must not change", begun=begun),
            )

    def _changed(
        self,
        item: QueueEntry,
        options: JobOptions,
        written: StoredJob | None,
        standing: DependencyStatus | None,
        *,
        approved: bool,
    ) -> list[Transaction]:
        row = replace(item.row, options=options)
        if not approved:
            held = TaskState.HELD if row.state is TaskState.QUEUED else row.state
            row = replace(row, proposal=True, approved_by="", state=held)
        entries: list[Transaction] = []
        if written is not None:
            record = _rewritten_record(item, written)
            row = replace(row, name=written.name, body=written.body, steps=len(written.expansion.tasks))
            entries.append(Transaction((), lambda: setattr(item, "record", record)))
        if standing is not None:
            entries.append(
                Transaction((), lambda: self._items.depend(item, self._submitting.not_done(standing.waits_for)))
            )
            if standing.notice is not None and row.state is TaskState.QUEUED:
                code, message = standing.notice.code, standing.notice.message
                row = replace(row, state=TaskState.HELD, code=code, message=message)
        return [*entries, self._changes.row(item, row)]

    def _require_no_loop(self, number: int, depends_on: tuple[int, ...]) -> None:
        """Raise `InvalidValue` if a job would wait for itself."""
        ahead, seen = list(depends_on), set[int]()
        while ahead:
            one = ahead.pop()
            if one == number:
                raise InvalidValue(key="depends_on", value=list(depends_on), reason="the job would wait for itself")
            item = self._items.find(one)
            if item is not None and one not in seen:
                seen.add(one)
                ahead.extend(item.row.options.depends_on)


def _effect(task: Task) -> tuple[object, ...]:
    """Return the effect of a task, by which tasks are compared."""
    return task.action, task.speed, task.then, task.otherwise, task.asked


def _rewritten_record(item: QueueEntry, written: StoredJob) -> JobRecord | None:
    """Return the record of a started job, with its new steps; None without a record."""
    if item.record is None:
        return None
    begun = [step.row for step in item.record.steps if step.state is not TaskState.QUEUED]
    return JobRecord.kept(written.expansion, begun)


def _unsure(entries: list[Transaction]) -> list[Transaction]:
    """Return changes that have no effect if they cannot be written: the user who requested them gets the error."""
    return [entry._replace(sure=False) for entry in entries]
