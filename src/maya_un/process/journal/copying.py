"""A copy of a database that is whole: taken at one instant, looked through, and only then given its name."""

from __future__ import annotations

import os
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from dmc41x3.files import sync_folder, writable_place
from maya_un.errors import FileNotOurs, FileUnreadable, FileUnwritable, StorageDamaged
from maya_un.process.journal import faults, file, schema


@contextmanager
def reading(path: Path) -> Iterator[sqlite3.Connection]:
    """Look at a file of ours at one instant, beside whoever writes it.

    Raises `FileUnreadable`, `FileNotOurs`, `StorageDamaged`, `StorageTooNew`.
    """
    if not path.is_file():
        raise FileUnreadable(path=path, reason="there is no such file")
    try:
        with closing(file.open_for_reading(path)) as connection:
            connection.execute("BEGIN")
            if not schema.version(connection, path):
                raise FileNotOurs(path=path, remedy="no queue was ever kept in it")
            yield connection
    except sqlite3.Error as error:
        raise _unreadable(error, path) from error


@contextmanager
def copied(source: Path, folder: Path) -> Iterator[Path]:
    """Copy a file of ours into `folder`, check the copy, and remove it after the block unless it was moved.

    Raises as `reading` does, and `FileUnwritable`.
    """
    try:
        descriptor, name = tempfile.mkstemp(prefix=f".{source.name}-", suffix=".part", dir=folder)
        os.close(descriptor)
    except OSError as error:
        raise FileUnwritable(path=folder, reason=faults.reason(error)) from error
    copy = Path(name)
    try:
        with reading(source) as connection:
            _copy(connection, source, copy)
        yield copy
    finally:
        copy.unlink(missing_ok=True)


def _copy(connection: sqlite3.Connection, source: Path, copy: Path) -> None:
    with closing(sqlite3.connect(copy, isolation_level=None)) as target:
        try:
            connection.backup(target)
            target.execute("PRAGMA journal_mode = DELETE")
        except sqlite3.Error as error:
            if faults.is_damage(error):
                raise
            raise FileUnwritable(path=copy.parent, reason=faults.reason(error)) from error
        found = target.execute("PRAGMA integrity_check(1)").fetchone()[0]
    if found != "ok":
        raise StorageDamaged(path=source, reason=" ".join(str(found).split()))


def put(copy: Path, target: Path) -> None:
    """Give a copy its name, in place of what has it; raises `FileUnwritable`."""
    place = writable_place(target)
    try:
        descriptor = os.open(copy, os.O_RDWR | os.O_CLOEXEC)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
        copy.replace(place)
        sync_folder(place.parent)
    except OSError as error:
        raise FileUnwritable(path=target, reason=faults.reason(error)) from error


def _unreadable(error: sqlite3.Error, path: Path) -> StorageDamaged | FileUnreadable:
    if faults.is_damage(error):
        return StorageDamaged(path=path, reason=str(error))
    return FileUnreadable(path=path, reason=faults.reason(error))
