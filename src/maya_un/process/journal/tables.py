"""Writes to and reads from the journal's tables, on a connection that the caller opened."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Sequence
from typing import Any

from maya_un.config import StorageConfig
from maya_un.process.journal import encoding
from maya_un.process.journal.encoding import AUDIT, EVENT, JOB, STEP, marks, updates
from maya_un.process.journal.rows import (
    AuditRow,
    ClearedJobs,
    EventRow,
    JobRow,
    QueueRow,
    StepRow,
    UnendedJobs,
    Unfinished,
)
from maya_un.process.order import QueueOrder, QueuePosition
from maya_un.schema.states import TaskState

Change = JobRow | QueueRow | ClearedJobs | tuple[int, StepRow]
"""A newer version of a job, of the queue's mode, of a step (the job's number, the step), the end of many jobs."""

LARGEST = 2**63 - 1
"""The largest whole number of SQLite; no number of ours comes near."""

_ADD_JOB = f"INSERT INTO jobs ({JOB}) VALUES ({marks(JOB)})"
_SAVE_JOB = f"{_ADD_JOB} {updates(JOB, 'id')}"
_SAVE_BODY = "INSERT INTO bodies VALUES (?, ?) ON CONFLICT (job) DO UPDATE SET body = excluded.body"
_SAVE_LABEL = (
    "INSERT INTO labels VALUES (?, ?) "
    "ON CONFLICT (job) DO UPDATE SET words = excluded.words WHERE words <> excluded.words"
)
_SAVE_STEP = f"INSERT INTO steps ({STEP}) VALUES ({marks(STEP)}) " + updates(STEP, "job", '"index"')
_SAVE_QUEUE = "INSERT OR REPLACE INTO queue VALUES (1, ?, ?, ?, ?)"
_ADD_EVENT = f"INSERT OR REPLACE INTO events ({EVENT}) VALUES ({marks(EVENT)})"
_ADD_AUDIT = f"INSERT INTO audit ({AUDIT}) VALUES ({marks(AUDIT)})"
ALIVE = ", ".join(f"'{state}'" for state in TaskState if not state.ended)
"""The states of jobs that have not ended, as SQL lists them."""
_WAITS = (
    "state IN ('queued', 'held') AND began = '' AND depends_on = '[]' "
    "AND NOT EXISTS (SELECT 1 FROM steps WHERE steps.job = jobs.id)"
)
"""Waiting jobs in SQL: no step has begun or was skipped, and the job depends on no other."""
_IN_ORDER = "ORDER BY priority DESC, position, id"
_CLEAR = "UPDATE jobs SET state = ?, code = ?, message = ?, ended = ? WHERE id IN (SELECT value FROM json_each(?))"
_WITH_BODY = f"SELECT {JOB}, body FROM jobs LEFT JOIN bodies ON bodies.job = jobs.id"


_BODIES = 1000


class Bodies:
    """Which bodies are known to be in the file: a job is written often, its body rarely changes and may be long.

    It goes by identity, so a body is never changed in place; `forget` after anything that may not have been kept.
    """

    def __init__(self) -> None:
        self._known: dict[int, tuple[dict[str, Any], str, str]] = {}

    def lacks(self, row: JobRow) -> bool:
        """Whether the body, the name or the notes of a job are to be written; from now on they count as written."""
        known = self._known.get(row.id)
        same = known is not None and known[0] is row.body and known[1:] == (row.name, row.options.notes)
        if row.state.ended:
            self._known.pop(row.id, None)
        else:
            self._known[row.id] = (row.body, row.name, row.options.notes)
            if len(self._known) > _BODIES:
                del self._known[next(iter(self._known))]
        return not same

    def forget(self) -> None:
        """Count no body as written."""
        self._known.clear()


def add(connection: sqlite3.Connection, bodies: Bodies, jobs: Iterable[JobRow]) -> None:
    """Write new jobs; raises `sqlite3.IntegrityError` for a number, or an owner's key, that is there."""
    for row in jobs:
        connection.execute(_ADD_JOB, encoding.job_values(row))
        _write_body(connection, bodies, row)


def save(connection: sqlite3.Connection, bodies: Bodies, changes: Iterable[Change]) -> None:
    """Write newer versions."""
    for change in changes:
        if isinstance(change, JobRow):
            connection.execute(_SAVE_JOB, encoding.job_values(change))
            _write_body(connection, bodies, change)
        elif isinstance(change, QueueRow):
            connection.execute(_SAVE_QUEUE, (change.paused, change.reason, change.by, change.since))
        elif isinstance(change, ClearedJobs):
            values = (change.state.value, change.code, change.message, change.ended, json.dumps(change.numbers))
            connection.execute(_CLEAR, values)
        else:
            connection.execute(_SAVE_STEP, encoding.step_values(*change))


def _write_body(connection: sqlite3.Connection, bodies: Bodies, row: JobRow) -> None:
    if bodies.lacks(row):
        connection.execute(_SAVE_LABEL, (row.id, encoding.words_of(row)))
        connection.execute(_SAVE_BODY, (row.id, encoding.body_text(row.body)))


def note(connection: sqlite3.Connection, rows: Iterable[EventRow | AuditRow]) -> None:
    """Write events and audit entries."""
    for row in rows:
        if isinstance(row, EventRow):
            connection.execute(_ADD_EVENT, encoding.event_values(row))
        else:
            connection.execute(_ADD_AUDIT, encoding.audit_values(row))


def probe(connection: sqlite3.Connection) -> None:
    """Write a new row and roll it back, because SQLite does not write unchanged rows."""
    connection.execute("INSERT INTO meta VALUES ('probe', 0)")
    connection.execute("DELETE FROM meta WHERE name = 'probe'")


