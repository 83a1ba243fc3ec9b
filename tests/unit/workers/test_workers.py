"""A worker process: its answers, limits, order of callers, and replacement."""

from __future__ import annotations

import asyncio
import os
import pickle
import re
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import ClassVar

import pytest

from dmc41x3.loops import run, run_virtual
from maya_un.errors import InternalError, InvalidJob, TakesTooLong, TooLarge, TooMuchAsked, WorkerFailed
from maya_un.values import Mode, Point
from maya_un.workers import ComputeLimits, Workers
from maya_un.workers.wire import pickled
from tests.unit.workers import tasks


@pytest.fixture(scope="module", autouse=True)
def forked_workers() -> None:
    """Have workers start from nothing here."""


BOUNDS = ComputeLimits(seconds=0.5, memory=1 << 29, most=8, each=3)


@contextmanager
def working(bounds: ComputeLimits = BOUNDS) -> Iterator[Workers]:
    """Keep a worker while the block runs."""
    workers = Workers("test", bounds, tasks.prepare, 5)
    try:
        yield workers
    finally:
        workers.close()


def test_a_worker_prepared_once_answers_with_value_and_parts() -> None:
    async def main() -> None:
        with working() as workers:
            assert (await workers.run(tasks.add, 1, 2)).value == 8
            answer = await workers.run(tasks.pieces, 3)
            assert (answer.parts, answer.value) == ([[0], [1], [2]], "end")
            assert workers.process == (await workers.run(tasks.number)).value

    run(main())


def test_error_of_ours_crosses_with_its_details() -> None:
    async def main() -> None:
        with working() as workers:
            with pytest.raises(InvalidJob, match=r"steps\.3") as told:
                await workers.run(tasks.refused)
            assert told.value.details == {"key": "steps.3", "reason": "no"}
            with pytest.raises(WorkerFailed, match="ZeroDivisionError"):
                await workers.run(tasks.broken)

    run(main())


def test_work_beyond_time_or_memory_is_refused_and_the_next_is_done() -> None:
    async def main() -> None:
        with working() as workers:
            with pytest.raises(TakesTooLong):
                await workers.run(tasks.endless)
            with pytest.raises(TooLarge):
                await workers.run(tasks.greedy)
            assert (await workers.run(tasks.add, 1, 2)).value == 8

    run(main())


def test_a_worker_that_dies_is_replaced_and_only_the_deadly_is_refused() -> None:
    async def main() -> None:
        with working() as workers:
            first = (await workers.run(tasks.number)).value
            os.kill(first, signal.SIGKILL)
            assert (await workers.run(tasks.number)).value != first
            with pytest.raises(WorkerFailed):
                await workers.run(tasks.deadly)
            assert (await workers.run(tasks.add, 1, 2)).value == 8

    run(main())


def test_every_caller_has_a_turn_and_none_too_many_requests() -> None:
    async def main() -> None:
        with working(ComputeLimits(seconds=60.0, most=8, each=3)) as workers:
            hostile = [asyncio.ensure_future(workers.run(tasks.endless, whose="eva")) for _ in range(3)]
            assert (await workers.run(tasks.add, 1, 2, whose="ana")).value == 8
            with pytest.raises(TooMuchAsked):
                await workers.run(tasks.add, 1, 2, whose="eva")
            assert not any(one.done() for one in hostile)
            for one in hostile:
                one.cancel()
            await asyncio.gather(*hostile, return_exceptions=True)
            assert (await workers.run(tasks.add, 1, 2, whose="eva")).value == 8

    run(main())


def test_jumping_clock_stops_while_a_worker_works() -> None:
    async def main() -> float:
        with working() as workers:
            loop = asyncio.get_running_loop()
            timer = loop.call_later(10.0, lambda: None)
            await workers.run(tasks.add, 1, 2)
            timer.cancel()
            return loop.time()

    assert run_virtual(main()) == 0.0


def test_a_closed_worker_refuses_and_leaves_no_process() -> None:
    async def main() -> None:
        with working() as workers:
            process = (await workers.run(tasks.number)).value
        with pytest.raises(WorkerFailed):
            await workers.run(tasks.add, 1, 2)
        with pytest.raises(ProcessLookupError):
            os.kill(process, 0)

    run(main())


