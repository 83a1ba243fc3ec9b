"""The order of the queue: who is next, and where a job goes that is moved. Pure; knows numbers, not jobs.

The greater priority goes first; within one priority the smaller position, then the smaller number. Only what is ready
is ever next: what is held, or waits for another job, keeps its place and lets the others pass.
"""

from __future__ import annotations

from bisect import bisect_left, insort
from collections.abc import Callable, Container, Iterable, Iterator
from itertools import islice
from typing import NamedTuple

MayBegin = Callable[[str], bool]
"""Tells whether a job of this owner may begin."""


class Place(NamedTuple):
    """Where a job stands; places compare as the queue goes."""

    back: int
    """The priority with its sign turned."""
    position: float
    number: int

    @classmethod
    def of(cls, priority: int, position: float, number: int) -> Place:
        """Return the place of job `number`."""
        return cls(-priority, position, number)

    @property
    def priority(self) -> int:
        """The greater goes first."""
        return -self.back


class Order:
    """Jobs in the order of the queue. Finding the next costs the same however many wait."""

    def __init__(self) -> None:
        self._places: dict[int, Place] = {}
        self._line: list[Place] = []
        self._ready: dict[str, list[Place]] = {}
        self._owners: dict[int, str] = {}
        self._last = 0.0

    def __len__(self) -> int:
        return len(self._line)

    def __contains__(self, number: int) -> bool:
        return number in self._places

    def __iter__(self) -> Iterator[int]:
        return (place.number for place in tuple(self._line))

    def first(self, count: int) -> list[int]:
        """Return the numbers of the first jobs, ready or not, `count` at most."""
        return [place.number for place in islice(self._line, count)]

    def place_of(self, number: int) -> int | None:
        """Return the place of a job, from 1, None where it does not wait."""
        place = self._places.get(number)
        return None if place is None else bisect_left(self._line, place) + 1

    def end(self, number: int) -> float:
        """Return the position of a new job `number`, behind all that there ever were."""
        return max(float(number), self._last + 1.0)

    def put(self, place: Place, owner: str, *, ready: bool) -> None:
        """Put a job of `owner` at its place, or at another one, or make it ready or not."""
        self.drop(place.number)
        self._places[place.number] = place
        insort(self._line, place)
        self._last = max(self._last, place.position)
        if ready:
            self._owners[place.number] = owner
            insort(self._ready.setdefault(owner, []), place)

    def fill(self, places: Iterable[tuple[Place, str, bool]]) -> None:
        """Fill an empty order with many jobs: places in the queue's order, owners, and whether they are ready."""
        for place, owner, ready in places:
            self._places[place.number] = place
            self._line.append(place)
            self._last = max(self._last, place.position)
            if ready:
                self._owners[place.number] = owner
                self._ready.setdefault(owner, []).append(place)

    def is_ready(self, number: int) -> bool:
        """Tell whether a job may be next."""
        return number in self._owners

    def drop_all(self, numbers: Container[int]) -> None:
        """Remove many jobs at once."""
        self._line = [place for place in self._line if place.number not in numbers]
        self._places = {place.number: place for place in self._line}
        self._owners = {number: owner for number, owner in self._owners.items() if number not in numbers}
        kept = {owner: [one for one in places if one.number not in numbers] for owner, places in self._ready.items()}
        self._ready = {owner: places for owner, places in kept.items() if places}

    def drop(self, number: int) -> None:
        """Take a job out, where it is in."""
        place = self._places.pop(number, None)
        if place is None:
            return
        _remove(self._line, place)
        owner = self._owners.pop(number, None)
        if owner is not None:
            _remove(self._ready[owner], place)
            if not self._ready[owner]:
                del self._ready[owner]

    def next(self, may_begin: MayBegin) -> int | None:
        """Return the first job that is ready and whose owner may begin, None where there is none."""
        firsts = [places[0] for owner, places in self._ready.items() if may_begin(owner)]
        return min(firsts).number if firsts else None

    def moved(self, number: int, beside: int, *, behind: bool) -> list[Place]:
        """Return the new places of jobs, so that `number` stands before or `behind` the job `beside`, at its priority.

        There are several where no number lies between two neighbours' positions any more. Both jobs are in the order.
        """
        there = self._places[beside]
        neighbour = self._neighbour(there, number, 1 if behind else -1)
        low, high = (there, neighbour) if behind else (neighbour, there)
        position = _between(low, high)
        if position is not None:
            return [Place(there.back, position, number)]
        rest = [place.number for place in self._line if place.back == there.back and place.number != number]
        rest.insert(rest.index(beside) + behind, number)
        return [Place(there.back, float(n), one) for n, one in enumerate(rest, 1)]

    def outermost(self, number: int, *, last: bool) -> int | None:
        """Return the first job, or the `last`, that is not `number`; None where there is no other."""
        ends = self._line[:-3:-1] if last else self._line[:2]
        return next((place.number for place in ends if place.number != number), None)

    def _neighbour(self, place: Place, number: int, way: int) -> Place | None:
        """Return who stands next to a place, before it (-1) or behind it (1), `number` left out; of its priority."""
        index = bisect_left(self._line, place) + way
        if 0 <= index < len(self._line) and self._line[index].number == number:
            index += way
        if not 0 <= index < len(self._line) or self._line[index].back != place.back:
            return None
        return self._line[index]


def _between(low: Place | None, high: Place | None) -> float | None:
    """Return a position between two neighbours, None where there is no number left; one of them may be missing."""
    if low is None:
        return 0.0 if high is None else high.position - 1.0
    if high is None:
        return low.position + 1.0
    middle = (low.position + high.position) / 2.0
    return middle if low.position < middle < high.position else None


def _remove(places: list[Place], place: Place) -> None:
    del places[bisect_left(places, place)]
