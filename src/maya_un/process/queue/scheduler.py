"""The scheduler of the queue: runs one job after the other, and pauses the queue for a reason."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from dmc41x3.i18n import phrase
from maya_un.errors import (
    AnswerNeeded,
    Busy,
    Cancelled,
    Faulted,
    MachineError,
    MayaError,
    NotConnected,
    Stopped,
    StorageFailed,
)
from maya_un.events import Event, Trouble
from maya_un.process.journal.protocol import RequestOwner
from maya_un.process.lease import ControlLease
from maya_un.process.queue.changes import Transaction
from maya_un.process.queue.entries import QueueEntries, QueueEntry
from maya_un.process.queue.runner import JobEnd, JobRunner, RunnerContext
from maya_un.schema.choices import OnFailure, RecoveryChoice
from maya_un.schema.jobs import PauseReason, TaskState
from maya_un.values import Mode, StopReport

T = TypeVar("T")


class ShieldedTasks:
    """Runs coroutines to their end: cancelling the caller that waits for one does not cancel it."""

    def __init__(self) -> None:
        self._tasks: set[asyncio.Task[Any]] = set()

    async def do(self, work: Coroutine[Any, Any, T]) -> T:
        """Run `work` to its end, even if the caller is cancelled. Return its result or raise its exception."""
        return await asyncio.shield(self.begin(work))

    def begin(self, work: Coroutine[Any, Any, T]) -> asyncio.Task[T]:
        """Start work in the background, and return its task."""
        task = asyncio.get_running_loop().create_task(work, name="whole")
        self._tasks.add(task)
        task.add_done_callback(self._done)
        return task

    async def settle(self) -> None:
        """Wait until all started work is done."""
        while self._tasks:
            await asyncio.wait(self._tasks)

    def _done(self, task: asyncio.Task[Any]) -> None:
        self._tasks.discard(task)
        if not task.cancelled():
            task.exception()  # the caller may be gone: mark the exception as retrieved


_PASSED_ON = {"taken", "released", "handed over", "broken"}
"""Changes of the lease by a user's decision: another user drives, or the driver has released it."""


