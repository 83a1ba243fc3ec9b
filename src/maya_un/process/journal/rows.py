"""The journal's rows of jobs, steps and the queue: plain values, as in its tables."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

from maya_un.process.order import QueueOrder
from maya_un.schema.jobs import OnFailure
from maya_un.schema.states import TaskState


@dataclass(frozen=True, slots=True)
class JobOptions:
    """How a job is to be queued.

    The greater `priority` (-100 to 100) goes first, equal ones in the order they came. With `held` it waits for
    somebody to release it. It begins after all jobs of `depends_on` are done. `retries` is how often a step that failed
    is tried again where that is harmless. `stepwise` pauses the queue after every step.
    """

    priority: int = 0
    held: bool = False
    depends_on: tuple[int, ...] = ()
    notes: str = ""
    on_failure: OnFailure = OnFailure.CONTINUE
    retries: int = 0
    stepwise: bool = False


@dataclass(frozen=True, slots=True)
class RequestOwner:
    """The origin of a request: a principal's `name`, and the source ("cli", an address, "ros")."""

    name: str = "local"
    source: str = ""


@dataclass(frozen=True, slots=True)
class StepRow:
    """One step of a job as it is kept; `index` counts from 1 over all rounds, durations in s.

    `phase` is the last phase that it was known to begin ("down", "close", …), "" where none.
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
    """One job as it is kept.

    `body` is the job as written, plain data that `Job.parse` reads, or {"wish": …} for one primitive. `position` orders
    the queue within a priority. Dates are ISO 8601 in UTC, durations in s. `key` is the idempotency key that it came
    with, "" where none; `digest` tells whether the same request comes again.
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
    """Whether the queue is paused, by whom, why: asked, step, stop, fault, restart, driver, storage or failure."""

    paused: bool = False
    reason: str = ""
    by: str = ""
    since: str = ""


@dataclass(frozen=True, slots=True)
class Unfinished:
    """The content of the file when it was opened: the queue's mode, and every unfinished job in the queue's order.

    `steps` has the rows of those jobs that had begun, by number.
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
    """An event as it is kept: `run` counts the starts of this program, `seq` the events of one run, `date` in UTC."""

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
    role: str
    source: str
    operation: str
    code: int
    detail: str = ""
