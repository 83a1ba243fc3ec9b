"""Rows for tests of the journal."""

from __future__ import annotations

import sqlite3
import stat
from contextlib import closing
from pathlib import Path
from typing import Any

from maya_un.process.journal.protocol import AuditRow, EventRow, JobOptions, JobRow, RequestOwner, StepRow
from maya_un.schema.jobs import TaskState

DATE = "2026-03-01T08:00:00Z"


def job_row(number: int, **changes: Any) -> JobRow:
    """Return a job that waits, with every field that `changes` does not name at a plain value."""
    plain: dict[str, Any] = {
        "name": f"job {number}",
        "body": {"name": f"job {number}", "steps": ["home", {"pick": [0.5, 1.1]}]},
        "options": JobOptions(),
        "owner": RequestOwner("ann", "cli"),
        "state": TaskState.QUEUED,
        "position": float(number),
        "submitted": DATE,
        "steps": 2,
    }
    return JobRow(id=number, **{**plain, **changes})


def step_row(index: int, state: TaskState = TaskState.RUNNING, **changes: Any) -> StepRow:
    """Return a step."""
    return StepRow(index, state, **changes)


def event_row(seq: int, run: int = 1, **changes: Any) -> EventRow:
    """Return an event."""
    plain: dict[str, Any] = {"date": DATE, "time": float(seq), "kind": "job", "code": 0, "detail": {"job": seq}}
    return EventRow(run=run, seq=seq, **{**plain, **changes})


def audit_row(number: int, **changes: Any) -> AuditRow:
    """Return an audit entry."""
    plain: dict[str, Any] = {"date": DATE, "who": "ann", "role": "operator", "source": "cli", "code": 0}
    return AuditRow(operation=f"submit {number}", **{**plain, **changes})


def looked_up(path: Path, statement: str) -> list[tuple[Any, ...]]:
    """Return what a connection of one's own finds in a file."""
    with closing(sqlite3.connect(path)) as connection:
        return connection.execute(statement).fetchall()


def content(path: Path) -> bytes:
    """Return all bytes of a file."""
    return path.read_bytes()


def overwrite(path: Path, data: bytes) -> None:
    """Have a file hold these bytes and nothing else."""
    path.write_bytes(data)


def damage(path: Path) -> bytes:
    """Write over the beginning of every page of a database but the first; return what the file is then."""
    data = bytearray(path.read_bytes())
    for page in range(4096, len(data), 4096):
        data[page : page + 200] = b"\xa5" * 200
    path.write_bytes(data)
    return bytes(data)


def size(path: Path) -> int:
    """Return how long a file is [bytes]."""
    return path.stat().st_size


def rights(path: Path) -> int:
    """Return who may do what with a file or a folder."""
    return stat.S_IMODE(path.stat().st_mode)
