from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import pytest

from maya_un.errors import FileUnreadable
from maya_un.process.journal import history
from maya_un.process.journal.history import ExportFormat
from maya_un.process.journal.protocol import JobOptions, RequestOwner
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.schema.jobs import TaskState
from tests.journals import DATE, job_row, step_row

DONE = job_row(
    1,
    name='trays, "two"\nof them',
    state=TaskState.DONE,
    options=JobOptions(priority=3, depends_on=(4, 5), notes="für Ana"),
    owner=RequestOwner("bob", "10.0.0.7"),
    done=2,
    predicted=61.5,
    duration=60.25,
    began=DATE,
    ended=DATE,
    key="secret",
)
FAILED = job_row(2, state=TaskState.FAILED, code=2101, message="(9, 9, 9) cannot be reached")


async def kept(path: Path) -> SqliteJournal:
    journal = await SqliteJournal.open(path)
    await journal.add(DONE, FAILED)
    await journal.save((1, step_row(1, TaskState.DONE, duration=30.0)), (1, step_row(2, TaskState.DONE)))
    return journal


async def test_the_table_is_read_back_as_it_was_while_the_file_is_in_use(tmp_path: Path) -> None:
    journal = await kept(tmp_path / "maya.db")
    out = io.StringIO()
    assert history.export(tmp_path / "maya.db", out) == 2
    first, second = csv.DictReader(io.StringIO(out.getvalue(), newline=""))
    assert tuple(first) == history.COLUMNS
    assert first["name"] == 'trays, "two"\nof them'
    assert (first["owner"], first["source"], first["notes"]) == ("bob", "10.0.0.7", "für Ana")
    assert (first["state"], first["depends_on"], first["predicted"], first["duration"]) == (
        "done",
        "4 5",
        "61.5",
        "60.25",
    )
    assert (second["id"], second["state"], second["code"], second["predicted"]) == ("2", "failed", "2101", "")
    await journal.close()


async def test_no_text_is_a_formula_in_a_spreadsheet(tmp_path: Path) -> None:
    journal = await SqliteJournal.open(tmp_path / "maya.db")
    notes = ("=1+1", "+1", "-1", "@SUM(A1)", "plain = text")
    await journal.add(*(job_row(number, options=JobOptions(notes=one)) for number, one in enumerate(notes, 1)))
    table, lines = io.StringIO(), io.StringIO()
    history.export(tmp_path / "maya.db", table)
    history.export(tmp_path / "maya.db", lines, history.ExportFormat.JSONL)
    written = [row["notes"] for row in csv.DictReader(io.StringIO(table.getvalue(), newline=""))]
    assert written == ["'=1+1", "'+1", "'-1", "'@SUM(A1)", "plain = text"]
    assert [json.loads(line)["notes"] for line in lines.getvalue().splitlines()] == list(notes)
    await journal.close()


async def test_json_lines_include_bodies_and_steps(tmp_path: Path) -> None:
    journal = await kept(tmp_path / "maya.db")
    await journal.close()
    out = io.StringIO()
    assert history.export(tmp_path / "maya.db", out, ExportFormat.JSONL) == 2
    first, second = (json.loads(line) for line in out.getvalue().splitlines())
    assert first["body"] == DONE.body
    assert [(step["index"], step["state"], step["duration"]) for step in first["step_results"]] == [
        (1, "done", 30.0),
        (2, "done", None),
    ]
    assert first["depends_on"] == [4, 5]
    assert second["step_results"] == []
    assert "secret" not in out.getvalue()


def test_missing_file_is_reported_and_not_made(tmp_path: Path) -> None:
    with pytest.raises(FileUnreadable):
        history.export(tmp_path / "maya.db", io.StringIO())
    assert not list(tmp_path.iterdir())
