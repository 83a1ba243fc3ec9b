"""The scheduler of the queue: runs one job after the other, and pauses the queue for a reason."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from dmc41x3.i18n import marked
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
from maya_un.process.queue.recovery import RecoveryChoice
from maya_un.process.queue.runner import JobEnd, JobRunner, RunnerContext
from maya_un.schema.jobs import OnFailure, TaskState
from maya_un.values import Mode, StopReport

T = TypeVar("T")


class ShieldedTasks:
    """Does coroutines to their end: cancelling who waits for one does not cancel it."""

    def __init__(self) -> None:
        self._tasks: set[asyncio.Task[Any]] = set()

    async def do(self, work: Coroutine[Any, Any, T]) -> T:
        """Run `work` to its end, even if the caller is cancelled. Return its result or raise its exception."""
        return await asyncio.shield(self.begin(work))

    def begin(self, work: Coroutine[Any, Any, T]) -> asyncio.Task[T]:
        """Do work for which nobody waits."""
        task = asyncio.get_running_loop().create_task(work, name="whole")
        self._tasks.add(task)
        task.add_done_callback(self._done)
        return task

    async def settle(self) -> None:
        """Wait until all that was begun is done."""
        while self._tasks:
            await asyncio.wait(self._tasks)

    def _done(self, task: asyncio.Task[Any]) -> None:
        self._tasks.discard(task)
        if not task.cancelled():
            task.exception()  # the caller may have left, and then nobody else notices it


_PASSED_ON = {"taken", "released", "handed over", "broken"}
"""Changes of the lease after which somebody drives, or whoever drove has said that he does no more."""


class Scheduler:
    """Takes job after job of `items` to a runner, whomever the `lease` lets.

    `halts` counts how often everything was told to stop.
    """

    def __init__(
        self, shared: RunnerContext, items: QueueEntries, whole: ShieldedTasks, lease: ControlLease | None
    ) -> None:
        self._shared = shared
        self._ledger = shared.ledger
        self._pausing = shared.pausing
        self._controller = shared.controller
        self._items = items
        self._whole = whole
        self._lease = lease
        self._runner: asyncio.Task[None] | None = None
        self._steps_allowed = 0
        self._closed = False
        self._aside = ""
        self._leaving: list[asyncio.Future[None]] = []
        self.running: QueueEntry | None = None
        self.halts = 0
        shared.ledger.on_failure = lambda: shared.pausing.pause("storage")
        shared.ledger.on_success = self._on_storage
        shared.controller.events.heard_by(self._hear)
        if lease is not None:
            lease.on_change.append(self._on_lease)

    @property
    def closed(self) -> bool:
        """Whether nothing begins any more, for the program ends."""
        return self._closed

    def wake(self) -> None:
        """Begin what may begin."""
        if self._runner is None and self._next() is not None:
            self._runner = asyncio.get_running_loop().create_task(self._run(), name="job queue")

    async def pause(self, by: str, *, now: bool) -> None:
        """Begin nothing more, and, where that is meant `now`, hold the motion under way on its path too.

        Raises `CannotPause` where that cannot be held, `NotConnected`, `Faulted`; `StorageFailed`, and pauses all the
        same.
        """
        running = self.running
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
        self.wake()

    async def step(self, by: str) -> None:
        """Do one step and pause again; where the queue runs, pause after the step under way.

        Raises as `resume`, and `Busy` while somebody drives past the queue.
        """
        self._require_decided()
        await self._ledger.flush()
        if not self._pausing.paused:
            self._pausing.pause("step", by)
        elif self.running is not None:
            await self._let_motion_go_on()
        elif self._aside:
            raise Busy(doing=self._aside)
        else:
            self._steps_allowed = 1
            self.wake()
            if self._runner is None:
                self._steps_allowed = 0

    def halt(self, error: MayaError, reason: str = "stop") -> None:
        """Begin nothing more: jobs that wait stay where they are, the one that runs begins no further step.

        A job in its check ends at once.
        """
        self.halts += 1
        self._steps_allowed = 0
        if self.running is not None:
            self.end(self.running, error, brake=self.running.checking)
        self.pause_by_itself(reason)

    def driver_ended(self, owner: str) -> None:
        """Pause after the step under way, where that is of a job of somebody who may not drive any more."""
        if self.running is not None and self.running.row.owner.name == owner:
            self._pausing.pause("driver")

    def pause_by_itself(self, reason: str) -> None:
        """Pause if a job waits that would begin; direct commands become ordinary jobs."""
        waited = self._items.no_longer_direct()
        if self._items.anything_waits or waited:
            self._pausing.pause(reason)

    async def lift(self) -> None:
        """End a pause that nobody asked for and that protects nothing any more."""
        if not self._needless():
            return
        try:
            await self._ledger.write(lambda: [self._pausing.resume("")] if self._needless() else [])
        except StorageFailed:
            return

    def _needless(self) -> bool:
        busy = self._closed or self.running is not None or self._items.anything_waits
        return self._pausing.by_itself and not busy and not self._ledger.failing

    def end(self, item: QueueEntry, error: MayaError, *, brake: bool = True) -> None:
        """Have the job end that is under way; a second time would cut short its wait for the axes to come to rest."""
        item.end_by = item.end_by or error
        if brake and item.moving and self._runner is not None and not self._runner.cancelling():
            self._runner.cancel()

    async def left(self, item: QueueEntry) -> None:
        """Wait until a job is under way no longer, be its end written or not."""
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
        """Let motion go on after a pause; raises as `Controller.resume` does."""
        await self._controller.resume()
        if self.running is not None:
            await self._mark(self.running, TaskState.RUNNING)

    @contextmanager
    def aside(self, command: str) -> Iterator[None]:
        """Begin no job while the block runs, which drives the robot past the queue; raises `Busy` while one does."""
        if self._aside:
            raise Busy(doing=self._aside)
        if self.running is not None and not self.running.row.state.ended:
            raise Busy(doing=f"job {self.running.number}")
        self._aside = command
        try:
            yield
        finally:
            self._aside = ""
            self.wake()

    def shut(self) -> None:
        """Begin nothing any more."""
        self._closed = True
        self._steps_allowed = 0

    async def close(self, *, interrupt: bool, finish: bool) -> None:
        """End the job under way, and return when that is written down: as interrupted or cancelled.

        It brakes on its path at once, or may `finish` its step first, unless that is held and would never end.
        """
        self.shut()
        running = self.running
        if running is not None:
            running.interrupt = interrupt
            self.end(running, Cancelled(), brake=not finish or running.row.state is TaskState.PAUSED)
        if self._runner is not None:
            await asyncio.wait({self._runner})

    def _require_decided(self) -> None:
        if self._items.interrupted is not None:
            question = marked("What should happen to the interrupted job?", "AnswerNeeded.question")
            raise AnswerNeeded(question=question, options=", ".join(RecoveryChoice))

    def _next(self) -> tuple[QueueEntry, int | None] | None:
        """Return whose turn it is, and how many steps he may do (None: all); None where nothing may begin."""
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
        """Take one job after the other until none may begin."""
        try:
            while (turn := self._next()) is not None:
                item, limit = turn
                self._steps_allowed = 0
                self.running = item
                await self._perform(item, limit)
                self._leave()
                await self.lift()
        finally:
            self._runner = None
            self._leave()

    def _leave(self) -> None:
        """Have nothing be under way, and tell who waits for that."""
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
            except Exception as defect:  # noqa: BLE001 - nothing may begin after it before somebody has looked
                context = {"message": f"the queue failed at job {item.number}", "exception": defect}
                asyncio.get_running_loop().call_exception_handler(context)
                self._items.no_longer_direct()
                self._pausing.pause("fault")

    @contextmanager
    def _driven(self, item: QueueEntry) -> Iterator[None]:
        """Have the job's owner drive while it runs; one that goes on under another driver is driven by him."""
        if self._lease is None:
            yield
            return
        owner, holder = item.row.owner, self._lease.holder
        if holder is not None and not self._lease.may_begin(owner.name):
            owner = RequestOwner(holder.name, holder.source)
        with self._lease.driving(owner.name, owner.source):
            yield

    def _follows(self, item: QueueEntry, ending: JobEnd) -> None:
        """Do what follows from how a job ended for those that wait."""
        if isinstance(ending.error, Stopped):
            self.halt(ending.error)
        elif isinstance(ending.error, MachineError | NotConnected | Faulted):
            self.halt(ending.error, "fault")
        elif ending.state is TaskState.FAILED and item.row.options.on_failure is OnFailure.PAUSE:
            self.pause_by_itself("failure")

    async def _mark(self, item: QueueEntry, state: TaskState) -> None:
        """Write that the job under way is held in its motion, or goes on."""
        before = TaskState.RUNNING if state is TaskState.PAUSED else TaskState.PAUSED

        def propose() -> list[Transaction]:
            wanted = item is self.running and item.row.state is before and not item.concludes
            return self._shared.changes.job(item, state) if wanted else []

        await self._whole.do(self._ledger.write(propose))

    async def _let_motion_go_on(self) -> None:
        held = self.running is not None and self.running.row.state is TaskState.PAUSED
        if held or self._controller.state.mode is Mode.PAUSED:
            await self.resume_motion()

    def _hear(self, event: Event) -> None:
        if isinstance(event, Trouble) and not self._closed:
            self.pause_by_itself("fault")

    def _on_storage(self) -> None:
        """Writing works again: a pause for that may have become needless."""
        if not self._closed:
            self._whole.begin(self.lift())

    def _on_lease(self, change: str) -> None:
        """Let those begin who may now; where a driver is lost, nothing goes on that he would have watched."""
        if self._closed:
            return
        if change not in _PASSED_ON and (self.running is not None or self._items.anything_waits):
            self._pausing.pause("driver")
        self.wake()
