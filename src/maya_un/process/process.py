"""The queue of jobs: one at a time, in order, each checked whole before its first step, everything written down.

After a stop, a fault or the loss of the link the queue is paused: nothing starts by itself once somebody has said stop,
or once a fault is cleared (docs/decisions/0026-a-stop-pauses-the-queue.md). After a restart it waits for a person
(docs/decisions/0027-the-queue-is-durable.md). What the parts do stands in their modules; here they are put together.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from maya_un.config import Config
from maya_un.controller.protocol import Controller
from maya_un.errors import (
    AnswerNeeded,
    Cancelled,
    Faulted,
    InvalidValue,
    MachineError,
    MayaError,
    NotConnected,
    NotFound,
    Stopped,
    StorageFailed,
    WrongState,
)
from maya_un.events import Event, Kind
from maya_un.process.changes import Changes
from maya_un.process.editing import Editing
from maya_un.process.forecast import AHEAD, Forecast
from maya_un.process.inspection import JobInspection, inspect_job
from maya_un.process.items import Item, Items
from maya_un.process.job import Job
from maya_un.process.journal.memory import MemoryJournal
from maya_un.process.journal.protocol import Journal
from maya_un.process.journal.rows import JobRow, OnFailure, Owner, StepRow
from maya_un.process.lease import Lease
from maya_un.process.ledger import Entry, Ledger
from maya_un.process.names import Recall
from maya_un.process.options import ORDINARY
from maya_un.process.pausing import Dates, Pausing
from maya_un.process.preview import JobPreview, preview_job
from maya_un.process.recovering import Recovering
from maya_un.process.recovery import Chosen
from maya_un.process.report import JobRecord, JobReport, line_of, report_of
from maya_un.process.runner import Ending, Runner, Shared
from maya_un.process.states import TaskState
from maya_un.process.submitting import Asked, Submitting
from maya_un.process.tasks import Expansion, expand
from maya_un.process.taught import Taught
from maya_un.process.view import JobLine, QueueMode, QueueView, Recovery
from maya_un.process.whole import Whole
from maya_un.process.written import Written, as_written, expanded, write_job, write_wish
from maya_un.robot.plan import Pose
from maya_un.robot.primitives import Primitive
from maya_un.robot.robot import Robot
from maya_un.values import Mode, StopReport

SHOWN = AHEAD
"""So many jobs that wait are shown: those that are predicted."""

LOCAL = Asked(Owner(), ORDINARY)
"""Whoever sits at the machine, and says nothing about how."""

_TROUBLE = {Kind.FAULT, Kind.LIMIT, Kind.ESTOP, Kind.DISCONNECTED}


class Process:
    """Runs jobs on a robot; see the module for what pauses the queue.

    `recall` tells what has been taught, when a job names something that it does not explain itself. A `durable`
    `journal` keeps what was not finished for the next start; without one everything ends with this process. Only whom
    the `lease` lets may begin. `dates` tells the date; without it dates are the loop's time. `speed` is how fast the
    loop's clock runs.
    """

    def __init__(
        self,
        robot: Robot,
        controller: Controller,
        config: Config,
        recall: Recall = Taught,
        *,
        journal: Journal | None = None,
        lease: Lease | None = None,
        dates: Dates | None = None,
        speed: float = 1.0,
    ) -> None:
        self._robot = robot
        self._recall = recall
        self._controller = controller
        self._grasp_height = config.cell.grasp_height
        self._durable = journal is not None
        self._lease = lease
        dates = _loop_time if dates is None else dates
        events = controller.events
        self._journal: Journal = MemoryJournal() if journal is None else journal
        self._items = Items()
        self._ledger = Ledger(self._journal, events)
        self._ledger.on_failure = lambda: self._pausing.pause("storage")
        self._ledger.on_success = self._on_storage
        self._pausing = Pausing(self._ledger, events, dates)
        changes = Changes(self._items, events)
        self._submitting = Submitting(self._items, self._ledger, changes, dates)
        self._editing = Editing(self._items, self._ledger, changes, self._submitting, self._grasp_height, self._recall)
        self._shared = Shared(
            robot, controller, self._ledger, changes, self._pausing, dates, self._grasp_height, self._durable
        )
        self._recovering = Recovering(self._shared, self._items, changes, self._editing)
        self._forecast = Forecast(robot, self._items, self._grasp_height, lambda: self._running)
        self._items.on_change = self._forecast.renew
        self._dates = dates
        self._speed = speed
        self._changes = changes
        self._whole = Whole()
        self._running: Item | None = None
        self._runner: asyncio.Task[None] | None = None
        self._steps_allowed = 0
        self._halts = 0
        self._closed = False
        events.heard_by(self._hear)
        if lease is not None:
            lease.on_change.append(self._on_lease)

    async def open(self) -> None:
        """Take up what the journal knows was not finished; nothing begins by itself. Raises `StorageFailed`."""
        known = await self._journal.unfinished()
        self._submitting.next_id = known.next_id
        await self._recovering.take_up(known)

    @property
    def journal(self) -> Journal:
        """What keeps everything."""
        return self._journal

    @property
    def running(self) -> int | None:
        """Number of the job under way, None where there is none."""
        item = self._running
        return None if item is None or item.row.state.ended else item.number

    async def submit(self, job: Job, asked: Asked = LOCAL) -> int:
        """Append a job and return its number, once it is written down; it starts when its turn comes.

        Raises `UnknownName` and `InvalidJob` for what it says, `FileUnreadable` where the book of taught places is
        needed and broken, `KeyReused`, `InvalidValue`, `StorageFailed`; `NotConnected` and `Faulted` while nothing can
        run, unless it is to be held.
        """
        return await self._submit(write_job(job, self._grasp_height, self._recall), asked)

    async def wish(self, wish: Primitive | Mapping[str, object], asked: Asked = LOCAL) -> int:
        """Append a job of one primitive and return its number; raises as `submit` does, and `InvalidRequest`.

        While the queue is paused and nothing is under way, a wish that says nothing about how it is to be queued is
        done at once: whoever says "home" to a robot that waits for him means now.
        """
        written = write_wish(wish, self._grasp_height, self._recall)
        if asked.options == ORDINARY and not asked.proposal and self._pausing.paused and self._running is None:
            asked = Asked(asked.owner, asked.options, asked.key, direct=True)
        return await self._submit(written, asked)

    async def again(self, number: int, asked: Asked, from_step: int | None = None) -> int:
        """Queue a job that has ended once more, as a new one, from a step on; return the new number.

        Without `from_step` it begins at the first step that was not done, at the first of all if all were. Raises
        `NotFound`, `WrongState`, `InvalidValue` and as `submit` does.
        """
        row, steps = await self._found(number)
        if not row.state.ended:
            raise WrongState(number=number, state=row.state.value, wish="done again")
        expansion = expanded(row.body, self._grasp_height)
        count = len(expansion.tasks)
        if from_step is not None and not 1 <= from_step <= count:
            raise InvalidValue(key="from_step", value=from_step, reason=f"the job has steps 1 to {count}")
        first = _first_undone(steps, count) if from_step is None else from_step
        return await self._submit(Written(row.name, row.body, expansion), asked, first - 1)

    def line(self, number: int) -> JobLine:
        """Return the line of a job that has not ended, or ended lately; raises `NotFound`."""
        return self._line(self._items.get(number))

    async def found_line(self, number: int) -> JobLine:
        """Return the line of any job, also of one long ended; raises `NotFound`."""
        row, _ = await self._found(number)
        return self.line_of(row)

    def lines(self) -> list[JobLine]:
        """Return a line for every job that has not ended, or ended lately, in the order they came."""
        return [self._line(item) for item in sorted(self._items, key=lambda item: item.number)]

    def line_of(self, row: JobRow) -> JobLine:
        """Return the line of a kept job, as it is now where more is known than was kept."""
        item = self._items.find(row.id)
        return line_of(row) if item is None else self._line(item)

    def first_lines(self) -> tuple[JobLine, ...]:
        """Return the job under way and the first that wait."""
        running = [] if self._running is None else [self._running]
        waiting = [item for item in self._items.waiting(SHOWN) if item not in running]
        etas = self._etas()
        return tuple(self._line(item, etas) for item in (*running, *waiting))

    def view(self) -> QueueView:
        """Return the queue now."""
        row, running, etas = self._pausing.row, self._running, self._etas()
        waiting = tuple(self._line(item, etas) for item in self._items.waiting(SHOWN) if item is not running)
        return QueueView(
            mode=self.mode,
            reason=row.reason,
            by=row.by,
            since=row.since,
            running=None if running is None else self._line(running, etas),
            waiting=waiting,
            counts=self._items.counts,
            finish_at=self._dates(max(etas.values()) / self._speed) if etas else None,
            recovery=self.recovery(),
        )

    @property
    def mode(self) -> QueueMode:
        """Whether jobs begin."""
        if not self._pausing.paused:
            return QueueMode.RUNNING
        ends = self._running is not None and not self._running.direct
        return QueueMode.PAUSING if ends else QueueMode.PAUSED

    @property
    def reason(self) -> str:
        """Why the queue is paused, "" while it runs."""
        return self._pausing.row.reason

    def recovery(self) -> Recovery | None:
        """Return the interrupted job that waits for a person."""
        return self._recovering.view()

    async def report(self, number: int) -> JobReport:
        """Return what is known of a job now, also of one long ended; raises `NotFound`."""
        item = self._items.find(number)
        if item is not None:
            return self._report(item)
        row, steps = await self._found(number)
        record = JobRecord.kept(expanded(row.body, self._grasp_height), steps)
        record.skip_rest()
        return report_of(line_of(row), record)

    async def body(self, number: int) -> dict[str, Any]:
        """Return a job as it was written; raises `NotFound`."""
        row, _ = await self._found(number)
        return as_written(row.body)

    async def result(self, number: int) -> JobReport:
        """Wait until a job has ended, or this process is closed, and return its report; raises `NotFound`."""
        item = self._items.find(number)
        if item is not None and not self._closed:
            await item.wait()
        return await self.report(number)

    async def cancel(self, number: int) -> JobReport:
        """End a job early; one that runs stops on its path. Returns when it has ended.

        Raises `NotFound`, `StorageFailed`.
        """
        item = self._items.find(number)
        if item is not None and not item.row.state.ended:
            if item is self._running:
                self._end(item, Cancelled())
            else:
                await self._whole.do(self._cancel_waiting(item))
        return await self.result(number)

    async def _cancel_waiting(self, item: Item) -> None:
        await self._editing.cancel(item.number, Cancelled())
        if item is self._running:
            self._end(item, Cancelled())
        await self._lift()

    async def pause(self, by: str, *, now: bool) -> None:
        """Begin nothing more, and, where that is meant `now`, hold the motion under way on its path too.

        Raises `CannotPause` where that cannot be held, `NotConnected`, `Faulted`; `StorageFailed`, and pauses all the
        same.
        """
        running = self._running
        if now and running is not None:
            await self._controller.pause(ahead=True)
        self._steps_allowed = 0
        self._pausing.pause("asked", by)
        if now and running is not None:
            await self._mark(running, TaskState.PAUSED)
        await self._ledger.flush()

    async def resume(self, by: str) -> None:
        """Begin jobs again, and let a motion go on that is held; raises `AnswerNeeded`, `StorageFailed`."""
        self._require_decided()
        await self._whole.do(self._ledger.write(lambda: [self._pausing.resume(by)] if self._pausing.paused else []))
        await self._let_motion_go_on()
        self._wake()

    async def step(self, by: str) -> None:
        """Do one step and pause again; where the queue runs, pause after the step under way."""
        self._require_decided()
        await self._ledger.flush()
        if not self._pausing.paused:
            self._pausing.pause("step", by)
            return
        if self._running is None:
            self._steps_allowed = 1
            self._wake()
            self._steps_allowed = self._steps_allowed if self._runner is not None else 0
        await self._let_motion_go_on()

    async def clear(self) -> None:
        """Cancel all that wait; raises `StorageFailed`."""
        await self._whole.do(self._editing.clear(Cancelled()))
        await self._lift()

    async def hold(self, number: int) -> None:
        """Put a job aside; raises as `Editing.hold` does."""
        await self._whole.do(self._editing.hold(number))
        await self._lift()

    async def release(self, number: int, by: str) -> None:
        """Let a held job wait for its turn; raises as `Editing.release` does."""
        await self._whole.do(self._editing.release(number, by))
        self._wake()

    async def move(self, number: int, beside: int, *, behind: bool) -> None:
        """Put a job before or `behind` another; raises as `Editing.move` does."""
        await self._whole.do(self._editing.move(number, beside, behind=behind))

    async def move_to(self, number: int, *, last: bool) -> None:
        """Put a job first, or `last`; raises as `Editing.move_to` does."""
        await self._whole.do(self._editing.move_to(number, last=last))

    async def change(self, number: int, changes: Mapping[str, object], *, approved: bool = True) -> None:
        """Change a job; raises as `Editing.change` does. What is not `approved` is a proposal after it."""
        await self._whole.do(self._editing.change(number, changes, approved=approved))
        self._wake()

    async def recover(self, choice: str, holding: bool | None, *, resume_queue: bool, by: str) -> None:
        """Do what a person chose for the interrupted job; raises as `Recovering.recover`, `NotConnected`, `Faulted`.

        The queue goes on after it with `resume_queue`, though never by an abort.
        """
        if choice != Chosen.ABORT:
            self._require_able()
        go_on = resume_queue and choice != Chosen.ABORT
        await self._whole.do(self._recovering.recover(choice, holding, resume_queue=go_on, by=by))
        await self._lift()
        self._wake()

    def halt(self, error: MayaError, reason: str = "stop") -> None:
        """Begin nothing more: jobs that wait stay where they are, the one that runs begins no further step."""
        self._halts += 1
        self._steps_allowed = 0
        if self._running is not None:
            self._running.end_by = self._running.end_by or error
        self._pause_by_itself(reason)

    async def pause_motion(self) -> StopReport:
        """Brake on the path and hold all motion, also of the job under way; raises as `Controller.pause` does."""
        running = self._running
        report = await self._controller.pause(ahead=running is not None)
        if running is not None:
            await self._mark(running, TaskState.PAUSED)
        return report

    async def resume_motion(self) -> None:
        """Let motion go on after a pause; raises as `Controller.resume` does."""
        await self._controller.resume()
        if self._running is not None:
            await self._mark(self._running, TaskState.RUNNING)

    async def preview(self, job: Job, start: Pose) -> JobPreview:
        """Return what `job` would be from `start`; raises as `submit` for what it says; sends nothing."""
        return await preview_job(self._robot, self._expanded(job).tasks, start)

    async def inspect(self, job: Job, start: Pose, samples: int) -> JobInspection:
        """Return `job` in detail, from `start`; raises as `preview` does; sends nothing."""
        return await inspect_job(self._robot, self._expanded(job).tasks, start, samples)

    async def close(self, *, finish: bool = False) -> None:
        """End what runs, and return when the robot is at rest and everything is written down.

        With a durable journal the job under way is interrupted, after the step under way where that is to `finish`, and
        what waits stays for the next start; otherwise all is cancelled.
        """
        self._closed = True
        self._steps_allowed = 0
        if not self._durable:
            await self._whole.do(self._editing.clear(Cancelled()))
        if self._running is not None:
            self._running.interrupt = self._durable
            self._end(self._running, Cancelled(), brake=not finish)
        if self._runner is not None:
            await asyncio.wait({self._runner})
        if not self._durable:
            for item in self._items.waiting(len(self._items.order) + 2):
                await self._editing.cancel(item.number, Cancelled())
        await self._whole.settle()
        await self._forecast.close()
        await self._ledger.close()
        for item in self._items:
            if item.ended is not None:
                item.ended.set()

    def _expanded(self, job: Job) -> Expansion:
        return expand(job, self._grasp_height, self._recall)

    async def _submit(self, written: Written, asked: Asked, skipped: int = 0) -> int:
        if not asked.options.held and not asked.proposal:
            self._require_able()
        number, _ = await self._whole.do(self._taken_in(written, asked, skipped))
        return number

    async def _taken_in(self, written: Written, asked: Asked, skipped: int) -> tuple[int, bool]:
        """Keep a job; one that was asked for before a stop does not begin after it."""
        halts = self._halts
        taken = await self._submitting.submit(written, asked, skipped)
        if halts != self._halts and not self._closed:
            self._pause_by_itself("stop")
        self._wake()
        return taken

    async def _found(self, number: int) -> tuple[JobRow, tuple[StepRow, ...]]:
        """Return a job with its steps, from memory or from the journal; raises `NotFound`."""
        item = self._items.find(number)
        if item is not None:
            return item.row, () if item.record is None else tuple(step.row for step in item.record.steps)
        known = await self._journal.job(number)
        if known is None:
            raise NotFound(what="job", number=number)
        return known

    def _require_able(self) -> None:
        state = self._controller.state
        if state.mode is Mode.DISCONNECTED:
            raise NotConnected
        if state.mode is Mode.FAULT:
            raise Faulted(fault=state.fault.message if state.fault else "")

    def _require_decided(self) -> None:
        recovery = self._items.interrupted
        if recovery is not None:
            question = f"what becomes of job {recovery.number}, which was interrupted?"
            raise AnswerNeeded(question=question, options=", ".join(Chosen))

    def _etas(self) -> dict[int, float]:
        """Return when jobs will have ended [s, loop time from now], none while the queue is paused."""
        if self._pausing.paused:
            return {}
        ratio = self._controller.state.override
        etas = self._forecast.etas(asyncio.get_running_loop().time())
        return {number: eta / ratio for number, eta in etas.items()}

    def _line(self, item: Item, etas: Mapping[int, float] = MappingProxyType({})) -> JobLine:
        done = None if item.record is None else item.record.done
        place = self._items.order.place_of(item.number)
        line = line_of(item.row, position=place, done=done, eta=etas.get(item.number))
        if line.predicted is None and not item.row.state.ended:
            line = replace(line, predicted=self._forecast.predicted(item))
        return line

    def _report(self, item: Item) -> JobReport:
        record = item.record
        if record is None:
            record = JobRecord(expanded(item.row.body, self._grasp_height))
            if item.row.state.ended:
                record.skip_rest()
        return report_of(self._line(item), record)

    def _turn(self) -> tuple[Item, int | None] | None:
        """Return whose turn it is, and how many steps it may do (None: all), or None where nothing may begin."""
        if self._closed:
            return None
        may_begin = self._may_begin
        direct = self._items.next_direct(may_begin)
        if direct is not None:
            return direct, None
        if self._pausing.paused and not self._steps_allowed:
            return None
        item = self._items.going_on() or self._items.next(may_begin)
        return None if item is None else (item, self._steps_allowed or None)

    def _may_begin(self, owner: str) -> bool:
        return self._lease is None or self._lease.may_begin(owner)

    def _wake(self) -> None:
        """Begin what may begin."""
        if self._runner is None and self._turn() is not None:
            self._runner = asyncio.get_running_loop().create_task(self._run(), name="job queue")

    async def _run(self) -> None:
        """Take one job after the other until none may begin."""
        try:
            while (turn := self._turn()) is not None:
                item, limit = turn
                self._steps_allowed = 0
                self._running = item
                await self._perform(item, limit)
                self._running = None
                await self._lift()
        finally:
            self._running = self._runner = None

    async def _perform(self, item: Item, limit: int | None) -> None:
        item.end_by = None
        with self._driven(item):
            try:
                await Runner(self._shared, item, limit, self._follows).run()
            except StorageFailed:
                self._items.no_longer_direct()

    @contextmanager
    def _driven(self, item: Item) -> Iterator[None]:
        """Have the job's owner drive while it runs; one that goes on under another driver is driven by him."""
        if self._lease is None:
            yield
            return
        owner, holder = item.row.owner, self._lease.holder
        if holder is not None and not self._lease.may_begin(owner.name):
            owner = Owner(holder.name, holder.source)
        with self._lease.driving(owner.name, owner.source):
            yield

    def _follows(self, item: Item, ending: Ending) -> None:
        """Do what follows for those that wait."""
        if isinstance(ending.error, Stopped):
            self.halt(ending.error)
        elif isinstance(ending.error, MachineError | NotConnected | Faulted):
            self.halt(ending.error, "fault")
        elif ending.state is TaskState.FAILED and item.row.options.on_failure is OnFailure.PAUSE:
            self._pause_by_itself("failure")

    def _pause_by_itself(self, reason: str, by: str = "") -> None:
        """Pause where anything waits that would begin; wishes for now are over, and wait as any other job."""
        waited = self._items.no_longer_direct()
        if self._items.anything_waits or waited:
            self._pausing.pause(reason, by)

    async def _lift(self) -> None:
        """End a pause that nobody asked for and that protects nothing any more."""

        def propose() -> list[Entry]:
            needless = self._pausing.by_itself and not self._items.anything_waits and self._running is None
            return [self._pausing.resume("")] if needless and not self._ledger.failing else []

        if self._pausing.by_itself and not self._items.anything_waits and not self._closed:
            try:
                await self._ledger.write(propose)
            except StorageFailed:
                return

    def _end(self, item: Item, error: MayaError, *, brake: bool = True) -> None:
        """Have the job end that is under way; a second time would cut short its wait for the axes to come to rest."""
        item.end_by = item.end_by or error
        if brake and item.moving and self._runner is not None and not self._runner.cancelling():
            self._runner.cancel()

    async def _mark(self, item: Item, state: TaskState) -> None:
        """Write that the job under way is held in its motion, or goes on."""
        before = TaskState.RUNNING if state is TaskState.PAUSED else TaskState.PAUSED

        def propose() -> list[Entry]:
            return self._changes.job(item, state) if item is self._running and item.row.state is before else []

        await self._whole.do(self._ledger.write(propose))

    async def _let_motion_go_on(self) -> None:
        if self._controller.state.mode is Mode.PAUSED or (
            self._running is not None and self._running.row.state is TaskState.PAUSED
        ):
            await self.resume_motion()

    def _hear(self, event: Event) -> None:
        if event.kind in _TROUBLE and not self._closed:
            self._pause_by_itself("fault")

    def _on_storage(self) -> None:
        """What could not be written is: a pause for that may have become needless."""
        if not self._closed:
            self._whole.begin(self._lift())

    def _on_lease(self, change: str) -> None:
        """Let those begin who may now; where a driver is lost, nothing goes on that he would have watched."""
        if self._closed:
            return
        if change == "expired" and (self._running is not None or self._items.anything_waits):
            self._pausing.pause("driver")
        self._wake()


def _first_undone(steps: tuple[StepRow, ...], count: int) -> int:
    """Return the first step that was not done, the first of all where all were; what was left out counts as done."""
    over = {step.index for step in steps if step.state is TaskState.DONE}
    skipped = {step.index for step in steps if step.state is TaskState.SKIPPED}
    begun = max(over, default=0)
    left = (n for n in range(1, count + 1) if n not in over and not (n in skipped and n < begun))
    return next(left, 1)


def _loop_time(after: float) -> str:
    return f"{asyncio.get_running_loop().time() + after:.3f}"
