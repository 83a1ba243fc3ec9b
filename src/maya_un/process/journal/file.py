"""The journal's file: safe against power cuts, checked when it is opened, used by one program.

Errors of SQLite are explained here.
"""

from __future__ import annotations

import errno
import fcntl
import os
import sqlite3
from contextlib import suppress
from pathlib import Path

from dmc41x3.files import open_own, sync_folder, writable_place
from dmc41x3.i18n import phrase
from maya_un.errors import FileUnwritable, MayaError, StorageDamaged, StorageFailed, StorageInUse, StorageUnavailable
from maya_un.process.journal import tables

_PASSING = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO, errno.EFBIG})

_DAMAGED = ("SQLITE_CORRUPT", "SQLITE_NOTADB")

_REASONS = {
    "SQLITE_FULL": phrase("the disk is full"),
    "SQLITE_READONLY": phrase("the file may only be read"),
    "SQLITE_CANTOPEN": phrase("the file cannot be opened"),
    "SQLITE_PERM": phrase("its rights do not allow it"),
    "SQLITE_BUSY": phrase("another program holds the file"),
    "SQLITE_CORRUPT": phrase("the file is damaged"),
    "SQLITE_NOTADB": phrase("the file is no database"),
    "SQLITE_IOERR": phrase("the disk reports an error"),
}


def sqlite_reason(error: sqlite3.Error | OSError) -> str:
    """Return the reason of an error: in words for known errors of SQLite, else as SQLite gives it, in English."""
    if isinstance(error, OSError):
        return error.strerror or str(error)
    name = str(getattr(error, "sqlite_errorname", ""))
    known = next((words for begin, words in _REASONS.items() if name.startswith(begin)), None)
    return f"{known}: {error}" if known else str(error)


def is_damage(error: sqlite3.Error | OSError) -> bool:
    """Return whether the error shows that the file itself is damaged."""
    return str(getattr(error, "sqlite_errorname", "")).startswith(_DAMAGED)


def opening_error(error: sqlite3.Error | OSError, path: Path) -> MayaError:
    """Return the error to raise if a file cannot be opened for writing."""
    if is_damage(error):
        return StorageDamaged(path=path, reason=str(error))
    if is_passing(error, path):
        return StorageUnavailable(path=path, reason=sqlite_reason(error))
    return FileUnwritable(path=path, reason=sqlite_reason(error))


def is_passing(error: BaseException | None, path: Path) -> bool:
    """Return whether the disk is at fault (full, read-only or broken), and not the file."""
    if isinstance(error, OSError):
        return error.errno in _PASSING
    name = str(getattr(error, "sqlite_errorname", ""))
    return name.startswith(("SQLITE_FULL", "SQLITE_IOERR")) or (
        name.startswith(("SQLITE_READONLY", "SQLITE_CANTOPEN")) and _is_read_only(path)
    )


def _is_read_only(path: Path) -> bool:
    """Return whether the file system of a file is mounted read-only."""
    try:
        return bool(os.statvfs(path.parent).f_flag & os.ST_RDONLY)
    except OSError:
        return False


def writing_error(error: sqlite3.Error | OSError) -> StorageFailed:
    """Return the error to raise if a write is not stored."""
    return StorageFailed(reason=sqlite_reason(error))


def reading_error(error: sqlite3.Error | OSError, path: Path | str) -> StorageDamaged:
    """Return the error to raise if stored data cannot be read any more."""
    return StorageDamaged(path=path, reason=str(error))


CHECKED_WHOLE = 64 * 2**20
"""A file up to this size is checked as a whole when it is opened [bytes]; of a larger file, the tables of the queue."""

WAL_LIMIT = 16 * 2**20
"""Size of the write-ahead log after a checkpoint [bytes]."""

_BUSY = 5.0
_HEADER = 512
_MAGIC = b"SQLite format 3\0"
"""`_BUSY`: longest wait for another program that reads the file, such as a backup [s, real time]."""

_NEEDED = ("meta", "queue", "jobs", "steps")


class JournalLock:
    """Lock for one program at a time: `flock` on a file beside the journal, which the kernel releases with the program.

    Raises `StorageInUse`, `FileUnwritable`.
    """

    def __init__(self, path: Path) -> None:
        self._descriptor = -1
        require_place(path)
        descriptor = open_own(beside(path, ".lock"), os.O_RDWR | os.O_CREAT)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            holder = os.pread(descriptor, 20, 0).decode(errors="replace").strip()
            os.close(descriptor)
            raise StorageInUse(path=path, pid=holder or "?") from error
        except OSError as error:
            os.close(descriptor)
            raise FileUnwritable(path=beside(path, ".lock"), reason=sqlite_reason(error)) from error
        found = os.fstat(descriptor)
        if _identity(beside(path, ".lock")) != (found.st_dev, found.st_ino):  # `remove_new` removed the file meanwhile
            os.close(descriptor)
            raise StorageInUse(path=path, pid="?")
        self._descriptor = descriptor
        self._say_who(descriptor)

    def _say_who(self, descriptor: int) -> None:
        """Write the process id for users; on a full disk it is missing, but the lock holds."""
        try:
            os.ftruncate(descriptor, 0)
            os.pwrite(descriptor, f"{os.getpid()}\n".encode(), 0)
        except OSError:
            return

    def release(self) -> None:
        """Release the lock. Its file stays, so the next process needs no new one."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1


class FileIdentity:
    """Checks that the open files are still at their paths: a write to a removed file would be lost.

    The file itself only grows, so a shorter file was truncated by another program.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._known = {file: _identity(file) for file in (path, beside(path, "-wal"))}
        self._size = path.stat().st_size

    def require(self) -> None:
        """Raise `OSError` if a file was moved, removed or replaced, or the journal was truncated."""
        for file, known in self._known.items():
            if _identity(file) != known:
                raise OSError(phrase("{file} was moved or removed while it was in use", file=file))
        size = self._path.stat().st_size
        if size < self._size:
            raise OSError(phrase("{path} was cut short while it was in use", path=self._path))
        self._size = size


