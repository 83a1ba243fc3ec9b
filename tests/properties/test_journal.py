"""The journal against a model of it: whatever is done in whatever order, and whenever the program is killed."""

from __future__ import annotations

import asyncio
import os
import select
import signal
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from dmc41x3.loops import JumpingLoop
from maya_un.errors import StorageFailed
from maya_un.process.journal.protocol import (
    EventRow,
    Filter,
    JobOptions,
    JobRow,
    Journal,
    QueueRow,
    RequestOwner,
    StepRow,
)
from maya_un.process.journal.sqlite import MemoryJournal, SqliteJournal
from maya_un.schema.jobs import PauseReason, TaskState
from tests.campaign import Campaign
from tests.journals import event_row, looked_up

NUMBERS = st.integers(1, 12)
TEXTS = st.text(st.characters(codec="utf-8"), max_size=8)
BODIES = st.dictionaries(TEXTS, st.none() | st.booleans() | st.integers(-5, 2**40) | TEXTS, max_size=3)

options = st.builds(
    JobOptions,
    priority=st.integers(-100, 100),
    held=st.booleans(),
    depends_on=st.lists(NUMBERS, max_size=3).map(tuple),
    notes=TEXTS,
    retries=st.integers(0, 3),
    stepwise=st.booleans(),
)
jobs = st.builds(
    JobRow,
    id=NUMBERS,
    name=TEXTS,
    body=BODIES,
    options=options,
    owner=st.builds(RequestOwner, TEXTS, TEXTS),
    state=st.sampled_from(TaskState),
    position=st.floats(-1e6, 1e6),
    submitted=TEXTS,
    steps=st.integers(0, 9),
    done=st.integers(0, 9),
    code=st.integers(0, 5999),
    message=TEXTS,
    predicted=st.none() | st.floats(0.0, 1e4),
    began=TEXTS,
    key=st.sampled_from(("", "", "k1", "k2")),
    proposal=st.booleans(),
)
steps = st.builds(
    StepRow,
    index=st.integers(1, 4),
    state=st.sampled_from(TaskState),
    code=st.integers(0, 5999),
    message=TEXTS,
    duration=st.none() | st.floats(0.0, 1e4),
    phase=st.sampled_from(("", "down", "close")),
    end=st.none() | BODIES,
)
modes = st.builds(QueueRow, paused=st.booleans(), reason=st.sampled_from(["", *PauseReason]), by=TEXTS, since=TEXTS)


class Kept(RuleBasedStateMachine):
    """A file and a dictionary with the same writes."""

    def __init__(self) -> None:
        super().__init__()
        self._loop = JumpingLoop()
        self._folder = tempfile.TemporaryDirectory()
        self._jobs: dict[int, JobRow] = {}
        self._steps: dict[tuple[int, int], StepRow] = {}
        self._mode = QueueRow()
        self._events: dict[int, list[EventRow]] = {}
        self._journal: Any = None
        self._memory = MemoryJournal()

    def _do(self, work: Any) -> Any:
        return self._loop.run_until_complete(work)

    @initialize()
    def open(self) -> None:
        self._journal = self._do(SqliteJournal.open(Path(self._folder.name) / "maya.db"))

    def _refused(self, row: JobRow) -> bool:
        keys = {(other.owner.name, other.key) for other in self._jobs.values() if other.key and other.id != row.id}
        return (row.owner.name, row.key) in keys

    def _tell_both(self, write: Any, *, refused: bool) -> None:
        for journal in (self._journal, self._memory):
            try:
                self._do(write(journal))
            except StorageFailed:
                assert refused
            else:
                assert not refused

    @rule(rows=st.lists(jobs, min_size=1, max_size=3, unique_by=lambda row: row.id))
    def add(self, rows: list[JobRow]) -> None:
        model = dict(self._jobs)
        refused = False
        for row in rows:
            refused = refused or row.id in self._jobs or self._refused(row)
            self._jobs[row.id] = row
        self._tell_both(lambda journal: journal.add(*rows), refused=refused)
        if refused:
            self._jobs = model

    @precondition(lambda self: self._jobs)
    @rule(row=jobs, step=steps, mode=st.none() | modes, data=st.data())
    def save(self, row: JobRow, step: StepRow, mode: QueueRow | None, data: st.DataObject) -> None:
        number = data.draw(st.sampled_from(sorted(self._jobs)))
        changed = replace(row, id=number)
        changes = [changed, (number, step), *([mode] if mode else [])]
        refused = self._refused(changed)
        self._tell_both(lambda journal: journal.save(*changes), refused=refused)
        if not refused:
            self._jobs[number] = changed
            self._steps[number, step.index] = step
            self._mode = mode or self._mode

    @precondition(lambda self: self._jobs)
    @rule(data=st.data(), done=st.integers(0, 9))
    def go_on(self, data: st.DataObject, done: int) -> None:
        """Save a job with the very body that it has."""
        row = self._jobs[data.draw(st.sampled_from(sorted(self._jobs)))]
        changed = replace(row, done=done)
        self._tell_both(lambda journal: journal.save(changed), refused=False)
        self._jobs[row.id] = changed

    @rule(count=st.integers(1, 4))
    def note(self, count: int) -> None:
        async def noted() -> None:
            for _ in range(count):
                kept = self._events.setdefault(self._journal.run, [])
                kept.append(event_row(len(kept) + 1, self._journal.run))
                self._journal.note(kept[-1])

        self._do(noted())

    @rule(settled=st.booleans())
    def reopen(self, settled: bool) -> None:
        if settled:
            self._do(self._journal.save())
        run = self._journal.run
        self._do(self._journal.close())
        self.open()
        assert self._journal.run == run + 1

    @invariant()
    def holds_what_it_was_told(self) -> None:
        if self._journal is None:
            return
        for journal in (self._journal, self._memory):
            self._look(journal)

    def _look(self, journal: Journal) -> None:
        found = self._do(journal.unfinished())
        alive = [row for row in self._jobs.values() if not row.state.ended]
        alive.sort(key=lambda row: (-row.options.priority, row.position, row.id))
        assert list(found.jobs) == alive
        assert found.queue == self._mode
        assert found.next_id == max(self._jobs, default=0) + 1
        for number, row in self._jobs.items():
            rows = tuple(step for (job, _), step in sorted(self._steps.items()) if job == number)
            assert self._do(journal.job(number)) == (row, rows)
            assert found.steps.get(number, ()) == (() if row.state.ended else rows)
        page = self._do(journal.page(Filter(oldest_first=True)))
        assert page == [replace(row, body={}) for _, row in sorted(self._jobs.items())]

    def teardown(self) -> None:
        if self._journal is not None:
            self._do(self._journal.close())
            self._do(self._memory.close())
            self._look_at_events()
        self._do(self._loop.shutdown_default_executor())
        self._loop.close()
        self._folder.cleanup()

    def _look_at_events(self) -> None:
        kept = looked_up(Path(self._folder.name) / "maya.db", "SELECT run, seq FROM events ORDER BY number")
        assert kept == [(run, event.seq) for run, events in sorted(self._events.items()) for event in events]


