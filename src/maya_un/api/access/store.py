"""The storage of users and tokens: tables in the file of the queue, or memory in a stack without a file.

Only hashes of secrets are in it. Its tables have a version of their own, for the queue's change at another pace.
"""

from __future__ import annotations

import asyncio
import sqlite3
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeVar

from maya_un.api.access.caller import Role
from maya_un.errors import StorageTooNew
from maya_un.process.journal import faults

T = TypeVar("T")

VERSION = 1
"""Of the tables."""

PATIENCE = 5.0
"""How long a write waits for another connection's [s]."""

_TABLES = """
CREATE TABLE IF NOT EXISTS access_schema (version INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS access_users (
    name TEXT PRIMARY KEY, role TEXT NOT NULL, created TEXT NOT NULL, password TEXT NOT NULL
) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS access_tokens (
    id TEXT PRIMARY KEY, user TEXT NOT NULL, secret TEXT NOT NULL, note TEXT NOT NULL, created TEXT NOT NULL,
    expires TEXT NOT NULL, used TEXT NOT NULL, session INTEGER NOT NULL
) WITHOUT ROWID;
"""


@dataclass(frozen=True, slots=True)
class User:
    """Somebody who may sign in; `password` is its hash, "" where he has none. `created` is a date in UTC."""

    name: str
    role: Role
    created: str
    password: str = ""


@dataclass(frozen=True, slots=True)
class Token:
    """A token of a `user`; `secret` is the hash of its secret part.

    `expires` is when it ends, "" where never; `used` when it was shown last, to the minute, "" where never. Those of a
    `session` come from signing in with a password.
    """

    id: str
    user: str
    secret: str
    note: str
    created: str
    expires: str = ""
    used: str = ""
    session: bool = False


@dataclass(frozen=True, slots=True)
class Change:
    """A change to be written, all of it or nothing: new or changed users and tokens, and removed ones.

    Users go by name, and their tokens with them; tokens go by id.
    """

    users: tuple[User, ...] = ()
    tokens: tuple[Token, ...] = ()
    without_users: tuple[str, ...] = ()
    without_tokens: tuple[str, ...] = ()


class Store(Protocol):
    """Keeps users and tokens."""

    async def load(self) -> tuple[list[User], list[Token]]:
        """Return all there are."""
        ...

    async def apply(self, change: Change) -> None:
        """Keep a change; it is on the disk when this returns. Raises `StorageFailed`, and then nothing was kept."""
        ...

    async def close(self) -> None:
        """Close what is open."""
        ...


class MemoryStore:
    """Keeps nothing beyond its own life."""

    async def load(self) -> tuple[list[User], list[Token]]:
        """Return nobody and nothing."""
        return [], []

    async def apply(self, change: Change) -> None:
        """Believe whoever keeps it in mind."""

    async def close(self) -> None:
        """Do nothing."""


class FileStore:
    """Keeps users and tokens in the SQLite file at `path`, by a connection of its own, beside the loop.

    The file may be the queue's, whose own connection is left alone; both wait for each other's writes.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._connection: sqlite3.Connection | None = None
        self._turn = asyncio.Lock()

    async def load(self) -> tuple[list[User], list[Token]]:
        """Return all there are; makes the tables where they are missing.

        Raises `FileUnwritable`, `StorageDamaged` and `StorageTooNew`.
        """
        return await self._beside(self._load)

    async def apply(self, change: Change) -> None:
        """Keep a change durably; raises `StorageFailed`."""
        await self._beside(lambda: self._apply(change))

    async def close(self) -> None:
        """Close the connection."""
        async with self._turn:
            if self._connection is not None:
                self._connection.close()
                self._connection = None

    async def _beside(self, work: Callable[[], T]) -> T:
        """Do it in a thread, to its end also where whoever asked is cancelled, one after the other."""

        async def done() -> T:
            async with self._turn:
                return await asyncio.get_running_loop().run_in_executor(None, work)

        return await asyncio.shield(asyncio.ensure_future(done()))

    def _load(self) -> tuple[list[User], list[Token]]:
        try:
            return loaded(self._opened())
        except (sqlite3.Error, OSError) as error:
            raise faults.at_opening(error, self._path) from error

    def _apply(self, change: Change) -> None:
        try:
            applied(self._opened(), change)
        except (sqlite3.Error, OSError) as error:
            raise faults.at_writing(error) from error

    def _opened(self) -> sqlite3.Connection:
        if self._connection is None:
            self._connection = connected(self._path)
        return self._connection


def connected(path: Path) -> sqlite3.Connection:
    """Open the file at `path`, with the tables in it; raises `StorageTooNew` and what SQLite raises."""
    connection = sqlite3.connect(path, timeout=PATIENCE, isolation_level=None, check_same_thread=False)
    try:
        connection.execute("PRAGMA journal_mode=WAL")
        connection.execute("PRAGMA synchronous=FULL")
        _migrate(connection, path)
    except BaseException:
        connection.close()
        raise
    return connection


def _migrate(connection: sqlite3.Connection, path: Path) -> None:
    with _transaction(connection):
        for statement in filter(str.strip, _TABLES.split(";")):
            connection.execute(statement)
        found = connection.execute("SELECT max(version) FROM access_schema").fetchone()[0]
        if found is None:
            connection.execute("INSERT INTO access_schema VALUES (?)", (VERSION,))
    if found is not None and found > VERSION:
        raise StorageTooNew(path=path, found=found, known=VERSION)


@contextmanager
def _transaction(connection: sqlite3.Connection) -> Iterator[None]:
    """Write all that the block writes, or nothing."""
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
        connection.execute("COMMIT")
    except BaseException:
        if connection.in_transaction:
            connection.execute("ROLLBACK")
        raise


def loaded(connection: sqlite3.Connection) -> tuple[list[User], list[Token]]:
    """Return all users and tokens of a file."""
    with closing(connection.execute("SELECT name, role, created, password FROM access_users ORDER BY name")) as rows:
        users = [User(name, Role.of(role), created, password) for name, role, created, password in rows]
    columns = "id, user, secret, note, created, expires, used, session"
    with closing(connection.execute(f"SELECT {columns} FROM access_tokens ORDER BY created, id")) as rows:
        tokens = [Token(*row[:7], session=bool(row[7])) for row in rows]
    return users, tokens


def applied(connection: sqlite3.Connection, change: Change) -> None:
    """Write a change in one transaction."""
    with _transaction(connection):
        _write(connection, change)


def _write(connection: sqlite3.Connection, change: Change) -> None:
    users = [(user.name, user.role.word, user.created, user.password) for user in change.users]
    connection.executemany("INSERT OR REPLACE INTO access_users VALUES (?, ?, ?, ?)", users)
    tokens = [
        (one.id, one.user, one.secret, one.note, one.created, one.expires, one.used, int(one.session))
        for one in change.tokens
    ]
    connection.executemany("INSERT OR REPLACE INTO access_tokens VALUES (?, ?, ?, ?, ?, ?, ?, ?)", tokens)
    _remove(connection, "DELETE FROM access_users WHERE name = ?", change.without_users)
    _remove(connection, "DELETE FROM access_tokens WHERE user = ?", change.without_users)
    _remove(connection, "DELETE FROM access_tokens WHERE id = ?", change.without_tokens)


def _remove(connection: sqlite3.Connection, statement: str, keys: Iterable[str]) -> None:
    connection.executemany(statement, [(key,) for key in keys])