def _identity(path: Path) -> tuple[int, int] | None:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def beside(path: Path, suffix: str) -> Path:
    """Return `path` with `suffix` added to its name."""
    return path.with_name(path.name + suffix)


def remove_new(path: Path) -> None:
    """Remove an unused new file and its companions, unless another process has opened it."""
    try:
        lock = JournalLock(path)
    except (FileUnwritable, StorageInUse):
        return
    try:
        for suffix in ("-wal", "-shm", "", ".lock"):
            with suppress(OSError):
                beside(path, suffix).unlink()
    finally:
        lock.release()


def create(path: Path) -> None:
    """Create the folder, and an empty file that only its owner may use, unless they exist; raises `OSError`."""
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    descriptor = open_own(path, os.O_RDWR | os.O_CREAT)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
    sync_folder(path.parent)


def require_place(path: Path) -> None:
    """Raise `FileUnwritable` if no database can be written; links are refused, because SQLite would follow them."""
    if writable_place(path) != path:
        raise FileUnwritable(path=path, reason="it is a symbolic link; name the file that it leads to")


def require_database(path: Path) -> None:
    """Raise `StorageDamaged` if the file is not an SQLite database, before other files are created beside it."""
    _require_whole(path)
    try:
        with path.open("rb") as found:
            head = found.read(len(_MAGIC))
    except OSError:
        return  # the file does not exist yet, or opening it raises the reason
    if head and head != _MAGIC and len(head) == len(_MAGIC):
        raise StorageDamaged(path=path, reason="file is not a database")


def open_for_writing(path: Path) -> sqlite3.Connection:
    """Open the file, create it if it is missing, check it and migrate it to this version.

    Raises `StorageDamaged`, `StorageTooNew`, `FileNotOurs`, `FileUnwritable`; a refused file stays unchanged.
    """
    _require_whole(path)
    connection: sqlite3.Connection | None = None
    try:
        create(path)
        connection = _connect(path)
        tables.schema_version(connection, path)
        check(connection, path)
        path.chmod(path.stat().st_mode & 0o700)
        _set_up(connection)
        tables.migrate(connection, path)
    except BaseException as error:
        if connection is not None:
            connection.close()
        if isinstance(error, sqlite3.Error | OSError):
            raise opening_error(error, path) from error
        raise
    return connection


def open_for_reading(path: Path) -> sqlite3.Connection:
    """Open an existing file for reading only, also while another program writes it.

    Its cache is small, because a walk over all jobs would fill any cache.
    """
    connection = _connect(path)
    connection.execute("PRAGMA query_only = 1")
    connection.execute("PRAGMA cache_size = -2000")
    return connection


def check(connection: sqlite3.Connection, path: Path) -> None:
    """Raise `StorageDamaged` if the check of the file, or of the queue's tables in a large file, fails."""
    pages, size = (int(connection.execute(f"PRAGMA {what}").fetchone()[0]) for what in ("page_count", "page_size"))
    there = {name for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall()}
    whole = pages * size <= CHECKED_WHOLE
    looks = ["quick_check(1)"] if whole else [f"quick_check('{name}')" for name in _NEEDED if name in there]
    for look in looks:
        found = connection.execute(f"PRAGMA {look}").fetchone()[0]
        if found != "ok":
            raise StorageDamaged(path=path, reason=" ".join(str(found).split()))


def _require_whole(path: Path) -> None:
    """Raise `StorageDamaged` if SQLite would lose data: a log without its file, or a fragment below a page."""
    log = beside(path, "-wal")
    if beside(path, ".restoring").exists():
        raise StorageDamaged(path=path, reason="a backup was being put in its place, and that was cut short")
    if path.exists() and 0 < path.stat().st_size < _HEADER:
        raise StorageDamaged(path=path, reason="it is shorter than any database")
    if log.exists() and log.stat().st_size and not (path.exists() and path.stat().st_size):
        raise StorageDamaged(
            path=path, reason=phrase("it is empty or missing, but {name} beside it is not", name=log.name)
        )


def _connect(path: Path) -> sqlite3.Connection:
    return sqlite3.connect(path, timeout=_BUSY, isolation_level=None, check_same_thread=False)


def _set_up(connection: sqlite3.Connection) -> None:
    """Choose a log that is on the disk before a commit returns."""
    connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("PRAGMA synchronous = FULL")
    connection.execute(f"PRAGMA journal_size_limit = {WAL_LIMIT}")