TestKept = Kept.TestCase
TestKept.settings = settings(max_examples=30 if settings().max_examples <= 100 else 300, stateful_step_count=15)


WRITER = """
import asyncio, os, sys
from pathlib import Path
from maya_un.process.journal.protocol import QueueRow
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.schema.jobs import TaskState
from tests.journals import event_row, job_row, step_row

async def write(journal, first, writers, mine):
    for number in range(first + mine, 10**9, writers):
        await journal.add(job_row(number, state=TaskState.RUNNING))
        os.write(1, f"job {number} 0\\n".encode())
        for index in (1, 2, 3):
            journal.note(event_row(3 * number + index, journal.run))
            job = job_row(number, state=TaskState.RUNNING, done=index)
            await journal.save(job, (number, step_row(index, end={"a": "x" * 500})), QueueRow(since=str(number)))
            os.write(1, f"job {number} {index}\\n".encode())

async def main():
    journal = await SqliteJournal.open(Path(sys.argv[1]))
    first = (await journal.unfinished()).next_id
    os.write(1, b"opened\\n")
    await asyncio.gather(*(write(journal, first, 4, mine) for mine in range(4)))

asyncio.run(main())
"""
"""Writes for ever, four rows at a time, and prints each acknowledgement afterwards."""


def killed(path: Path, rng: Random) -> dict[int, int]:
    """Have a process write and kill it at a random instant; return how many steps of each job it was sure of."""
    root = Path(__file__).resolve().parents[2]
    writer = subprocess.Popen([sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE, cwd=root)
    assert writer.stdout is not None
    enough, said = rng.randrange(0, 4000), b""
    while b"opened" not in said or len(said) < enough:
        said += os.read(writer.stdout.fileno(), 4096)
    select.select([], [], [], rng.uniform(0.0, 0.02))
    writer.send_signal(signal.SIGKILL)
    said += writer.stdout.read()
    writer.wait()
    writer.stdout.close()
    sure: dict[int, int] = {}
    for line in said.split(b"\n")[:-1]:
        if line.startswith(b"job"):
            _, number, index = line.split()
            sure[int(number)] = int(index)
    return sure


def test_acknowledged_rows_survive_a_kill_at_any_instant(campaign: Campaign, tmp_path: Path) -> None:
    path, sure = tmp_path / "maya.db", dict[int, int]()
    for case in range(campaign.size(ci=12, long=300)):
        sure |= killed(path, campaign.rng(case))
        asyncio.run(_look_for(path, sure, case))


async def _look_for(path: Path, sure: dict[int, int], case: int) -> None:
    journal = await SqliteJournal.open(path)
    assert journal.run == 2 * (case + 1)
    found = await journal.unfinished()
    done = {job.id: job.done for job in found.jobs}
    for number, index in sure.items():
        assert done.get(number, -1) >= index, f"job {number} was acknowledged"
    for number, index in done.items():
        assert index == len(found.steps.get(number, ())), "a step without its job, or a job without its step"
    await journal.close()
    assert looked_up(path, "PRAGMA integrity_check") == [("ok",)]
