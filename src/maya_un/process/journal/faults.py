"""Explanations of SQLite's errors."""

from __future__ import annotations

import errno
import os
import sqlite3
from pathlib import Path

from maya_un.errors import FileUnwritable, MayaError, StorageDamaged, StorageFailed, StorageUnavailable

_PASSING = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO, errno.EFBIG})

_DAMAGED = ("SQLITE_CORRUPT", "SQLITE_NOTADB")

_REASONS = {
    "SQLITE_FULL": "the disk is full",
    "SQLITE_READONLY": "the file may only be read",
    "SQLITE_CANTOPEN": "the file cannot be opened",
    "SQLITE_PERM": "its rights do not allow it",
    "SQLITE_BUSY": "another program holds the file",
    "SQLITE_CORRUPT": "the file is damaged",
    "SQLITE_NOTADB": "the file is no database",
    "SQLITE_IOERR": "the disk reports an error",
}


def reason(error: sqlite3.Error | OSError) -> str:
    """Return why, in words where we know them, in SQLite's own where not."""
    if isinstance(error, OSError):
        return error.strerror or str(error)
    name = str(getattr(error, "sqlite_errorname", ""))
    known = next((words for begin, words in _REASONS.items() if name.startswith(begin)), None)
    return f"{known}: {error}" if known else str(error)


def is_damage(error: sqlite3.Error | OSError) -> bool:
    """Whether the file itself is not what it was."""
    return str(getattr(error, "sqlite_errorname", "")).startswith(_DAMAGED)


def at_opening(error: sqlite3.Error | OSError, path: Path) -> MayaError:
    """Return what to raise where a file cannot be opened for writing."""
    if is_damage(error):
        return StorageDamaged(path=path, reason=str(error))
    if is_passing(error, path):
        return StorageUnavailable(path=path, reason=reason(error))
    return FileUnwritable(path=path, reason=reason(error))


def is_passing(error: BaseException | None, path: Path) -> bool:
    """Tell whether the disk is at fault, full or read-only, and not the file."""
    if isinstance(error, OSError):
        return error.errno in _PASSING
    name = str(getattr(error, "sqlite_errorname", ""))
    return name.startswith(("SQLITE_FULL", "SQLITE_IOERR")) or (
        name.startswith(("SQLITE_READONLY", "SQLITE_CANTOPEN")) and _is_read_only(path)
    )


def _is_read_only(path: Path) -> bool:
    """Tell whether the file system of a file is mounted for reading only."""
    try:
        return bool(os.statvfs(path.parent).f_flag & os.ST_RDONLY)
    except OSError:
        return False


def at_writing(error: sqlite3.Error | OSError) -> StorageFailed:
    """Return what to raise where a write is not kept."""
    return StorageFailed(reason=reason(error))


def at_reading(error: sqlite3.Error | OSError, path: Path | str) -> StorageDamaged:
    """Return what to raise where something kept cannot be read any more."""
    return StorageDamaged(path=path, reason=str(error))
