"""Backups of the journal's file: made while it is in use, put back while it is not."""

from __future__ import annotations

import os
import sqlite3
from contextlib import closing, suppress
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from dmc41x3.files import open_own, sync_folder, writable_place
from maya_un.errors import FileUnwritable, MayaError
from maya_un.process.journal import copying, faults, file
from maya_un.process.journal.file import beside
from maya_un.process.journal.tables import ALIVE

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
    with copying.copied(source, target.parent) as copy:
        made = _described(copy, target)
        copying.put(copy, target)
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
        raise FileUnwritable(path=path, reason=faults.reason(error)) from error
    lock = file.JournalLock(path)
    try:
        with copying.copied(backup, path.parent) as copy:
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
        copying.put(copy, path)
        mark.unlink()
        sync_folder(path.parent)
    except OSError as error:
        raise FileUnwritable(path=path, reason=faults.reason(error)) from error
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
        with suppress(MayaError), copying.reading(path) as old:
            other = _run(old)
        connection.execute("UPDATE meta SET value = ? WHERE name = 'run'", (max(own, other),))


def _run(connection: sqlite3.Connection) -> int:
    return int(connection.execute("SELECT value FROM meta WHERE name = 'run'").fetchone()[0])


def _described(copy: Path, path: Path) -> Backup:
    with copying.reading(copy) as connection:
        jobs = int(connection.execute("SELECT count(*) FROM jobs").fetchone()[0])
        alive = int(connection.execute(f"SELECT count(*) FROM jobs WHERE state IN ({ALIVE})").fetchone()[0])
    return Backup(path, copy.stat().st_size, jobs, alive)
