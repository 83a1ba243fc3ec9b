"""The tables of the journal: their schema and migrations, the encoding of rows, and the statements.

A file has its version in `PRAGMA user_version` and the id of its program in `PRAGMA application_id`. A released version
never changes: a later change is a new step at the end of `MIGRATIONS`.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from maya_un.config import StorageConfig
from maya_un.errors import FileNotOurs, StorageTooNew
from maya_un.process.journal.protocol import (
    AuditRow,
    ClearedJobs,
    EventRow,
    JobOptions,
    JobRow,
    QueueRow,
    RequestOwner,
    StepRow,
    UnendedJobs,
    Unfinished,
)
from maya_un.process.queue_order import QueueOrder, QueuePosition
from maya_un.schema.choices import OnFailure
from maya_un.schema.jobs import PauseReason, TaskState

APPLICATION_ID = 0x4D617961
"""The application id in the header of Maya's files: "Maya"."""

_VERSION_1 = """
CREATE TABLE meta (name TEXT PRIMARY KEY, value INTEGER NOT NULL) WITHOUT ROWID;
INSERT INTO meta VALUES ('run', 0);
CREATE TABLE queue (
    one INTEGER PRIMARY KEY CHECK (one = 1),
    paused INTEGER NOT NULL, reason TEXT NOT NULL, "by" TEXT NOT NULL, since TEXT NOT NULL
);
CREATE TABLE jobs (
    id INTEGER PRIMARY KEY,
    name TEXT NOT NULL, owner TEXT NOT NULL, source TEXT NOT NULL,
    priority INTEGER NOT NULL, held INTEGER NOT NULL, depends_on TEXT NOT NULL, notes TEXT NOT NULL,
    on_failure TEXT NOT NULL, retries INTEGER NOT NULL, stepwise INTEGER NOT NULL,
    state TEXT NOT NULL, position REAL NOT NULL, submitted TEXT NOT NULL,
    steps INTEGER NOT NULL, done INTEGER NOT NULL, code INTEGER NOT NULL, message TEXT NOT NULL,
    predicted REAL, duration REAL, began TEXT NOT NULL, ended TEXT NOT NULL,
    key TEXT NOT NULL, digest TEXT NOT NULL, proposal INTEGER NOT NULL, approved_by TEXT NOT NULL
);
CREATE INDEX jobs_by_state ON jobs (state, id);
CREATE INDEX jobs_by_owner ON jobs (owner, state, id);
CREATE UNIQUE INDEX jobs_by_key ON jobs (owner, key) WHERE key <> '';
CREATE TABLE bodies (job INTEGER PRIMARY KEY, body TEXT NOT NULL);
CREATE TABLE labels (job INTEGER PRIMARY KEY, words TEXT NOT NULL);
CREATE TABLE steps (
    job INTEGER NOT NULL, "index" INTEGER NOT NULL, state TEXT NOT NULL, code INTEGER NOT NULL, message TEXT NOT NULL,
    predicted REAL, duration REAL, phase TEXT NOT NULL, "end" TEXT,
    PRIMARY KEY (job, "index")
) WITHOUT ROWID;
CREATE TABLE events (
    number INTEGER PRIMARY KEY,
    run INTEGER NOT NULL, seq INTEGER NOT NULL, date TEXT NOT NULL, time REAL NOT NULL,
    kind TEXT NOT NULL, code INTEGER NOT NULL, detail TEXT NOT NULL
);
CREATE UNIQUE INDEX events_by_seq ON events (run, seq);
CREATE TABLE audit (
    number INTEGER PRIMARY KEY,
    date TEXT NOT NULL, who TEXT NOT NULL, role TEXT NOT NULL, source TEXT NOT NULL,
    operation TEXT NOT NULL, code INTEGER NOT NULL, detail TEXT NOT NULL
);
"""

MIGRATIONS: tuple[str, ...] = (_VERSION_1,)
"""The migrations from each version to the next; the first one initialises an empty file."""

SCHEMA_VERSION = len(MIGRATIONS)
"""The version that this program writes."""


def migrate(connection: sqlite3.Connection, path: Path | str, steps: tuple[str, ...] = MIGRATIONS) -> None:
    """Migrate the file to this version, one transaction per step, so that an interrupted step has no effect.

    `path` is for errors: raises `StorageTooNew`, and `FileNotOurs` for a database of another program.
    """
    found = schema_version(connection, path, len(steps))
    for number, script in enumerate(steps[found:], found + 1):
        connection.executescript(
            f"BEGIN IMMEDIATE;{script};PRAGMA application_id = {APPLICATION_ID};PRAGMA user_version = {number};COMMIT;"
        )


