"""Reports: the queue's record of a job, and frozen copies of it.

Long lists are built in slices, so that no reader blocks the robot's loop.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from maya_un.process.journal.protocol import JobRow, StepRow
from maya_un.process.spec.statements import AskOperator
from maya_un.process.spec.stored import version_of
from maya_un.process.spec.tasks import Expansion, Task
from maya_un.robot.plan_builder import Pose
from maya_un.schema.jobs import JobLine, JobReport, StepResult, TaskState, advance
from maya_un.schema.previews import JobPreview, StepPreview
from maya_un.values import Notice, Point, State

S = TypeVar("S")
T = TypeVar("T")

SLICE = 100
"""Number of entries built at a time: about 1 ms of work."""


class Slices:
    """Serializes readers by `turn`: several readers at once block the loop no longer than one alone."""

    def __init__(self) -> None:
        self.turn = asyncio.Lock()

    async def each(self, make: Callable[[S], T], things: Sequence[S]) -> list[T]:
        """Return the results of `make` for `things`, computed in one turn."""
        async with self.turn:
            return await map_in_slices(make, things)


async def map_in_slices(make: Callable[[S], T], things: Sequence[S]) -> list[T]:
    """Return the results of `make` for `things`; other tasks use the loop between two slices."""
    found: list[T] = []
    for begin in range(0, len(things), SLICE):
        if begin:
            await asyncio.sleep(0)
        found += map(make, things[begin : begin + SLICE])
    return found


@dataclass(slots=True)
class Edition:
    """Counts the changes of a job's steps."""

    number: int = 0


class StepRecord:
    """The present data of one step; the `edition` of the job's steps counts every change of its `row`.

    A step that is not `expected` belongs to a branch to which the prediction does not lead.
    """

    __slots__ = ("_edition", "_row", "expected", "task")

    def __init__(self, task: Task, row: StepRow, edition: Edition) -> None:
        self.task = task
        self._row = row
        self._edition = edition
        self.expected = True

    @property
    def row(self) -> StepRow:
        """Its row in the journal."""
        return self._row

    @row.setter
    def row(self, row: StepRow) -> None:
        self._row = row
        self._edition.number += 1

    @property
    def state(self) -> TaskState:
        """Its state."""
        return self.row.state

    def become(self, state: TaskState, notice: Notice | None = None) -> StepRow:
        """Return the step's row after a change to `state`, with `notice` as its reason."""
        code, message = (0, "") if notice is None else (notice.code, notice.message)
        return replace(self.row, state=advance(self.row.state, state), code=code, message=message)


def result_of(task: Task, row: StepRow, *, ended: bool) -> StepResult:
    """Return a step as a value; a step that had not begun when its job `ended` counts as skipped."""
    end = row.end or {}
    counts, point = end.get("counts"), end.get("point")
    return StepResult(
        index=task.index,
        key=task.key,
        step=task.label,
        state=TaskState.SKIPPED if ended and row.state is TaskState.QUEUED else row.state,
        code=row.code,
        message=row.message,
        predicted=row.predicted,
        duration=row.duration,
        end_counts=None if counts is None else (counts[0], counts[1], counts[2]),
        end_point=None if point is None else Point(*point),
        phase=row.phase,
    )


def where(state: State) -> dict[str, object]:
    """Return where a step has ended, in its stored form."""
    return {"counts": list(state.counts), "point": None if state.point is None else list(state.point)}


@dataclass(frozen=True, slots=True)
class StepCounts:
    """The steps of a job, counted: `done`, and those that remain, in order.

    `predicted` is the sum of the predicted durations of remaining steps [s]; `homings` counts those without a
    prediction.
    """

    done: int
    remaining: tuple[StepRecord, ...]
    predicted: float
    homings: int

    @classmethod
    def of(cls, steps: Sequence[StepRecord]) -> StepCounts:
        """Count some steps."""
        remaining = tuple(step for step in steps if not step.state.ended)
        expected = [step.row.predicted for step in remaining if step.expected]
        predicted = [duration for duration in expected if duration is not None]
        done = sum(step.state is TaskState.DONE for step in steps)
        return cls(done, remaining, sum(predicted), len(expected) - len(predicted))


