"""Known steps, in a file that outlives this program: each id is carried out only once."""

from __future__ import annotations

import asyncio
import json
import sqlite3
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TypeVar
from uuid import uuid4

from maya_un.errors import FileNotOurs, StorageTooNew
from maya_un.process.journal import file
from maya_un.steps.text import StepEnd

T = TypeVar("T")

NAME = "steps.db"
"""The file within the state folder."""

_APPLICATION = 0x4D617973
_VERSION = 2
_TABLE = """
CREATE TABLE steps (
    id TEXT PRIMARY KEY, digest TEXT NOT NULL, started TEXT NOT NULL, warnings TEXT NOT NULL,
    result TEXT, told INTEGER NOT NULL DEFAULT 0
) WITHOUT ROWID
"""
_IDENTITY = "CREATE TABLE IF NOT EXISTS identity (journal TEXT NOT NULL)"
"""Each journal has a unique name; programs that do not know this table ignore it."""

_TO_VERSION_2 = ("ALTER TABLE steps ADD COLUMN begun TEXT", "UPDATE steps SET begun = started")
"""In version 1 a step was stored when it started."""

_COLUMNS = "id, digest, started, warnings, result, told, begun"


@dataclass(frozen=True, slots=True)
class StoredStep:
    """A step as stored: `started` is the date of its acceptance, `begun` that of its execution, None before it.

    `result` is None while the step waits or runs, and if the program ended meanwhile. `told` is True if the result was
    delivered.
    """

    id: str
    digest: str
    started: str
    warnings: tuple[str, ...]
    result: StepEnd | None
    told: bool
    begun: str | None


class StepStore:
    """Stores steps in one file; when a method returns, its write is on the disk.

    Every write raises `StorageFailed`, and then nothing was stored. `journal` is the unique name of this file; a new
    file gets a new name.
    """

    def __init__(self, path: Path, connection: sqlite3.Connection, lock: file.JournalLock, journal: str) -> None:
        self.journal = journal
        self._path = path
        self._connection = connection
        self._lock = lock
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="steps")

    @classmethod
    async def open(cls, path: Path) -> StepStore:
        """Open or create the file at `path`, and lock it until `close`.

        Raises `StorageInUse`, `StorageDamaged`, `StorageTooNew`, `FileNotOurs`, `FileUnwritable`.
        """
        return await asyncio.get_running_loop().run_in_executor(None, _open, path)

    async def find(self, id_: str) -> StoredStep | None:
        """Return the step with an id, None if it is unknown."""
        asked = f"SELECT {_COLUMNS} FROM steps WHERE id = ?"
        rows = await self._do(lambda connection: connection.execute(asked, (id_,)).fetchall())
        return _kept(rows[0]) if rows else None

    async def unfinished(self) -> list[StoredStep]:
        """Return the steps without a result, and those with an undelivered result, oldest first."""
        asked = f"SELECT {_COLUMNS} FROM steps WHERE result IS NULL OR NOT told ORDER BY started, id"
        return [_kept(row) for row in await self._do(lambda connection: connection.execute(asked).fetchall())]

    async def accept(
        self, id_: str, digest: str, started: str, warnings: tuple[str, ...], *, begins: bool = False
    ) -> None:
        """Store an accepted step; with `begins`, it also starts at once."""
        values = (id_, digest, started, json.dumps(warnings), started if begins else None)
        added = "INSERT INTO steps (id, digest, started, warnings, begun) VALUES (?, ?, ?, ?, ?)"
        await self._do(lambda connection: connection.execute(added, values))

    async def refuse(self, id_: str, digest: str, result: StepEnd) -> None:
        """Store a step that never starts, with its result."""
        values = (id_, digest, result.started, json.dumps(result.warnings), _written(result))
        added = "INSERT INTO steps (id, digest, started, warnings, result) VALUES (?, ?, ?, ?, ?)"
        await self._do(lambda connection: connection.execute(added, values))

    async def begin(self, id_: str, date: str) -> None:
        """Store that a step starts; this must be on the disk before any motion."""
        changed = "UPDATE steps SET begun = ? WHERE id = ?"
        await self._do(lambda connection: connection.execute(changed, (date, id_)))

    async def end(self, id_: str, result: StepEnd) -> None:
        """Store the result of a step."""
        values = (_written(result), id_)
        await self._do(lambda connection: connection.execute("UPDATE steps SET result = ? WHERE id = ?", values))

    async def told(self, result: StepEnd) -> None:
        """Store that a result was delivered; a result that is not stored changes nothing."""
        values = (result.id, _written(result))
        changed = "UPDATE steps SET told = 1 WHERE id = ? AND result = ? AND NOT told"
        await self._do(lambda connection: connection.execute(changed, values))

    async def close(self) -> None:
        """Close and unlock the file."""
        try:
            await self._run(self._connection.close)
            self._thread.shutdown()
        finally:
            self._lock.release()

    async def _do(self, work: Callable[[sqlite3.Connection], T]) -> T:
        try:
            return await self._run(lambda: work(self._connection))
        except (sqlite3.Error, OSError) as error:
            raise file.writing_error(error) from error

    async def _run(self, work: Callable[[], T]) -> T:
        """Do `work` to its end, even if the caller is cancelled."""
        return await asyncio.shield(asyncio.get_running_loop().run_in_executor(self._thread, work))


