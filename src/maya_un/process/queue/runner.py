"""One job, from its check to its end: step by step, each written before it begins."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from maya_un.controller.protocol import Controller
from maya_un.errors import (
    Cancelled,
    Faulted,
    InternalError,
    MayaError,
    NotConnected,
    RequestError,
    Stopped,
    StorageFailed,
)
from maya_un.process.computation import JobComputer
from maya_un.process.queue.changes import Changes, Dates, QueuePauser, Transaction, TransactionLog
from maya_un.process.queue.entries import QueueEntry
from maya_un.process.queue.report import JobRecord, StepRecord, where
from maya_un.process.queue.statements import StatementRunner
from maya_un.process.spec.statements import ELSE, THEN, JobStatement
from maya_un.robot.robot import OnPhase, Robot
from maya_un.schema.jobs import PauseReason, TaskState
from maya_un.values import Notice

RETRY_AFTER = 1.0
"""Time between a failed step and its retry [s]."""


@dataclass(frozen=True, slots=True)
class RunnerContext:
    """The shared objects of the queue's workers. With `notes_phases` every phase of a step is written.

    `computer` computes jobs.
    """

    robot: Robot
    controller: Controller
    transactions: TransactionLog
    changes: Changes
    pausing: QueuePauser
    dates: Dates
    computer: JobComputer
    notes_phases: bool


class JobEnd(NamedTuple):
    """How a run of a job ended: its state, the reason, and the error unless its check refused it."""

    state: TaskState
    notice: Notice | None = None
    error: MayaError | None = None


class _Refused(Exception):
    """The check of the whole job refused a step."""

    def __init__(self, step: StepRecord, notice: Notice) -> None:
        super().__init__(notice.message)
        self.step = step
        self.notice = notice


class JobRunner:
    """Runs or continues one job, for at most `limit` steps; without a limit until the queue is paused.

    Calls `follows` with the end before it is written or announced, so the consequences for the queue hold by then.
    """

    def __init__(
        self, shared: RunnerContext, item: QueueEntry, limit: int | None, follows: Callable[[QueueEntry, JobEnd], None]
    ) -> None:
        self._shared = shared
        self._item = item
        self._limit = limit
        self._follows = follows
        self._statements = StatementRunner(shared.controller)
        self._done = 0
        self._carried: list[Transaction] = []
        self._noting: asyncio.Task[None] | None = None

    async def run(self) -> None:
        """Run the job as far as it may go and return once that is written, as far as the storage allows.

        Has no effect if the job may no longer begin at its turn.

        Raises `StorageFailed` if its start cannot be written; then no step has begun.
        """
        if not await self._begin():
            return
        ending = await self._outcome()
        self._follows(self._item, ending)
        await self._conclude(ending)

    async def _begin(self) -> bool:
        """Write that the job runs; return False if it was held, cancelled or paused before that."""
        item, shared = self._item, self._shared
        date = shared.dates(0.0)

        def propose() -> list[Transaction]:
            if not item.may_begin or self._must_pause():
                return []
            began = item.row.began or date
            return [entry._replace(sure=False) for entry in shared.changes.job(item, TaskState.RUNNING, began=began)]

        await shared.transactions.write(propose)
        item.began = asyncio.get_running_loop().time()
        return item.row.state is TaskState.RUNNING

    async def _outcome(self) -> JobEnd:
        """Check the job and do its steps; return its end, whatever happens."""
        item = self._item
        try:
            await self._checked()
            return await self._steps()
        except asyncio.CancelledError:
            _take_back()
            return self._ended_early(item.end_by or Cancelled())
        except StorageFailed:
            return JobEnd(TaskState.PAUSED)
        except _Refused as refused:
            step, notice = refused.step, refused.notice
            self._carried.append(self._shared.changes.step(item, step, step.become(TaskState.FAILED, notice)))
            return JobEnd(TaskState.FAILED, notice)
        except MayaError as error:
            return self._ended_early(error)
        except Exception as defect:  # noqa: BLE001 - handed to the loop's handler
            context = {"message": f"job {item.number} ended by a defect", "exception": defect}
            asyncio.get_running_loop().call_exception_handler(context)
            return self._ended_early(InternalError(reason=repr(defect)))

    def _ended_early(self, error: MayaError) -> JobEnd:
        """Return the end of a job or a step by `error`: interrupted if this program is shutting down."""
        if self._item.interrupt and error is self._item.end_by:
            return JobEnd(TaskState.INTERRUPTED)
        cancelled = isinstance(error, Stopped | Cancelled)
        return JobEnd(TaskState.CANCELLED if cancelled else TaskState.FAILED, Notice(error.code, str(error)), error)

    async def _checked(self) -> None:
        """Compute the job; a stop ends this."""
        self._item.checking = True
        try:
            await self._cancellable(self._check())
        finally:
            self._item.checking = False

    async def _check(self) -> None:
        """Compute the remaining steps from the robot's position; raises `_Refused`."""
        item, shared = self._item, self._shared
        if item.record is None:
            item.record = await JobRecord.new(await shared.computer.expanded(item.row.body))
            await asyncio.sleep(0)  # a long job takes the loop for milliseconds below
        record = item.record
        self._done = record.done
        tasks = [step.task for step in record.remaining]
        outlook = await shared.computer.walk(tasks, shared.robot.pose, record.answers)
        preview = outlook.preview
        await record.previewed(preview, outlook.end)
        if preview.refusal is not None:
            raise _Refused(record.steps[preview.refusal.index - 1], preview.refusal.notice)

    async def _steps(self) -> JobEnd:
        """Do the remaining steps, in order."""
        item = self._item
        assert item.record is not None
        for step in item.record.remaining:
            if step.state.ended:  # it belongs to the other branch
                continue
            if item.end_by is not None:
                raise item.end_by
            if self._must_pause():
                return JobEnd(TaskState.PAUSED)
            await self._begin_step(step)
            await self._do(step)
        return JobEnd(TaskState.DONE)

    def _must_pause(self) -> bool:
        if self._limit is not None:
            return self._limit <= 0
        return self._shared.pausing.paused and not self._item.direct

    async def _begin_step(self, step: StepRecord) -> None:
        """Write that a step begins, with the end of the step before; raises `StorageFailed`, then it may not begin."""
        carried, self._carried = self._carried, []

        def propose() -> list[Transaction]:
            begins = step.become(TaskState.RUNNING)
            return [*carried, *self._predicted(), self._shared.changes.step(self._item, step, begins, sure=False)]

        await self._shared.transactions.write(propose)

    def _predicted(self) -> list[Transaction]:
        """Return the change that stores the check's prediction for the job, once."""
        item = self._item
        preview = None if item.record is None else item.record.preview
        if preview is None or item.row.predicted is not None:
            return []
        row = replace(item.row, predicted=preview.duration)
        return [Transaction((row,), lambda: setattr(item, "row", row), sure=True)]

    async def _do(self, step: StepRecord) -> None:
        """Do a step whose start is written; raises the error that ends the job early."""
        item, loop = self._item, asyncio.get_running_loop()
        began = loop.time()
        assert item.record is not None
        item.record.current, item.record.current_since = step.row.index, began
        if self._limit is not None:
            self._limit -= 1
        error: Exception | None = item.end_by
        if error is None:
            error = await self._attempted(step)
        item.record.current = 0
        await self._end_step(step, error, loop.time() - began)
        if error is not None:
            raise error
        if item.row.options.stepwise:
            self._shared.pausing.pause(PauseReason.STEP)

    async def _attempted(self, step: StepRecord) -> Exception | None:
        """Do a step and return the error that ended it early, defects included: its end is written in any case."""
        try:
            await self._cancellable(self._tried(step))
        except asyncio.CancelledError:
            _take_back()
            return self._item.end_by or Cancelled()
        except Exception as error:  # noqa: BLE001 - raised again once the end is stored
            return error
        return None

    async def _end_step(self, step: StepRecord, error: Exception | None, duration: float) -> None:
        """Store how a step has ended, to be written with the next change."""
        if self._noting is not None:
            await asyncio.wait({self._noting})
            self._noting = None
        if error is None:
            ending = JobEnd(TaskState.DONE)
            self._done += 1
        else:
            ending = self._ended_early(error if isinstance(error, MayaError) else InternalError(reason=repr(error)))
        row = step.become(ending.state, ending.notice)
        row = replace(row, duration=(row.duration or 0.0) + duration, end=where(self._shared.controller.state))
        self._carried.append(self._shared.changes.step(self._item, step, row))
        if error is None and step.task.branches:
            self._leave_out(step.task.branch(ELSE if step.row.phase == THEN else THEN))

    def _leave_out(self, indices: range) -> None:
        """Mark the steps of a branch as skipped, to be written together with the choice."""
        item = self._item
        assert item.record is not None
        for index in indices:
            other = item.record.steps[index - 1]
            other.row = skipped = other.become(TaskState.SKIPPED)
            self._carried.append(self._shared.changes.step(item, other, skipped, quiet=True))
        item.record.turned()

    async def _tried(self, step: StepRecord) -> None:
        """Do a step, with the retries of the job if a repetition is harmless; raises its error."""
        attempts = 1 + (self._item.row.options.retries if step.task.action.harmless() else 0)
        for attempt in range(1, attempts + 1):
            try:
                await self._act(step)
            except RequestError as error:
                if attempt == attempts or isinstance(error, Stopped | Cancelled | NotConnected | Faulted):
                    raise
                failed = replace(step.row, code=error.code)
                self._shared.changes.tell_step(self._item, step, failed, attempt=attempt + 1)
                await asyncio.sleep(RETRY_AFTER)
                if self._item.end_by is not None:  # a stop came meanwhile, when nothing moved
                    raise self._item.end_by from None
            else:
                return

    async def _act(self, step: StepRecord) -> None:
        """Do the action of a step; the answer to a question, and the branch of an `if`, are its phase."""
        task, record = step.task, self._item.record
        assert record is not None
        if not isinstance(task.action, JobStatement):
            await self._shared.robot.run(task.action, self._on_phase(step), task.speed)
            return
        phase = await self._statements.run(self._item, task, task.action, record.answers)
        if phase:
            step.row = replace(step.row, phase=phase)

    def _on_phase(self, step: StepRecord) -> OnPhase | None:
        """Return the callback that writes each phase of a step as it begins, None if phases are not written."""
        if not self._shared.notes_phases:
            return None

        def began(phase: str) -> None:
            note = self._note(step, phase, self._noting)
            self._noting = asyncio.get_running_loop().create_task(note, name="phase")

        return began

    async def _note(self, step: StepRecord, phase: str, before: asyncio.Task[None] | None) -> None:
        """Write a phase; if that fails, the step continues: a motion does not end half way for it."""
        if before is not None:
            await asyncio.wait({before})

        def propose() -> list[Transaction]:
            return [self._shared.changes.step(self._item, step, replace(step.row, phase=phase), quiet=True)]

        with suppress(StorageFailed):
            await self._shared.transactions.write(propose)

    async def _cancellable(self, work: Awaitable[None]) -> None:
        """Await work that a cancellation of the job may end."""
        self._item.moving = True
        try:
            await work
        finally:
            self._item.moving = False

    async def _conclude(self, ending: JobEnd) -> None:
        """Write how far the job has come."""
        item, shared = self._item, self._shared
        duration = (item.row.duration or 0.0) + asyncio.get_running_loop().time() - (item.began or 0.0)
        fields: dict[str, Any] = {"done": self._done, "duration": duration}
        if ending.state.ended:
            fields["ended"] = shared.dates(0.0)

        def goes_on() -> list[Transaction]:
            held = item.row.state is TaskState.PAUSED and ending.state in {TaskState.PAUSED, TaskState.DONE}
            return shared.changes.job(item, TaskState.RUNNING) if held else []

        def propose() -> list[Transaction]:
            return [*self._carried, *shared.changes.job(item, ending.state, ending.notice, **fields)]

        item.concludes = True
        with suppress(StorageFailed):
            await shared.transactions.write(goes_on)
        with suppress(StorageFailed):
            await shared.transactions.write(propose)


def _take_back() -> None:
    """Revoke the cancellation of a motion, because its end is still to be written."""
    task = asyncio.current_task()
    if task is not None:
        task.uncancel()
