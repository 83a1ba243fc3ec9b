from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from maya_un.errors import FileNotOurs, StorageTooNew
from maya_un.process.journal import tables
from maya_un.process.journal.protocol import Filter, QueueRow
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.schema.jobs import PauseReason, TaskState
from tests.journals import audit_row, event_row, job_row, step_row

DUMPS = sorted((Path(__file__).parents[3] / "vectors" / "journal").glob("version-*.sql"))
"""Content of a file of each version, as text; the dump of a released version never changes."""


def stored(dump: Path, path: Path) -> None:
    """Make the file that a dump describes."""
    with closing(sqlite3.connect(path)) as connection:
        connection.executescript(dump.read_text(encoding="utf-8"))


def layout(connection: sqlite3.Connection) -> list[tuple[str, str]]:
    found = connection.execute("SELECT name, sql FROM sqlite_master WHERE sql NOT NULL ORDER BY name").fetchall()
    return [(name, " ".join(sql.split())) for name, sql in found]


def test_there_is_a_dump_of_every_version() -> None:
    assert [dump.stem for dump in DUMPS] == [f"version-{number}" for number in range(1, tables.SCHEMA_VERSION + 1)]


@pytest.mark.parametrize("dump", DUMPS, ids=lambda dump: dump.stem)
async def test_a_file_of_an_earlier_version_is_brought_to_this_one_with_all_that_is_in_it(
    dump: Path, tmp_path: Path
) -> None:
    path = tmp_path / "maya.db"
    stored(dump, path)
    journal = await SqliteJournal.open(path)
    found = await journal.unfinished()
    assert found.queue == QueueRow(paused=True, reason=PauseReason.STOP, by="ann", since="2026-03-01T08:00:00Z")
    assert found.jobs == (job_row(2, state=TaskState.RUNNING, done=1), job_row(3))
    assert found.steps == {2: (step_row(1, TaskState.DONE, duration=30.5, end={"a": 0.5}), step_row(2, phase="down"))}
    assert [job.id for job in await journal.page(Filter(text="job"))] == [3, 2, 1]
    assert await journal.events(7, 0, 10) == [event_row(1, 7), event_row(2, 7)]
    assert await journal.audit(None, 10) == [(1, audit_row(1))]
    assert journal.run == 8
    await journal.close()
    with closing(sqlite3.connect(path)) as connection, closing(sqlite3.connect(":memory:")) as fresh:
        tables.migrate(fresh, path)
        assert layout(connection) == layout(fresh)


def test_every_step_is_done_whole_or_not_at_all() -> None:
    steps = (*tables.MIGRATIONS, "CREATE TABLE more (x);", "CREATE TABLE yet_more (x); INSERT INTO missing VALUES (1);")
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as connection:
        with pytest.raises(sqlite3.Error):
            tables.migrate(connection, "maya.db", steps)
        connection.execute("ROLLBACK")
        names = {name for name, _ in layout(connection)}
        assert "more" in names
        assert "yet_more" not in names
        assert tables.schema_version(connection, "maya.db", 99) == tables.SCHEMA_VERSION + 1
        tables.migrate(connection, "maya.db", (*steps[:-1], "CREATE TABLE yet_more (x);"))
        assert tables.schema_version(connection, "maya.db", 99) == tables.SCHEMA_VERSION + 2


def test_a_file_of_this_version_is_not_touched() -> None:
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as connection:
        tables.migrate(connection, "maya.db")
        before = connection.total_changes
        tables.migrate(connection, "maya.db")
        assert connection.total_changes == before


def test_header_names_the_application() -> None:
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as connection:
        assert tables.schema_version(connection, "maya.db") == 0
        tables.migrate(connection, "maya.db")
        assert tables.schema_version(connection, "maya.db") == tables.SCHEMA_VERSION
        connection.execute("PRAGMA user_version = 99")
        with pytest.raises(StorageTooNew):
            tables.migrate(connection, "maya.db")
        connection.execute("PRAGMA application_id = 1")
        with pytest.raises(FileNotOurs):
            tables.migrate(connection, "maya.db")
