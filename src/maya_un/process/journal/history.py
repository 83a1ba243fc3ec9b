"""The history of the journal: pages of ended jobs and events, backups, restores and exports.

A backup is a copy of the file at one instant, made while the file is in use, and checked before it gets its name. A
backup is restored while the file is not in use.
"""

from __future__ import annotations

import csv
import json
import os
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import asdict, dataclass
from enum import StrEnum
from itertools import count
from pathlib import Path
from typing import Any, TextIO

from dmc41x3.files import open_own, sync_folder, writable_place
from maya_un.errors import FileNotOurs, FileUnreadable, FileUnwritable, MayaError, StorageDamaged
from maya_un.process.journal import file, tables
from maya_un.process.journal.file import beside
from maya_un.process.journal.protocol import EventRow, Filter, JobRow, StepRow
from maya_un.process.journal.tables import ALIVE, EVENT, JOB, LARGEST, STEP, bounded
from maya_un.schema.jobs import TaskState


@contextmanager
def reading(path: Path) -> Iterator[sqlite3.Connection]:
    """Yield a connection that reads a journal file at one instant, also while another program writes it.

    Raises `FileUnreadable`, `FileNotOurs`, `StorageDamaged`, `StorageTooNew`.
    """
    if not path.is_file():
        raise FileUnreadable(path=path, reason="there is no such file")
    try:
        with closing(file.open_for_reading(path)) as connection:
            connection.execute("BEGIN")
            if not tables.schema_version(connection, path):
                raise FileNotOurs(path=path, remedy="it is not a queue of Maya")
            yield connection
    except sqlite3.Error as error:
        raise _unreadable(error, path) from error


@contextmanager
def copied(source: Path, folder: Path) -> Iterator[Path]:
    """Copy a journal file into `folder`, check the copy, and remove it after the block unless it was moved.

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
    """Move a copy to `target`, replacing an older file; raises `FileUnwritable`."""
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
"""If the old file cannot be read, the number of the next run is increased by this beyond the backup's."""


@dataclass(frozen=True, slots=True)
class Backup:
    """A backup that was made or restored: its file, its size [bytes], the number of its jobs, and of unfinished ones.

    `aside` is the new place of the file that it replaced, None without one.
    """

    path: Path
    size: int
    jobs: int
    unfinished: int
    aside: Path | None = None


def make(source: Path, target: Path) -> Backup:
    """Copy the file at `source` to `target` at one instant, also while it is written; replaces an older backup.

    The copy is checked as a whole before it gets its name. Only its owner may read it, because it contains users and
    hashes of tokens. Raises `FileUnreadable`, `FileNotOurs`, `StorageDamaged`, `StorageTooNew`, `FileUnwritable`.
    """
    if target.exists() and source.exists() and target.samefile(source):
        raise FileUnwritable(path=target, reason="it is the file of the queue itself")
    writable_place(target)
    with copied(source, target.parent) as copy:
        made = _described(copy, target)
        put(copy, target)
    return made


