"""The queue with 100 000 jobs that wait: the start of the stack on it, the memory it takes, and clearing it.

Every sample works on a copy of the same file. Memory is that of Python's objects, for one job, and that of a process in
which so many jobs wait, over one with an empty queue.
"""

from __future__ import annotations

import asyncio
import gc
import shutil
import subprocess
import sys
import tempfile
import time
import tracemalloc
from collections.abc import AsyncIterator, Coroutine
from contextlib import asynccontextmanager
from pathlib import Path
from statistics import median

from bench_journal import QUEUED, Kept
from bench_memory import resident
from harness import Case, Goal, Sample, measure, report

from maya_un.assembly.stack import Stack, stack
from maya_un.config import Config
from maya_un.process.journal.sqlite import SqliteJournal

EMPTY = "process, empty queue"
STARTED = """
import asyncio, sys
from pathlib import Path
from maya_un.assembly.stack import stack
from maya_un.config import Config
from maya_un.process.journal.sqlite import SqliteJournal

async def start():
    journal = await SqliteJournal.open(Path(sys.argv[1]))
    async with stack(Config(), live=False, journal=journal):
        print("started", flush=True)
        sys.stdin.read()
    await journal.close()

asyncio.run(start())
"""


class Queue:
    """A file in which jobs wait, and the stack on copies of it."""

    def __init__(self, folder: Path, jobs: int = QUEUED) -> None:
        kept = Kept(folder, jobs, "queue")
        self._file = kept.journal.path
        kept.close()
        self._copy = folder / "copy.db"

    @asynccontextmanager
    async def _started(self) -> AsyncIterator[Stack]:
        journal = await SqliteJournal.open(self._copy)
        try:
            async with stack(Config(), live=False, journal=journal) as wired:
                yield wired
        finally:
            await journal.close()

    async def _start(self) -> float:
        begun = time.perf_counter()
        async with self._started():
            return time.perf_counter() - begun

    async def _clear(self) -> float:
        async with self._started() as wired:
            begun = time.perf_counter()
            await wired.process.clear()
            return time.perf_counter() - begun

    async def _memory(self) -> float:
        gc.collect()
        tracemalloc.start()
        try:
            async with self._started():
                gc.collect()
                return tracemalloc.get_traced_memory()[0] / QUEUED
        finally:
            tracemalloc.stop()

    def _sample(self, work: Coroutine[None, None, float]) -> float:
        shutil.copy(self._file, self._copy)
        return asyncio.run(work)

    def start(self) -> Sample:
        """Return a sample of the time until the stack is there [s]."""
        return lambda: self._sample(self._start())

    def clear(self) -> Sample:
        """Return a sample of the time until all jobs have ended [s]."""
        return lambda: self._sample(self._clear())

    def resident(self) -> float:
        """Return the memory of a process that has started on the file [bytes]."""
        shutil.copy(self._file, self._copy)
        words = [sys.executable, "-c", STARTED, str(self._copy)]
        with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
            assert process.stdout is not None
            process.stdout.readline()
            return resident(process.pid)

    def memory(self) -> Sample:
        """Return a sample of what one job takes [bytes, in millionths, so that it shows as it is]."""
        return lambda: self._sample(self._memory())


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        queue = Queue(Path(folder))
        empty, some = Queue(Path(folder), 0), Queue(Path(folder), 10_000)
        cases = [
            Case(f"start, {QUEUED} jobs wait", queue.start(), "ms", Goal(3000.0)),
            Case(f"clear {QUEUED} jobs", queue.clear(), "ms", Goal(2000.0)),
            Case("memory of a job that waits", queue.memory(), "B", goal=Goal(42.0)),
            Case(EMPTY, empty.resident, "MB"),
            Case("process, 10000 jobs wait", some.resident, "MB", Goal(5.0, to=EMPTY, kind="over")),
            Case(f"process, {QUEUED} jobs wait", queue.resident, "MB", Goal(12.0, to=EMPTY, kind="over")),
        ]
        report(measure(cases, rounds=3, by=median))


if __name__ == "__main__":
    main()
