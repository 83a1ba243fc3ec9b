from __future__ import annotations

import asyncio
import sqlite3
import subprocess
import sys
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from maya_un.config import StorageConfig
from maya_un.errors import (
    FileNotOurs,
    FileUnwritable,
    StorageDamaged,
    StorageFailed,
    StorageInUse,
    StorageTooNew,
)
from maya_un.process.journal import file, group_commit
from maya_un.process.journal.protocol import Filter, JobOptions, Journal, QueueRow, Unfinished
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.schema.jobs import PauseReason, TaskState
from tests.journals import (
    DATE,
    audit_row,
    content,
    damage,
    event_row,
    job_row,
    looked_up,
    overwrite,
    rights,
    size,
    step_row,
)
from tests.virtual_time import elapse, turn


@asynccontextmanager
async def opened(path: Path, keep: StorageConfig | None = None) -> AsyncIterator[SqliteJournal]:
    journal = await SqliteJournal.open(path, keep)
    try:
        yield journal
    finally:
        await journal.close()


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "state" / "maya.db"


def allowed_pages(journal: SqliteJournal, more: int) -> None:
    """Limit the growth of the file in pages: SQLite then reports a full disk."""
    connection = journal._writer
    pages = connection.execute("PRAGMA page_count").fetchone()[0]
    connection.execute(f"PRAGMA max_page_count = {pages + more}")


async def test_written_rows_are_found_by_the_next_run(path: Path) -> None:
    options = JobOptions(5, held=True, depends_on=(1, 2), notes="two trays", retries=3, stepwise=True)
    job = job_row(
        3,
        options=options,
        state=TaskState.RUNNING,
        done=1,
        predicted=61.5,
        began=DATE,
        key="k",
        digest="d",
        proposal=True,
    )
    step = step_row(1, phase="down", predicted=30.25, end={"point": [0.5, 1.1, 0.4]})
    mode = QueueRow(paused=True, reason=PauseReason.STOP, by="ann", since=DATE)
    async with opened(path) as journal:
        await journal.add(job)
        await journal.save((3, step), mode)
    async with opened(path) as journal:
        assert await journal.unfinished() == Unfinished(mode, (job,), {3: (step,)}, next_id=4)
        assert await journal.job(3) == (job, (step,))
        assert await journal.job(4) is None
        assert journal.run == 2


async def test_it_is_a_journal(path: Path) -> None:
    async with opened(path) as journal:
        kept: Journal = journal
        assert kept.failing == ""
        assert await kept.unfinished() == Unfinished(QueueRow(), ())


async def test_unfinished_jobs_are_in_queue_order_without_ended_ones(path: Path) -> None:
    first = job_row(1, position=7.0)
    urgent = job_row(2, options=JobOptions(priority=10), position=9.0)
    moved = job_row(3, position=2.0)
    ended = [job_row(10 + i, state=state) for i, state in enumerate(TaskState) if state.ended]
    async with opened(path) as journal:
        await journal.add(first, urgent, moved, *ended)
        found = await journal.unfinished()
        assert [job.id for job in found.jobs] == [2, 3, 1]
        assert found.next_id == 11 + list(TaskState).index(TaskState.SKIPPED)


async def test_of_several_new_jobs_all_are_kept_or_none(path: Path) -> None:
    async with opened(path) as journal:
        await journal.add(job_row(1))
        with pytest.raises(StorageFailed):
            await journal.add(job_row(2), job_row(1, name="the same number"))
        assert [job.name for job in await journal.page(Filter())] == ["job 1"]


async def test_failed_write_does_not_affect_other_writes(path: Path) -> None:
    async with opened(path) as journal:
        outcomes = await asyncio.gather(
            journal.add(job_row(1)),
            journal.add(job_row(2, body={"steps": {1, 2}})),
            journal.add(job_row(1)),
            journal.add(job_row(3)),
            return_exceptions=True,
        )
        assert [type(outcome) for outcome in outcomes] == [type(None), TypeError, StorageFailed, type(None)]
        assert [job.id for job in await journal.page(Filter(oldest_first=True))] == [1, 3]


