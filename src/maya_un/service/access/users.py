"""Users and tokens: their storage, a read-only view of another process's file, and the registry.

The file contains only hashes of secrets. Its tables have a separate version, because the queue's tables change
independently.
"""

from __future__ import annotations

import asyncio
import sqlite3
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol, TypeVar

from maya_un.errors import StorageFailed, StorageTooNew
from maya_un.process.journal import file
from maya_un.service.access.operations import Operation, Role, allowed

T = TypeVar("T")

VERSION = 1
"""Version of the tables."""

PATIENCE = 5.0
"""Longest wait for the write of another connection [s]."""

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
    """A user; `password` is the hash of the password, "" for none. `created` is a date in UTC."""

    name: str
    role: Role
    created: str
    password: str = ""


@dataclass(frozen=True, slots=True)
class Token:
    """A token of a `user`; `secret` is the hash of its secret part.

    `expires` is the date of its end, `used` that of its last use, to the minute; both are "" for never. A `session`
    token was created by signing in with a password.
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
    """A change to be written completely or not at all: new or changed users and tokens, and removed ones.

    Users are removed by name, with their tokens; tokens are removed by id.
    """

    users: tuple[User, ...] = ()
    tokens: tuple[Token, ...] = ()
    without_users: tuple[str, ...] = ()
    without_tokens: tuple[str, ...] = ()


class Store(Protocol):
    """Store of users and tokens."""

    async def load(self) -> tuple[list[User], list[Token]]:
        """Return all users and tokens."""
        ...

    async def apply(self, change: Change) -> None:
        """Store a change; it is on the disk when this returns. Raises `StorageFailed`, and then nothing was stored."""
        ...

    async def close(self) -> None:
        """Close the store."""
        ...


class MemoryStore:
    """Store without a file: the registry holds all users and tokens."""

    async def load(self) -> tuple[list[User], list[Token]]:
        """Return no users and no tokens."""
        return [], []

    async def apply(self, change: Change) -> None:
        """Do nothing."""

    async def close(self) -> None:
        """Do nothing."""


class FileStore:
    """Stores users and tokens in the SQLite file at `path`, over a separate connection, outside the loop.

    The file may be the queue's, whose connection is not used; both connections wait for each other's writes.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._connection: sqlite3.Connection | None = None
        self._turn = asyncio.Lock()

    async def load(self) -> tuple[list[User], list[Token]]:
        """Return all users and tokens; create the tables if they do not exist.

        Raises `FileUnwritable`, `StorageDamaged` and `StorageTooNew`.
        """
        return await self._beside(self._load)

    async def apply(self, change: Change) -> None:
        """Store a change durably; raises `StorageFailed`."""
        await self._beside(lambda: self._apply(change))

    async def close(self) -> None:
        """Close the connection."""
        async with self._turn:
            if self._connection is not None:
                self._connection.close()
                self._connection = None

    async def _beside(self, work: Callable[[], T]) -> T:
        """Do work in a thread, one call after the other, and to its end even if the caller is cancelled."""

        async def done() -> T:
            async with self._turn:
                return await asyncio.get_running_loop().run_in_executor(None, work)

        return await asyncio.shield(asyncio.ensure_future(done()))

    def _load(self) -> tuple[list[User], list[Token]]:
        try:
            return loaded(self._opened())
        except (sqlite3.Error, OSError) as error:
            raise file.opening_error(error, self._path) from error

    def _apply(self, change: Change) -> None:
        try:
            applied(self._opened(), change)
        except (sqlite3.Error, OSError) as error:
            raise file.writing_error(error) from error

    def _opened(self) -> sqlite3.Connection:
        if self._connection is None:
            self._connection = connected(self._path)
        return self._connection


def connected(path: Path) -> sqlite3.Connection:
    """Open the file at `path` and create its tables if necessary; raises `StorageTooNew` and SQLite's errors."""
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
    """Write everything in the block, or nothing."""
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
        """Return all users and tokens, none if there is no file; raises `StorageDamaged` and related errors."""
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
            raise file.opening_error(error, self._path) from error

    def _stamps(self) -> tuple[tuple[int, int, int], ...]:
        return tuple(_stamp(Path(f"{self._path}{suffix}")) for suffix in _BESIDE)


def _stamp(path: Path) -> tuple[int, int, int]:
    try:
        found = path.stat()
    except OSError:
        return 0, 0, 0
    return found.st_ino, found.st_mtime_ns, found.st_size


_TO_THE_MINUTE = 16

OnChange = Callable[[], None]
"""Called after a change of users or tokens."""


class Calendar(Protocol):
    """The current date; only interfaces such as HTTP and the command line read a clock.

    Dates are ISO 8601 in UTC, to the second.
    """

    def now(self) -> str:
        """Return the current date."""
        ...

    def after(self, seconds: float) -> str:
        """Return the date `seconds` from now."""
        ...


class UserRegistry:
    """Users by name and tokens by id. Hold `turn` to read and then change them.

    A removal takes effect at once, even if it cannot be written; a grant takes effect when it is on the disk.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._used: dict[str, str] = {}
        self.users: dict[str, User] = {}
        self.tokens: dict[str, Token] = {}
        self.turn = asyncio.Lock()
        self._listeners: list[OnChange] = []

    async def open(self) -> None:
        """Read the store; raises `StorageFailed` and related errors."""
        users, tokens = await self._store.load()
        self.users = {user.name: user for user in users}
        self.tokens = {token.id: token for token in tokens if token.user in self.users}

    async def read_again(self) -> None:
        """Read the store again, because another process may have changed it; raises as `open`."""
        await self.open()
        self._tell()

    def of(self, name: str) -> list[Token]:
        """Return the tokens of a user, oldest first."""
        return [token for token in self.tokens.values() if token.user == name]

    def drivers(self) -> list[str]:
        """Return the names of the users whose role allows them to drive, sorted."""
        return sorted(user.name for user in self.users.values() if allowed(user.role, Operation.LEASE))

    def heard_by(self, listener: OnChange) -> Callable[[], None]:
        """Call `listener` after each change, before other tasks continue; return a function that ends this."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener)

    async def change(self, change: Change) -> None:
        """Change users and tokens; raises `StorageFailed`."""
        for name in change.without_users:
            self.users.pop(name, None)
            for token in self.of(name):
                del self.tokens[token.id]
        for key in change.without_tokens:
            self.tokens.pop(key, None)
        if change.without_users or change.without_tokens:
            self._tell()
        used, self._used = self._used, {}
        noted = tuple(token for token in map(self.tokens.get, used) if token is not None)
        await self._store.apply(replace(change, tokens=noted + change.tokens))
        self.users.update({user.name: user for user in change.users})
        self.tokens.update({token.id: token for token in change.tokens})
        if change.users:
            self._tell()

    def _tell(self) -> None:
        for listener in tuple(self._listeners):
            listener()

    def used(self, token: Token, date: str) -> None:
        """Record the use of a token; it is written with the next change, or at the end."""
        if token.used[:_TO_THE_MINUTE] != date[:_TO_THE_MINUTE] and token.id in self.tokens:
            self.tokens[token.id] = replace(token, used=date)
            self._used[token.id] = date

    async def close(self) -> None:
        """Write the recorded uses of tokens, and close the store; a failed write is ignored."""
        async with self.turn:
            try:
                if self._used:
                    await self.change(Change())
            except StorageFailed:
                self._used.clear()
            finally:
                await self._store.close()
