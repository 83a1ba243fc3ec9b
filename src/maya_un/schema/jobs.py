"""Jobs, their steps, the queue, and the taught places that jobs name, as messages.

Units are s, m and rad. The table of states is drawn in docs/explanation/the-queue.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from maya_un.values import Joints, Point, State


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


@dataclass(frozen=True, slots=True)
class TaughtPose:
    """Position of the gripper on the day `taught` (as the one who taught it wrote it; ISO 8601 by ours).

    `joints` (rad, m, m) are what was taught. `point` [m] is what they come to with the constants in force: where
    those have been corrected since, the same lengths of line still lead to the same place of the real table, and the
    point as it was computed then does not. None where lines of these lengths cannot meet.
    """

    name: str
    joints: Joints
    point: Point | None
    taught: str


@dataclass(frozen=True, slots=True)
class PalletInfo:
    """A taught pallet: cells (1, 1), (1, columns), (rows, 1) and (rows, columns) [m], None where they span none now.

    `flatness` is how far its corners lie from a plane [m], `squareness` how far its angles are from right ones
    [rad]; `remarks` say in words what of that, or of its corners, is not as it should be.
    """

    name: str
    rows: int
    columns: int
    corners: tuple[Point, ...] | None
    flatness: float | None
    squareness: float | None
    remarks: tuple[str, ...]
    taught: str
