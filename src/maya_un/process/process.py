"""The queue: one job at a time, in the order they came, each checked whole before its first step.

After a stop, a fault or the loss of the link the jobs that wait are cancelled too: nothing starts by itself
once somebody has said stop, or once a fault is cleared (docs/decisions/0016-a-stop-empties-the-queue.md).
"""

from __future__ import annotations

import asyncio
from collections import deque
from dataclasses import dataclass, field

from maya_un.config import Config
from maya_un.controller.protocol import Controller
from maya_un.errors import (
    Cancelled,
    Faulted,
    InternalError,
    MachineError,
    MayaError,
    NotConnected,
    NotFound,
    Stopped,
)
from maya_un.events import Kind
from maya_un.process.inspection import JobInspection, inspect_job
from maya_un.process.job import Job
from maya_un.process.names import Recall
from maya_un.process.preview import JobPreview, preview_job
from maya_un.process.report import JobRecord, JobReport, JobSummary, StepRecord
from maya_un.process.states import TaskState
from maya_un.process.tasks import Expansion, expand, single
from maya_un.process.taught import Taught
from maya_un.robot.plan import Pose
from maya_un.robot.primitives import Primitive
from maya_un.robot.robot import Robot
from maya_un.values import Mode, Notice

REMEMBERED = 1000
"""Jobs that have ended and are still known."""


@dataclass(slots=True, eq=False)
class _Entry:
    """A job in the queue; `ended` is set with its report final, `end_by` holds what is to end it early."""

    record: JobRecord
    ended: asyncio.Event = field(default_factory=asyncio.Event)
    end_by: MayaError | None = None
    task: asyncio.Task[None] | None = None