def begin_run(connection: sqlite3.Connection) -> int:
    """Count one more opening of the file, and return which it is."""
    connection.execute("UPDATE meta SET value = value + 1 WHERE name = 'run'")
    return int(connection.execute("SELECT value FROM meta WHERE name = 'run'").fetchone()[0])


def left(connection: sqlite3.Connection) -> UnendedJobs:
    """Return unfinished jobs; of waiting jobs, only what the queue needs."""
    waiting = f"SELECT id, priority, position, owner, state = 'queued' FROM jobs WHERE {_WAITS} {_IN_ORDER}"
    order = QueueOrder()
    order.fill(
        (QueuePosition.of(priority, position, number), owner, bool(queued))
        for number, priority, position, owner, queued in connection.execute(waiting)
    )
    return UnendedJobs(unfinished(connection, f"state IN ({ALIVE}) AND NOT ({_WAITS})"), order)


def waiting_job(connection: sqlite3.Connection, number: int) -> JobRow | None:
    """Return a job with its body, None where there is none."""
    return _one(connection, "jobs.id = ?", bounded(number))


def waiting_of(connection: sqlite3.Connection, owner: str) -> list[int]:
    """Return the numbers of an owner's waiting jobs."""
    asked = f"SELECT id FROM jobs WHERE owner = ? AND {_WAITS} ORDER BY id"
    return [number for (number,) in connection.execute(asked, (owner,)).fetchall()]


def names_of(connection: sqlite3.Connection, numbers: Sequence[int]) -> list[tuple[int, str, str]]:
    """Return numbers, names and owners of jobs, in the order of their numbers."""
    asked = "SELECT id, name, owner FROM jobs WHERE id IN (SELECT value FROM json_each(?)) ORDER BY id"
    return connection.execute(asked, (json.dumps(numbers),)).fetchall()


def unfinished(connection: sqlite3.Connection, which: str = f"state IN ({ALIVE})") -> Unfinished:
    """Return the queue's mode, and every job that has not ended, in the queue's order; `which` of them, in SQL."""
    mode = connection.execute('SELECT paused, reason, "by", since FROM queue').fetchone()
    jobs = connection.execute(f"{_WITH_BODY} WHERE {which} {_IN_ORDER}").fetchall()
    steps: dict[int, list[StepRow]] = {}
    of_jobs = (
        f'SELECT {STEP} FROM steps WHERE job IN (SELECT id FROM jobs WHERE state IN ({ALIVE})) ORDER BY job, "index"'
    )
    for job, row in map(encoding.step_of, connection.execute(of_jobs).fetchall()):
        steps.setdefault(job, []).append(row)
    last = connection.execute("SELECT max(id) FROM jobs").fetchone()[0]
    return Unfinished(
        QueueRow() if mode is None else encoding.queue_of(mode),
        tuple(encoding.job_of(values[:-1], values[-1] or "{}") for values in jobs),
        {number: tuple(rows) for number, rows in steps.items()},
        (last or 0) + 1,
    )


def bounded(number: int) -> int:
    """Return the number that SQLite can compare with which is nearest to any."""
    return max(-LARGEST - 1, min(number, LARGEST))


def job(connection: sqlite3.Connection, number: int) -> tuple[JobRow, tuple[StepRow, ...]] | None:
    """Return a job with its body and its steps, None where there is none."""
    found = _one(connection, "jobs.id = ?", bounded(number))
    if found is None:
        return None
    steps = connection.execute(f'SELECT {STEP} FROM steps WHERE job = ? ORDER BY "index"', (number,)).fetchall()
    return found, tuple(encoding.step_of(values)[1] for values in steps)


def keyed(connection: sqlite3.Connection, owner: str, key: str) -> JobRow | None:
    """Return the job that an owner submitted with a key, None where there is none."""
    return _one(connection, "owner = ? AND key = ? AND key <> ''", owner, key)


def _one(connection: sqlite3.Connection, where: str, *values: object) -> JobRow | None:
    found = connection.execute(f"{_WITH_BODY} WHERE {where}", values).fetchone()
    return None if found is None else encoding.job_of(found[:-1], found[-1] or "{}")


def events(connection: sqlite3.Connection, run: int, above: int, limit: int) -> list[EventRow]:
    """Return events of a run above a number, oldest first."""
    asked = f"SELECT {EVENT} FROM events WHERE run = ? AND seq > ? ORDER BY seq LIMIT ?"
    return [
        encoding.event_of(values)
        for values in connection.execute(asked, (bounded(run), bounded(above), bounded(limit))).fetchall()
    ]


def audit(connection: sqlite3.Connection, below: int | None, limit: int) -> Sequence[tuple[int, AuditRow]]:
    """Return numbered audit entries below a number, newest first."""
    asked = f"SELECT number, {AUDIT} FROM audit WHERE number < ? ORDER BY number DESC LIMIT ?"
    bounds = (LARGEST if below is None else bounded(below), bounded(limit))
    return [(values[0], AuditRow(*values[1:])) for values in connection.execute(asked, bounds).fetchall()]


def prune(connection: sqlite3.Connection, keep: StorageConfig) -> None:
    """Drop the events and audit entries that are too many or too old; jobs and their steps are kept for ever.

    Old is what lies `keep.days` before the newest of its kind, so that a clock that was wrong once costs nothing.
    """
    for table, most in (("events", keep.events), ("audit", keep.audit)):
        connection.execute(f"DELETE FROM {table} WHERE number <= (SELECT max(number) FROM {table}) - ?", (most,))
        oldest = f"SELECT date(date, ?) FROM {table} ORDER BY number DESC LIMIT 1"
        first_kept = f"SELECT min(number) FROM {table} WHERE date >= ({oldest})"
        connection.execute(f"DELETE FROM {table} WHERE number < ({first_kept})", (f"-{keep.days} days",))
