"""The interface of the queue's storage: the journal's methods, and the rows that they take and return."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, NamedTuple, Protocol

from pydantic import AfterValidator, Field

from dmc41x3.i18n import phrase
from maya_un.process.queue_order import QueueOrder
from maya_un.schema.choices import MOST_PRIORITY, MOST_RETRIES, OnFailure, RoleName
from maya_un.schema.encoding import MOST
from maya_un.schema.jobs import LONGEST_NOTES, MOST_DEPENDENCIES, PauseReason, TaskState


def _printable(text: str) -> str:
    if not all(letter.isprintable() or letter in "\n\t" for letter in text):
        raise ValueError(phrase("it must be printable"))
    return text


def _distinct(numbers: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(dict.fromkeys(numbers))


Priority = Annotated[int, Field(ge=-MOST_PRIORITY, le=MOST_PRIORITY)]
"""The priority of a job."""

Dependencies = Annotated[
    tuple[Annotated[int, Field(ge=1, le=MOST)], ...],
    Field(max_length=MOST_DEPENDENCIES, strict=False),
    AfterValidator(_distinct),
]
"""Numbers of the jobs that must be done first; a list becomes a tuple."""

Notes = Annotated[str, Field(max_length=LONGEST_NOTES), AfterValidator(_printable)]
"""Notes on a job."""

FailureAction = Annotated[OnFailure, Field(strict=False)]
"""The action of the queue if a job fails, also as its word."""

Retries = Annotated[int, Field(ge=0, le=MOST_RETRIES)]
"""The number of repetitions of a failed step."""


@dataclass(frozen=True, slots=True)
class JobOptions:
    """The options of a job in the queue.

    The greater `priority` comes first, equal ones in order of submission. A `held` job waits for a user
    to release it. A job begins after all jobs of `depends_on` are done. `retries` is how often a failed step is
    repeated if that is harmless. `stepwise` pauses the queue after every step.
    """

    priority: Priority = 0
    held: bool = False
    depends_on: Dependencies = ()
    notes: Notes = ""
    on_failure: FailureAction = OnFailure.CONTINUE
    retries: Retries = 0
    stepwise: bool = False


@dataclass(frozen=True, slots=True)
class RequestOwner:
    """The origin of a request: a principal's `name`, and the source ("cli", an address, "ros")."""

    name: str = "local"
    source: str = ""