@dataclass(slots=True)
class JobRecord:
    """The present data of the steps of one job.

    `preview` is the prediction of its last check, `end` the robot's predicted end pose. `current` is the index of the
    step under way, 0 between two steps; it would have begun at loop time `current_since` [s] at the present speed.
    """

    expansion: Expansion
    steps: list[StepRecord]
    _edition: Edition
    preview: JobPreview | None = None
    end: Pose | None = None
    current: int = 0
    current_since: float = 0.0
    _counted: tuple[int, StepCounts] | None = None

    @classmethod
    async def new(cls, expansion: Expansion) -> JobRecord:
        """Return the record of a job of which no step has begun; other tasks use the loop meanwhile."""
        edition = Edition()

        def queued(task: Task) -> StepRecord:
            return StepRecord(task, StepRow(task.index, TaskState.QUEUED), edition)

        return cls(expansion, await map_in_slices(queued, expansion.tasks), edition)

    @classmethod
    def kept(cls, expansion: Expansion, rows: Iterable[StepRow]) -> JobRecord:
        """Return the record of a job from its stored `rows`."""
        edition, known = Edition(), {row.index: row for row in rows}
        steps = [
            StepRecord(task, known.get(task.index) or StepRow(task.index, TaskState.QUEUED), edition)
            for task in expansion.tasks
        ]
        return cls(expansion, steps, edition)

    @property
    def tally(self) -> StepCounts:
        """The counts of the steps, computed once between two changes: a job may have thousands of steps."""
        if self._counted is None or self._counted[0] != self._edition.number:
            self._counted = (self._edition.number, StepCounts.of(self.steps))
        return self._counted[1]

    @property
    def done(self) -> int:
        """The number of done steps."""
        return self.tally.done

    @property
    def under_way(self) -> StepRecord | None:
        """The step under way, None between two steps."""
        return self.steps[self.current - 1] if self.current else None

    @property
    def begun(self) -> bool:
        """Whether a step of the job was tried."""
        return any(step.row.duration is not None for step in self.steps)

    @property
    def remaining(self) -> tuple[StepRecord, ...]:
        """The steps that have not ended, in order."""
        return self.tally.remaining

    async def previewed(self, preview: JobPreview, end: Pose) -> None:
        """Store the predictions of a check of the remaining steps; other tasks use the loop meanwhile."""

        def store(step: StepPreview) -> None:
            record = self.steps[step.index - 1]
            record.row = replace(record.row, predicted=step.duration)
            record.expected = step.expected

        await map_in_slices(store, preview.steps)
        self.preview, self.end = preview, end

    @property
    def answers(self) -> dict[int, str]:
        """The answers to the questions so far, by step."""
        return {
            step.task.index: step.row.phase
            for step in self.steps
            if isinstance(step.task.action, AskOperator) and step.row.phase and step.state.ended
        }

    def turned(self) -> None:
        """Expect the steps of the branches that were taken, after a branch was left out."""
        for step in self.steps:
            if step.state is TaskState.DONE and step.task.branches:
                for index in step.task.branch(step.row.phase):
                    self.steps[index - 1].expected = True
        self._edition.number += 1


def parts_of(expansion: Expansion, rows: Sequence[StepRow]) -> dict[str, Point | None]:
    """Return the places of the parts after the steps so far; a step that ended early may have taken its part."""
    parts: dict[str, Point | None] = dict.fromkeys(expansion.parts)
    for task, row in zip(expansion.tasks, rows, strict=True):
        if task.part is not None and row.state not in {TaskState.QUEUED, TaskState.SKIPPED}:
            parts[task.part] = task.put if row.state is TaskState.DONE else None
    return parts


def next_step(rows: Iterable[StepRow], count: int) -> int | None:
    """Return the first of `count` steps that is neither done nor left out, None without one.

    Only steps that were left out on purpose have a row with the state `skipped`: those before the first step of a job
    that is run again, those of a branch that was not taken, and one that a person has left out after a restart.
    """
    over = {row.index for row in rows if row.state in {TaskState.DONE, TaskState.SKIPPED}}
    return next((index for index in range(1, count + 1) if index not in over), None)


@dataclass(frozen=True, slots=True)
class JobSnapshot:
    """A job at one instant: its line, its row, the expansion of this row, and a row for every step.

    `preview` is that of its check.
    """

    line: JobLine
    row: JobRow
    expansion: Expansion
    rows: Sequence[StepRow]
    preview: JobPreview | None = None

    @classmethod
    def of(cls, line: JobLine, row: JobRow, record: JobRecord) -> JobSnapshot:
        """Return the snapshot of a job whose record is in memory."""
        preview = None if line.state.ended and not record.begun else record.preview
        return cls(line, row, record.expansion, [step.row for step in record.steps], preview)

    @classmethod
    def kept(cls, line: JobLine, row: JobRow, expansion: Expansion, known: Iterable[StepRow]) -> JobSnapshot:
        """Return the snapshot of a job from its `known` rows."""
        rows = [StepRow(task.index, TaskState.QUEUED) for task in expansion.tasks]
        for step in known:
            if 0 < step.index <= len(rows):
                rows[step.index - 1] = step
        return cls(line, row, expansion, rows)


async def report_of(job: JobSnapshot) -> JobReport:
    """Return a job's report; other tasks use the loop meanwhile, because a job may have thousands of steps."""
    line, preview = job.line, job.preview
    pairs = list(zip(job.expansion.tasks, job.rows, strict=True))
    steps = await map_in_slices(lambda pair: result_of(*pair, ended=line.state.ended), pairs)
    await asyncio.sleep(0)
    version = version_of(job.row)
    await asyncio.sleep(0)  # the version of a long job takes over a millisecond
    return JobReport(
        id=line.id,
        name=line.name,
        state=line.state,
        code=line.code,
        message=line.message,
        predicted=line.predicted,
        duration=line.duration,
        lowest=None if preview is None else preview.lowest,
        highest=None if preview is None else preview.highest,
        steps=tuple(steps),
        parts=parts_of(job.expansion, job.rows),
        remarks=job.expansion.remarks,
        line=line,
        version=version,
        next_step=next_step(job.rows, len(pairs)),
    )


def line_of(
    row: JobRow,
    *,
    position: int | None = None,
    eta: float | None = None,
    done: int | None = None,
    predicted: float | None = None,
    direct: bool = False,
    obstacle: Notice | None = None,
) -> JobLine:
    """Return a job's line; `done` and `predicted` replace values that the row lacks or has outdated."""
    options = row.options
    return JobLine(
        id=row.id,
        name=row.name,
        state=row.state,
        code=row.code,
        message=row.message,
        owner=row.owner.name,
        source=row.owner.source,
        priority=options.priority,
        position=position,
        notes=options.notes,
        depends_on=options.depends_on,
        done=row.done if done is None else done,
        steps=row.steps,
        predicted=predicted if row.predicted is None else row.predicted,
        duration=row.duration,
        eta=eta,
        submitted=row.submitted,
        began=row.began,
        ended=row.ended,
        proposal=row.proposal,
        approved_by=row.approved_by,
        on_failure=options.on_failure,
        retries=options.retries,
        stepwise=options.stepwise,
        direct=direct,
        obstacle=obstacle,
    )
