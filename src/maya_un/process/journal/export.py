"""The history as text that other programs read: one job a line."""

from __future__ import annotations

import csv
import json
import sqlite3
from collections.abc import Iterator
from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import Any, TextIO

from maya_un.process.journal import copying, encoding
from maya_un.process.journal.encoding import JOB, STEP
from maya_un.process.journal.rows import JobRow, StepRow

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


def write(path: Path, out: TextIO, form: ExportFormat = ExportFormat.CSV) -> int:
    """Write all jobs of the file at `path` to `out`, oldest first, and return how many; the file may be in use.

    Raises `FileUnreadable`, `FileNotOurs`, `StorageDamaged`, `StorageTooNew`, and what `out` raises.
    """
    with copying.reading(path) as connection:
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
            yield encoding.job_of(values[:-1], values[-1])


def _steps(connection: sqlite3.Connection, job: int) -> list[StepRow]:
    rows = connection.execute(f'SELECT {STEP} FROM steps WHERE job = ? ORDER BY "index"', (job,)).fetchall()
    return [encoding.step_of(values)[1] for values in rows]
