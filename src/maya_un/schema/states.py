"""The life of jobs and of their steps, as a table; docs/explanation/the-queue.md draws it."""

from __future__ import annotations

from enum import StrEnum


class TaskState(StrEnum):
    """The state of a job or a step.

    `held` waits for a person: it was put aside, is a proposal, or depends on what failed. `paused` was begun and goes
    on when somebody says so. `interrupted` was under way when this program ended; a person says what becomes of it.
    `skipped` is for steps only.
    """

    QUEUED = "queued"
    HELD = "held"
    RUNNING = "running"
    PAUSED = "paused"
    INTERRUPTED = "interrupted"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"
    SKIPPED = "skipped"

    @property
    def ended(self) -> bool:
        """Whether nothing follows."""
        return not TRANSITIONS[self]


TRANSITIONS: dict[TaskState, frozenset[TaskState]] = {
    TaskState.QUEUED: frozenset(
        {TaskState.HELD, TaskState.RUNNING, TaskState.FAILED, TaskState.CANCELLED, TaskState.SKIPPED}
    ),
    TaskState.HELD: frozenset({TaskState.QUEUED, TaskState.CANCELLED}),
    TaskState.RUNNING: frozenset(
        {TaskState.PAUSED, TaskState.INTERRUPTED, TaskState.DONE, TaskState.FAILED, TaskState.CANCELLED}
    ),
    TaskState.PAUSED: frozenset({TaskState.RUNNING, TaskState.INTERRUPTED, TaskState.FAILED, TaskState.CANCELLED}),
    TaskState.INTERRUPTED: frozenset(
        {TaskState.QUEUED, TaskState.RUNNING, TaskState.DONE, TaskState.SKIPPED, TaskState.FAILED, TaskState.CANCELLED}
    ),
    TaskState.DONE: frozenset(),
    TaskState.FAILED: frozenset(),
    TaskState.CANCELLED: frozenset(),
    TaskState.SKIPPED: frozenset(),
}
"""States that may follow a state, for jobs and steps.

A queued step fails when the check of the whole job refuses it. An interrupted step is queued again to be redone, or
done if a person says that it was.
"""


def advance(old: TaskState, new: TaskState) -> TaskState:
    """Return `new`; raises `ValueError` where it may not follow `old`, which is a defect of ours."""
    if new not in TRANSITIONS[old]:
        raise ValueError(f"{new} cannot follow {old}")
    return new