async def test_a_key_is_used_once_by_an_owner(path: Path) -> None:
    async with opened(path) as journal:
        await journal.add(job_row(1, key="k", digest="d"), job_row(2), job_row(3))
        with pytest.raises(StorageFailed):
            await journal.add(job_row(4, key="k"))
        found = await journal.keyed("ann", "k")
        assert found is not None
        assert (found.id, found.digest) == (1, "d")
        assert await journal.keyed("bob", "k") is None
        assert await journal.keyed("ann", "") is None


async def test_simultaneous_writes_share_a_commit(path: Path) -> None:
    async with opened(path) as journal:
        commits: list[str] = []
        journal._writer.set_trace_callback(lambda said: commits.append(said) if said == "COMMIT" else None)
        await asyncio.gather(*(journal.add(job_row(number)) for number in range(1, 17)))
        assert len(commits) == 1


async def test_write_during_a_commit_is_in_the_next_one(path: Path) -> None:
    async with opened(path) as journal:
        held, going = threading.Event(), threading.Event()

        def hold(_: sqlite3.Connection) -> None:
            going.set()
            held.wait(30.0)

        order: list[int] = []

        async def add(number: int) -> None:
            await journal.add(job_row(number))
            order.append(number)

        first = asyncio.ensure_future(journal.write(hold))
        await asyncio.get_running_loop().run_in_executor(None, going.wait, 30.0)
        later = [asyncio.ensure_future(add(number)) for number in range(1, 6)]
        await turn()
        assert await journal.page(Filter()) == [], "a page waits for no commit"
        assert not first.done()
        held.set()
        await asyncio.gather(first, *later)
        assert order == [1, 2, 3, 4, 5]


async def test_cancelled_write_may_have_been_kept(path: Path) -> None:
    async with opened(path) as journal:
        given_up = asyncio.ensure_future(journal.add(job_row(1)))
        await turn()
        given_up.cancel()
        await journal.add(job_row(2))
        assert given_up.cancelled()
        assert {job.id for job in await journal.page(Filter())} == {1, 2}


async def test_notes_are_kept_within_a_moment_without_being_waited_for(path: Path) -> None:
    async with opened(path) as journal:
        journal.note(event_row(1), audit_row(1))
        journal.note(event_row(2))
        assert await journal.events(1, 0, 10) == []
        await elapse(group_commit.FLUSH)
        await elapse(1e-6)
        assert [event.seq for event in await journal.events(1, 0, 10)] == [1, 2]
        assert await journal.audit(None, 10) == [(1, audit_row(1))]


async def test_notes_are_on_the_disk_before_a_later_save(path: Path) -> None:
    async with opened(path) as journal:
        written: list[str] = []
        journal._writer.set_trace_callback(written.append)
        journal.note(event_row(1))
        await journal.save(QueueRow(paused=True))
        tables = [said.split()[4] for said in written if said.startswith("INSERT")]
        assert tables == ["events", "queue"]
        assert written.count("COMMIT") == 1


async def test_closing_writes_pending_rows(path: Path) -> None:
    async with opened(path) as journal:
        journal.note(event_row(1))
    assert looked_up(path, "SELECT run, seq FROM events") == [(1, 1)]


async def test_a_closed_journal_takes_nothing(path: Path) -> None:
    async with opened(path) as journal:
        pass
    with pytest.raises(StorageFailed, match="closed"):
        await journal.add(job_row(1))
    journal.note(event_row(1))


async def test_events_are_read_by_run_and_number(path: Path) -> None:
    for run in (1, 2):
        async with opened(path) as journal:
            assert journal.run == run
            journal.note(*(event_row(seq, run) for seq in range(1, 6)))
    async with opened(path) as journal:
        assert await journal.events(2, 3, 10) == [event_row(4, 2), event_row(5, 2)]
        assert [event.seq for event in await journal.events(1, 0, 2)] == [1, 2]


async def test_the_audit_log_is_read_backwards_page_by_page(path: Path) -> None:
    async with opened(path) as journal:
        journal.note(*(audit_row(number) for number in range(1, 8)))
        await journal.save(QueueRow())
        newest = await journal.audit(None, 3)
        assert [number for number, _ in newest] == [7, 6, 5]
        assert [entry.operation for _, entry in await journal.audit(newest[-1][0], 2)] == ["submit 4", "submit 3"]