def schema_version(connection: sqlite3.Connection, path: Path | str, known: int = SCHEMA_VERSION) -> int:
    """Return the version of a file, 0 for an empty one; raises as `migrate` does."""
    found = int(connection.execute("PRAGMA user_version").fetchone()[0])
    application = int(connection.execute("PRAGMA application_id").fetchone()[0])
    if (found or _strangers(connection)) and application != APPLICATION_ID:
        raise FileNotOurs(path=path, remedy="another program made it; give another folder in MAYA_STATE_DIR")
    if found > known:
        raise StorageTooNew(path=path, found=found, known=known)
    return found


def _strangers(connection: sqlite3.Connection) -> bool:
    """Return whether tables exist other than those of users, which may be created before the journal's."""
    named = "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name NOT GLOB 'access_*'"
    return bool(connection.execute(named).fetchone()[0])


Values = tuple[Any, ...]
"""Values bound to a statement, or a row of its result."""

JOB = (
    "id, name, owner, source, priority, held, depends_on, notes, on_failure, retries, stepwise, state, position, "
    "submitted, steps, done, code, message, predicted, duration, began, ended, key, digest, proposal, approved_by"
)
"""The columns of a job, in the order of `job_values`; its body is in another table."""

STEP = 'job, "index", state, code, message, predicted, duration, phase, "end"'
"""The columns of a step."""

EVENT = "run, seq, date, time, kind, code, detail"
"""The columns of an event."""

AUDIT = "date, who, role, source, operation, code, detail"
"""The columns of an audit entry."""

_compact = json.JSONEncoder(separators=(",", ":"), ensure_ascii=False).encode
_lenient = json.JSONEncoder(separators=(",", ":"), ensure_ascii=False, default=str).encode


def body_text(body: dict[str, Any]) -> str:
    """Return a body as JSON; raises `TypeError` for a value that JSON cannot hold."""
    return _compact(body)


def job_values(row: JobRow) -> Values:
    """Return the values of the columns `JOB`."""
    options = row.options
    return (
        row.id,
        row.name,
        row.owner.name,
        row.owner.source,
        options.priority,
        options.held,
        _compact(options.depends_on) if options.depends_on else "[]",
        options.notes,
        options.on_failure.value,
        options.retries,
        options.stepwise,
        row.state.value,
        row.position,
        row.submitted,
        row.steps,
        row.done,
        row.code,
        row.message,
        row.predicted,
        row.duration,
        row.began,
        row.ended,
        row.key,
        row.digest,
        row.proposal,
        row.approved_by,
    )


def job_of(values: Values, body: str | None = None) -> JobRow:
    """Return the job of the columns `JOB`, without a body if none is given."""
    (number, name, owner, source, priority, held, depends_on, notes, on_failure, retries, stepwise, state, *rest) = (
        values
    )
    (position, submitted, steps, done, code, message, predicted, duration, began, ended, key, digest, *last) = rest
    proposal, approved_by = last
    options = JobOptions(
        priority,
        bool(held),
        () if depends_on == "[]" else tuple(json.loads(depends_on)),
        notes,
        OnFailure(on_failure),
        retries,
        bool(stepwise),
    )
    return JobRow(
        id=number,
        name=name,
        body={} if body is None else json.loads(body),
        options=options,
        owner=RequestOwner(owner, source),
        state=TaskState(state),
        position=position,
        submitted=submitted,
        steps=steps,
        done=done,
        code=code,
        message=message,
        predicted=predicted,
        duration=duration,
        began=began,
        ended=ended,
        key=key,
        digest=digest,
        proposal=bool(proposal),
        approved_by=approved_by,
    )


def words_of(row: JobRow) -> str:
    """Return the searchable text of a job in lower case: its name and its notes."""
    return f"{row.name}\n{row.options.notes}".casefold()


def step_values(job: int, row: StepRow) -> Values:
    """Return the values of the columns `STEP`."""
    end = None if row.end is None else _lenient(row.end)
    return (job, row.index, row.state.value, row.code, row.message, row.predicted, row.duration, row.phase, end)


def step_of(values: Values) -> tuple[int, StepRow]:
    """Return the job's number and the step of the columns `STEP`."""
    job, index, state, code, message, predicted, duration, phase, end = values
    reached = None if end is None else json.loads(end)
    return job, StepRow(index, TaskState(state), code, message, predicted, duration, phase, reached)


