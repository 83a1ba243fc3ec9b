"""The interface of the queue's storage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

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
from maya_un.schema.states import TaskState


@dataclass(frozen=True, slots=True)
class Filter:
    """Which jobs of the file to list: by states, owner, words in the name or notes; newest first unless `oldest_first`.

    `below` and `above` bound the number, to go from page to page.
    """

    states: tuple[TaskState, ...] = ()
    owner: str | None = None
    text: str = ""
    below: int | None = None
    above: int | None = None
    oldest_first: bool = False
    limit: int = 100


class Journal(Protocol):
    """Keeps jobs, steps, the queue's mode, events and the audit log.

    When a coroutine returns, its data is on the disk (a power cut does not remove it). Writes that are awaited at the
    same time share one commit. They happen in the order they were asked for. Every write raises `StorageFailed`, and
    then nothing of it was kept.
    """

    async def unfinished(self) -> Unfinished:
        """Return what was not finished when the file was opened."""
        ...

    async def left(self) -> UnendedJobs:
        """Return the jobs that were unfinished when the file was opened; of waiting jobs, only their places."""
        ...

    def waiting_job(self, number: int) -> JobRow | None:
        """Return a waiting job, at once; None if there is none."""
        ...

    def waiting_of(self, owner: str) -> list[int]:
        """Return the numbers of an owner's waiting jobs, at once."""
        ...

    async def names_of(self, numbers: Sequence[int]) -> list[tuple[int, str, str]]:
        """Return numbers, names and owners of jobs, in the order of their numbers."""
        ...

    async def probe(self) -> None:
        """Write a row and roll it back, to check whether the file can be written."""
        ...

    async def add(self, *jobs: JobRow) -> None:
        """Keep new jobs, all of them or none."""
        ...

    async def save(self, *changes: JobRow | QueueRow | ClearedJobs | tuple[int, StepRow]) -> None:
        """Keep newer versions of jobs, the queue, steps (the job's number, the step), ends of many; all or none."""
        ...

    async def job(self, number: int) -> tuple[JobRow, tuple[StepRow, ...]] | None:
        """Return a job and its steps as far as they were begun, None where there is no such job."""
        ...

    async def keyed(self, owner: str, key: str) -> JobRow | None:
        """Return the job that `owner` submitted with this idempotency key, None where there is none."""
        ...

    async def page(self, which: Filter) -> list[JobRow]:
        """Return a page of jobs; the body of each is left out ({})."""
        ...

    def note(self, *rows: EventRow | AuditRow) -> None:
        """Keep events and audit entries soon: in order, not waited for, before any later `save` is on the disk."""
        ...

    async def events(self, run: int, above: int, limit: int) -> list[EventRow]:
        """Return kept events of a run, numbered above `above`, oldest first."""
        ...

    async def audit(self, below: int | None, limit: int) -> Sequence[tuple[int, AuditRow]]:
        """Return audit entries with their numbers, newest first, numbered below `below`."""
        ...

    @property
    def run(self) -> int:
        """How often the file was opened, this time included."""
        ...

    @property
    def failing(self) -> str:
        """Why the last write failed, "" where it did not."""
        ...

    async def close(self) -> None:
        """Write what is noted, and close the file."""
        ...
