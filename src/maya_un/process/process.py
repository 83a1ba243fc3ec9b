"""The queue of jobs: one at a time, in order, each checked whole before its first step, everything written down.

After a stop, a fault or the loss of the link the queue is paused: nothing starts by itself once somebody has said stop,
or once a fault is cleared (docs/decisions/0026-a-stop-pauses-the-queue.md). After a restart it waits for a person
(docs/decisions/0027-the-queue-is-durable.md). Here its parts are put together:

    submitting · editing     jobs come in, and are changed while they wait (items, order, options, written)
    turns · runner           whose turn it is, and one job from its check to its end (pausing, forecast)
    recovering · recovery    what an earlier run left, and what a person says of it
    ledger · changes         every change: written, made, told (journal)
    showing                  all of it as others see it (view, report)
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping

from maya_un.config import Config
from maya_un.controller.protocol import Controller
from maya_un.errors import Cancelled, Faulted, InvalidValue, NotConnected, StorageFailed, WrongState
from maya_un.process.computation import JobComputer
from maya_un.process.journal.protocol import JobRow, Journal, RequestOwner, StepRow
from maya_un.process.journal.sqlite import MemoryJournal
from maya_un.process.lease import ControlLease
from maya_un.process.queue.changes import Changes, Dates, QueuePauser, TransactionLog
from maya_un.process.queue.editing import DEFAULT_OPTIONS, JobEditor, JobSubmitter, SubmitRequest
from maya_un.process.queue.entries import QueueEntries, QueueEntry
from maya_un.process.queue.recovery import JobRecoverer, RecoveryChoice
from maya_un.process.queue.runner import RunnerContext
from maya_un.process.queue.scheduler import Scheduler, ShieldedTasks
from maya_un.process.queue.views import QueueViews
from maya_un.process.spec.job import Job
from maya_un.process.spec.poses import TaughtPlaces
from maya_un.process.spec.tasks import Recall, StoredJob, write_command
from maya_un.robot.plan_builder import Pose
from maya_un.robot.primitives import Primitive
from maya_un.robot.robot import Robot
from maya_un.schema.jobs import JobReport, TaskState
from maya_un.schema.previews import JobInspection, JobPreview
from maya_un.values import Mode
from maya_un.workers import WorkerSet

LOCAL = SubmitRequest(RequestOwner(), DEFAULT_OPTIONS)
"""A user of this machine, with default options."""


class Process:
    """Runs jobs on a robot; see the module for what pauses the queue.

    `turns` takes one job after the other and can be paused, `shown` tells how everything stands, `journal` keeps it.
    `recall` tells what has been taught, when a job names something that it does not explain itself. A journal that is
    given keeps what was not finished for the next start; without one everything ends with this process. Only whom the
    `lease` lets may begin. `dates` tells the date; without it dates are the loop's time. `speed` is how fast the loop's
    clock runs. Jobs are worked out by `staff`, in the running loop where there are none.
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
        self._ledger = ledger = TransactionLog(self.journal, controller.events)
        self._pausing = pausing = QueuePauser(ledger, controller.events, dates)
        self._whole = ShieldedTasks()
        changes = Changes(items, controller.events)
        self.foresight = foresight = JobComputer(robot, controller, self._grasp_height, recall, staff)
        shared = RunnerContext(robot, controller, ledger, changes, pausing, dates, foresight, self._durable)
        self._submitting = JobSubmitter(items, ledger, changes, dates)
        self._editing = JobEditor(items, ledger, changes, self._submitting, foresight)
        self._recovering = JobRecoverer(shared, items, changes, self._editing)
        self.turns = Scheduler(shared, items, self._whole, lease)
        self.shown = QueueViews(shared, items, self.turns, self._recovering, speed=speed)

    async def open(self) -> None:
        """Take up what the journal knows was not finished; nothing begins by itself. Raises `StorageFailed`."""
        known, waiting = await self.journal.left()
        self._submitting.next_id = known.next_id
        await self._recovering.take_up(known, waiting)

    async def check_storage(self) -> str:
        """Return why the journal cannot be written, "" if it can; if not, the queue pauses."""
        await self._whole.do(self._ledger.check())
        return self._ledger.failing

    @property
    def running(self) -> int | None:
        """Number of the job under way, None where there is none."""
        item = self.turns.running
        return None if item is None or item.row.state.ended else item.number

    async def submit(self, job: Job | Mapping[str, object] | bytes, asked: SubmitRequest = LOCAL) -> int:
        """Append a job and return its number, once it is written down; it starts when its turn comes.

        It may come as plain data or JSON. Raises `UnknownName` and `InvalidJob` for what it says, `FileUnreadable`
        where the book of taught places is needed and broken, `KeyReused`, `InvalidValue`, `StorageFailed`;
        `NotConnected` and `Faulted` while nothing can run, unless it is to be held.
        """
        halts = self.turns.halts
        return await self._submit(await self.foresight.written(job, whose=asked.owner.name), asked, halts=halts)

    async def command(self, command: Primitive | Mapping[str, object], asked: SubmitRequest = LOCAL) -> int:
        """Append a job of one primitive and return its number; raises as `submit` does, and `InvalidRequest`.

        While the queue is paused and nothing runs, a command without options for the queue is done at once: a person
        who sends "home" to a waiting robot means now.
        """
        written = write_command(command, self._grasp_height, self._recall)
        if (
            asked.options == DEFAULT_OPTIONS
            and not asked.proposal
            and self._pausing.paused
            and self.turns.running is None
        ):
            asked = SubmitRequest(asked.owner, asked.options, asked.key, direct=True)
        return await self._submit(written, asked)

    async def again(self, number: int, asked: SubmitRequest, from_step: int | None = None) -> int:
        """Queue a job that has ended once more, as a new one, from a step on; return the new number.

        Without `from_step` it begins at the first step that was not done, at the first of all if all were. Raises
        `NotFound`, `WrongState`, `InvalidValue` and as `submit` does.
        """
        halts = self.turns.halts
        row, steps = await self.shown.found(number)
        if not row.state.ended:
            raise WrongState(number=number, state=row.state.value, action="done again")
        expansion = await self.foresight.expanded(row.body)
        count = len(expansion.tasks)
        if from_step is not None and not 1 <= from_step <= count:
            raise InvalidValue(key="from_step", value=from_step, reason=f"the job has steps 1 to {count}")
        first = _first_undone(steps, count) if from_step is None else from_step
        return await self._submit(StoredJob(row.name, row.body, expansion), asked, first - 1, halts=halts)

    async def result(self, number: int) -> JobReport:
        """Wait until a job has ended, or this process is closed, and return its report; raises `NotFound`."""
        item = self._items.find(number)
        if item is not None and not self.turns.closed:
            await item.wait()
        return await self.shown.report(number)

    async def cancel(self, number: int) -> JobReport:
        """End a job early; one that runs stops on its path. Returns when it has ended.

        Raises `NotFound`, and `StorageFailed` where the end cannot be written: one that ran is at rest all the same.
        """
        item = self._items.find(number)
        if item is not None and item is not self.turns.running:
            await self._whole.do(self._cancel_waiting(item))
        if item is not None and item is self.turns.running:
            self.turns.end(item, Cancelled())
            await self.turns.left(item)
            if self._ledger.failing:
                raise StorageFailed(reason=self._ledger.failing)
        return await self.result(number)

    async def clear(self) -> None:
        """Cancel all that wait; raises `StorageFailed`."""
        await self._whole.do(self._clear())
        await self.turns.lift()

    def end_running(self) -> None:
        """Have the job under way end, braking on its path, and let none begin that waits."""
        self.turns.halt(Cancelled())
        if self.turns.running is not None:
            self.turns.end(self.turns.running, Cancelled())

    async def end_all(self) -> None:
        """Cancel what is under way and all that wait, those that have begun too; an interrupted one still waits.

        Returns when all have ended; raises `StorageFailed`.
        """
        self.end_running()
        await self.clear()
        for item in [item for item in self._items if not item.row.state.ended]:
            if item.row.state is not TaskState.INTERRUPTED:
                await self.cancel(item.number)
        await self.turns.lift()

    async def hold(self, number: int) -> None:
        """Put a job aside; raises as `JobEditor.hold` does."""
        await self._whole.do(self._editing.hold(number))
        await self.turns.lift()

    async def release(self, number: int, by: str, require: Callable[[JobRow], None] = lambda row: None) -> None:
        """Let a held job wait for its turn; raises as `JobEditor.release` does."""
        await self._whole.do(self._editing.release(number, by, require))
        self.turns.wake()

    async def move(self, number: int, beside: int, *, behind: bool) -> None:
        """Put a job before or `behind` another; raises as `JobEditor.move` does."""
        await self._whole.do(self._editing.move(number, beside, behind=behind))

    async def move_to(self, number: int, *, last: bool) -> None:
        """Put a job first, or `last`; raises as `JobEditor.move_to` does."""
        await self._whole.do(self._editing.move_to(number, last=last))

    async def change(self, number: int, changes: Mapping[str, object], *, approved: bool = True) -> None:
        """Change a job; raises as `JobEditor.change` does. A job that is not `approved` is a proposal afterwards."""
        await self._whole.do(self._editing.change(number, changes, approved=approved))
        self.turns.wake()

    def owner_ended(self, owner: str) -> None:
        """Let nothing begin of somebody who may not queue jobs any more: his job pauses after the step under way.

        Waiting jobs of the owner become proposals, which a person approves or declines.
        """
        self.turns.driver_ended(owner)
        self._whole.begin(self._editing.unapprove(owner))

    async def recover(self, choice: str, holding: bool | None, *, resume_queue: bool, by: str) -> None:
        """Do what a person chose for the interrupted job; raises as `JobRecoverer.recover`, `NotConnected`, `Faulted`.

        The queue goes on after it with `resume_queue`, though never by an abort.
        """
        if choice != RecoveryChoice.ABORT:
            self._require_able()
        go_on = resume_queue and choice != RecoveryChoice.ABORT
        await self._whole.do(self._recovering.recover(choice, holding, resume_queue=go_on, by=by))
        await self.turns.lift()
        self.turns.wake()

    async def preview(self, job: Job, start: Pose) -> JobPreview:
        """Return what `job` would be from `start`; raises as `submit` for what it says; sends nothing."""
        return await self.foresight.preview(job, start)

    async def inspect(self, job: Job, start: Pose, samples: int) -> JobInspection:
        """Return `job` in detail, from `start`; raises as `preview` does; sends nothing."""
        return await self.foresight.inspect(job, start, samples)

    async def close(self, *, finish: bool = False) -> None:
        """End what runs, and return when the robot is at rest and everything is written down.

        With a journal that outlives this process the job under way is interrupted, after the step under way where that
        is to `finish`, and what waits stays for the next start; otherwise all is cancelled.
        """
        self.turns.shut()
        if not self._durable:
            await self._whole.do(self._clear())
        await self.turns.close(interrupt=self._durable, finish=finish)
        if not self._durable:
            for item in [item for item in self._items if not item.row.state.ended]:
                await self._editing.cancel(item.number, Cancelled())
        await self._whole.settle()
        await self.shown.close()
        await self._ledger.close()
        if not self._durable:
            await self.journal.close()
        for item in self._items:
            item.finish()

    async def _submit(
        self, written: StoredJob, asked: SubmitRequest, skipped: int = 0, halts: int | None = None
    ) -> int:
        """Store a job; if `halts` has changed since its request, a stop came meanwhile, and it does not begin."""
        if not asked.options.held and not asked.proposal:
            self._require_able()
        before = self.turns.halts if halts is None else halts
        return await self._whole.do(self._taken_in(written, asked, skipped, before))

    async def _taken_in(self, written: StoredJob, asked: SubmitRequest, skipped: int, halts: int) -> int:
        number = await self._submitting.submit(written, asked, skipped)
        if halts != self.turns.halts:
            self.turns.pause_by_itself("stop")
        self.turns.wake()
        return number

    async def _clear(self) -> None:
        """Cancel all waiting jobs; their events follow afterwards, some at a time."""
        cleared = await self._editing.clear(Cancelled())
        if cleared is not None:
            self._whole.begin(self._editing.tell_cleared(cleared))

    async def _cancel_waiting(self, item: QueueEntry) -> None:
        await self._editing.cancel(item.number, Cancelled(), unless=lambda: item is self.turns.running)
        await self.turns.lift()

    def _require_able(self) -> None:
        state = self._controller.state
        if state.mode is Mode.DISCONNECTED:
            raise NotConnected
        if state.mode is Mode.FAULT:
            raise Faulted(fault=state.fault.message if state.fault else "")


def _first_undone(steps: tuple[StepRow, ...], count: int) -> int:
    """Return the first step that was not done, the first of all where all were; what was left out counts as done."""
    over = {step.index for step in steps if step.state is TaskState.DONE}
    skipped = {step.index for step in steps if step.state is TaskState.SKIPPED}
    begun = max(over, default=0)
    left = (n for n in range(1, count + 1) if n not in over and not (n in skipped and n < begun))
    return next(left, 1)


def _loop_time(after: float) -> str:
    return f"{asyncio.get_running_loop().time() + after:.3f}"