def queue_of(values: Values) -> QueueRow:
    """Return the queue's mode of its columns."""
    paused, reason, by, since = values
    return QueueRow(bool(paused), PauseReason(reason) if reason else "", by, since)


def event_values(row: EventRow) -> Values:
    """Return the values of the columns `EVENT`; values that JSON cannot hold are stored as text."""
    return (row.run, row.seq, row.date, row.time, row.kind, row.code, _lenient(row.detail))


def event_of(values: Values) -> EventRow:
    """Return the event of the columns `EVENT`."""
    run, seq, date, time, kind, code, detail = values
    return EventRow(run, seq, date, time, kind, code, json.loads(detail))


def audit_values(row: AuditRow) -> Values:
    """Return the values of the columns `AUDIT`."""
    return (row.date, row.who, row.role, row.source, row.operation, row.code, row.detail)


def marks(columns: str) -> str:
    """Return as many question marks as there are columns."""
    return ", ".join("?" * (columns.count(",") + 1))


def updates(columns: str, *keys: str) -> str:
    """Return the end of an upsert: every column but the keys gets its newer value."""
    names = [name for name in columns.split(", ") if name not in keys]
    return f"ON CONFLICT ({', '.join(keys)}) DO UPDATE SET " + ", ".join(f"{name} = excluded.{name}" for name in names)


Change = JobRow | QueueRow | ClearedJobs | tuple[int, StepRow]
"""A newer version of a job, of the queue's mode, of a step (the job's number, the step), the end of many jobs."""

LARGEST = 2**63 - 1
"""The largest whole number of SQLite; no number of this program comes near."""

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
    """The bodies known to be in the file: a job is written often, its body rarely changes and may be long.

    Bodies are compared by identity, so a body must never be changed in place. Call `forget` after any write that may
    have failed.
    """

    def __init__(self) -> None:
        self._known: dict[int, tuple[dict[str, Any], str, str]] = {}

    def lacks(self, row: JobRow) -> bool:
        """Return whether the body, the name or the notes of a job must be written.

        From now on they count as written.
        """
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
    """Write new jobs; raises `sqlite3.IntegrityError` for a number, or an owner's key, that exists."""
    for row in jobs:
        connection.execute(_ADD_JOB, job_values(row))
        _write_body(connection, bodies, row)


def save(connection: sqlite3.Connection, bodies: Bodies, changes: Iterable[Change]) -> None:
    """Write newer versions."""
    for change in changes:
        if isinstance(change, JobRow):
            connection.execute(_SAVE_JOB, job_values(change))
            _write_body(connection, bodies, change)
        elif isinstance(change, QueueRow):
            connection.execute(_SAVE_QUEUE, (change.paused, str(change.reason), change.by, change.since))
        elif isinstance(change, ClearedJobs):
            values = (change.state.value, change.code, change.message, change.ended, json.dumps(change.numbers))
            connection.execute(_CLEAR, values)
        else:
            connection.execute(_SAVE_STEP, step_values(*change))


def _write_body(connection: sqlite3.Connection, bodies: Bodies, row: JobRow) -> None:
    if bodies.lacks(row):
        connection.execute(_SAVE_LABEL, (row.id, words_of(row)))
        connection.execute(_SAVE_BODY, (row.id, body_text(row.body)))


def note(connection: sqlite3.Connection, rows: Iterable[EventRow | AuditRow]) -> None:
    """Write events and audit entries."""
    for row in rows:
        if isinstance(row, EventRow):
            connection.execute(_ADD_EVENT, event_values(row))
        else:
            connection.execute(_ADD_AUDIT, audit_values(row))


def probe(connection: sqlite3.Connection) -> None:
    """Write a new row and roll it back, because SQLite does not write unchanged rows."""
    connection.execute("INSERT INTO meta VALUES ('probe', 0)")
    connection.execute("DELETE FROM meta WHERE name = 'probe'")


def begin_run(connection: sqlite3.Connection) -> int:
    """Count one more opening of the file, and return its number."""
    connection.execute("UPDATE meta SET value = value + 1 WHERE name = 'run'")
    return int(connection.execute("SELECT value FROM meta WHERE name = 'run'").fetchone()[0])


