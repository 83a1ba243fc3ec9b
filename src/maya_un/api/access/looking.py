"""Users and tokens of another process: read from its file, never written."""

from __future__ import annotations

import asyncio
import sqlite3
from contextlib import closing
from pathlib import Path

from maya_un.api.access.store import PATIENCE, Change, Token, User, loaded
from maya_un.process.journal import faults

_BESIDE = ("", "-wal")


class ReadOnlyStore:
    """Reads users and tokens of the SQLite file at `path`, which may not exist yet."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._seen: tuple[tuple[int, int, int], ...] = ()

    async def changed(self) -> bool:
        """Return whether the file may have changed since the last read."""
        return await asyncio.get_running_loop().run_in_executor(None, self._stamps) != self._seen

    async def load(self) -> tuple[list[User], list[Token]]:
        """Return all users and tokens, none without a file; raises `StorageDamaged` and related errors."""
        return await asyncio.get_running_loop().run_in_executor(None, self._load)

    async def apply(self, change: Change) -> None:
        """Store nothing: the file belongs to another process."""

    async def close(self) -> None:
        """Do nothing: the file is open only while it is read."""

    def _load(self) -> tuple[list[User], list[Token]]:
        self._seen = self._stamps()
        if not self._path.exists():
            return [], []
        try:
            place = f"{self._path.absolute().as_uri()}?mode=ro"
            with closing(sqlite3.connect(place, uri=True, timeout=PATIENCE)) as connection:
                made = connection.execute("SELECT name FROM sqlite_master WHERE name = 'access_users'").fetchone()
                return ([], []) if made is None else loaded(connection)
        except (sqlite3.Error, OSError) as error:
            raise faults.at_opening(error, self._path) from error

    def _stamps(self) -> tuple[tuple[int, int, int], ...]:
        return tuple(_stamp(Path(f"{self._path}{suffix}")) for suffix in _BESIDE)


def _stamp(path: Path) -> tuple[int, int, int]:
    try:
        found = path.stat()
    except OSError:
        return 0, 0, 0
    return found.st_ino, found.st_mtime_ns, found.st_size
