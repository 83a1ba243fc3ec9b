"""Jobs, their steps and the queue, as messages. Durations are in s, lengths in m."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from maya_un.schema.states import TaskState
from maya_un.values import Point, State


class OnFailure(StrEnum):
    """Effect of a refused job on the queue; after a fault of the machine the queue always pauses."""

    CONTINUE = "continue"
    PAUSE = "pause"


class QueueMode(StrEnum):
    """Whether jobs begin: `pausing` lets the step under way end first, `paused` begins nothing."""

    RUNNING = "running"
    PAUSING = "pausing"
    PAUSED = "paused"


@dataclass(frozen=True, slots=True)
class JobLine:
    """One line of the queue or of its history.

    `position` is its place among those that wait, from 1, None for others. `done` of `steps` are done, over all
    rounds. `predicted` and `duration` are what it was to take and took [s, the robot's time], homings left out of the
    first; `eta` is when it will have ended, from now [s, the robot's time]: None where nobody knows, or the queue is
    paused. Dates are ISO 8601 in UTC, "" where there is none. A `direct` one begins at
    once, though the queue is paused.
    """

    id: int
    name: str
    state: TaskState
    code: int
    message: str
    owner: str
    source: str
    priority: int
    position: int | None
    notes: str
    depends_on: tuple[int, ...]
    done: int
    steps: int
    predicted: float | None
    duration: float | None
    eta: float | None
    submitted: str
    began: str
    ended: str
    proposal: bool
    approved_by: str
    on_failure: OnFailure
    retries: int
    stepwise: bool
    direct: bool = False


@dataclass(frozen=True, slots=True)
class Choice:
    """A choice for an interrupted job; with `needs_answer` the person also says whether the gripper holds a part."""

    name: str
    meaning: str
    needs_answer: bool


@dataclass(frozen=True, slots=True)
class Recovery:
    """An interrupted job that waits for a person.

    `index` and `step` name the step that was under way and `phase` the last that it was known to begin, 0 and "" where
    it stood between two steps. `since` is when it was found. `holding` is what the machine tells of the gripper now:
    False where it is open, None where only a person can see; `state` is where the machine is.
    """

    job: int
    name: str
    index: int
    step: str
    phase: str
    since: str
    holding: bool | None
    state: State
    choices: tuple[Choice, ...]


@dataclass(frozen=True, slots=True)
class QueueView:
    """The queue now: its mode, with who paused it, why and since when; what is under way, the first that wait.

    `reason` is asked, step, stop, fault, restart, driver, storage or failure, "" while it runs. `counts` has the number
    of jobs that have not ended, by state. `finish_at` is the date when all of them that are predicted will have ended;
    what is held does not count. It is `estimated` where a homing is among them, whose time nobody knows before.
    """

    mode: QueueMode
    reason: str
    by: str
    since: str
    running: JobLine | None
    waiting: tuple[JobLine, ...]
    counts: dict[str, int]
    finish_at: str | None
    recovery: Recovery | None
    estimated: bool = False


@dataclass(frozen=True, slots=True)
class StepResult:
    """One step: what was predicted, what it took, where it ended.

    `index` counts from 1 over all rounds, `key` is its place in the job. `code` is 0, or the error's; durations in s;
    `end_counts` are encoder counts, `end_point` is in m; both None until the step has ended somewhere. `phase` is the
    last that it was known to begin.
    """

    index: int
    key: str
    step: str
    state: TaskState
    code: int
    message: str
    predicted: float | None
    duration: float | None
    end_counts: tuple[int, int, int] | None
    end_point: Point | None
    phase: str = ""


@dataclass(frozen=True, slots=True)
class JobReport:
    """One job: its state, its steps' results, predicted and actual duration [s].

    `predicted` is the sum over the steps that can be predicted (a homing cannot). `lowest` and `highest` bound
    the gripper point over the whole job as checked [m], None where that was in an earlier run, and where the job has
    ended before its first step. `parts` tells where the job has put its named parts [m], None for those that it has not
    put down, or let go where nobody knows. `remarks` say what of its pallets is out of shape; they are used as they
    are. `line` is how it stands in the queue, with its owner, dates and options. `version` is another where its steps
    are changed, or the places that they name.
    """

    id: int
    name: str
    state: TaskState
    code: int
    message: str
    predicted: float | None
    duration: float | None
    lowest: float | None
    highest: float | None
    steps: tuple[StepResult, ...]
    parts: dict[str, Point | None]
    remarks: tuple[str, ...]
    line: JobLine
    version: str = ""


@dataclass(frozen=True, slots=True)
class JobAccepted:
    """A job is in the queue under the number `id`, with so many `steps` over all rounds and cells."""

    id: int
    name: str
    steps: int