def unended_jobs(connection: sqlite3.Connection) -> UnendedJobs:
    """Return unfinished jobs; of waiting jobs, only what the queue needs."""
    waiting = f"SELECT id, priority, position, owner, state = 'queued' FROM jobs WHERE {_WAITS} {_IN_ORDER}"
    order = QueueOrder()
    order.fill(
        (QueuePosition.of(priority, position, number), owner, bool(queued))
        for number, priority, position, owner, queued in connection.execute(waiting)
    )
    return UnendedJobs(unfinished(connection, f"state IN ({ALIVE}) AND NOT ({_WAITS})"), order)


def waiting_job(connection: sqlite3.Connection, number: int) -> JobRow | None:
    """Return a job with its body, None if it does not exist."""
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
    """Return the queue's mode, and the jobs that match `which` (SQL; all unended by default), in the queue's order."""
    mode = connection.execute('SELECT paused, reason, "by", since FROM queue').fetchone()
    jobs = connection.execute(f"{_WITH_BODY} WHERE {which} {_IN_ORDER}").fetchall()
    steps: dict[int, list[StepRow]] = {}
    of_jobs = (
        f'SELECT {STEP} FROM steps WHERE job IN (SELECT id FROM jobs WHERE state IN ({ALIVE})) ORDER BY job, "index"'
    )
    for job, row in map(step_of, connection.execute(of_jobs).fetchall()):
        steps.setdefault(job, []).append(row)
    last = connection.execute("SELECT max(id) FROM jobs").fetchone()[0]
    return Unfinished(
        QueueRow() if mode is None else queue_of(mode),
        tuple(job_of(values[:-1], values[-1] or "{}") for values in jobs),
        {number: tuple(rows) for number, rows in steps.items()},
        (last or 0) + 1,
    )


def bounded(number: int) -> int:
    """Return the number nearest to `number` that SQLite can hold."""
    return max(-LARGEST - 1, min(number, LARGEST))


def job(connection: sqlite3.Connection, number: int) -> tuple[JobRow, tuple[StepRow, ...]] | None:
    """Return a job with its body and its steps, None if it does not exist."""
    found = _one(connection, "jobs.id = ?", bounded(number))
    if found is None:
        return None
    steps = connection.execute(f'SELECT {STEP} FROM steps WHERE job = ? ORDER BY "index"', (number,)).fetchall()
    return found, tuple(step_of(values)[1] for values in steps)


def keyed(connection: sqlite3.Connection, owner: str, key: str) -> JobRow | None:
    """Return the job that an owner submitted with a key, None without one."""
    return _one(connection, "owner = ? AND key = ? AND key <> ''", owner, key)


def _one(connection: sqlite3.Connection, where: str, *values: object) -> JobRow | None:
    found = connection.execute(f"{_WITH_BODY} WHERE {where}", values).fetchone()
    return None if found is None else job_of(found[:-1], found[-1] or "{}")


def events(connection: sqlite3.Connection, run: int, above: int, limit: int) -> list[EventRow]:
    """Return events of a run above a number, oldest first."""
    asked = f"SELECT {EVENT} FROM events WHERE run = ? AND seq > ? ORDER BY seq LIMIT ?"
    return [
        event_of(values)
        for values in connection.execute(asked, (bounded(run), bounded(above), bounded(limit))).fetchall()
    ]


def audit(connection: sqlite3.Connection, below: int | None, limit: int) -> Sequence[tuple[int, AuditRow]]:
    """Return numbered audit entries below a number, newest first."""
    asked = f"SELECT number, {AUDIT} FROM audit WHERE number < ? ORDER BY number DESC LIMIT ?"
    bounds = (LARGEST if below is None else bounded(below), bounded(limit))
    return [(values[0], AuditRow(*values[1:])) for values in connection.execute(asked, bounds).fetchall()]


def prune(connection: sqlite3.Connection, keep: StorageConfig) -> None:
    """Drop events and audit entries that are too many or too old; jobs and their steps are never dropped.

    An entry is old if it is dated more than `keep.days` before the newest of its kind, so that a clock that was wrong
    once loses nothing.
    """
    for table, most in (("events", keep.events), ("audit", keep.audit)):
        connection.execute(f"DELETE FROM {table} WHERE number <= (SELECT max(number) FROM {table}) - ?", (most,))
        oldest = f"SELECT date(date, ?) FROM {table} ORDER BY number DESC LIMIT 1"
        first_kept = f"SELECT min(number) FROM {table} WHERE date >= ({oldest})"
        connection.execute(f"DELETE FROM {table} WHERE number < ({first_kept})", (f"-{keep.days} days",))