class Scheduler:
    """Passes one job of `items` after the other to a runner, if the `lease` permits its owner.

    `halts` counts the stops of all jobs.
    """

    def __init__(
        self, shared: RunnerContext, items: QueueEntries, shielded: ShieldedTasks, lease: ControlLease | None
    ) -> None:
        self._shared = shared
        self._transactions = shared.transactions
        self._pausing = shared.pausing
        self._controller = shared.controller
        self._items = items
        self._shielded = shielded
        self._lease = lease
        self._runner: asyncio.Task[None] | None = None
        self._steps_allowed = 0
        self._closed = False
        self._aside = ""
        self._leaving: list[asyncio.Future[None]] = []
        self.running: QueueEntry | None = None
        self.halts = 0
        shared.transactions.on_failure = lambda: shared.pausing.pause(PauseReason.STORAGE)
        shared.transactions.on_success = self._on_storage
        shared.controller.events.heard_by(self._hear)
        if lease is not None:
            lease.on_change.append(self._on_lease)

    @property
    def closed(self) -> bool:
        """Whether no job begins any more, because the program ends."""
        return self._closed

    def wake(self) -> None:
        """Begin the next job if one may begin."""
        if self._runner is None and self._next() is not None:
            self._runner = asyncio.get_running_loop().create_task(self._run(), name="job queue")

    async def pause(self, by: str, *, now: bool) -> None:
        """Begin nothing more; with `now`, also hold the motion under way on its path.

        Raises `CannotPause` if the motion cannot be held, `NotConnected`, `Faulted`. Raises `StorageFailed` too, but is
        paused even then.
        """
        running = self.running
        if now and running is not None:
            await self._controller.pause(ahead=True)
        self._steps_allowed = 0
        self._pausing.pause(PauseReason.ASKED, by)
        if now and running is not None:
            await self._mark(running, TaskState.PAUSED)
        await self._transactions.flush()

    async def resume(self, by: str) -> None:
        """Resume the queue, and continue a held motion; raises `AnswerNeeded`, `StorageFailed`."""
        self._require_decided()
        await self._shielded.do(self._resumed(by, self.halts))

    async def _resumed(self, by: str, halts: int) -> None:
        await self._transactions.write(lambda: [self._pausing.resume(by)] if self._pausing.paused else [])
        if halts == self.halts:
            await self._let_motion_go_on()
            self.wake()
        else:
            self.pause_by_itself(PauseReason.STOP)

    async def step(self, by: str) -> None:
        """Do one step and pause again; if the queue runs, pause after the step under way.

        Raises as `resume`, `Busy` while a command drives past the queue, and `Stopped` if a stop comes before the step.
        """
        self._require_decided()
        halts = self.halts
        await self._transactions.flush()
        if halts != self.halts:
            raise Stopped
        if not self._pausing.paused:
            self._pausing.pause(PauseReason.STEP, by)
        elif self.running is not None:
            await self._let_motion_go_on()
        elif self._aside:
            raise Busy(doing=self._aside)
        else:
            self._steps_allowed = 1
            self.wake()
            if self._runner is None:
                self._steps_allowed = 0

    def halt(self, error: MayaError, reason: PauseReason = PauseReason.STOP) -> None:
        """Begin nothing more: waiting jobs keep their places, the running job begins no further step.

        A job in its check or in a wait ends at once.
        """
        self.halts += 1
        self._steps_allowed = 0
        if self.running is not None:
            self.end(self.running, error, brake=self.running.checking or self.running.waiting)
        self.pause_by_itself(reason)

    def driver_ended(self, owner: str) -> None:
        """Pause after the step under way, if its job belongs to an owner who may no longer drive."""
        if self.running is not None and self.running.row.owner.name == owner:
            self._pausing.pause(PauseReason.DRIVER)

    def pause_by_itself(self, reason: PauseReason) -> None:
        """Pause if a job waits that would begin; direct commands become ordinary jobs."""
        waited = self._items.no_longer_direct()
        if self._items.anything_waits or waited:
            self._pausing.pause(reason)

    async def lift(self) -> None:
        """End a pause that no user requested and that protects nothing any more."""
        if not self._needless():
            return
        try:
            await self._transactions.write(lambda: [self._pausing.resume("")] if self._needless() else [])
        except StorageFailed:
            return

    def _needless(self) -> bool:
        busy = self._closed or self.running is not None or self._items.anything_waits
        return self._pausing.by_itself and not busy and not self._transactions.failing

    def end(self, item: QueueEntry, error: MayaError, *, brake: bool = True) -> None:
        """End the job under way; it is cancelled only once, because a second time would cut short its wait for rest."""
        item.end_by = item.end_by or error
        if brake and item.moving and self._runner is not None and not self._runner.cancelling():
            self._runner.cancel()

    async def left(self, item: QueueEntry) -> None:
        """Wait until a job is no longer under way, whether or not its end is written."""
        while self.running is item:
            leaving: asyncio.Future[None] = asyncio.get_running_loop().create_future()
            self._leaving.append(leaving)
            await leaving

    async def pause_motion(self) -> StopReport:
        """Brake on the path and hold all motion, also of the job under way; raises as `Controller.pause` does."""
        running = self.running
        report = await self._controller.pause(ahead=running is not None)
        if running is not None:
            await self._mark(running, TaskState.PAUSED)
        return report

    async def resume_motion(self) -> None:
        """Continue motion after a pause; raises as `Controller.resume` does."""
        await self._controller.resume()
        if self.running is not None:
            await self._mark(self.running, TaskState.RUNNING)

    @contextmanager
    def aside(self, command: str) -> Iterator[None]:
        """Begin no job while the block drives the robot past the queue.

        If a stop ends the block, the queue pauses, so the stop begins no job. Raises `Busy` while another block or a
        job runs.
        """
        if self._aside:
            raise Busy(doing=self._aside)
        if self.running is not None and not self.running.row.state.ended:
            raise Busy(doing=phrase("job {number:d}", number=self.running.number))
        self._aside = command
        try:
            yield
        except Stopped:
            self.pause_by_itself(PauseReason.STOP)
            raise
        finally:
            self._aside = ""
            self.wake()

    def shut(self) -> None:
        """Begin no job any more."""
        self._closed = True
        self._steps_allowed = 0

    async def close(self, *, interrupt: bool, finish: bool) -> None:
        """End the job under way, as interrupted or cancelled, and return when that is written.

        The job brakes on its path at once. With `finish` it first finishes its step, unless that is held or waits and
        would never end.
        """
        self.shut()
        running = self.running
        if running is not None:
            running.interrupt = interrupt
            self.end(running, Cancelled(), brake=not finish or running.waiting or running.row.state is TaskState.PAUSED)
        if self._runner is not None:
            await asyncio.wait({self._runner})

    def _require_decided(self) -> None:
        if self._items.interrupted is not None:
            raise AnswerNeeded(question="What should happen to the interrupted job?", options=", ".join(RecoveryChoice))

    def _next(self) -> tuple[QueueEntry, int | None] | None:
        """Return the next job and the limit of its steps (None: all), or None if no job may begin."""
        if self._closed or self._aside:
            return None
        direct = self._items.next_direct(self._may_begin)
        if direct is not None:
            return direct, None
        if self._pausing.paused and not self._steps_allowed:
            return None
        item = self._items.going_on() or self._items.next(self._may_begin)
        return None if item is None else (item, self._steps_allowed or None)

    def _may_begin(self, owner: str) -> bool:
        return self._lease is None or self._lease.may_begin(owner)

    async def _run(self) -> None:
        """Run one job after the other until none may begin."""
        try:
            while (turn := self._next()) is not None:
                item, limit = turn
                self._steps_allowed = 0
                self.running = item
                item.under_way = True
                await self._perform(item, limit)
                self._leave()
                await self.lift()
        finally:
            self._runner = None
            self._leave()

    def _leave(self) -> None:
        """Mark that no job is under way, and wake the tasks that wait for that."""
        if self.running is not None:
            self.running.under_way = False
        self.running = None
        leaving, self._leaving = self._leaving, []
        for one in leaving:
            if not one.done():
                one.set_result(None)

    async def _perform(self, item: QueueEntry, limit: int | None) -> None:
        item.end_by, item.concludes = None, False
        with self._driven(item):
            try:
                await JobRunner(self._shared, item, limit, self._follows).run()
            except StorageFailed:
                self._items.no_longer_direct()
            except Exception as defect:  # noqa: BLE001 - no job may begin after it before a user has looked
                context = {"message": f"the queue failed at job {item.number}", "exception": defect}
                asyncio.get_running_loop().call_exception_handler(context)
                self._items.no_longer_direct()
                self._pausing.pause(PauseReason.FAULT)

    @contextmanager
    def _driven(self, item: QueueEntry) -> Iterator[None]:
        """Make the job's owner the driver while it runs.

        A job that continues under another driver is driven by that user.
        """
        if self._lease is None:
            yield
            return
        owner, holder = item.row.owner, self._lease.holder
        if holder is not None and not self._lease.may_begin(owner.name):
            owner = RequestOwner(holder.name, holder.source)
        with self._lease.driving(owner.name, owner.source):
            yield

    def _follows(self, item: QueueEntry, ending: JobEnd) -> None:
        """Apply the consequences of a job's end for the waiting jobs."""
        if isinstance(ending.error, Stopped):
            self.halt(ending.error)
        elif isinstance(ending.error, MachineError | NotConnected | Faulted):
            self.halt(ending.error, PauseReason.FAULT)
        elif ending.state is TaskState.FAILED and item.row.options.on_failure is OnFailure.PAUSE:
            self.pause_by_itself(PauseReason.FAILURE)

    async def _mark(self, item: QueueEntry, state: TaskState) -> None:
        """Write that the job under way is held in its motion, or continues."""
        before = TaskState.RUNNING if state is TaskState.PAUSED else TaskState.PAUSED

        def propose() -> list[Transaction]:
            wanted = item is self.running and item.row.state is before and not item.concludes
            return self._shared.changes.job(item, state) if wanted else []

        await self._shielded.do(self._transactions.write(propose))

    async def _let_motion_go_on(self) -> None:
        held = self.running is not None and self.running.row.state is TaskState.PAUSED
        if held or self._controller.state.mode is Mode.PAUSED:
            await self.resume_motion()

    def _hear(self, event: Event) -> None:
        if isinstance(event, Trouble) and not self._closed:
            self.pause_by_itself(PauseReason.FAULT)

    def _on_storage(self) -> None:
        """End a pause for storage that has become needless, because writing works again."""
        if not self._closed:
            self._shielded.begin(self.lift())

    def _on_lease(self, change: str) -> None:
        """Begin the jobs that the new holder permits.

        If a driver is lost, pause, because that user no longer watches.
        """
        if self._closed:
            return
        if change not in _PASSED_ON and (self.running is not None or self._items.anything_waits):
            self._pausing.pause(PauseReason.DRIVER)
        self.wake()
