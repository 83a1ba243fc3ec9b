"""Users and tokens in a file of their own, or in the queue's."""

from __future__ import annotations

import asyncio
import shutil
import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from maya_un.errors import FileUnwritable, StorageDamaged, StorageFailed, StorageTooNew
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.service.access.operations import Role
from maya_un.service.access.users import VERSION, Change, FileStore, Token, User
from tests.virtual_time import turn

ROOT = User("root", Role.ADMIN, "2026-11-21T09:00:00+00:00", "$argon2id$...")
SAM = User("sam", Role.STUDENT, "2026-11-21T09:00:01+00:00")
FIRST = Token("0a", "root", "$argon2id$...", "first", "2026-11-21T09:00:00+00:00")
SECOND = Token("0b", "sam", "$argon2id$...", "ñ", "2026-11-21T09:00:01+00:00", "2026-12-01", "2026-11-22", session=True)


async def kept(path: Path) -> tuple[list[User], list[Token]]:
    store = FileStore(path)
    try:
        return await store.load()
    finally:
        await store.close()


async def filled(path: Path) -> None:
    store = FileStore(path)
    await store.load()
    await store.apply(Change(users=(ROOT, SAM), tokens=(FIRST, SECOND)))
    await store.close()


async def test_stored_user_is_read_back(tmp_path: Path) -> None:
    path = tmp_path / "maya.db"
    assert await kept(path) == ([], [])
    await filled(path)
    assert await kept(path) == ([ROOT, SAM], [FIRST, SECOND])


async def test_changes_replace_and_tokens_go_with_their_user(tmp_path: Path) -> None:
    path = tmp_path / "maya.db"
    await filled(path)
    store = FileStore(path)
    older = replace(FIRST, used="2026-11-23")
    await store.apply(Change(users=(replace(ROOT, password=""),), tokens=(older,), without_users=("sam",)))
    await store.close()
    assert await kept(path) == ([replace(ROOT, password="")], [older])


async def test_tokens_go_one_by_one(tmp_path: Path) -> None:
    path = tmp_path / "maya.db"
    await filled(path)
    store = FileStore(path)
    await store.apply(Change(without_tokens=("0a", "never seen")))
    await store.close()
    assert (await kept(path))[1] == [SECOND]


async def test_it_lives_in_the_file_of_the_queue_while_that_is_in_use(tmp_path: Path) -> None:
    path = tmp_path / "maya.db"
    journal = await SqliteJournal.open(path)
    await filled(path)
    assert await kept(path) == ([ROOT, SAM], [FIRST, SECOND])
    await journal.close()
    again = await SqliteJournal.open(path)
    assert await kept(path) == ([ROOT, SAM], [FIRST, SECOND])
    await again.close()
    assert path.stat().st_mode & 0o077 == 0


async def test_it_was_there_before_the_queue(tmp_path: Path) -> None:
    path = tmp_path / "maya.db"
    await filled(path)
    journal = await SqliteJournal.open(path)
    await journal.close()
    assert await kept(path) == ([ROOT, SAM], [FIRST, SECOND])


async def test_written_user_survives_a_copy_of_the_disk(tmp_path: Path) -> None:
    """Taken right after `apply`, with the connection still open, as a power cut would."""
    path, copy = tmp_path / "disk" / "maya.db", tmp_path / "copy"
    path.parent.mkdir()
    store = FileStore(path)
    await store.load()
    await store.apply(Change(users=(ROOT,), tokens=(FIRST,)))
    shutil.copytree(path.parent, copy)
    await store.close()
    assert await kept(copy / "maya.db") == ([ROOT], [FIRST])


async def test_all_of_a_change_is_kept_or_nothing(tmp_path: Path) -> None:
    path = tmp_path / "maya.db"
    await filled(path)
    with closing(sqlite3.connect(path)) as other:
        other.execute("CREATE TRIGGER refuse BEFORE INSERT ON access_tokens BEGIN SELECT RAISE(ABORT, 'no'); END")
        other.commit()
    store = FileStore(path)
    with pytest.raises(StorageFailed, match="no"):
        await store.apply(Change(users=(replace(SAM, name="new"),), tokens=(replace(FIRST, id="0c"),)))
    await store.close()
    assert await kept(path) == ([ROOT, SAM], [FIRST, SECOND])


async def test_change_completes_when_its_caller_is_gone(tmp_path: Path) -> None:
    path = tmp_path / "maya.db"
    store = FileStore(path)
    await store.load()
    asked = asyncio.ensure_future(store.apply(Change(users=(ROOT,))))
    await turn()
    asked.cancel()
    await store.apply(Change(users=(SAM,)))
    await store.close()
    assert (await kept(path))[0] == [ROOT, SAM]


async def test_a_newer_file_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "maya.db"
    await filled(path)
    with closing(sqlite3.connect(path)) as other:
        other.execute("UPDATE access_schema SET version = ?", (VERSION + 1,))
        other.commit()
    with pytest.raises(StorageTooNew):
        await kept(path)


async def test_invalid_database_is_reported_as_damaged(tmp_path: Path) -> None:
    path = tmp_path / "maya.db"
    path.write_bytes(b"not a database" * 1000)
    with pytest.raises(StorageDamaged):
        await kept(path)
    with pytest.raises(FileUnwritable):
        await kept(tmp_path / "nowhere" / "maya.db")
