"""The jobs that the queue knows: all that have not ended, in order, and the last that have."""

from __future__ import annotations

import asyncio
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from weakref import WeakValueDictionary

from maya_un.errors import MayaError, NotFound
from maya_un.process.journal.protocol import ClearedJobs, JobRow, Journal
from maya_un.process.queue.report import JobRecord
from maya_un.process.queue_order import MayBegin, QueueOrder, QueuePosition
from maya_un.schema.jobs import TaskState

AT_HAND = 100
"""Number of waiting jobs in memory; the others stay in the journal."""

REMEMBERED = 200
"""Number of ended jobs that stay in memory; the journal has the others."""


@dataclass(frozen=True, slots=True, eq=False)
class OpenQuestion:
    """A question to the operator: the `index` of its step, its text, its choices, and the future answer."""

    index: int
    question: str
    choices: tuple[str, ...]
    answered: asyncio.Future[str]


_LINED_UP = {TaskState.QUEUED, TaskState.HELD}
_GOING_ON = {TaskState.QUEUED, TaskState.PAUSED}


@dataclass(slots=True, eq=False, weakref_slot=True)
class QueueEntry:
    """A job in the queue: its stored row, and the state of this run.

    `record` exists once the job has begun. `waits_for` are the jobs that must be done before it. A `direct` job is a
    command to be done now, which a paused queue does not delay. `end_by` is the error that is to end it early; with
    `interrupt` it ends as interrupted instead. `under_way`: a runner has it. `moving`: its runner may be cancelled.
    `checking`: its runner still computes the job. `waiting`: its runner waits, while nothing moves, and `question` is
    the one that it asks. `concludes`: its runner is finished and writes the end. `began` is loop time [s] of this run.
    `finished`: its end has been announced. `ended` then wakes the waiting tasks.
    """

    row: JobRow
    record: JobRecord | None = None
    waits_for: frozenset[int] = frozenset()
    direct: bool = False
    end_by: MayaError | None = None
    interrupt: bool = False
    under_way: bool = False
    moving: bool = False
    checking: bool = False
    waiting: bool = False
    question: OpenQuestion | None = None
    concludes: bool = False
    began: float | None = None
    finished: bool = False
    ended: asyncio.Event | None = None

    @property
    def number(self) -> int:
        """The job's number."""
        return self.row.id

    def finish(self) -> None:
        """Mark the end as announced, and wake the tasks that wait for it."""
        self.finished = True
        if self.ended is not None:
            self.ended.set()

    async def wait(self) -> None:
        """Wait until its end has been announced, or the queue is closed."""
        if not self.finished:
            self.ended = self.ended or asyncio.Event()
            await self.ended.wait()

    @property
    def may_begin(self) -> bool:
        """Whether the job may begin, or continue, when its turn comes."""
        going_on = self.begun and self.row.state in _GOING_ON
        return going_on or (self.row.state is TaskState.QUEUED and not self.waits_for)

    @property
    def begun(self) -> bool:
        """Whether a step of the job has begun, in this run or before."""
        return self.row.began != ""