@dataclass(frozen=True, slots=True)
class StepRow:
    """One stored step of a job; `index` counts from 1 over all rounds, durations in s.

    `phase` is the last phase that is known to have begun ("down", "close", …), "" without one.
    """

    index: int
    state: TaskState
    code: int = 0
    message: str = ""
    predicted: float | None = None
    duration: float | None = None
    phase: str = ""
    end: dict[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class JobRow:
    """One stored job.

    `body` is the job as written, plain data that `Job.parse` reads, or {"wish": …} for one primitive. `position` orders
    the queue within a priority. Dates are ISO 8601 in UTC, durations in s. `key` is its idempotency key, "" without
    one; `digest` identifies a repeated request.
    """

    id: int
    name: str
    body: dict[str, Any]
    options: JobOptions
    owner: RequestOwner
    state: TaskState
    position: float
    submitted: str
    steps: int
    done: int = 0
    code: int = 0
    message: str = ""
    predicted: float | None = None
    duration: float | None = None
    began: str = ""
    ended: str = ""
    key: str = ""
    digest: str = ""
    proposal: bool = False
    approved_by: str = ""


@dataclass(frozen=True, slots=True)
class QueueRow:
    """Whether the queue is paused, why, by whom, and since which date."""

    paused: bool = False
    reason: PauseReason | Literal[""] = ""
    by: str = ""
    since: str = ""

    @property
    def automatic(self) -> bool:
        """Whether the queue is paused without a user's request."""
        return self.paused and self.reason != "" and self.reason.automatic


@dataclass(frozen=True, slots=True)
class Unfinished:
    """The content of the file when it was opened: the queue's mode, and every unfinished job in the queue's order.

    `steps` has the rows of started jobs, by number.
    """

    queue: QueueRow
    jobs: tuple[JobRow, ...]
    steps: dict[int, tuple[StepRow, ...]] = field(default_factory=dict)
    next_id: int = 1


class UnendedJobs(NamedTuple):
    """The unfinished jobs of a file when it was opened: those of `Unfinished`, and the places of waiting jobs.

    Waiting jobs that are not held are ready. The rest of a waiting job stays in the file.
    """

    unfinished: Unfinished
    waiting: QueueOrder


class ClearedJobs(NamedTuple):
    """The end of many waiting jobs, all for one reason."""

    numbers: tuple[int, ...]
    state: TaskState
    code: int
    message: str
    ended: str


@dataclass(frozen=True, slots=True)
class EventRow:
    """A stored event: `run` counts the starts of this program, `seq` the events of one run, `date` in UTC."""

    run: int
    seq: int
    date: str
    time: float
    kind: str
    code: int
    detail: dict[str, Any]


@dataclass(frozen=True, slots=True)
class AuditRow:
    """A request: caller, operation, source and result: `code` is 0, or the error's."""

    date: str
    who: str
    role: RoleName | Literal[""]
    source: str
    operation: str
    code: int
    detail: str = ""


@dataclass(frozen=True, slots=True)
class Filter:
    """Filter of listed jobs: by states, owner, words in the name or notes; newest first unless `oldest_first`.

    `below` and `above` bound the number, for paging.
    """

    states: tuple[TaskState, ...] = ()
    owner: str | None = None
    text: str = ""
    below: int | None = None
    above: int | None = None
    oldest_first: bool = False
    limit: int = 100


class Journal(Protocol):
    """Stores jobs, steps, the queue's mode, events and the audit log.

    When a coroutine returns, its data is on the disk (a power cut does not remove it). Writes that are awaited at the
    same time share one commit. They happen in the order of their calls. Every write raises `StorageFailed`, and then
    nothing of it was stored.
    """

    async def unfinished(self) -> Unfinished:
        """Return the jobs that were unfinished when the file was opened."""
        ...

    async def left(self) -> UnendedJobs:
        """Return the jobs that were unfinished when the file was opened; of waiting jobs, only their places."""
        ...

    def waiting_job(self, number: int) -> JobRow | None:
        """Return a waiting job without suspending; None without one."""
        ...

    def waiting_of(self, owner: str) -> list[int]:
        """Return the numbers of an owner's waiting jobs without suspending."""
        ...

    async def names_of(self, numbers: Sequence[int]) -> list[tuple[int, str, str]]:
        """Return numbers, names and owners of jobs, in the order of their numbers."""
        ...

    async def probe(self) -> None:
        """Write a row and roll it back, to check whether the file can be written."""
        ...

    async def add(self, *jobs: JobRow) -> None:
        """Store new jobs, all of them or none."""
        ...

    async def save(self, *changes: JobRow | QueueRow | ClearedJobs | tuple[int, StepRow]) -> None:
        """Store newer versions of jobs, the queue, steps (the job's number, the step), ends of many; all or none."""
        ...

    async def job(self, number: int) -> tuple[JobRow, tuple[StepRow, ...]] | None:
        """Return a job and its stored steps, None if the job does not exist."""
        ...

    async def keyed(self, owner: str, key: str) -> JobRow | None:
        """Return the job that `owner` submitted with this idempotency key, None without one."""
        ...

    async def page(self, which: Filter) -> list[JobRow]:
        """Return a page of jobs; the body of each is left out ({})."""
        ...

    def note(self, *rows: EventRow | AuditRow) -> None:
        """Store events and audit entries soon, in order.

        Does not wait, but they are on the disk before any later `save`.
        """
        ...

    async def events(self, run: int, above: int, limit: int) -> list[EventRow]:
        """Return stored events of a run, numbered above `above`, oldest first."""
        ...

    async def audit(self, below: int | None, limit: int) -> Sequence[tuple[int, AuditRow]]:
        """Return audit entries with their numbers, newest first, numbered below `below`."""
        ...

    @property
    def run(self) -> int:
        """Number of times that the file was opened, this time included."""
        ...

    @property
    def failing(self) -> str:
        """Why the last write failed, "" if it did not."""
        ...

    async def close(self) -> None:
        """Write what is noted, and close the file."""
        ...
