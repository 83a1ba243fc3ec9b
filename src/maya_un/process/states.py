"""The life of jobs and of their steps, as a table."""

from __future__ import annotations

from enum import StrEnum


class TaskState(StrEnum):
    """Where a job or a step is in its life; `skipped` is for steps only."""

    QUEUED = "queued"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"
    SKIPPED = "skipped"

    @property
    def ended(self) -> bool:
        """Whether nothing follows."""
        return not TRANSITIONS[self]


TRANSITIONS: dict[TaskState, frozenset[TaskState]] = {
    TaskState.QUEUED: frozenset({TaskState.RUNNING, TaskState.FAILED, TaskState.CANCELLED, TaskState.SKIPPED}),
    TaskState.RUNNING: frozenset({TaskState.DONE, TaskState.FAILED, TaskState.CANCELLED}),
    TaskState.DONE: frozenset(),
    TaskState.FAILED: frozenset(),
    TaskState.CANCELLED: frozenset(),
    TaskState.SKIPPED: frozenset(),
}
"""What may follow a state. A step fails from the queue when the check of the whole job refuses it."""


def advance(old: TaskState, new: TaskState) -> TaskState:
    """Return `new`; raises `ValueError` where it may not follow `old`, which is a defect of ours."""
    if new not in TRANSITIONS[old]:
        raise ValueError(f"{new} cannot follow {old}")
    return new
