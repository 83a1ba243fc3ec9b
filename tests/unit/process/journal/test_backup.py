from __future__ import annotations

import asyncio
import sqlite3
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from maya_un.errors import (
    FileNotOurs,
    FileUnreadable,
    FileUnwritable,
    MayaError,
    StorageDamaged,
    StorageInUse,
    StorageTooNew,
)
from maya_un.process.journal import history
from maya_un.process.journal.protocol import Filter
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.schema.jobs import TaskState
from tests.journals import content, damage, job_row, looked_up, overwrite, rights


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "state" / "maya.db"


async def filled(path: Path, *numbers: int, state: TaskState = TaskState.QUEUED) -> None:
    """Add jobs to the file at `path`."""
    journal = await SqliteJournal.open(path)
    await journal.add(*(job_row(number, state=state) for number in numbers))
    await journal.close()


async def numbers(path: Path) -> list[int]:
    """Open the file, return the jobs in it."""
    journal = await SqliteJournal.open(path)
    found = await journal.page(Filter(oldest_first=True))
    await journal.close()
    return [job.id for job in found]


def names(folder: Path) -> set[str]:
    return {file.name for file in folder.iterdir()}


async def test_backup_during_submissions_is_complete(path: Path, tmp_path: Path) -> None:
    journal = await SqliteJournal.open(path)
    await journal.add(*(job_row(number) for number in range(1, 101)))

    async def submit() -> None:
        for number in range(101, 160):
            await journal.add(job_row(number))

    coming = asyncio.ensure_future(submit())
    made = await asyncio.get_running_loop().run_in_executor(None, history.make, path, tmp_path / "b.db")
    await coming
    await journal.close()
    held = looked_up(tmp_path / "b.db", "SELECT id FROM jobs ORDER BY id")
    assert held == [(number,) for number in range(1, len(held) + 1)]
    assert made.jobs == made.unfinished == len(held) >= 100
    assert made.size == made.path.stat().st_size


async def test_a_backup_is_one_file_for_its_owner_alone(path: Path, tmp_path: Path) -> None:
    await filled(path, 1, 2)
    await filled(path, 3, state=TaskState.DONE)
    target = tmp_path / "backups" / "b.db"
    target.parent.mkdir()
    made = history.make(path, target)
    assert (made.jobs, made.unfinished, made.aside) == (3, 2, None)
    assert names(target.parent) == {"b.db"}
    assert rights(target) == 0o600


async def test_a_backup_takes_the_place_of_an_older_one_only_when_it_is_whole(path: Path, tmp_path: Path) -> None:
    await filled(path, 1)
    target = tmp_path / "b.db"
    history.make(path, target)
    before = target.read_bytes()
    damage(path)
    with pytest.raises(StorageDamaged):
        history.make(path, target)
    assert target.read_bytes() == before
    assert names(tmp_path) == {"state", "b.db"}


async def test_impossible_backup_is_reported(path: Path, tmp_path: Path) -> None:
    with pytest.raises(FileUnreadable):
        history.make(path, tmp_path / "b.db")
    await filled(path, 1)
    with pytest.raises(FileUnwritable):
        history.make(path, tmp_path / "missing" / "b.db")
    with pytest.raises(FileUnwritable, match="the file of the queue itself"):
        history.make(path, path)
    with closing(sqlite3.connect(tmp_path / "other.db")) as connection:
        connection.execute("CREATE TABLE bookmarks (url TEXT)")
    with pytest.raises(FileNotOurs):
        history.make(tmp_path / "other.db", tmp_path / "b.db")
    (tmp_path / "empty.db").touch()
    with pytest.raises(FileNotOurs):
        history.make(tmp_path / "empty.db", tmp_path / "b.db")


async def test_restored_backup_is_identical(path: Path, tmp_path: Path) -> None:
    await filled(path, 1, 2)
    history.make(path, tmp_path / "b.db")
    await filled(path, 3)
    restored = history.restore(tmp_path / "b.db", path)
    assert restored.aside is not None
    assert (restored.jobs, restored.path) == (2, path)
    assert await numbers(path) == [1, 2]
    assert await numbers(restored.aside) == [1, 2, 3]


async def test_backup_is_restored_to_an_empty_place(path: Path, tmp_path: Path) -> None:
    await filled(tmp_path / "a.db", 1)
    history.make(tmp_path / "a.db", tmp_path / "b.db")
    assert history.restore(tmp_path / "b.db", path).aside is None
    assert await numbers(path) == [1]
    assert names(path.parent) == {"maya.db", "maya.db.lock"}


