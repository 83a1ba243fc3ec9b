"""A job stored so that a power cut does not lose it: Maya's journal beside persist-queue, both on SQLite."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from threading import Thread
from typing import Any, Protocol, TypeVar

import numpy as np

from benchmarks.peers.contest import Contest, Floats, LeftOut, Side, peer
from maya_un.process.journal.protocol import JobOptions, JobRow, RequestOwner
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.schema.jobs import TaskState
from scripts.performance_results import OURS, Growth

T = TypeVar("T")

EACH = 20
"""Number of jobs of one submitter in a sample."""

SUBMITTERS = 16

SAMPLES = 15
"""Number of samples of every size of a queue."""


def job(number: int) -> JobRow:
    """Return a small job of four steps that waits."""
    return JobRow(
        number,
        f"tray {number}",
        {"name": f"tray {number}", "steps": [{"pick": [0.5, 1.1]}, {"place": [1.1, 0.5]}] * 2},
        JobOptions(),
        RequestOwner("student", "10.0.0.7"),
        TaskState.QUEUED,
        float(number),
        "2026-03-01T08:00:00Z",
        4,
    )


class Store(Protocol):
    """A durable queue in a folder of its own."""

    def fill(self, jobs: int) -> None:
        """Put so many jobs in, together."""
        ...

    def submit(self, submitters: int, each: int = EACH) -> None:
        """Put jobs of every submitter in, each on its own and durable before the next of the same submitter."""
        ...

    def kept(self) -> list[str]:
        """Close the queue, open it again, and return the names of the jobs in it."""
        ...

    def close(self) -> None:
        """Close it."""
        ...


class Journal:
    """Maya's."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / "maya.db"
        self._loop = asyncio.new_event_loop()
        self._numbers = count(1)
        self._journal: SqliteJournal = self._do(SqliteJournal.open(self._path))

    def _do(self, work: Coroutine[Any, Any, T]) -> T:
        return self._loop.run_until_complete(work)

    def fill(self, jobs: int) -> None:
        """Put so many jobs in, together."""
        self._do(self._journal.add(*(job(next(self._numbers)) for _ in range(jobs))))

    def submit(self, submitters: int, each: int = EACH) -> None:
        """Put jobs of every submitter in, one after the other."""

        async def one() -> None:
            for _ in range(each):
                await self._journal.add(job(next(self._numbers)))

        async def together() -> None:
            await asyncio.gather(*(one() for _ in range(submitters)))

        self._do(together())

    def kept(self) -> list[str]:
        """Close and open it; return the names of the jobs in it."""
        self._do(self._journal.close())
        self._journal = self._do(SqliteJournal.open(self._path))
        return [row.name for row in self._do(self._journal.unfinished()).jobs]

    def close(self) -> None:
        """Close it."""
        self._do(self._journal.close())
        self._do(self._loop.shutdown_default_executor())
        self._loop.close()


class PersistQueue:
    """persist-queue's on SQLite, which commits after every job; a submitter is a thread."""

    def __init__(self, folder: Path) -> None:
        self._module = peer("persistqueue", "persist-queue")
        self._folder = str(folder / "persist")
        self._numbers = count(1)
        self._queue = self._opened()
        sync = self._queue._putter.execute("PRAGMA synchronous").fetchone()[0]
        if sync < 2:
            raise LeftOut(f"persist-queue does not sync every job to the disk: synchronous = {sync}")

    def _opened(self) -> Any:
        return self._module.SQLiteQueue(self._folder, multithreading=True, auto_commit=True)

    def _body(self) -> dict[str, object]:
        return job(next(self._numbers)).body

    def fill(self, jobs: int) -> None:
        """Put so many jobs in, together."""
        queue = self._queue
        rows = ((queue._serializer.dumps(self._body()), time.time()) for _ in range(jobs))
        with queue._putter:
            queue._putter.executemany(queue._sql_insert, rows)
        queue.close()
        self._queue = self._opened()

    def submit(self, submitters: int, each: int = EACH) -> None:
        """Put jobs of every submitter in, one after the other."""

        def one() -> None:
            for _ in range(each):
                self._queue.put(self._body())

        threads = [Thread(target=one) for _ in range(submitters)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    def kept(self) -> list[str]:
        """Close and open it; return the names of the jobs in it."""
        self._queue.close()
        self._queue = self._opened()
        return [row["data"]["name"] for row in self._queue.queue()]

    def close(self) -> None:
        """Close it."""
        with suppress(OSError):
            self._queue.close()


@contextmanager
def stores(folder: Path, left_out: dict[str, str]) -> Iterator[dict[str, Store]]:
    """Provide every queue by the name of its program."""
    made: dict[str, Store] = {}
    makers: dict[str, Callable[[Path], Store]] = {OURS: Journal, "persist-queue": PersistQueue}
    try:
        for program, make in makers.items():
            try:
                made[program] = make(folder)
            except LeftOut as reason:
                left_out[program] = str(reason)
        yield made
    finally:
        for store in made.values():
            store.close()


def contests(open_stores: dict[str, Store]) -> list[Contest]:
    """Return one submitter and many."""
    return [
        Contest(
            "queue",
            "a job stored durably, " + ("one submitter" if submitters == 1 else f"{submitters} submitters"),
            "µs",
            "jobs",
            0.0,
            [_side(program, store, submitters) for program, store in open_stores.items()],
        )
        for submitters in (1, SUBMITTERS)
    ]


def _side(program: str, store: Store, submitters: int) -> Side:
    def answer() -> Floats:
        """Return how many jobs a submission adds that are still there after the queue was closed and opened."""
        before = set(store.kept())
        store.submit(submitters)
        return np.array([float(len(set(store.kept()) - before))])

    return Side(program, answer, lambda: took(store, submitters))


def took(store: Store, submitters: int, each: int = EACH) -> float:
    """Return the time of one submission while so many submit [s]."""
    start = time.perf_counter()
    store.submit(submitters, each)
    return (time.perf_counter() - start) / (submitters * each)


def growth(folder: Path, sizes: tuple[int, ...], left_out: dict[str, str]) -> Iterator[Growth]:
    """Yield what a submission takes while so many jobs wait [µs], the best of `SAMPLES`; each size has new queues."""
    for size in sizes:
        own = folder / str(size)
        own.mkdir()
        with stores(own, left_out) as opened:
            for program, store in opened.items():
                store.fill(size)
                cost = min(took(store, 1, each=1) for _ in range(SAMPLES))
                yield Growth("jobs that wait", program, size, 1e6 * cost, "µs")