@pytest.mark.waits("2 s of patience with a process that hangs")
@pytest.mark.parametrize("size", [1, 4_000_000])
def test_worker_that_hangs_is_replaced_and_its_request_refused(size: int) -> None:
    """A stopped process computes nothing, so that no limit of its computing ends it; a long request fills its pipe."""

    async def main() -> None:
        with working(ComputeLimits(patience=2.0)) as workers:
            first = (await workers.run(tasks.number)).value
            os.kill(first, signal.SIGSTOP)
            with pytest.raises(TakesTooLong, match="2 s"):
                await workers.run(tasks.length, bytes(size))
            assert (await workers.run(tasks.number)).value != first
            assert (await workers.run(tasks.length, bytes(4_000_000))).value == 4_000_000
            with pytest.raises(ProcessLookupError):
                os.kill(first, 0)

    run(main())


@pytest.mark.waits("2 s of patience with a process that hangs")
def test_worker_that_hangs_delays_others_and_refuses_none_of_them() -> None:
    async def main() -> None:
        with working(ComputeLimits(patience=2.0)) as workers:
            first = (await workers.run(tasks.number)).value
            os.kill(first, signal.SIGSTOP)
            hangs = asyncio.ensure_future(workers.run(tasks.add, 1, 2, whose="eva"))
            waits = asyncio.ensure_future(workers.run(tasks.add, 3, 4, whose="ana"))
            with pytest.raises(TakesTooLong):
                await hangs
            assert (await waits).value == 12

    run(main())


def test_defect_while_reading_an_answer_is_reported_and_the_next_request_runs() -> None:
    async def main() -> None:
        with working() as workers:
            async with asyncio.timeout(60.0):
                with pytest.raises(InternalError, match="it is unreadable"):
                    await workers.run(tasks.unreadable)
                assert (await workers.run(tasks.add, 1, 2)).value == 8

    run(main())


def test_worker_forgets_every_request_whose_caller_has_left() -> None:
    """It leaves before, while or after the worker gets the request, which is long so that this takes a while."""

    async def main() -> None:
        with working(ComputeLimits(seconds=60.0, most=8, each=3)) as workers:
            await workers.run(tasks.add, 1, 2)
            for turns in range(0, 300, 5):
                leaving = asyncio.ensure_future(workers.run(tasks.endless, bytes(4_000_000)))
                for _ in range(turns):
                    await asyncio.sleep(0)
                leaving.cancel()
                await asyncio.gather(leaving, return_exceptions=True)
            assert (await workers.run(tasks.under_way)).value == 0

    run(main())


@dataclass(frozen=True)
class Compiled:
    """Stands for a dataclass that mypyc has compiled: pickle can restore it only by setting its attributes."""

    __mypyc_attrs__: ClassVar[tuple[str, ...]] = ("size", "parts")
    size: float
    parts: tuple[Compiled, ...] = ()

    def __getstate__(self) -> tuple[None, dict[str, object]]:
        return None, {"size": self.size, "parts": self.parts}


@dataclass(frozen=True, slots=True)
class Fixed:
    """A frozen dataclass with slots."""

    name: str
    size: float = 1.0


@dataclass(frozen=True, slots=True)
class Wider(Fixed):
    """One that inherits fields."""

    part: Fixed | None = None


def test_every_kind_of_value_goes_through_the_pipe() -> None:
    value = [
        Compiled(1.0, (Compiled(2.0),)), Fixed("a"), Wider("b", 2.0, Fixed("c")), Wider, Mode, Mode.IDLE,
        Point(1, 2, 3), InvalidJob, re.compile("[a-z]"), {1: {2}, "x": frozenset({b"y"})}, 1j,
    ]  # fmt: skip
    assert pickle.loads(pickled(value)) == value
    error = pickle.loads(pickled(InvalidJob(key="a", reason="b")))
    assert (type(error), error.details) == (InvalidJob, {"key": "a", "reason": "b"})