async def test_a_damaged_file_is_replaced_and_kept_aside_with_its_log(path: Path, tmp_path: Path) -> None:
    await filled(path, 1)
    history.make(path, tmp_path / "b.db")
    overwrite(path, b"rubbish")
    log = path.with_name("maya.db-wal")
    overwrite(log, b"the log of rubbish")
    aside = history.restore(tmp_path / "b.db", path).aside
    assert aside is not None
    assert aside.read_bytes() == b"rubbish"
    assert aside.with_name(aside.name + "-wal").read_bytes() == b"the log of rubbish"
    assert await numbers(path) == [1]


async def test_every_replaced_file_gets_its_own_name(path: Path, tmp_path: Path) -> None:
    await filled(path, 1)
    history.make(path, tmp_path / "b.db")
    asides = [history.restore(tmp_path / "b.db", path).aside for _ in range(3)]
    assert [aside.name for aside in asides if aside] == ["maya.db.old-1", "maya.db.old-2", "maya.db.old-3"]


async def test_runs_are_numbered_on_after_a_restore(path: Path, tmp_path: Path) -> None:
    await filled(path, 1)
    history.make(path, tmp_path / "b.db")
    for number in (2, 3, 4):
        await filled(path, number)
    history.restore(tmp_path / "b.db", path)
    journal = await SqliteJournal.open(path)
    assert journal.run == 5
    await journal.close()
    overwrite(path, b"rubbish")
    history.restore(tmp_path / "b.db", path)
    journal = await SqliteJournal.open(path)
    assert journal.run > 5
    await journal.close()


async def test_nothing_is_put_back_while_the_file_is_in_use(path: Path, tmp_path: Path) -> None:
    await filled(path, 1)
    history.make(path, tmp_path / "b.db")
    journal = await SqliteJournal.open(path)
    with pytest.raises(StorageInUse):
        history.restore(tmp_path / "b.db", path)
    await journal.add(job_row(2))
    await journal.close()
    assert await numbers(path) == [1, 2]


def newer(path: Path) -> None:
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA user_version = 99")


@pytest.mark.parametrize(
    ("spoil", "error"),
    [
        (newer, StorageTooNew),
        (lambda path: path.write_bytes(b"rubbish" * 500), StorageDamaged),
        (lambda path: path.write_bytes(path.read_bytes()[:5000]), StorageDamaged),
        (Path.unlink, FileUnreadable),
    ],
    ids=["newer", "rubbish", "cut short", "missing"],
)
async def test_a_bad_backup_leaves_the_file_as_it_is(path: Path, tmp_path: Path, spoil: Any, error: type) -> None:
    await filled(path, 1)
    history.make(path, tmp_path / "b.db")
    spoil(tmp_path / "b.db")
    with pytest.raises(error):
        history.restore(tmp_path / "b.db", path)
    assert await numbers(path) == [1]


@pytest.mark.parametrize("cut", ["link", "unlink", "replace", "sync"])
async def test_interrupted_restore_loses_neither_file_and_is_repeated(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cut: str
) -> None:
    class Cut(BaseException):
        """The power goes."""

    def cut_short(*_: object, **__: object) -> None:
        raise Cut

    await filled(path, 1)
    history.make(path, tmp_path / "b.db")
    await filled(path, 2)
    old = content(path)
    place = {"link": "os.link", "unlink": "pathlib.Path.unlink", "replace": "pathlib.Path.replace", "sync": "os.fsync"}
    with monkeypatch.context() as patched:
        exchange = history._exchange
        monkeypatch.setattr(history, "_exchange", partial(_cut_within, exchange, patched, place[cut], cut_short))
        with pytest.raises(Cut):
            history.restore(tmp_path / "b.db", path)
        monkeypatch.setattr(history, "_exchange", exchange)
    if cut in {"link", "sync"}:
        assert await numbers(path) == [1, 2], "nothing had been exchanged yet"
    else:
        with pytest.raises(StorageDamaged, match="cut short"):
            await SqliteJournal.open(path)
        assert old in [file.read_bytes() for file in path.parent.iterdir()]
    history.restore(tmp_path / "b.db", path)
    assert await numbers(path) == [1]


def _cut_within(exchange: Any, patched: pytest.MonkeyPatch, what: str, cut_short: Any, *rest: Any) -> Any:
    patched.setattr(what, cut_short)
    try:
        return exchange(*rest)
    finally:
        patched.undo()


def test_folder_that_cannot_be_made_is_reported(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("mine", encoding="ascii")
    with pytest.raises(FileUnwritable):
        history.restore(tmp_path / "b.db", tmp_path / "state" / "maya.db")


async def test_a_copy_that_is_not_put_anywhere_is_removed(path: Path, tmp_path: Path) -> None:
    await filled(path, 1)
    with history.copied(path, tmp_path) as copy:
        assert copy.exists()
    assert names(tmp_path) == {"state"}
    with pytest.raises(MayaError), history.copied(tmp_path / "missing.db", tmp_path):
        pass
    assert names(tmp_path) == {"state"}
