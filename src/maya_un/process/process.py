"""The queue of jobs: one at a time, in order, each checked as a whole before its first step, every change stored.

A stop, a fault or the loss of the link pauses the queue: nothing starts by itself after a stop or a cleared fault
(docs/decisions/0026-a-stop-pauses-the-queue.md). After a restart the queue waits for a user
(docs/decisions/0027-the-queue-is-durable.md). This module combines its parts:

    editing               submit jobs, and edit them while they wait
    entries               the jobs in memory, and their order
    scheduler · runner    choose the next job; carry out one job from its check to its end
    statements            the steps that wait, switch outputs, read inputs, ask or choose
    recovery              a user's decision about a job that an earlier run interrupted
    changes               write each change, apply it and announce it
    views · report        the queue and one job as others see them
    believed              the parts and their places, as far as jobs tell
    ahead                 the step after the running one, with its path
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

from dmc41x3.i18n import phrase
from maya_un.config import Config
from maya_un.controller.protocol import Controller
from maya_un.errors import Cancelled, Faulted, InvalidValue, NotConnected, NotFound, StorageFailed, WrongState
from maya_un.events import QuestionAnswered
from maya_un.process.computation import JobComputer
from maya_un.process.journal.protocol import JobRow, Journal, RequestOwner, StepRow
from maya_un.process.journal.sqlite import MemoryJournal
from maya_un.process.lease import ControlLease
from maya_un.process.queue.ahead import StepAhead
from maya_un.process.queue.believed import BelievedParts
from maya_un.process.queue.changes import Changes, Dates, QueuePauser, Transaction, TransactionLog
from maya_un.process.queue.editing import DEFAULT_OPTIONS, JobEditor, JobSubmitter, SubmitRequest
from maya_un.process.queue.entries import OpenQuestion, QueueEntries, QueueEntry
from maya_un.process.queue.recovery import JobRecoverer
from maya_un.process.queue.report import next_step
from maya_un.process.queue.runner import RunnerContext
from maya_un.process.queue.scheduler import Scheduler, ShieldedTasks
from maya_un.process.queue.statements import require_choice
from maya_un.process.queue.views import QueueViews
from maya_un.process.spec.job import Job
from maya_un.process.spec.poses import TaughtPlaces
from maya_un.process.spec.statements import ELSE, THEN, AskOperator
from maya_un.process.spec.stored import StoredJob, write_command
from maya_un.process.spec.tasks import Recall, Task
from maya_un.robot.plan_builder import Pose
from maya_un.robot.primitives import Primitive
from maya_un.robot.robot import Robot
from maya_un.schema.choices import RecoveryChoice
from maya_un.schema.jobs import JobReport, PauseReason, TaskState
from maya_un.schema.previews import JobInspection, JobPreview
from maya_un.values import Mode
from maya_un.workers import WorkerSet

T = TypeVar("T")

LOCAL = SubmitRequest(RequestOwner(), DEFAULT_OPTIONS)
"""A user of this machine, with default options."""


class Process:
    """Runs jobs on a robot; the module's docstring lists what pauses the queue.

    `scheduler` runs one job after the other and can be paused, `views` reports the state, `journal` stores it. `parts`
    are the parts as jobs tell them, `ahead` is the step after the running one. `recall` returns the taught places, if a
    job names a place that it does not define. A given journal stores unfinished jobs for the next start; without one
    all jobs end with this process. Jobs begin only if the `lease` permits their owner. `dates` returns dates; without
    it dates are the loop's time. `speed` is the speed of the loop's clock. `staff` computes jobs; without it the
    running loop does.
    """

    def __init__(  # noqa: PLR0913 - every option of a process is a parameter
        self,
        robot: Robot,
        controller: Controller,
        config: Config,
        recall: Recall = TaughtPlaces,
        *,
        journal: Journal | None = None,
        lease: ControlLease | None = None,
        dates: Dates | None = None,
        speed: float = 1.0,
        staff: WorkerSet | None = None,
    ) -> None:
        self._recall = recall
        self._controller = controller
        self._grasp_height = config.cell.grasp_height
        self._durable = journal is not None
        self.journal: Journal = MemoryJournal() if journal is None else journal
        dates = _loop_time if dates is None else dates
        self._items = items = QueueEntries(self.journal)
        self._transactions = transactions = TransactionLog(self.journal, controller.events)
        self._pausing = pausing = QueuePauser(transactions, controller.events, dates)
        self._shielded = ShieldedTasks()
        self._changes = changes = Changes(items, controller.events)
        self.computer = computer = JobComputer(robot, controller, self._grasp_height, recall, staff)
        shared = RunnerContext(robot, controller, transactions, changes, pausing, dates, computer, self._durable)
        self._submitting = JobSubmitter(items, transactions, changes, dates)
        self._editing = JobEditor(items, transactions, changes, self._submitting, computer)
        self._recovering = JobRecoverer(shared, items, changes, self._editing)
        self.parts = BelievedParts(items, controller.events)
        self.scheduler = Scheduler(shared, items, self._shielded, lease)
        self.ahead = StepAhead(robot, computer, lambda: self.scheduler.running, controller.events)
        self.views = QueueViews(shared, items, self.scheduler, self._recovering, speed=speed)

    async def open(self) -> None:
        """Load the unfinished jobs of the journal; no job begins by itself. Raises `StorageFailed`."""
        known, waiting = await self.journal.left()
        self._submitting.next_id = known.next_id
        await self._recovering.take_up(known, waiting)

    async def check_storage(self) -> str:
        """Return why the journal cannot be written, "" if it can; if not, the queue pauses."""
        await self._shielded.do(self._transactions.check())
        return self._transactions.failing

    @property
    def running(self) -> int | None:
        """Number of the job under way, None without one."""
        item = self.scheduler.running
        return None if item is None or item.row.state.ended else item.number

    async def submit(
        self, job: Job | Mapping[str, object] | bytes, asked: SubmitRequest = LOCAL, *, stopped: bool = False
    ) -> int:
        """Append a job and return its number, once it is stored; it starts when its turn comes.

        The job may be plain data or JSON. If a stop came after its request (`stopped`), the queue pauses. Raises
        `UnknownName` and `InvalidJob` for its contents, `FileUnreadable` if it needs the file of taught places and that
        is broken, `KeyReused`, `InvalidValue`, `StorageFailed`; `NotConnected` and `Faulted` while no job can run,
        unless it is to be held.
        """
        halts, asked = self.scheduler.halts - stopped, self._noted(asked)
        return await self._submit(await self.computer.written(job, whose=asked.owner.name), asked, halts=halts)

    async def command(self, command: Primitive | Mapping[str, object], asked: SubmitRequest = LOCAL) -> int:
        """Append a job of one primitive and return its number; raises as `submit` does, and `InvalidRequest`.

        While the queue is paused and nothing runs, a command without options for the queue runs at once: a user who
        sends "home" to a waiting robot means now.
        """
        written = write_command(command, self._grasp_height, self._recall)
        if (
            asked.options == DEFAULT_OPTIONS
            and not asked.proposal
            and self._pausing.paused
            and self.scheduler.running is None
        ):
            asked = replace(asked, direct=True)
        return await self._submit(written, self._noted(asked))

    async def again(self, number: int, asked: SubmitRequest, from_step: int | None = None) -> int:
        """Queue an ended job once more, as a new job, from a step on; return the new number.

        Without `from_step` it begins at the `next_step` of its report, or at the first step if that is None. Raises
        `NotFound`, `WrongState`, `InvalidValue` and as `submit` does.
        """
        halts, asked = self.scheduler.halts, self._noted(asked)
        row, steps = await self.views.found(number)
        if not row.state.ended:
            raise WrongState(number=number, state=row.state.value, action="done again")
        expansion = await self.computer.expanded(row.body)
        count = len(expansion.tasks)
        if from_step is not None and not 1 <= from_step <= count:
            raise InvalidValue(
                key="from_step", value=from_step, reason=phrase("the job has steps 1 to {count}", count=count)
            )
        first = from_step or next_step(steps, count) or 1
        skipped = _passed_over(expansion.tasks, steps, first)
        return await self._submit(StoredJob(row.name, row.body, expansion), asked, skipped, halts=halts)

    async def result(self, number: int) -> JobReport:
        """Wait until a job has ended, or this process is closed, and return its report; raises `NotFound`."""
        item = self._items.find(number)
        if item is not None and not self.scheduler.closed:
            await item.wait()
        return await self.views.report(number)

    async def cancel(self, number: int) -> JobReport:
        """End a job early and return its report once it has ended; a running job stops on its path.

        Raises `NotFound`, and `StorageFailed` if the end cannot be stored; the robot is at rest even then.
        """
        item = self._items.find(number)
        if item is not None and item is not self.scheduler.running:
            await self._shielded.do(self._cancel_waiting(item))
        if item is not None and item is self.scheduler.running:
            self.scheduler.end(item, Cancelled())
            await self.scheduler.left(item)
            if self._transactions.failing:
                raise StorageFailed(reason=self._transactions.failing)
        return await self.result(number)

    async def clear(self) -> None:
        """Cancel all waiting jobs; raises `StorageFailed`."""
        await self._shielded.do(self._clear())
        await self.scheduler.lift()

    def end_running(self) -> None:
        """End the job under way, braking on its path, and begin no waiting job."""
        self.scheduler.halt(Cancelled())
        if self.scheduler.running is not None:
            self.scheduler.end(self.scheduler.running, Cancelled())

    async def end_all(self) -> None:
        """Cancel the job under way and all waiting jobs, started ones included, except interrupted ones.

        Returns when all have ended; raises `StorageFailed`.
        """
        self.end_running()
        await self.clear()
        for item in [item for item in self._items if not item.row.state.ended]:
            if item.row.state is not TaskState.INTERRUPTED:
                await self.cancel(item.number)
        await self.scheduler.lift()

    async def hold(self, number: int) -> None:
        """Hold a waiting job; raises as `JobEditor.hold` does."""
        await self._shielded.do(self._editing.hold(number))
        await self.scheduler.lift()

    async def release(self, number: int, by: str, require: Callable[[JobRow], None] = lambda row: None) -> None:
        """Queue a held job; raises as `JobEditor.release` does."""
        await self._shielded.do(self._letting_begin(self._editing.release(number, by, require), self.scheduler.halts))

    async def move(self, number: int, beside: int, *, behind: bool) -> None:
        """Move a job before or `behind` another; raises as `JobEditor.move` does."""
        await self._shielded.do(self._editing.move(number, beside, behind=behind))

    async def move_to(self, number: int, *, last: bool) -> None:
        """Move a job to the first place, or with `last` to the last; raises as `JobEditor.move_to` does."""
        await self._shielded.do(self._editing.move_to(number, last=last))

    async def change(
        self,
        number: int,
        changes: Mapping[str, object],
        require: Callable[[JobRow], None] = lambda row: None,
        *,
        approved: bool = True,
    ) -> None:
        """Change a job; raises as `JobEditor.change` does. A job that is not `approved` is a proposal afterwards."""
        change = self._editing.change(number, changes, require, approved=approved)
        await self._shielded.do(self._letting_begin(change, self.scheduler.halts))

    def owner_ended(self, owner: str) -> None:
        """Start nothing more for an owner who may no longer queue jobs: a running job pauses after its current step.

        Waiting jobs of the owner become proposals, which a user approves or declines.
        """
        self.scheduler.driver_ended(owner)
        self._submitting.revocations[owner] += 1
        self._shielded.begin(self._editing.unapprove(owner))

    async def recover(
        self, choice: str, holding: bool | None, *, resume_queue: bool, by: str, job: int | None = None
    ) -> None:
        """Apply a user's choice to the interrupted job, which `job` names.

        Raises as `JobRecoverer.recover`, `NotConnected`, `Faulted`.

        With `resume_queue` the queue resumes afterwards, except after an abort.
        """
        if choice != RecoveryChoice.ABORT:
            self._require_able()
        go_on = resume_queue and choice != RecoveryChoice.ABORT
        decision = self._recovering.recover(choice, holding, resume_queue=go_on, by=by, job=job)
        await self._shielded.do(self._letting_begin(decision, self.scheduler.halts))
        await self.scheduler.lift()

    async def answer(self, answer: str, job: int | None = None, index: int | None = None) -> None:
        """Answer the question of the job under way; `job` and the `index` of its step name the question that is meant.

        Raises `NotFound` without one, or while another one is open; `InvalidValue` for an answer that it does not
        offer, `StorageFailed`.
        """
        item = self.scheduler.running
        question = None if item is None else item.question
        if item is None or question is None or question.answered.done():
            raise NotFound(what="open question", number="now")
        if job not in (None, item.number) or index not in (None, question.index):
            raise NotFound(what="open question", number=f"of job {job or item.number}, step {index or question.index}")
        require_choice(question, answer)
        await self._shielded.do(self._answered(item, question, answer))

    async def _answered(self, item: QueueEntry, question: OpenQuestion, answer: str) -> None:
        """Store an answer, then pass it on."""
        assert item.record is not None
        step = item.record.steps[question.index - 1]

        def propose() -> list[Transaction]:
            if item.question is not question or question.answered.done():
                raise NotFound(what="open question", number="now")
            changed = self._changes.step(item, step, replace(step.row, phase=answer), sure=False, quiet=True)
            return [changed, Transaction((), lambda: question.answered.set_result(answer))]

        await self._transactions.write(propose)
        self._controller.events.emit(QuestionAnswered(item.number, question.index, answer))

    async def preview(self, job: Job, start: Pose) -> JobPreview:
        """Return the preview of `job` from `start`; raises as `submit` for its contents; sends nothing."""
        return await self.computer.preview(job, start)

    async def inspect(self, job: Job, start: Pose, samples: int) -> JobInspection:
        """Return `job` in detail, from `start`; raises as `preview` does; sends nothing."""
        return await self.computer.inspect(job, start, samples)

    async def close(self, *, finish: bool = False) -> None:
        """End the running job, and return when the robot is at rest and everything is stored.

        With a durable journal the job under way is interrupted, after its current step with `finish`, and waiting jobs
        stay for the next start; otherwise all jobs are cancelled.
        """
        self.scheduler.shut()
        if not self._durable:
            await self._shielded.do(self._clear())
        await self.scheduler.close(interrupt=self._durable, finish=finish)
        if not self._durable:
            for item in [item for item in self._items if not item.row.state.ended]:
                await self._editing.cancel(item.number, Cancelled())
        await self._shielded.settle()
        await self.views.close()
        await self.ahead.close()
        await self._transactions.close()
        if not self._durable:
            await self.journal.close()
        for item in self._items:
            item.finish()

    def _noted(self, asked: SubmitRequest) -> SubmitRequest:
        """Return a request that has come now."""
        return replace(asked, revocations=self._submitting.revocations[asked.owner.name])

    async def _submit(
        self, written: StoredJob, asked: SubmitRequest, skipped: Sequence[StepRow] = (), halts: int | None = None
    ) -> int:
        """Store a job; if `halts` has changed since its request, a stop came meanwhile, and the queue pauses."""
        if not asked.options.held and not asked.proposal:
            self._require_able()
        before = self.scheduler.halts if halts is None else halts
        return await self._shielded.do(self._letting_begin(self._submitting.submit(written, asked, skipped), before))

    async def _letting_begin(self, change: Awaitable[T], halts: int) -> T:
        """Make a change after which jobs may begin; if `halts` has changed since its request, pause before any does."""
        result = await change
        if halts != self.scheduler.halts:
            self.scheduler.pause_by_itself(PauseReason.STOP)
        self.scheduler.wake()
        return result

    async def _clear(self) -> None:
        """Cancel all waiting jobs; announce their ends in the background, some at a time."""
        cleared = await self._editing.clear(Cancelled())
        if cleared is not None:
            self._shielded.begin(self._editing.tell_cleared(cleared))

    async def _cancel_waiting(self, item: QueueEntry) -> None:
        await self._editing.cancel(item.number, Cancelled(), unless=lambda: item is self.scheduler.running)
        await self.scheduler.lift()

    def _require_able(self) -> None:
        state = self._controller.state
        if state.mode is Mode.DISCONNECTED:
            raise NotConnected
        if state.mode is Mode.FAULT:
            raise Faulted(fault=state.fault.message if state.fault else "")


def _passed_over(tasks: Sequence[Task], steps: tuple[StepRow, ...], first: int) -> list[StepRow]:
    """Return the rows of the steps that a job leaves out if it begins at step `first`, with their answers.

    If it begins within a `then`, they include the `else`. Raises `InvalidValue` if a later step needs an answer that
    was not given.
    """
    answers = {step.index: step.phase for step in steps if isinstance(tasks[step.index - 1].action, AskOperator)}
    left_out = set(range(1, first))
    for task in tasks[: first - 1]:
        if task.branches and first in task.branch(THEN):
            left_out.update(task.branch(ELSE))
    for task in tasks[first - 1 :]:
        if task.index not in left_out and 0 < task.asked < first and not answers.get(task.asked):
            raise InvalidValue(
                key="from_step",
                value=first,
                reason=phrase("step {later} needs the answer to step {asked}", later=task.index, asked=task.asked),
            )
    return [StepRow(index, TaskState.SKIPPED, phase=answers.get(index, "")) for index in sorted(left_out)]


def _loop_time(after: float) -> str:
    return f"{asyncio.get_running_loop().time() + after:.3f}"