def _open(path: Path) -> StepStore:
    with ExitStack() as undo:
        try:
            file.create(path)
            lock = file.JournalLock(path)
            undo.callback(lock.release)
            connection = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
            undo.callback(connection.close)
            _require_ours(connection, path)
            connection.execute("PRAGMA journal_mode = WAL")
            connection.execute("PRAGMA synchronous = FULL")
            _set_up(connection)
            journal = _journal(connection)
        except (sqlite3.Error, OSError) as error:
            raise file.opening_error(error, path) from error
        undo.pop_all()
        return StepStore(path, connection, lock, journal)


def _require_ours(connection: sqlite3.Connection, path: Path) -> None:
    """Raise `FileNotOurs` or `StorageTooNew` for a file that this program must not write; an empty file is accepted."""
    application, version = (
        connection.execute(f"PRAGMA {what}").fetchone()[0] for what in ("application_id", "user_version")
    )
    empty = not connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
    if application != _APPLICATION and not empty:
        raise FileNotOurs(path=path, remedy="another program made it; give another folder in MAYA_STATE_DIR")
    if version > _VERSION:
        raise StorageTooNew(path=path, found=version, known=_VERSION)


def _set_up(connection: sqlite3.Connection) -> None:
    """Create the table, or migrate it to this version, in one transaction."""
    version = connection.execute("PRAGMA user_version").fetchone()[0]
    if version == _VERSION:
        return
    connection.execute("BEGIN IMMEDIATE")
    for statement in (*(() if version else (_TABLE,)), *_TO_VERSION_2):
        connection.execute(statement)
    connection.execute(f"PRAGMA application_id = {_APPLICATION}")
    connection.execute(f"PRAGMA user_version = {_VERSION}")
    connection.execute("COMMIT")


def _journal(connection: sqlite3.Connection) -> str:
    """Return the name of this journal; a new journal gets its name here."""
    connection.execute("BEGIN IMMEDIATE")
    connection.execute(_IDENTITY)
    connection.execute("INSERT INTO identity SELECT ? WHERE NOT EXISTS (SELECT 1 FROM identity)", (uuid4().hex,))
    (found,) = connection.execute("SELECT journal FROM identity").fetchone()
    connection.execute("COMMIT")
    return str(found)


def _kept(row: tuple[str, str, str, str, str | None, int, str | None]) -> StoredStep:
    id_, digest, started, warnings, result, told, begun = row
    return StoredStep(id_, digest, started, tuple(json.loads(warnings)), _result(result), bool(told), begun)


def _written(result: StepEnd) -> str:
    return json.dumps(asdict(result))


def _result(text: str | None) -> StepEnd | None:
    if text is None:
        return None
    data = json.loads(text)
    return StepEnd(**(data | {"warnings": tuple(data["warnings"])}))
