"""History: pages and reports of all times, events from memory and from the journal, the audit log."""

from __future__ import annotations

import pytest

from maya_un.errors import EventsForgotten, NotFound
from maya_un.events import EventLog, MotionBegun
from maya_un.process.journal.protocol import AuditRow, EventRow, Filter
from maya_un.process.queue import entries
from maya_un.schema.jobs import TaskState
from maya_un.service.queueing import HistoryService
from tests.queues import Machine, job, submit_request
from tests.virtual_time import elapse

HOME = job("home", name="home")


async def test_page_shows_running_jobs_in_their_current_state() -> None:
    async with Machine().running() as layer:
        history = HistoryService(layer.process, layer.controller.events)
        for owner in ("ana", "ben", "ana"):
            await layer.process.submit(job("home", "home"), submit_request(owner))
        await layer.until(1, 2)
        page = await history.page(Filter(owner="ana"))
        assert [(line.id, line.state, line.done, line.position) for line in page] == [
            (3, TaskState.QUEUED, 0, 2),
            (1, TaskState.RUNNING, 1, None),
        ]
        assert [line.id for line in await history.page(Filter(states=(TaskState.QUEUED,), oldest_first=True))] == [2, 3]


async def test_forgotten_job_is_read_from_the_journal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(entries, "REMEMBERED", 1)
    async with Machine().running() as layer:
        history = HistoryService(layer.process, layer.controller.events)
        first = await layer.process.submit(job({"pick": "cube"}, {"place": "tray"}, {"approach": [5.0, 5.0]}))
        second = await layer.process.submit(job({"pick": "cube"}, {"place": "tray"}))
        fresh = await layer.process.result(second)
        await layer.process.result(await layer.process.submit(HOME))
        old = await history.job(second)
        assert old.steps == fresh.steps
        assert (old.parts, old.state, old.duration) == (fresh.parts, fresh.state, fresh.duration)
        assert (old.lowest, fresh.lowest is None) == (None, False)
        refused = await history.job(first)
        assert [step.state.value for step in refused.steps] == ["skipped", "skipped", "failed"]
        with pytest.raises(NotFound):
            await history.job(99)


async def test_recent_events_are_from_memory_and_older_ones_from_the_journal() -> None:
    async with Machine().running() as layer:
        log = EventLog(lambda: 0.0, kept=8)
        log.run = 3
        history = HistoryService(layer.process, log)
        for _ in range(12):
            event = log.emit(MotionBegun())
            layer.journal.note(EventRow(3, event.seq, "", 0.0, event.kind, 0, {}))
        assert log.oldest > 1
        assert [event.seq for event in await history.events(3, 0, limit=5)] == [1, 2, 3, 4, 5]
        assert [event.seq for event in await history.events(3, 10)] == [11, 12]
        assert await history.events(3, 12) == []
        assert await history.events(2, 0) == []


async def test_missing_events_are_reported() -> None:
    async with Machine().running() as layer:
        log = EventLog(lambda: 0.0, kept=8)
        history = HistoryService(layer.process, log)
        for number in range(12):
            event = log.emit(MotionBegun())
            if number > 1:
                layer.journal.note(EventRow(1, event.seq, "", 0.0, event.kind, 0, {}))
        with pytest.raises(EventsForgotten, match="oldest stored event is 3"):
            await history.events(1, 0)
        assert [event.seq for event in await history.events(1, 2)] == list(range(3, 13))


async def test_audit_log_is_newest_first() -> None:
    async with Machine().running() as layer:
        history = HistoryService(layer.process, layer.controller.events)
        for who in ("ana", "ben"):
            layer.journal.note(AuditRow("2026-01-01", who, "operator", "lab", "stop", 0))
        lines = await history.audit()
        assert [(line.who, line.operation) for line in lines] == [("ben", "stop"), ("ana", "stop")]
        assert [line.who for line in await history.audit(below=lines[0].number)] == ["ana"]


async def test_job_is_shown_as_written() -> None:
    async with Machine().running() as layer:
        history = HistoryService(layer.process, layer.controller.events)
        await layer.process.submit(HOME)
        await elapse(100.0)
        assert (await history.body(1))["steps"] == [{"home": True}]
