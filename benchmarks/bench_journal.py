"""The journal: submissions by many at once, and the list of 100 000 jobs that wait.

Submissions are compared with a bare loop of SQLite commits of the same kind (WAL, synchronous=FULL) on the same disk
in the same run: what a program without group commit would do. Every sample is the time of one submission.
"""

from __future__ import annotations

import asyncio
import sqlite3
import tempfile
import time
from collections.abc import Coroutine, Iterator
from contextlib import AsyncExitStack, ExitStack, closing, contextmanager
from itertools import count
from pathlib import Path
from statistics import median
from typing import Any, TypeVar

from harness import Case, Goal, Sample, measure, report

from maya_un.assembly.stack import stack
from maya_un.config import Config
from maya_un.process.journal.protocol import Filter, JobOptions, JobRow, RequestOwner
from maya_un.process.journal.sqlite import MemoryJournal, SqliteJournal
from maya_un.process.spec.job import Job
from maya_un.schema.jobs import TaskState

T = TypeVar("T")

QUEUED = 100_000
"""Jobs that wait in the full file."""

SUBMITTERS = 16
EACH = 25
"""Submissions of one submitter in a sample."""

BARE = "bare SQLite commit (WAL, FULL)"
ALONE = "submission, one submitter, empty queue"
SERVED = f"Service.submit, {SUBMITTERS} submitters"


def job(number: int, state: TaskState = TaskState.QUEUED) -> JobRow:
    """Return a job of four steps, as small ones are."""
    steps = [{"pick": [0.5, 1.1]}, {"place": [1.1, 0.5]}] * 2
    owner = RequestOwner(f"student {number % 20}", "10.0.0.7")
    options = JobOptions(notes="of the second group, with the blue cubes")
    body = {"name": f"tray {number}", "steps": steps}
    return JobRow(number, f"tray {number}", body, options, owner, state, float(number), "2026-03-01T08:00:00Z", 4)


class Kept:
    """A journal in a file of its own, with an event loop to ask it in."""

    def __init__(self, folder: Path, jobs: int, name: str = "kept") -> None:
        self._loop = asyncio.new_event_loop()
        self._numbers = count(jobs + 1)
        self.journal: SqliteJournal = self._do(SqliteJournal.open(folder / f"{name}-{jobs}.db"))
        if jobs:
            self._do(self.journal.add(*(job(number) for number in range(1, jobs + 1))))

    def _do(self, work: Coroutine[Any, Any, T]) -> T:
        return self._loop.run_until_complete(work)

    def submissions(self, submitters: int) -> Sample:
        """Return a sample of the time of one submission while so many submit [s]."""

        async def submit() -> None:
            for _ in range(EACH):
                await self.journal.add(job(next(self._numbers)))

        async def together() -> None:
            await asyncio.gather(*(submit() for _ in range(submitters)))

        def sample() -> float:
            start = time.perf_counter()
            self._do(together())
            return (time.perf_counter() - start) / (submitters * EACH)

        return sample

    def page(self, which: Filter) -> Sample:
        """Return a sample of the time of a page [s]."""

        def sample() -> float:
            start = time.perf_counter()
            self._do(self.journal.page(which))
            return time.perf_counter() - start

        return sample

    def close(self) -> None:
        """Close the file and the loop."""
        self._do(self.journal.close())
        self._do(self._loop.shutdown_default_executor())
        self._loop.close()


class Served:
    """The whole stack, on a file with so many jobs that wait, and a loop to ask its service in."""

    def __init__(self, folder: Path, jobs: int) -> None:
        with closing(Kept(folder, jobs, "served")) as kept:
            path = kept.journal.path
        self._loop = asyncio.new_event_loop()
        self._loop.run_until_complete(self._open(path))

    async def _open(self, path: Path) -> None:
        self._opened = AsyncExitStack()
        journal = await SqliteJournal.open(path)
        self._opened.push_async_callback(journal.close)
        wired = await self._opened.enter_async_context(stack(Config(), live=False, journal=journal))
        self._service = wired.service
        await self._service.queue.pause()

    def submissions(self) -> Sample:
        """Return a sample of the time of one submission to the service, while so many submit [s]."""
        parsed = Job.parse(job(1).body)

        async def submit() -> None:
            for _ in range(EACH):
                await self._service.submit(parsed)

        async def together() -> None:
            await asyncio.gather(*(submit() for _ in range(SUBMITTERS)))

        def sample() -> float:
            start = time.perf_counter()
            self._loop.run_until_complete(together())
            return (time.perf_counter() - start) / (SUBMITTERS * EACH)

        return sample

    def close(self) -> None:
        """Close everything."""
        self._loop.run_until_complete(self._opened.aclose())
        self._loop.run_until_complete(self._loop.shutdown_default_executor())
        self._loop.close()


def bare(folder: Path) -> Sample:
    """Return a sample of the time of a commit of one small row [s]."""
    connection = sqlite3.connect(folder / "bare.db", isolation_level=None)
    connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("PRAGMA synchronous = FULL")
    connection.execute("CREATE TABLE jobs (id INTEGER PRIMARY KEY, body TEXT)")

    def sample() -> float:
        start = time.perf_counter()
        for _ in range(EACH):
            connection.execute("INSERT INTO jobs (body) VALUES ('x')")
        return (time.perf_counter() - start) / EACH

    return sample


def in_memory() -> Sample:
    """Return a sample of the CPU time of a submission that is only remembered [s]."""
    journal = MemoryJournal()
    numbers = count(1)

    async def submit() -> None:
        for _ in range(1000):
            await journal.add(job(next(numbers)))

    def sample() -> float:
        start = time.thread_time()
        asyncio.run(submit())
        return (time.thread_time() - start) / 1000

    return sample


@contextmanager
def journals() -> Iterator[tuple[Path, Kept, Kept, Served, Served]]:
    """Provide a folder, an empty journal and a full one, a service on an empty one and on a full one."""
    with tempfile.TemporaryDirectory() as name, ExitStack() as made:
        folder = Path(name)
        kept = [made.enter_context(closing(Kept(folder, jobs))) for jobs in (0, QUEUED)]
        served = [made.enter_context(closing(Served(folder, jobs))) for jobs in (0, QUEUED)]
        yield folder, kept[0], kept[1], served[0], served[1]


def main() -> None:
    page = Goal(20.0)
    with journals() as (folder, empty, full, served, served_full):
        cases = [
            Case(BARE, bare(folder)),
            Case(ALONE, empty.submissions(1)),
            Case(f"submission, {SUBMITTERS} submitters", empty.submissions(SUBMITTERS), goal=Goal(1.0, BARE)),
            Case(f"submission, one submitter, {QUEUED} jobs wait", full.submissions(1), goal=Goal(1.2, ALONE)),
            Case(SERVED, served.submissions(), goal=Goal(1.0, BARE)),
            Case(f"{SERVED}, {QUEUED} jobs wait", served_full.submissions(), goal=Goal(1.2, SERVED)),
            Case("submission in memory", in_memory(), goal=Goal(60.0)),
            Case("newest page", full.page(Filter()), "ms", page),
            Case("page of those that wait", full.page(Filter(states=(TaskState.QUEUED,))), "ms", page),
            Case("page in the middle", full.page(Filter(states=(TaskState.QUEUED,), below=QUEUED // 2)), "ms", page),
            Case("page of one owner", full.page(Filter(owner="student 7")), "ms", page),
            Case("page of words found nowhere", full.page(Filter(text="blue spheres")), "ms", page),
        ]
        report(measure(cases, rounds=9, by=median))


if __name__ == "__main__":
    main()
