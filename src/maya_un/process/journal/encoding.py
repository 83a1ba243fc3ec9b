"""Rows as they stand in the tables, and back."""

from __future__ import annotations

import json
from typing import Any

from maya_un.process.journal.rows import AuditRow, EventRow, JobOptions, JobRow, QueueRow, RequestOwner, StepRow
from maya_un.schema.jobs import OnFailure
from maya_un.schema.states import TaskState

Values = tuple[Any, ...]
"""A value that is bound to a statement, or that one returns."""

JOB = (
    "id, name, owner, source, priority, held, depends_on, notes, on_failure, retries, stepwise, state, position, "
    "submitted, steps, done, code, message, predicted, duration, began, ended, key, digest, proposal, approved_by"
)
"""The columns of a job, in the order of `job_values`; its body is kept apart."""

STEP = 'job, "index", state, code, message, predicted, duration, phase, "end"'
"""The columns of a step."""

EVENT = "run, seq, date, time, kind, code, detail"
"""The columns of an event."""

AUDIT = "date, who, role, source, operation, code, detail"
"""The columns of an audit entry."""

_compact = json.JSONEncoder(separators=(",", ":"), ensure_ascii=False).encode
_lenient = json.JSONEncoder(separators=(",", ":"), ensure_ascii=False, default=str).encode


def body_text(body: dict[str, Any]) -> str:
    """Return a body as JSON; raises `TypeError` for what JSON does not know."""
    return _compact(body)


def job_values(row: JobRow) -> Values:
    """Return what stands in the columns `JOB`."""
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
    """Return the job of the columns `JOB`, without a body where none is given."""
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
    """Return what a job is found by, in lower case: its name and its notes."""
    return f"{row.name}\n{row.options.notes}".casefold()


def step_values(job: int, row: StepRow) -> Values:
    """Return what stands in the columns `STEP`."""
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
    return QueueRow(bool(paused), reason, by, since)


def event_values(row: EventRow) -> Values:
    """Return what stands in the columns `EVENT`; what JSON does not know of its detail is kept in words."""
    return (row.run, row.seq, row.date, row.time, row.kind, row.code, _lenient(row.detail))


def event_of(values: Values) -> EventRow:
    """Return the event of the columns `EVENT`."""
    run, seq, date, time, kind, code, detail = values
    return EventRow(run, seq, date, time, kind, code, json.loads(detail))


def audit_values(row: AuditRow) -> Values:
    """Return what stands in the columns `AUDIT`."""
    return (row.date, row.who, row.role, row.source, row.operation, row.code, row.detail)


def marks(columns: str) -> str:
    """Return as many question marks as there are columns."""
    return ", ".join("?" * (columns.count(",") + 1))


def updates(columns: str, *keys: str) -> str:
    """Return the end of an upsert: every column but the keys gets its newer value."""
    names = [name for name in columns.split(", ") if name not in keys]
    return f"ON CONFLICT ({', '.join(keys)}) DO UPDATE SET " + ", ".join(f"{name} = excluded.{name}" for name in names)
