"""What SQLite's errors mean to people."""

from __future__ import annotations

import sqlite3
from pathlib import Path

from maya_un.errors import FileUnwritable, MayaError, StorageDamaged, StorageFailed

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
    return FileUnwritable(path=path, reason=reason(error))


def at_writing(error: sqlite3.Error | OSError) -> StorageFailed:
    """Return what to raise where a write is not kept."""
    return StorageFailed(reason=reason(error))


def at_reading(error: sqlite3.Error | OSError, path: Path | str) -> StorageDamaged:
    """Return what to raise where something kept cannot be read any more."""
    return StorageDamaged(path=path, reason=str(error))