class QueueEntries:
    """All jobs that have not ended, the order of waiting jobs, and the last ended jobs.

    Of waiting jobs beyond the first `AT_HAND`, only the place is in memory; the `journal` has the rest. `on_change` is
    called after every change.
    """

    def __init__(self, journal: Journal) -> None:
        self._journal = journal
        self._looked_at: WeakValueDictionary[int, QueueEntry] = WeakValueDictionary()
        self._alive: dict[int, QueueEntry] = {}
        self._ended: dict[int, QueueEntry] = {}
        self._order = QueueOrder()
        self._under_way: list[int] = []
        self._interrupted: list[int] = []
        self._direct: list[int] = []
        self._dependents: defaultdict[int, set[int]] = defaultdict(set)
        self._counts: Counter[TaskState] = Counter()
        self.on_change: Callable[[], None] = lambda: None

    def __iter__(self) -> Iterator[QueueEntry]:
        """Yield the jobs in memory: started, dependent, recently read or recently ended ones."""
        yield from self._ended.values()
        yield from self._alive.values()
        yield from (item for number, item in tuple(self._looked_at.items()) if self._is_parked(number))

    @property
    def parked(self) -> list[int]:
        """The numbers of waiting jobs of which only the place is in memory."""
        return [number for number in self._order if number not in self._alive]

    def _is_parked(self, number: int) -> bool:
        return number not in self._alive and number in self._order

    def take_up(self, waiting: QueueOrder) -> None:
        """Restore the waiting jobs, before any other."""
        self._order = waiting
        self._counts[TaskState.QUEUED] += waiting.ready_count
        self._counts[TaskState.HELD] += len(waiting) - waiting.ready_count
        if len(waiting):
            self.on_change()

    def park(self, item: QueueEntry) -> None:
        """Reduce a waiting job beyond the first `AT_HAND` to its place, if no caller waits for its end."""
        plain = not (item.waits_for or item.direct or item.begun or item.record or item.ended)
        place = self._order.place_of(item.number)
        if plain and place is not None and place > AT_HAND and self._alive.get(item.number) is item:
            del self._alive[item.number]
            self._looked_at[item.number] = item

    def cleared(self, row: ClearedJobs) -> list[QueueEntry]:
        """End many waiting jobs at once; return those in memory."""
        gone = {number for number in row.numbers if self._is_parked(number)}
        queued = sum(self._order.is_ready(number) for number in gone)
        self._counts[TaskState.QUEUED] -= queued
        self._counts[TaskState.HELD] -= len(gone) - queued
        self._order.drop_all(gone)
        changed = [self._alive[number] for number in row.numbers if number not in gone and number in self._alive]
        seen = [item for number, item in tuple(self._looked_at.items()) if number in gone]
        for item in changed:
            self.replace(item, _ended_by(row, item.row))
        for item in seen:
            item.row = _ended_by(row, item.row)
        self.on_change()
        return [*changed, *seen]

    def needed(self, number: int) -> bool:
        """Return whether another job waits for a job."""
        return bool(self._dependents.get(number))

    def _item(self, number: int) -> QueueEntry | None:
        """Return a job that has not ended; read it if only its place is in memory.

        All references share one object, which is dropped with the last reference unless it changes.
        """
        item = self._alive.get(number)
        if item is None and self._is_parked(number):
            item = self._looked_at.get(number)
            row = None if item is not None else self._journal.waiting_job(number)
            if row is not None:
                item = self._looked_at[number] = QueueEntry(row)
        return item

    def _hold(self, item: QueueEntry) -> None:
        """Hold all of a job in memory from now on, because it is near its turn, or changes."""
        if self._is_parked(item.number):
            self._alive[item.number] = item

    @property
    def order(self) -> QueueOrder:
        """The order of the jobs that wait for their turn, or are held."""
        return self._order

    @property
    def counts(self) -> dict[str, int]:
        """The number of jobs that have not ended, by state."""
        return {state.value: count for state, count in self._counts.items() if count and not state.ended}

    @property
    def interrupted(self) -> QueueEntry | None:
        """The first interrupted job, which waits for a user's decision, or None."""
        return self._alive[self._interrupted[0]] if self._interrupted else None

    @property
    def anything_waits(self) -> bool:
        """Whether any job would begin by itself, now or when its turn comes."""
        return bool(self._under_way or self._interrupted or self._counts[TaskState.QUEUED])

    def get(self, number: int) -> QueueEntry:
        """Return a job that has not ended, or has ended lately; raises `NotFound`."""
        item = self.find(number)
        if item is None:
            raise NotFound(what="job", number=number)
        return item

    def find(self, number: int) -> QueueEntry | None:
        """Return a job that has not ended, or has ended lately, None if it is unknown."""
        return self._item(number) or self._ended.get(number)

    def in_memory(self, number: int) -> QueueEntry | None:
        """Return a job as `find` does, but None if only its place is in memory: nothing is read."""
        if self._is_parked(number):
            return self._looked_at.get(number)
        return self._alive.get(number) or self._ended.get(number)

    def alive(self, number: int) -> bool:
        """Return whether a job has not ended."""
        return number in self._alive or number in self._order

    def waiting(self, count: int) -> list[QueueEntry]:
        """Return the first `count` waiting jobs, held ones included, in the order of the queue."""
        going_on = [self._alive[number] for number in (*self._interrupted, *self._under_way)]
        left = max(0, count - len(going_on))
        return [*going_on, *(self._known(number) for number in self._order.first(left))][:count]

    def going_on(self) -> QueueEntry | None:
        """Return the job that has begun and must continue before any other begins, or None."""
        return self._alive[self._under_way[0]] if self._under_way else None

    def next(self, may_begin: MayBegin) -> QueueEntry | None:
        """Return the next job that may begin, or None."""
        number = self._order.next(may_begin)
        return None if number is None else self._known(number)

    def _known(self, number: int) -> QueueEntry:
        """Return a job that has not ended, and hold it in memory."""
        item = self._item(number)
        assert item is not None
        self._hold(item)
        return item

    def next_direct(self, may_begin: MayBegin) -> QueueEntry | None:
        """Return the first direct command that may begin, or None."""
        items = (self._alive[number] for number in self._direct)
        return next((item for item in items if item.may_begin and may_begin(item.row.owner.name)), None)

    def add(self, item: QueueEntry) -> None:
        """Add a new job."""
        self._alive[item.number] = item
        for number in item.waits_for:
            self._dependents[number].add(item.number)
        self._counts[item.row.state] += 1
        self._line_up(item)

    def replace(self, item: QueueEntry, row: JobRow) -> None:
        """Replace a job's row by a newer version."""
        self._hold(item)
        self._counts[item.row.state] -= 1
        self._counts[row.state] += 1
        item.row = row
        if row.state.ended:
            self._end(item)
        self._line_up(item)

    def depend(self, item: QueueEntry, numbers: frozenset[int]) -> None:
        """Set the jobs for which a job waits."""
        self._hold(item)
        for number in item.waits_for:
            self._dependents[number].discard(item.number)
        item.waits_for = numbers
        for number in numbers:
            self._dependents[number].add(item.number)
        self._line_up(item)

    def dependents(self, number: int) -> list[QueueEntry]:
        """Return the jobs that wait for a job, in order of submission."""
        return [self._alive[one] for one in sorted(self._dependents.get(number, ())) if one in self._alive]

    def no_longer_direct(self) -> list[QueueEntry]:
        """Make direct commands ordinary jobs, and return those that still waited."""
        items = [self._alive[number] for number in self._direct]
        for item in items:
            item.direct = False
        self._direct.clear()
        return items

    def _line_up(self, item: QueueEntry) -> None:
        """Put a job into the lists that match its state, and remove it from the others."""
        row, number = item.row, item.number
        if row.state is TaskState.HELD:
            item.direct = False  # its release or approval may come much later, in a queue that was paused for a reason
        going_on = not row.state.ended and item.begun
        if row.state in _LINED_UP and not going_on:
            place = QueuePosition.of(row.options.priority, row.position, number)
            self._order.put(place, row.owner.name, ready=row.state is TaskState.QUEUED and not item.waits_for)
        else:
            self._order.drop(number)
        _keep(self._under_way, number, among=going_on and row.state in _GOING_ON)
        _keep(self._interrupted, number, among=row.state is TaskState.INTERRUPTED)
        _keep(self._direct, number, among=item.direct and row.state is TaskState.QUEUED)
        self.on_change()

    def _end(self, item: QueueEntry) -> None:
        del self._alive[item.number]
        for number in item.waits_for:
            self._dependents[number].discard(item.number)
        self._dependents.pop(item.number, None)
        self._ended[item.number] = item
        while len(self._ended) > REMEMBERED:
            del self._ended[next(iter(self._ended))]


def _ended_by(end: ClearedJobs, row: JobRow) -> JobRow:
    return replace(row, state=end.state, code=end.code, message=end.message, ended=end.ended)


def _keep(numbers: list[int], number: int, *, among: bool) -> None:
    """Add a number to a list, or remove it."""
    if among and number not in numbers:
        numbers.append(number)
    elif not among and number in numbers:
        numbers.remove(number)
