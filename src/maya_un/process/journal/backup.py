"""Backups of the journal's file: made while it is in use, restored while it is not.

A copy is taken at one instant and checked before it gets its name.
"""

from __future__ import annotations

import os
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from dmc41x3.files import open_own, sync_folder, writable_place
from maya_un.errors import FileNotOurs, FileUnreadable, FileUnwritable, MayaError, StorageDamaged
from maya_un.process.journal import file, tables
from maya_un.process.journal.file import beside
from maya_un.process.journal.tables import ALIVE


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
            if not tables.schema_version(connection, path):
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
        raise FileUnwritable(path=folder, reason=file.sqlite_reason(error)) from error
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
            if file.is_damage(error):
                raise
            raise FileUnwritable(path=copy.parent, reason=file.sqlite_reason(error)) from error
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
        raise FileUnwritable(path=target, reason=file.sqlite_reason(error)) from error


def _unreadable(error: sqlite3.Error, path: Path) -> StorageDamaged | FileUnreadable:
    if file.is_damage(error):
        return StorageDamaged(path=path, reason=str(error))
    return FileUnreadable(path=path, reason=file.sqlite_reason(error))


_RUNS_BEYOND = 1000
"""If the old file cannot be read, the next run is numbered so far beyond the backup's."""


@dataclass(frozen=True, slots=True)
class Backup:
    """A backup that was made or put back: its file, its size [bytes], how many jobs are in it, how many unfinished.

    `aside` is where the file went whose place it took, None where there was none.
    """

    path: Path
    size: int
    jobs: int
    unfinished: int
    aside: Path | None = None


def make(source: Path, target: Path) -> Backup:
    """Copy the file at `source` to `target` as it is at this instant, also while it is written; an older one goes.

    The copy is checked whole before it gets its name, and is for its owner alone: users and hashes of tokens are in it.
    Raises `FileUnreadable`, `FileNotOurs`, `StorageDamaged`, `StorageTooNew`, `FileUnwritable`.
    """
    if target.exists() and source.exists() and target.samefile(source):
        raise FileUnwritable(path=target, reason="it is the file itself")
    writable_place(target)
    with copied(source, target.parent) as copy:
        made = _described(copy, target)
        put(copy, target)
    return made


def restore(backup: Path, path: Path) -> Backup:
    """Put a backup in the place of the file at `path`, which is kept aside whatever state it is in.

    Cut short at any instant it leaves both; once the exchange has begun, the file is refused until this was done again.
    The numbers of runs go on from the greater of the two, so that nobody takes the events of one for another's.
    Raises `StorageInUse` while somebody has the file open, and what `make` raises.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    except OSError as error:
        raise FileUnwritable(path=path, reason=file.sqlite_reason(error)) from error
    lock = file.JournalLock(path)
    try:
        with copied(backup, path.parent) as copy:
            _count_on(copy, path)
            described = _described(copy, path)
            return Backup(path, described.size, described.jobs, described.unfinished, _exchange(copy, path))
    finally:
        lock.release()


def _exchange(copy: Path, path: Path) -> Path | None:
    """Give the old file a second name, then its name to the copy; a mark tells where that was cut short."""
    mark = beside(path, ".restoring")
    try:
        aside = _keep_aside(path)
        os.close(open_own(mark, os.O_WRONLY | os.O_CREAT))
        sync_folder(path.parent)
        for suffix in ("-wal", "-shm"):
            beside(path, suffix).unlink(missing_ok=True)
        put(copy, path)
        mark.unlink()
        sync_folder(path.parent)
    except OSError as error:
        raise FileUnwritable(path=path, reason=file.sqlite_reason(error)) from error
    return aside


def _keep_aside(path: Path) -> Path | None:
    """Give the old file and its log a name more, that is not taken."""
    if not path.exists() and not beside(path, "-wal").exists():
        return None
    names = (beside(path, f".old-{number}") for number in count(1))
    aside = next(name for name in names if not name.exists() and not beside(name, "-wal").exists())
    for suffix in ("-wal", ""):
        if beside(path, suffix).exists():
            os.link(beside(path, suffix), beside(aside, suffix))
    sync_folder(path.parent)
    return aside


def _count_on(copy: Path, path: Path) -> None:
    """Have the copy's next run numbered beyond both files'."""
    with closing(sqlite3.connect(copy, isolation_level=None)) as connection:
        own = _run(connection)
        other = own + _RUNS_BEYOND if path.exists() else own
        with suppress(MayaError), reading(path) as old:
            other = _run(old)
        connection.execute("UPDATE meta SET value = ? WHERE name = 'run'", (max(own, other),))


def _run(connection: sqlite3.Connection) -> int:
    return int(connection.execute("SELECT value FROM meta WHERE name = 'run'").fetchone()[0])


def _described(copy: Path, path: Path) -> Backup:
    with reading(copy) as connection:
        jobs = int(connection.execute("SELECT count(*) FROM jobs").fetchone()[0])
        alive = int(connection.execute(f"SELECT count(*) FROM jobs WHERE state IN ({ALIVE})").fetchone()[0])
    return Backup(path, copy.stat().st_size, jobs, alive)