async def test_an_unknown_thing_in_an_event_is_kept_in_words(path: Path) -> None:
    async with opened(path) as journal:
        journal.note(event_row(1, detail={"where": Path("shelf")}))
        await journal.save(QueueRow())
        assert (await journal.events(1, 0, 1))[0].detail == {"where": "shelf"}


async def test_body_is_rewritten_only_when_it_changed(path: Path) -> None:
    async with opened(path) as journal:
        row = job_row(1)
        await journal.add(row)
        written: list[str] = []
        journal._writer.set_trace_callback(written.append)
        await journal.save(replace(row, done=1))
        assert not [said for said in written if "bodies" in said]
        await journal.save(replace(row, body={"name": "changed", "steps": []}))
        found = await journal.job(1)
        assert found is not None
        assert found[0].body == {"name": "changed", "steps": []}


async def test_body_of_a_failed_write_is_written_with_the_next(path: Path) -> None:
    async with opened(path) as journal:
        row = job_row(1)
        await journal.add(row)
        changed = replace(row, body={"steps": []})
        with pytest.raises(TypeError):
            await journal.save(changed, job_row(2, body={"steps": {1}}))
        await journal.save(changed)
        found = await journal.job(1)
        assert found is not None
        assert found[0].body == {"steps": []}


async def test_on_a_full_disk_nothing_is_acknowledged_and_nothing_kept(path: Path) -> None:
    async with opened(path) as journal:
        await journal.add(job_row(1))
        allowed_pages(journal, 0)
        long = {"steps": ["x" * 100_000]}
        outcomes = await asyncio.gather(
            *(journal.add(job_row(number, body=long)) for number in (2, 3)), return_exceptions=True
        )
        assert [type(outcome) for outcome in outcomes] == [StorageFailed, StorageFailed]
        assert "full" in str(outcomes[0])
        allowed_pages(journal, 1000)
        await journal.add(job_row(4, body=long))
        assert journal.failing == ""
        assert [job.id for job in await journal.page(Filter(oldest_first=True))] == [1, 4]


async def test_notes_outlast_a_disk_that_fails_for_a_while(path: Path) -> None:
    async with opened(path) as journal:
        journal._writer.execute("PRAGMA query_only = 1")
        journal.note(event_row(1))
        with pytest.raises(StorageFailed, match="may only be read"):
            await journal.add(job_row(1))
        assert "may only be read" in journal.failing
        journal.note(event_row(2))
        journal._writer.execute("PRAGMA query_only = 0")
        await elapse(group_commit.RETRY)
        await elapse(1e-6)
        assert [event.seq for event in await journal.events(1, 0, 10)] == [1, 2]
        assert journal.failing == ""


