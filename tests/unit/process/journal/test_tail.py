"""The newest events of all runs, read while another process writes them."""

from __future__ import annotations

from pathlib import Path

import pytest

from maya_un.errors import FileUnreadable
from maya_un.process.journal import history
from maya_un.process.journal.protocol import EventRow
from maya_un.process.journal.sqlite import SqliteJournal


def row(run: int, seq: int, date: str = "2026-11-21T10:00:00+00:00") -> EventRow:
    return EventRow(run, seq, date, 0.0, "phase", 0, {"name": f"{run}.{seq}"})


async def test_events_of_all_runs_are_in_order_also_during_writes(tmp_path: Path) -> None:
    path = tmp_path / "maya.db"
    first = await SqliteJournal.open(path)
    first.note(row(1, 1), row(1, 2))
    await first.close()
    second = await SqliteJournal.open(path)
    second.note(row(2, 1))
    await second.save()
    found = history.newest_events(path, 10)
    assert [(event.run, event.seq) for _, event in found] == [(1, 1), (1, 2), (2, 1)]
    second.note(row(2, 2))
    await second.close()
    assert [event.seq for _, event in history.newest_events(path, 10, above=found[-1][0])] == [2]


async def test_newest_events_are_listed_without_those_before_a_date(tmp_path: Path) -> None:
    path = tmp_path / "maya.db"
    journal = await SqliteJournal.open(path)
    journal.note(*(row(1, hour, f"2026-11-21T{hour:02d}:00:00+00:00") for hour in range(1, 10)))
    await journal.close()
    assert [event.seq for _, event in history.newest_events(path, 3)] == [7, 8, 9]
    assert [event.seq for _, event in history.newest_events(path, 100, since="2026-11-21T08:00:00")] == [8, 9]


def test_missing_journal_is_reported(tmp_path: Path) -> None:
    with pytest.raises(FileUnreadable):
        history.newest_events(tmp_path / "maya.db", 1)
