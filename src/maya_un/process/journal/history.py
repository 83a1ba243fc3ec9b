"""The history of jobs: pages of the list, exports as CSV or JSON lines, and the newest events."""

from __future__ import annotations

import csv
import json
import sqlite3
from collections.abc import Iterator
from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import Any, TextIO

from maya_un.process.journal import backup, tables
from maya_un.process.journal.protocol import EventRow, Filter, JobRow, StepRow
from maya_un.process.journal.tables import EVENT, JOB, LARGEST, STEP, bounded
from maya_un.schema.jobs import TaskState

LONGEST_PAGE = 1000
"""The longest page."""


def page(connection: sqlite3.Connection, which: Filter) -> list[JobRow]:
    """Return a page of jobs without their bodies."""
    statement, values = _by_text(which) if which.text.split() else _by_index(which)
    return [tables.job_of(row) for row in connection.execute(statement, values).fetchall()]


def _by_index(which: Filter) -> tuple[str, list[object]]:
    """Look at each state by itself: the newest of each are the newest of all, and every part has an index in order."""
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
    """Read the narrow table of words in order, until the page is full; the longest word rules most out."""
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
    """How a history is written: `csv` without bodies and steps, `jsonl` with all that is kept."""

    CSV = "csv"
    JSONL = "jsonl"


def export(path: Path, out: TextIO, form: ExportFormat = ExportFormat.CSV) -> int:
    """Write all jobs of the file at `path` to `out`, oldest first, and return how many; the file may be in use.

    Raises `FileUnreadable`, `FileNotOurs`, `StorageDamaged`, `StorageTooNew`, and what `out` raises.
    """
    with backup.reading(path) as connection:
        return _csv(connection, out) if form is ExportFormat.CSV else _jsonl(connection, out)


def _csv(connection: sqlite3.Connection, out: TextIO) -> int:
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    written = 0
    for row in _jobs(connection):
        plain = _plain(row)
        depends_on = " ".join(str(number) for number in row.options.depends_on)
        writer.writerow([{**plain, "depends_on": depends_on}[name] for name in COLUMNS])
        written += 1
    return written


def _jsonl(connection: sqlite3.Connection, out: TextIO) -> int:
    written = 0
    for row in _jobs(connection):
        line = {**_plain(row), "body": row.body, "step_results": [asdict(step) for step in _steps(connection, row.id)]}
        out.write(json.dumps(line, ensure_ascii=False) + "\n")
        written += 1
    return written


def _plain(row: JobRow) -> dict[str, Any]:
    """Return a job without its body and its key, which is its owner's own business, flat."""
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
    """Return the newest events, at most so many, oldest first, each with its number in the file.

    Only those numbered above `above`, and not dated before `since` (ISO 8601, UTC). Raises `FileUnreadable`,
    `FileNotOurs`, `StorageDamaged`, `StorageTooNew`.
    """
    asked = f"SELECT number, {EVENT} FROM events WHERE number > ? AND date >= ? ORDER BY number DESC LIMIT ?"
    with backup.reading(path) as connection:
        found = connection.execute(asked, (above, since, most)).fetchall()
    return [(int(number), tables.event_of(tuple(values))) for number, *values in reversed(found)]
