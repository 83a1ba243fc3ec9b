"""One description of a verb serves both clients, and help shows what it takes."""

from __future__ import annotations

import inspect
from collections.abc import AsyncIterator, Iterator
from typing import Any, TypeVar

import pytest

from maya_un.client import AsyncClient, Client
from maya_un.client.request import Request, get
from maya_un.client.resources import AsyncJobHandle, AsyncQueue, JobHandle, Queue
from maya_un.client.steps import Awaiting, Blocking, Emit, Plan, PlanRunner, Sleep, Stream, StreamPlan, Verb

T = TypeVar("T")


def asked(number: int, *, twice: bool = False) -> Plan[int]:
    """Ask for a number."""
    first = yield from get("/number", int, number=number)
    return first + (yield from get("/number", int)) if twice else first


def counted(most: int) -> StreamPlan[int]:
    """Count."""
    for number in range(most):
        yield Emit(number)


class Verbs:
    asked = Verb(asked)
    counted = Stream(counted)


class Answers(Verbs, Blocking):
    """Answers every request with 21."""

    def perform(self, plan: Plan[T]) -> T:
        course: PlanRunner[T] = PlanRunner(plan)
        while course.step is not None:
            course.answered(21)
        return course.result

    def iterate(self, source: StreamPlan[T]) -> Iterator[T]:
        course: PlanRunner[None] = PlanRunner(source)
        while isinstance(course.step, Emit):
            yield course.step.value
            course.answered(None)


class LateAnswers(Verbs, Awaiting):
    """The same in a loop."""

    async def perform(self, plan: Plan[T]) -> T:
        return Answers().perform(plan)

    async def iterate(self, source: StreamPlan[T]) -> AsyncIterator[T]:
        for item in Answers().iterate(source):
            yield item


def test_on_a_client_that_blocks_a_verb_returns_the_answer() -> None:
    assert Answers().asked(1) == 21
    assert Answers().asked(1, twice=True) == 42
    assert list(Answers().counted(3)) == [0, 1, 2]


async def test_on_a_client_that_awaits_the_same_verb_is_awaited() -> None:
    assert await LateAnswers().asked(1, twice=True) == 42
    assert [item async for item in LateAnswers().counted(3)] == [0, 1, 2]


def test_help_shows_the_arguments_and_the_result_of_the_plan() -> None:
    method = Answers().asked
    assert str(inspect.signature(method)) == "(number: 'int', *, twice: 'bool' = False) -> 'int'"
    assert inspect.getdoc(method) == "Ask for a number."
    assert method.__name__ == "asked"


@pytest.mark.parametrize(("one", "other"), [(Client, AsyncClient), (Queue, AsyncQueue), (JobHandle, AsyncJobHandle)])
def test_both_clients_have_the_same_verbs_with_the_same_arguments(one: type, other: type) -> None:
    dunder = {"__iter__", "__aiter__", "__enter__", "__exit__", "__aenter__", "__aexit__"}
    own = {name for name in dir(one) if not name.startswith("_")} - {"beside"}
    assert own == {name for name in dir(other) if not name.startswith("_")} - dunder
    for name in own:
        here, there = getattr(one, name), getattr(other, name)
        if callable(here) and inspect.isfunction(here):
            assert list(inspect.signature(here).parameters) == list(inspect.signature(there).parameters), name
        elif isinstance(here, Verb | Stream):
            assert here is there


def test_every_verb_has_a_description() -> None:
    for owner in (Client, Queue, JobHandle):
        for name in dir(owner):
            if not name.startswith("_"):
                assert inspect.getdoc(getattr(owner, name)), name


def test_the_handle_of_a_job_has_its_number_left_out() -> None:
    assert list(JobHandle.wait.__signature__.parameters) == ["timeout"]


def test_error_of_a_step_is_thrown_into_the_plan() -> None:
    def careful() -> Plan[str]:
        try:
            yield from Sleep(1.0)
        except KeyError:
            yield from get("/cleanup", int)
            return "cleaned"
        return "undisturbed"

    course: PlanRunner[str] = PlanRunner(careful())
    course.failed(KeyError())
    assert isinstance(course.step, Request)
    course.answered(0)
    assert course.step is None
    assert course.result == "cleaned"


def test_unhandled_error_is_raised_by_the_plan() -> None:
    course: PlanRunner[Any] = PlanRunner(Sleep(1.0))
    with pytest.raises(ZeroDivisionError):
        course.failed(ZeroDivisionError())
