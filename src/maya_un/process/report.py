"""What happened: the record that the queue keeps of a job, and the frozen report that it hands out."""

from __future__ import annotations

from dataclasses import dataclass, field

from maya_un.process.preview import JobPreview
from maya_un.process.states import TaskState, advance
from maya_un.process.tasks import Expansion, Task
from maya_un.values import Notice, Point, State


@dataclass(frozen=True, slots=True)
class StepResult:
    """One step: what was predicted, what it took, where it ended.

    `index` counts from 1 over all rounds, `key` is its place in the job. `code` is 0, or the error's; durations in s;
    `end_counts` are encoder counts, `end_point` is in m; both None until the step has ended somewhere.
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


@dataclass(frozen=True, slots=True)
class JobSummary:
    """One line of the queue: `done` of `steps` are done, over all rounds."""

    id: int
    name: str
    state: TaskState
    code: int
    done: int
    steps: int


@dataclass(frozen=True, slots=True)
class JobReport:
    """One job: its state, its steps' results, predicted and actual duration [s].

    `predicted` is the sum over the steps that can be predicted (a homing cannot). `lowest` and `highest` bound
    the gripper point over the whole job as checked [m]. `parts` tells where the job has put its named parts [m],
    None for those that it has not put down, or let go where nobody knows. `remarks` say what of its pallets is out of
    shape; they are used as they are.
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
    remarks: tuple[str, ...] = ()


@dataclass(slots=True)
class StepRecord:
    """What is known of one step so far."""

    task: Task
    state: TaskState = TaskState.QUEUED
    notice: Notice | None = None
    predicted: float | None = None
    duration: float | None = None
    end: State | None = None

    def become(self, state: TaskState, notice: Notice | None = None) -> None:
        """Go on to `state`, because of `notice` where there is one."""
        self.state = advance(self.state, state)
        self.notice = notice

    def result(self) -> StepResult:
        """Return it as a value."""
        return StepResult(
            index=self.task.index,
            key=self.task.key,
            step=self.task.label,
            state=self.state,
            code=0 if self.notice is None else self.notice.code,
            message="" if self.notice is None else self.notice.message,
            predicted=self.predicted,
            duration=self.duration,
            end_counts=None if self.end is None else self.end.counts,
            end_point=None if self.end is None else self.end.point,
        )


@dataclass(slots=True)
class JobRecord:
    """What is known of one job so far."""

    id: int
    name: str
    expansion: Expansion
    steps: list[StepRecord] = field(init=False)
    state: TaskState = TaskState.QUEUED
    notice: Notice | None = None
    preview: JobPreview | None = None
    done: int = 0
    began: float | None = None
    duration: float | None = None

    def __post_init__(self) -> None:
        self.steps = [StepRecord(task) for task in self.expansion.tasks]

    def begin(self, now: float) -> None:
        """Start to run at loop time `now` [s]."""
        self.state = advance(self.state, TaskState.RUNNING)
        self.began = now

    def finish(self, state: TaskState, notice: Notice | None, now: float) -> None:
        """End in `state`, because of `notice` where there is one; steps that have not begun are skipped."""
        self.state = advance(self.state, state)
        self.notice = notice
        self.duration = None if self.began is None else now - self.began
        for step in self.steps:
            if step.state is TaskState.QUEUED:
                step.become(TaskState.SKIPPED)
            elif step.state is TaskState.RUNNING:
                step.become(TaskState.FAILED, notice)

    def previewed(self, preview: JobPreview) -> None:
        """Keep what the check of the whole job predicted."""
        self.preview = preview
        for record, step in zip(self.steps, preview.steps, strict=False):
            record.predicted = step.duration

    def summary(self) -> JobSummary:
        """Return its line of the queue."""
        code = 0 if self.notice is None else self.notice.code
        return JobSummary(self.id, self.name, self.state, code, self.done, len(self.steps))

    def report(self) -> JobReport:
        """Return it as a value."""
        return JobReport(
            id=self.id,
            name=self.name,
            state=self.state,
            code=0 if self.notice is None else self.notice.code,
            message="" if self.notice is None else self.notice.message,
            predicted=None if self.preview is None else self.preview.duration,
            duration=self.duration,
            lowest=None if self.preview is None else self.preview.lowest,
            highest=None if self.preview is None else self.preview.highest,
            steps=tuple(record.result() for record in self.steps),
            parts=self._parts(),
            remarks=self.expansion.remarks,
        )

    def _parts(self) -> dict[str, Point | None]:
        """Return where the steps done so far have put the parts; a step that ended early may have taken its part."""
        parts: dict[str, Point | None] = dict.fromkeys(self.expansion.parts)
        for step in self.steps:
            if step.task.part is not None and step.state not in {TaskState.QUEUED, TaskState.SKIPPED}:
                parts[step.task.part] = step.task.put if step.state is TaskState.DONE else None
        return parts