class Process:
    """Runs jobs on a robot, first come first served; see the module for what ends the queue.

    `recall` tells what has been taught, when a job names something that it does not explain itself.
    """

    def __init__(self, robot: Robot, controller: Controller, config: Config, recall: Recall = Taught) -> None:
        self._robot = robot
        self._recall = recall
        self._controller = controller
        self._grasp_height = config.cell.grasp_height
        self._entries: dict[int, _Entry] = {}
        self._waiting: deque[_Entry] = deque()
        self._running: _Entry | None = None
        self._runner: asyncio.Task[None] | None = None
        self._count = 0

    @property
    def running(self) -> int | None:
        """Number of the job under way, None where there is none."""
        entry = self._running
        return None if entry is None or entry.ended.is_set() else entry.record.id

    def submit(self, job: Job) -> int:
        """Append a job and return its number; it starts when its turn comes.

        Raises `UnknownName` and `InvalidJob` for what it says, `FileUnreadable` where the book of taught places is
        needed and broken, `NotConnected` and `Faulted` while nothing can run.
        """
        return self._append(job.name, expand(job, self._grasp_height, self._recall))

    def wish(self, primitive: Primitive) -> int:
        """Append a job of one primitive and return its number; raises `NotConnected`, `Faulted`."""
        return self._append(primitive.command, single(primitive))

    def summary(self, number: int) -> JobSummary:
        """Return the line of a job; raises `NotFound`."""
        return self._entry(number).record.summary()

    def report(self, number: int) -> JobReport:
        """Return what is known of a job now; raises `NotFound`."""
        return self._entry(number).record.report()

    def summaries(self) -> list[JobSummary]:
        """Return one line for every job that is still known, in the order they came."""
        return [entry.record.summary() for entry in self._entries.values()]

    async def result(self, number: int) -> JobReport:
        """Wait until a job has ended and return its report; raises `NotFound`."""
        entry = self._entry(number)
        await entry.ended.wait()
        return entry.record.report()

    async def cancel(self, number: int) -> JobReport:
        """End a job early; one that runs stops on its path. Returns when it has ended; raises `NotFound`."""
        entry = self._entry(number)
        self._end_early(entry, Cancelled())
        _cancel_once(entry.task)
        return await self.result(number)

    def halt(self, error: MayaError) -> None:
        """Begin nothing more: jobs that wait end with `error`, the one that runs begins no further step."""
        for entry in tuple(self._waiting):
            self._end_early(entry, error)
        if self._running is not None:
            self._running.end_by = self._running.end_by or error

    async def preview(self, job: Job, start: Pose) -> JobPreview:
        """Return what `job` would be from `start`; raises as `submit` for what it says; sends nothing."""
        return await preview_job(self._robot, expand(job, self._grasp_height, self._recall).tasks, start)

    async def inspect(self, job: Job, start: Pose, samples: int) -> JobInspection:
        """Return `job` in detail, from `start`; raises as `preview` does; sends nothing."""
        return await inspect_job(self._robot, expand(job, self._grasp_height, self._recall).tasks, start, samples)

    async def close(self) -> None:
        """Cancel what runs and what waits, and return when the robot is at rest."""
        self.halt(Cancelled())
        if self._running is not None:
            _cancel_once(self._running.task)
        if self._runner is not None:
            await self._runner

    def _append(self, name: str, tasks: Expansion) -> int:
        self._require_able()
        self._count += 1
        entry = _Entry(JobRecord(self._count, name, tasks))
        self._forget()
        self._entries[self._count] = entry
        self._waiting.append(entry)
        self._tell(entry)
        if self._runner is None:
            self._runner = asyncio.get_running_loop().create_task(self._run(), name="job queue")
        return self._count

    def _require_able(self) -> None:
        state = self._controller.state
        if state.mode is Mode.DISCONNECTED:
            raise NotConnected
        if state.mode is Mode.FAULT:
            raise Faulted(fault=state.fault.message if state.fault else "")

    def _forget(self) -> None:
        """Drop the oldest job that has ended, once there are too many."""
        if len(self._entries) >= REMEMBERED:
            oldest = next((number for number, entry in self._entries.items() if entry.ended.is_set()), None)
            if oldest is not None:
                del self._entries[oldest]

    def _entry(self, number: int) -> _Entry:
        if number not in self._entries:
            raise NotFound(what="job", number=number)
        return self._entries[number]

    def _end_early(self, entry: _Entry, error: MayaError) -> None:
        """Note why a job is to end; one that still waits ends at once."""
        if entry.ended.is_set():
            return
        entry.end_by = entry.end_by or error
        if entry in self._waiting:
            self._waiting.remove(entry)
            self._finish(entry, TaskState.CANCELLED, _notice(error))

    async def _run(self) -> None:
        """Take one job after the other until none waits."""
        try:
            while self._waiting:
                self._running = entry = self._waiting.popleft()
                entry.task = asyncio.get_running_loop().create_task(self._perform(entry), name="job")
                await asyncio.wait({entry.task})
                self._settle(entry)
        finally:
            self._running = self._runner = None

    def _settle(self, entry: _Entry) -> None:
        """See that a job whose task is over has ended; hand a defect of ours to the loop's handler."""
        assert entry.task is not None
        if not entry.ended.is_set():
            self._finish(entry, TaskState.CANCELLED, _notice(entry.end_by or Cancelled()))
        defect = None if entry.task.cancelled() else entry.task.exception()
        if defect is not None:
            asyncio.get_running_loop().call_exception_handler(
                {"message": f"job {entry.record.id} ended by a defect", "exception": defect}
            )

    async def _perform(self, entry: _Entry) -> None:
        """Run one job to its end, whatever the end is."""
        entry.record.begin(asyncio.get_running_loop().time())
        self._tell(entry)
        try:
            refused = await self._check(entry) or await self._steps(entry)
            self._finish(entry, TaskState.FAILED if refused else TaskState.DONE, refused)
        except asyncio.CancelledError:
            self._finish(entry, TaskState.CANCELLED, _notice(entry.end_by or Cancelled()))
        except (Stopped, Cancelled) as error:
            self._finish(entry, TaskState.CANCELLED, _notice(error))
            if isinstance(error, Stopped):
                self.halt(error)
        except MayaError as error:
            self._finish(entry, TaskState.FAILED, _notice(error))
            if isinstance(error, MachineError | NotConnected | Faulted):
                self.halt(error)
        except Exception as defect:
            error = InternalError(reason=repr(defect))
            self._finish(entry, TaskState.FAILED, _notice(error))
            self.halt(error)
            raise

    async def _check(self, entry: _Entry) -> Notice | None:
        """Work the whole job out from where the robot is; return why it is refused, if it is."""
        record = entry.record
        preview = await preview_job(self._robot, record.expansion.tasks, self._robot.pose)
        record.previewed(preview)
        if preview.refusal is None:
            return None
        step = record.steps[preview.refusal.index - 1]
        step.become(TaskState.FAILED, preview.refusal.notice)
        self._tell_step(entry, step)
        return preview.refusal.notice

    async def _steps(self, entry: _Entry) -> None:
        """Do all steps in order; raises what ends the job early."""
        for step in entry.record.steps:
            if entry.end_by is not None:
                raise entry.end_by
            await self._step(entry, step)

    async def _step(self, entry: _Entry, step: StepRecord) -> None:
        loop = asyncio.get_running_loop()
        began = loop.time()
        step.become(TaskState.RUNNING)
        self._tell_step(entry, step)
        try:
            await self._robot.run(step.task.primitive)
        except asyncio.CancelledError:
            self._end_step(entry, step, TaskState.CANCELLED, began, entry.end_by or Cancelled())
            raise
        except MayaError as error:
            state = TaskState.CANCELLED if isinstance(error, Stopped) else TaskState.FAILED
            self._end_step(entry, step, state, began, error)
            raise
        entry.record.done += 1
        self._end_step(entry, step, TaskState.DONE, began, None)

    def _end_step(
        self, entry: _Entry, step: StepRecord, state: TaskState, began: float, error: MayaError | None
    ) -> None:
        step.duration = asyncio.get_running_loop().time() - began
        step.end = self._controller.state
        step.become(state, None if error is None else _notice(error))
        self._tell_step(entry, step)

    def _finish(self, entry: _Entry, state: TaskState, notice: Notice | None) -> None:
        entry.record.finish(state, notice, asyncio.get_running_loop().time())
        entry.ended.set()
        self._tell(entry)

    def _tell(self, entry: _Entry) -> None:
        record = entry.record
        code = 0 if record.notice is None else record.notice.code
        self._controller.events.emit(Kind.JOB, code, job=record.id, name=record.name, state=record.state.value)

    def _tell_step(self, entry: _Entry, step: StepRecord) -> None:
        self._controller.events.emit(
            Kind.STEP,
            0 if step.notice is None else step.notice.code,
            job=entry.record.id,
            index=step.task.index,
            step=step.task.label,
            state=step.state.value,
        )


def _cancel_once(task: asyncio.Task[None] | None) -> None:
    """Cancel a job's task; a second time would cut short its wait for the axes to come to rest."""
    if task is not None and not task.cancelling():
        task.cancel()


def _notice(error: MayaError) -> Notice:
    return Notice(error.code, str(error))
