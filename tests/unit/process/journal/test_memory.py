from __future__ import annotations

import pytest

from maya_un.errors import StorageFailed
from maya_un.process.journal.protocol import Filter, Journal, QueueRow, Unfinished
from maya_un.process.journal.sqlite import MemoryJournal
from maya_un.schema.jobs import PauseReason
from tests.journals import audit_row, event_row, job_row, step_row


async def test_memory_journal_keeps_the_same_as_a_file() -> None:
    journal: Journal = MemoryJournal()
    job, step, mode = job_row(1), step_row(1, phase="up"), QueueRow(paused=True, reason=PauseReason.ASKED)
    await journal.add(job)
    await journal.save((1, step), mode)
    journal.note(event_row(1), audit_row(1))
    assert await journal.unfinished() == Unfinished(mode, (job,), {1: (step,)}, 2)
    assert await journal.events(journal.run, 0, 10) == [event_row(1)]
    assert await journal.audit(None, 10) == [(1, audit_row(1))]
    assert (journal.run, journal.failing) == (1, "")
    await journal.close()


async def test_a_number_beyond_all_bounds_is_one_that_is_not_there() -> None:
    journal = MemoryJournal()
    await journal.add(job_row(1))
    for far in (10**30, -(10**30)):
        assert await journal.job(far) is None
        assert await journal.events(far, far, far) == []
        assert await journal.audit(far, 10) == []
        assert len(await journal.page(Filter(below=far))) == (far > 0)
        assert len(await journal.page(Filter(above=far))) == (far < 0)
    await journal.close()


async def test_no_write_waits() -> None:
    journal = MemoryJournal()
    write = journal.add(job_row(1))
    with pytest.raises(StopIteration):
        write.send(None)
    await journal.close()


async def test_refused_write_leaves_nothing() -> None:
    journal = MemoryJournal()
    with pytest.raises(StorageFailed):
        await journal.add(job_row(1), job_row(1))
    with pytest.raises(TypeError):
        await journal.add(job_row(2), job_row(3, body={"steps": {1}}))
    assert await journal.page(Filter()) == []
    await journal.close()
    with pytest.raises(StorageFailed):
        await journal.add(job_row(1))
    journal.note(event_row(1))