async def test_while_nothing_can_be_written_the_newest_notes_are_held(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(group_commit, "MOST_NOTES", 3)
    async with opened(path) as journal:
        journal._writer.execute("PRAGMA query_only = 1")
        for seq in range(1, 6):
            journal.note(event_row(seq))
        with pytest.raises(StorageFailed):
            await journal.add(job_row(1))
        journal._writer.execute("PRAGMA query_only = 0")
        await journal.add(job_row(1))
        assert [event.seq for event in await journal.events(1, 0, 10)] == [3, 4, 5]


@pytest.mark.parametrize("gone", ["maya.db", "maya.db-wal"])
async def test_nothing_is_acknowledged_into_a_file_that_was_removed(path: Path, gone: str) -> None:
    async with opened(path) as journal:
        await journal.add(job_row(1))
        path.with_name(gone).unlink()
        with pytest.raises(StorageFailed, match="moved or removed"):
            await journal.add(job_row(2))


async def test_nothing_is_acknowledged_into_a_file_that_was_cut_short(path: Path) -> None:
    async with opened(path) as journal:
        await journal.add(job_row(1))
        overwrite(path, b"")
        with pytest.raises(StorageFailed, match="cut short"):
            await journal.add(job_row(2))
        with pytest.raises(StorageFailed, match="cut short"):
            await journal.add(job_row(3))


async def test_lost_folder_is_reported(path: Path) -> None:
    async with opened(path) as journal:
        path.parent.rename(path.parent.with_name("elsewhere"))
        with pytest.raises(StorageFailed, match="moved or removed"):
            await journal.save(QueueRow())


async def test_the_file_is_for_its_owner_alone(path: Path) -> None:
    async with opened(path) as journal:
        await journal.add(job_row(1))
        modes = {file.name: rights(file) for file in path.parent.iterdir()}
        assert set(modes) == {"maya.db", "maya.db-wal", "maya.db-shm", "maya.db.lock"}
        assert set(modes.values()) == {0o600}
        assert rights(path.parent) == 0o700


def closed_to_nobody(path: Path) -> None:
    path.chmod(0o644)


async def test_a_file_that_others_could_read_is_closed_to_them(path: Path) -> None:
    async with opened(path):
        pass
    closed_to_nobody(path)
    async with opened(path):
        assert rights(path) == 0o600


async def test_one_program_at_a_time(path: Path) -> None:
    async with opened(path):
        with pytest.raises(StorageInUse) as refused:
            await SqliteJournal.open(path)
        script = (
            "import asyncio, sys; from pathlib import Path; from maya_un.process.journal.sqlite import SqliteJournal;"
            "from maya_un.errors import StorageInUse\n"
            "try: asyncio.run(SqliteJournal.open(Path(sys.argv[1])))\n"
            "except StorageInUse as error: print(error.code, error.details['pid'])"
        )
        said = await asyncio.get_running_loop().run_in_executor(
            None,
            lambda: subprocess.run(
                [sys.executable, "-c", script, str(path)], capture_output=True, text=True, check=True, timeout=50
            ),
        )
        assert said.stdout.split() == ["5010", refused.value.details["pid"]]
    async with opened(path) as journal:
        assert journal.run == 2


async def test_commit_is_on_the_disk_before_a_caller_continues(path: Path) -> None:
    async with opened(path) as journal:
        settings = [journal._writer.execute(f"PRAGMA {what}").fetchone()[0] for what in ("journal_mode", "synchronous")]
        assert settings == ["wal", 2]


async def test_the_log_of_a_long_run_stays_bounded(path: Path) -> None:
    async with opened(path) as journal:
        longest = 0
        for round_ in range(40):
            await journal.save(*(job_row(n, body={"steps": ["x" * 10_000], "round": round_}) for n in range(1, 101)))
            longest = max(longest, size(path.with_name("maya.db-wal")))
        assert size(path) > 0
        assert longest < file.WAL_LIMIT


async def test_a_damaged_file_is_refused_and_left_as_it_is(path: Path) -> None:
    async with opened(path) as journal:
        await journal.add(*(job_row(number) for number in range(1, 200)))
    left = damage(path)
    with pytest.raises(StorageDamaged) as refused:
        await SqliteJournal.open(path)
    assert refused.value.details["path"] == path
    assert content(path) == left


@pytest.mark.parametrize("rubbish", [b"S", b"not a database at all " * 100, b"SQLite format 3\0" + b"\xff" * 4080])
async def test_file_that_is_no_database_is_refused_and_unchanged(path: Path, rubbish: bytes) -> None:
    path.parent.mkdir()
    overwrite(path, rubbish)
    with pytest.raises(StorageDamaged):
        await SqliteJournal.open(path)
    assert content(path) == rubbish


async def test_of_a_large_file_the_part_that_the_queue_needs_is_checked(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with opened(path) as journal:
        await journal.add(*(job_row(number) for number in range(1, 200)))
    monkeypatch.setattr(file, "CHECKED_WHOLE", 0)
    async with opened(path):
        pass
    damage(path)
    with pytest.raises(StorageDamaged):
        await SqliteJournal.open(path)


@pytest.mark.parametrize("left", [b"", None])
async def test_a_log_without_its_file_is_not_thrown_away(path: Path, left: bytes | None) -> None:
    log = path.with_name("maya.db-wal")
    path.parent.mkdir()
    overwrite(log, b"what was acknowledged")
    if left is not None:
        overwrite(path, left)
    with pytest.raises(StorageDamaged, match="empty or missing"):
        await SqliteJournal.open(path)
    assert content(log) == b"what was acknowledged"


async def test_damage_found_while_reading_is_reported(path: Path) -> None:
    async with opened(path) as journal:
        await journal.add(*(job_row(number) for number in range(1, 200)))
        journal._writer.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        damage(path)
        with pytest.raises(StorageDamaged):
            await journal.unfinished()


async def test_a_file_of_a_newer_version_is_refused(path: Path) -> None:
    async with opened(path):
        pass
    with sqlite3.connect(path) as connection:
        connection.execute("PRAGMA user_version = 99")
    connection.close()
    with pytest.raises(StorageTooNew) as refused:
        await SqliteJournal.open(path)
    assert (refused.value.details["found"], refused.value.details["known"]) == (99, 1)


async def test_a_database_of_another_program_is_left_alone(path: Path) -> None:
    path.parent.mkdir()
    with sqlite3.connect(path) as connection:
        connection.execute("CREATE TABLE bookmarks (url TEXT)")
    connection.close()
    before = content(path), rights(path)
    with pytest.raises(FileNotOurs):
        await SqliteJournal.open(path)
    assert (content(path), rights(path)) == before


async def test_the_users_tables_may_be_there_first(path: Path) -> None:
    path.parent.mkdir()
    with sqlite3.connect(path) as connection:
        connection.execute("CREATE TABLE access_users (name TEXT)")
    connection.close()
    async with opened(path) as journal:
        await journal.add(job_row(1))


async def test_folder_that_is_a_file_is_reported(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("mine", encoding="ascii")
    with pytest.raises(FileUnwritable):
        await SqliteJournal.open(tmp_path / "state" / "maya.db")


async def test_the_past_is_bounded_and_the_jobs_are_not(path: Path) -> None:
    keep = StorageConfig(events=1000, audit=1000)
    async with opened(path, keep) as journal:
        await journal.add(*(job_row(number, state=TaskState.DONE) for number in range(1, 1500)))
        for seq in range(1, 2502):
            journal.note(event_row(seq), audit_row(seq))
        await journal.save(QueueRow())
        events = await journal.events(1, 0, 10_000)
        assert events[-1].seq == 2501
        assert 1000 <= len(events) < 2000
        assert 1000 <= len(await journal.audit(None, 10_000)) < 2000
    async with opened(path, keep) as journal:
        assert len(await journal.events(1, 0, 10_000)) == 1000
        assert len(await journal.page(Filter(limit=10_000))) == 1000
        assert await journal.job(1) is not None


async def test_old_rows_are_deleted_when_the_file_is_opened(path: Path) -> None:
    keep = StorageConfig(days=30)
    async with opened(path, keep) as journal:
        for day in range(1, 29):
            journal.note(event_row(day, date=f"2026-02-{day:02}T12:00:00Z"))
        journal.note(event_row(29, date="2026-03-20T12:00:00Z"))
    async with opened(path, keep) as journal:
        assert (await journal.events(1, 0, 100))[0].date == "2026-02-18T12:00:00Z"


async def test_threads_and_files_end_with_it(path: Path) -> None:
    """Only its own files and new threads count: other tests of the process may leave some that end meanwhile."""

    def files() -> list[str]:
        return [target for target in map(target_of, Path("/proc/self/fd").iterdir()) if str(path.parent) in target]

    def threads() -> set[threading.Thread]:  # the loop keeps those of its own pool
        return {thread for thread in threading.enumerate() if not thread.name.startswith("asyncio_")}

    before = threads()
    for _ in range(5):
        async with opened(path) as journal:
            await journal.add(job_row(journal.run))
            assert files()
    assert files() == []
    assert threads() <= before


def target_of(descriptor: Path) -> str:
    """Return what an open descriptor of this process stands for, "" if it was closed meanwhile."""
    try:
        return str(descriptor.readlink())
    except OSError:
        return ""
