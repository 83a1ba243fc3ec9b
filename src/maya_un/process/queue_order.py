"""The order of the queue: the next job, and the new place of a moved job. Pure; it knows numbers, not jobs.

The greater priority comes first; within one priority the smaller position, then the smaller number. Only a ready job
can be next: a job that is held, or waits for another, keeps its place, and later jobs pass it.

A job takes some 36 bytes, because very many may wait: numbers and positions are stored in arrays.
"""

from __future__ import annotations

from array import array
from bisect import bisect_left
from collections.abc import Callable, Container, Iterable, Iterator
from itertools import pairwise
from typing import NamedTuple

MayBegin = Callable[[str], bool]
"""Returns whether a job of this owner may begin."""


class QueuePosition(NamedTuple):
    """The place of a job; places compare in the order of the queue."""

    back: int
    """The negated priority."""
    position: float
    number: int

    @classmethod
    def of(cls, priority: int, position: float, number: int) -> QueuePosition:
        """Return the place of job `number`."""
        return cls(-priority, position, number)

    @property
    def priority(self) -> int:
        """The priority; the greater comes first."""
        return -self.back


class _Kind(NamedTuple):
    """The common fields of many jobs."""

    back: int
    owner: str
    ready: bool


class QueueOrder:
    """Jobs in the order of the queue. The cost of finding the next is independent of their number.

    Three columns have a row for every job, in the order of the numbers: its number, its position and its kind, an index
    into `_kinds`. The line of all jobs, and the line of each owner's ready jobs, hold numbers in the queue's order.
    """

    def __init__(self) -> None:
        self._numbers = array("q")
        self._positions = array("d")
        self._kind = array("i")
        self._kinds: list[_Kind] = []
        self._kind_of: dict[_Kind, int] = {}
        self._line = array("q")
        self._ready: dict[str, array[int]] = {}
        self._last = 0.0

    def __len__(self) -> int:
        return len(self._line)

    def __contains__(self, number: int) -> bool:
        row = self._row(number)
        return row < len(self._numbers) and self._numbers[row] == number

    def __iter__(self) -> Iterator[int]:
        return iter(self._line[:])

    @property
    def ready_count(self) -> int:
        """The number of ready jobs."""
        return sum(map(len, self._ready.values()))

    def first(self, count: int) -> list[int]:
        """Return the numbers of the first jobs, ready or not, `count` at most."""
        return list(self._line[:count])

    def place_of(self, number: int) -> int | None:
        """Return the place of a job, from 1, None if it does not wait."""
        return self._spot(self._line, self._place(number)) + 1 if number in self else None

    def end(self, number: int) -> float:
        """Return the position of a new job `number`, after all earlier positions."""
        return max(float(number), self._last + 1.0)

    def put(self, place: QueuePosition, owner: str, *, ready: bool) -> None:
        """Put a job of `owner` at its place, or update its place and whether it is ready."""
        self.drop(place.number)
        lines = [self._line, self._ready.setdefault(owner, array("q"))] if ready else [self._line]
        for line in lines:
            line.insert(self._spot(line, place), place.number)
        row = self._row(place.number)
        self._numbers.insert(row, place.number)
        self._positions.insert(row, place.position)
        self._kind.insert(row, self._index_of(_Kind(place.back, owner, ready)))
        self._last = max(self._last, place.position)

    def fill(self, places: Iterable[tuple[QueuePosition, str, bool]]) -> None:
        """Fill an empty order with many jobs: places in the queue's order, owners, and whether they are ready."""
        for place, owner, ready in places:
            self._line.append(place.number)
            if ready:
                self._ready.setdefault(owner, array("q")).append(place.number)
            self._positions.append(place.position)
            self._kind.append(self._index_of(_Kind(place.back, owner, ready)))
            self._last = max(self._last, place.position)
        self._numbers = self._line[:]
        if any(one > other for one, other in pairwise(self._line)):
            self._keep(sorted(range(len(self)), key=self._line.__getitem__))

    def is_ready(self, number: int) -> bool:
        """Return whether a job may be next."""
        return number in self and self._kinds[self._kind[self._row(number)]].ready

    def drop_all(self, numbers: Container[int]) -> None:
        """Remove many jobs at once."""
        self._keep([row for row, number in enumerate(self._numbers) if number not in numbers])
        self._line = array("q", (one for one in self._line if one not in numbers))
        kept = {owner: array("q", (one for one in line if one not in numbers)) for owner, line in self._ready.items()}
        self._ready = {owner: line for owner, line in kept.items() if line}

    def drop(self, number: int) -> None:
        """Remove a job, if present."""
        if number not in self:
            return
        row, place = self._row(number), self._place(number)
        kind = self._kinds[self._kind[row]]
        del self._line[self._spot(self._line, place)]
        if kind.ready:
            line = self._ready[kind.owner]
            del line[self._spot(line, place)]
            if not line:
                del self._ready[kind.owner]
        del self._numbers[row], self._positions[row], self._kind[row]

    def next(self, may_begin: MayBegin) -> int | None:
        """Return the first ready job whose owner may begin, None without one."""
        firsts = (line[0] for owner, line in self._ready.items() if may_begin(owner))
        return min(firsts, key=self._place, default=None)

    def moved(self, number: int, beside: int, *, behind: bool) -> list[QueuePosition]:
        """Return the new places of jobs that put `number` before or `behind` the job `beside`, at its priority.

        Several jobs move if no number lies between the positions of two neighbours. Both jobs must be in the order.
        """
        there = self._place(beside)
        neighbour = self._neighbour(there, number, 1 if behind else -1)
        low, high = (there, neighbour) if behind else (neighbour, there)
        position = _between(low, high)
        if position is not None:
            return [QueuePosition(there.back, position, number)]
        rest = [one for one in self._line if one != number and self._place(one).back == there.back]
        rest.insert(rest.index(beside) + behind, number)
        return [QueuePosition(there.back, float(n), one) for n, one in enumerate(rest, 1)]

    def outermost(self, number: int, *, last: bool) -> int | None:
        """Return the first job, or the `last`, other than `number`; None without another."""
        ends = self._line[:-3:-1] if last else self._line[:2]
        return next((one for one in ends if one != number), None)

    def _row(self, number: int) -> int:
        """Return the row of a job in the columns, or its insertion row."""
        return bisect_left(self._numbers, number)

    def _place(self, number: int) -> QueuePosition:
        """Return the place of a job in the order."""
        row = self._row(number)
        return QueuePosition(self._kinds[self._kind[row]].back, self._positions[row], number)

    def _spot(self, line: array[int], place: QueuePosition) -> int:
        """Return the number of jobs of a line before a place."""
        return bisect_left(line, place, key=self._place)

    def _neighbour(self, place: QueuePosition, number: int, way: int) -> QueuePosition | None:
        """Return the neighbour before a place (-1) or after it (1), without `number`.

        None unless its priority is the same.
        """
        index = self._spot(self._line, place) + way
        if 0 <= index < len(self._line) and self._line[index] == number:
            index += way
        if not 0 <= index < len(self._line):
            return None
        found = self._place(self._line[index])
        return found if found.back == place.back else None

    def _index_of(self, kind: _Kind) -> int:
        """Return the index of a kind; a new kind is added."""
        index = self._kind_of.setdefault(kind, len(self._kinds))
        if index == len(self._kinds):
            self._kinds.append(kind)
        return index

    def _keep(self, rows: list[int]) -> None:
        """Keep these rows of the columns, in this order."""
        self._numbers = array("q", map(self._numbers.__getitem__, rows))
        self._positions = array("d", map(self._positions.__getitem__, rows))
        self._kind = array("i", map(self._kind.__getitem__, rows))


def _between(low: QueuePosition | None, high: QueuePosition | None) -> float | None:
    """Return a position between two neighbours, of which one may be missing; None if no number lies between them."""
    if low is None:
        return 0.0 if high is None else high.position - 1.0
    if high is None:
        return low.position + 1.0
    middle = (low.position + high.position) / 2.0
    return middle if low.position < middle < high.position else None
