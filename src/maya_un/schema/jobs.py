"""Jobs, their steps, the queue, and the taught places that jobs name, as messages.

Units are s, m and rad. The table of states is drawn in docs/explanation/the-queue.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

from maya_un.schema.choices import OnFailure
from maya_un.values import Joints, Notice, Point, State

MOST_DEPENDENCIES = 100
"""The greatest number of jobs that another one waits for."""

LONGEST_NOTES = 1000
"""The greatest number of letters in the notes of a job. An older journal may hold longer ones."""


class TaskState(StrEnum):
    """The state of a job or a step.

    `held` waits for a person: it was held, is a proposal, or depends on a failed job. `paused` has started and
    continues after `resume`. `interrupted` was running when this program ended; a person decides about it. `skipped` is
    for steps only.
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
        """Whether this state is final."""
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

A queued step fails if the check of the whole job refuses it. An interrupted step is queued again to be redone, or is
done if a person confirms it.
"""


def advance(old: TaskState, new: TaskState) -> TaskState:
    """Return `new`; raises `ValueError`, an internal defect, if it may not follow `old`."""
    if new not in TRANSITIONS[old]:
        raise ValueError(f"{new} cannot follow {old}")
    return new


class QueueMode(StrEnum):
    """Whether jobs start: `pausing` finishes the running step first, `paused` starts nothing."""

    RUNNING = "running"
    PAUSING = "pausing"
    PAUSED = "paused"


class PauseReason(StrEnum):
    """Why the queue is paused."""

    ASKED = "asked"
    STEP = "step"
    STOP = "stop"
    FAULT = "fault"
    RESTART = "restart"
    DRIVER = "driver"
    STORAGE = "storage"
    FAILURE = "failure"

    @property
    def automatic(self) -> bool:
        """Whether no user requested the pause: it protects waiting jobs, and ends when none waits any more."""
        return self not in {PauseReason.ASKED, PauseReason.STEP}


@dataclass(frozen=True, slots=True)
class JobLine:
    """One line of the queue or of its history.

    `position` is the place among the waiting jobs, from 1, None for others. `done` of `steps` are done, over all
    rounds. `predicted` and `duration` are the predicted and actual duration [s, the robot's time], the first at full
    speed and without homings. `eta` is the time until the end at the present speed [s, the robot's time], None if it is
    unknown or the queue is paused. Dates are ISO 8601 in UTC, "" for none. A `direct` job starts at once, even if the
    queue is paused. `obstacle` is the error with which a waiting job would fail as things are: after the jobs before
    it, or in the present state of the robot.
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
    obstacle: Notice | None = None


@dataclass(frozen=True, slots=True)
class Choice:
    """A choice for an interrupted job; `needs_answer` means that it requires whether the gripper holds a part."""

    name: str
    meaning: str
    needs_answer: bool


@dataclass(frozen=True, slots=True)
class Recovery:
    """An interrupted job that waits for a decision.

    `index` and `step` name the interrupted step and `phase` its last known phase, 0 and "" between two steps. `since`
    is the date when the interruption was found. `holding` is the gripper state known to the machine: False if it is
    open, None if only a person can see it. `state` is the state of the machine.
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
class OperatorQuestion:
    """A question to the operator, of step `index` of a job: its text, and the answers to choose from.

    It is `open` while the job waits for the answer. After a restart the job must be recovered first, and asks
    again.
    """

    job: int
    name: str
    index: int
    question: str
    choices: tuple[str, ...]
    open: bool = True


@dataclass(frozen=True, slots=True)
class QueueView:
    """The queue now: its mode, by whom, why and since when it is paused; the running job and the first waiting ones.

    `reason` is "" while it runs. `counts` is the number
    of jobs that have not ended, by state. `finish_at` is the date when all predicted jobs will have ended at the
    present speed, without held ones. It is `estimated` if a homing is among them, whose duration is unknown in advance.
    `question` is the one that waits for an answer.
    """

    mode: QueueMode
    reason: PauseReason | Literal[""]
    by: str
    since: str
    running: JobLine | None
    waiting: tuple[JobLine, ...]
    counts: dict[str, int]
    finish_at: str | None
    recovery: Recovery | None
    estimated: bool = False
    question: OperatorQuestion | None = None


@dataclass(frozen=True, slots=True)
class StepResult:
    """One step: predicted and actual duration, and where it ended.

    `index` counts from 1 over all rounds, `key` is its place in the job. `code` is 0, or the error's; durations are in
    s, the robot's time, and the `predicted` one is at full speed. `end_counts` are encoder counts, `end_point` is in m;
    both are None until the step has ended at a known position. `phase` is the last known phase.
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

    `predicted` is the sum over the steps that can be predicted (a homing cannot). `lowest` and `highest` bound the
    gripper point over the whole checked job [m], None if it was checked in an earlier run, or ended before its first
    step. `parts` contains the positions where the job has put its named parts [m], None for parts that it has not put
    down, or released at an unknown position. `remarks` describe deviations of its pallets, which are used nevertheless,
    and what the prediction leaves out or assumes. `line` is its line of the queue, with its owner, dates and options.
    `version` changes with its steps and the places that they name. `next_step` is the first step that is neither done
    nor left out, None without one: an ended job that is run again begins there.
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
    next_step: int | None = None


@dataclass(frozen=True, slots=True)
class JobAccepted:
    """A job was accepted under the number `id`, with the number of its `steps` over all rounds and cells."""

    id: int
    name: str
    steps: int


@dataclass(frozen=True, slots=True)
class TaughtPose:
    """Position of the gripper; `taught` is the date of teaching, as written by its program (ISO 8601 by Maya).

    `joints` (rad, m, m) are the taught values. `point` [m] is computed from them with the current constants: after a
    correction of the constants, the same line lengths still lead to the same place on the real table, whereas a
    previously computed point does not. It is None if lines of these lengths cannot meet.
    """

    name: str
    joints: Joints
    point: Point | None
    taught: str


@dataclass(frozen=True, slots=True)
class PalletInfo:
    """A taught pallet: cells (1, 1), (1, columns), (rows, 1) and (rows, columns) [m], None without a valid grid.

    `flatness` is the deviation of its corners from a plane [m], `squareness` that of its angles from right angles
    [rad]; `remarks` describe deviations that are too large, and invalid corners.
    """

    name: str
    rows: int
    columns: int
    corners: tuple[Point, ...] | None
    flatness: float | None
    squareness: float | None
    remarks: tuple[str, ...]
    taught: str
