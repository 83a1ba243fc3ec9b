"""The order of the queue against the plainest description of it: sort, and take the first that may."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest
from hypothesis import strategies as st
from hypothesis.stateful import Bundle, RuleBasedStateMachine, consumes, invariant, multiple, rule

from maya_un.process.queue_order import QueueOrder, QueuePosition

OWNERS = ("ana", "ben", "eva")


@dataclass
class Told:
    """Announcements of a job."""

    number: int
    priority: int
    position: float
    owner: str
    ready: bool = True

    @property
    def key(self) -> tuple[int, float, int]:
        return (-self.priority, self.position, self.number)

    @property
    def place(self) -> QueuePosition:
        return QueuePosition.of(self.priority, self.position, self.number)


@dataclass
class Line:
    """Jobs in a list, sorted whenever somebody asks."""

    jobs: dict[int, Told] = field(default_factory=dict)

    def sorted(self) -> list[Told]:
        return sorted(self.jobs.values(), key=lambda job: job.key)

    def next(self, driver: str | None) -> int | None:
        ready = (job.number for job in self.sorted() if job.ready and driver in (None, job.owner))
        return next(ready, None)


class OrderMachine(RuleBasedStateMachine):
    """Does the same to both."""

    numbers = Bundle("numbers")

    def __init__(self) -> None:
        super().__init__()
        self.order = QueueOrder()
        self.line = Line()
        self.count = 0

    @rule(target=numbers, priority=st.integers(-2, 2), owner=st.sampled_from(OWNERS), ready=st.booleans())
    def put(self, priority: int, owner: str, ready: bool) -> int:
        self.count += 1
        job = Told(self.count, priority, self.order.end(self.count), owner, ready)
        assert all(job.position > other.position for other in self.line.jobs.values())
        self._put(job)
        return self.count

    @rule(number=numbers, ready=st.booleans())
    def make_ready(self, number: int, ready: bool) -> None:
        job = self.line.jobs[number]
        job.ready = ready
        self._put(job)

    @rule(number=numbers, beside=numbers, behind=st.booleans())
    def move(self, number: int, beside: int, behind: bool) -> None:
        if number == beside:
            return
        rest = [job.number for job in self.line.sorted() if job.number != number]
        rest.insert(rest.index(beside) + behind, number)
        for place in self.order.moved(number, beside, behind=behind):
            job = self.line.jobs[place.number]
            job.priority, job.position = place.priority, place.position
            self._put(job)
        assert list(self.order) == rest

    @rule(target=numbers, number=consumes(numbers))
    def drop(self, number: int) -> object:
        self.order.drop(number)
        self.order.drop(number)
        del self.line.jobs[number]
        return multiple()

    @rule(numbers=st.sets(st.integers(1, 20)))
    def drop_all(self, numbers: set[int]) -> None:
        self.order.drop_all(numbers)
        assert list(self.order) == [job.number for job in self.line.sorted() if job.number not in numbers]
        for number in numbers & self.line.jobs.keys():
            self._put(self.line.jobs[number])

    @rule()
    def fill_another(self) -> None:
        order = QueueOrder()
        order.fill((job.place, job.owner, job.ready) for job in self.line.sorted())
        self.order = order

    @invariant()
    def the_same(self) -> None:
        expected = [job.number for job in self.line.sorted()]
        assert list(self.order) == expected
        assert [self.order.place_of(number) for number in expected] == list(range(1, len(expected) + 1))
        assert self.order.first(2) == expected[:2]
        assert self.order.ready_count == sum(job.ready for job in self.line.jobs.values())
        for number, job in self.line.jobs.items():
            assert self.order.is_ready(number) == job.ready
            rest = [other for other in expected if other != number]
            assert self.order.outermost(number, last=False) == (rest[0] if rest else None)
            assert self.order.outermost(number, last=True) == (rest[-1] if rest else None)
        for driver in (None, *OWNERS):
            found = self.order.next(lambda owner, driver=driver: driver in (None, owner))
            assert found == self.line.next(driver)

    def _put(self, job: Told) -> None:
        self.line.jobs[job.number] = job
        self.order.put(job.place, job.owner, ready=job.ready)


TestOrder = OrderMachine.TestCase


def test_a_job_that_is_not_there_has_no_place() -> None:
    order = QueueOrder()
    assert order.place_of(1) is None
    assert order.next(lambda _: True) is None
    assert 1 not in order


def test_jobs_are_moved_between_the_same_two_for_ever() -> None:
    """Positions between two neighbours run out; then the neighbours get new ones, in the same order."""
    order = QueueOrder()
    for number in range(1, 4):
        order.put(QueuePosition.of(0, float(number), number), "ana", ready=True)
    renumbered = 0
    for turn in range(200):
        mover, last = (3, 2) if turn % 2 == 0 else (2, 3)
        places = order.moved(mover, 1, behind=True)
        renumbered += len(places) > 1
        for place in places:
            order.put(place, "ana", ready=True)
        assert list(order) == [1, mover, last]
    assert renumbered > 0


@pytest.mark.parametrize("behind", [False, True])
def test_a_moved_job_takes_the_priority_of_its_neighbour(behind: bool) -> None:
    order = QueueOrder()
    order.put(QueuePosition.of(5, 1.0, 1), "ana", ready=True)
    order.put(QueuePosition.of(0, 2.0, 2), "ana", ready=True)
    (place,) = order.moved(2, 1, behind=behind)
    assert (place.number, place.priority) == (2, 5)