def restore(backup: Path, path: Path) -> Backup:
    """Restore a backup to `path`; the file there is moved aside, whatever its state.

    An interruption at any time leaves both files. If the exchange had started, `path` cannot be opened until the
    restore is repeated. The numbers of runs continue from the greater of the two, so that events of different runs stay
    distinct. Raises `StorageInUse` while a program has the file open, and the errors of `make`.
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
    """Give the old file a second name, then its name to the copy; a mark file shows an interrupted exchange."""
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
    """Give the old file and its log a second, free name; return it, None without an old file."""
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
    """Set the run number of the copy, so that the next run is numbered beyond both files."""
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


LONGEST_PAGE = 1000
"""The longest page."""


def page(connection: sqlite3.Connection, which: Filter) -> list[JobRow]:
    """Return a page of jobs without their bodies."""
    statement, values = _by_text(which) if which.text.split() else _by_index(which)
    return [tables.job_of(row) for row in connection.execute(statement, values).fetchall()]


def _by_index(which: Filter) -> tuple[str, list[object]]:
    """Query each state separately: the newest of each include the newest of all, and an index orders every part."""
    if not which.states and which.owner is None:
        conditions, values = _conditions(which, "id", ())
        return f"SELECT {JOB} FROM jobs WHERE {conditions} {_end(which)}", [*values, _limit(which)]
    parts: list[str] = []
    values = []
    for state in which.states or tuple(TaskState):
        conditions, bound = _conditions(which, "id", (state,))
        parts.append(f"SELECT * FROM (SELECT id FROM jobs WHERE {conditions} {_end(which)})")
        values += [*bound, _limit(which)]
    numbers = f"SELECT id FROM ({' UNION ALL '.join(parts)}) {_end(which)}"
    return f"SELECT {JOB} FROM jobs WHERE id IN ({numbers}) ORDER BY id {_way(which)}", [*values, _limit(which)]


def _by_text(which: Filter) -> tuple[str, list[object]]:
    """Read the narrow table of words in order, until the page is full; the longest word excludes the most rows."""
    words = sorted(which.text.casefold().split(), key=len, reverse=True)
    alike = " AND ".join("words LIKE ? ESCAPE '\\'" for _ in words)
    conditions, values = _conditions(which, "labels.job", which.states)
    found = f"SELECT {JOB} FROM labels CROSS JOIN jobs ON jobs.id = labels.job WHERE {alike} AND {conditions}"
    return f"{found} ORDER BY labels.job {_way(which)} LIMIT ?", [*map(_pattern, words), *values, _limit(which)]


def _conditions(which: Filter, number: str, states: tuple[TaskState, ...]) -> tuple[str, list[object]]:
    conditions = [f"{number} > ?", f"{number} < ?"]
    values: list[object] = [-1 if which.above is None else bounded(which.above)]
    values.append(LARGEST if which.below is None else bounded(which.below))
    if which.owner is not None:
        conditions.append("owner = ?")
        values.append(which.owner)
    if states:
        conditions.append(f"state IN ({', '.join('?' * len(states))})")
        values += [state.value for state in states]
    return " AND ".join(conditions), values


def _pattern(word: str) -> str:
    escaped = word.replace("\\", "\\\\").replace("%", "\\%").replace("_", "\\_")
    return f"%{escaped}%"


def _way(which: Filter) -> str:
    return "ASC" if which.oldest_first else "DESC"


def _end(which: Filter) -> str:
    return f"ORDER BY id {_way(which)} LIMIT ?"


def _limit(which: Filter) -> int:
    return max(0, min(which.limit, LONGEST_PAGE))


COLUMNS = (
    *("id", "name", "state", "code", "message", "owner", "source", "priority", "notes", "depends_on"),
    *("submitted", "began", "ended", "predicted", "duration", "steps", "done", "proposal", "approved_by"),
)
"""The columns of the CSV: dates ISO 8601 in UTC, durations in s, dependencies separated by a space."""

_TOGETHER = 500
"""Jobs read at a time."""


class ExportFormat(StrEnum):
    """The format of an exported history: `csv` without bodies and steps, `jsonl` with all stored data."""

    CSV = "csv"
    JSONL = "jsonl"


def export(path: Path, out: TextIO, form: ExportFormat = ExportFormat.CSV) -> int:
    """Write all jobs of the file at `path` to `out`, oldest first, and return their number; the file may be in use.

    Raises `FileUnreadable`, `FileNotOurs`, `StorageDamaged`, `StorageTooNew`, and the errors of `out`.
    """
    with reading(path) as connection:
        return _csv(connection, out) if form is ExportFormat.CSV else _jsonl(connection, out)


def _csv(connection: sqlite3.Connection, out: TextIO) -> int:
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    written = 0
    for row in _jobs(connection):
        plain = _plain(row)
        depends_on = " ".join(str(number) for number in row.options.depends_on)
        writer.writerow([_inert({**plain, "depends_on": depends_on}[name]) for name in COLUMNS])
        written += 1
    return written


def _inert(value: object) -> object:
    """Return a value; a text that a spreadsheet would evaluate as a formula gets an apostrophe before it."""
    return f"'{value}" if isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r")) else value


def _jsonl(connection: sqlite3.Connection, out: TextIO) -> int:
    written = 0
    for row in _jobs(connection):
        line = {**_plain(row), "body": row.body, "step_results": [asdict(step) for step in _steps(connection, row.id)]}
        out.write(json.dumps(line, ensure_ascii=False) + "\n")
        written += 1
    return written


def _plain(row: JobRow) -> dict[str, Any]:
    """Return a job as a flat mapping, without its body and its key, which is private to its owner."""
    options = asdict(row.options)
    flat = {name: getattr(row, name) for name in JobRow.__dataclass_fields__ if name not in _NOT_FLAT}
    return {**flat, **options, "owner": row.owner.name, "source": row.owner.source}


_NOT_FLAT = {"body", "options", "owner", "key", "digest"}


def _jobs(connection: sqlite3.Connection) -> Iterator[JobRow]:
    cursor = connection.execute(f"SELECT {JOB}, body FROM jobs LEFT JOIN bodies ON bodies.job = jobs.id ORDER BY id")
    while rows := cursor.fetchmany(_TOGETHER):
        for values in rows:
            yield tables.job_of(values[:-1], values[-1])


def _steps(connection: sqlite3.Connection, job: int) -> list[StepRow]:
    rows = connection.execute(f'SELECT {STEP} FROM steps WHERE job = ? ORDER BY "index"', (job,)).fetchall()
    return [tables.step_of(values)[1] for values in rows]


def newest_events(path: Path, most: int, *, above: int = 0, since: str = "") -> list[tuple[int, EventRow]]:
    """Return the newest events, at most `most`, oldest first, each with its number in the file.

    Only events numbered above `above` and dated at or after `since` (ISO 8601, UTC) are returned. Raises
    `FileUnreadable`, `FileNotOurs`, `StorageDamaged`, `StorageTooNew`.
    """
    asked = f"SELECT number, {EVENT} FROM events WHERE number > ? AND date >= ? ORDER BY number DESC LIMIT ?"
    with reading(path) as connection:
        found = connection.execute(asked, (above, since, most)).fetchall()
    return [(int(number), tables.event_of(tuple(values))) for number, *values in reversed(found)]
