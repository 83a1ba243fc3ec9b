"""Jobs that an earlier run left: load them when the queue opens, show them, and let a person decide."""

from __future__ import annotations

from dataclasses import replace

from maya_un.errors import Cancelled, MayaError, NotFound
from maya_un.process.journal.protocol import JobRow, QueueRow, StepRow, Unfinished
from maya_un.process.queue.changes import AUTOMATIC_REASONS, Changes
from maya_un.process.queue.editing import JobEditor
from maya_un.process.queue.entries import QueueEntries, QueueEntry
from maya_un.process.queue.recovery import RecoveryDecision, RecoverySituation, choices, decide
from maya_un.process.queue.report import JobRecord, StepRecord
from maya_un.process.queue.runner import RunnerContext
from maya_un.process.queue.transaction_log import Transaction
from maya_un.process.queue_order import QueueOrder
from maya_un.process.spec.tasks import Task
from maya_un.robot.gripper import GripperState
from maya_un.robot.plan import Pose
from maya_un.schema.jobs import Recovery, TaskState
from maya_un.values import Mode

_UNDER_WAY = {TaskState.RUNNING, TaskState.PAUSED}


class JobRecoverer:
    """Deals with jobs that were interrupted, one after the other."""

    def __init__(self, shared: RunnerContext, items: QueueEntries, changes: Changes, editing: JobEditor) -> None:
        self._shared = shared
        self._items = items
        self._changes = changes
        self._editing = editing

    async def take_up(self, known: Unfinished, waiting: QueueOrder | None = None) -> None:
        """Restore all unfinished jobs; `waiting` has the places of the waiting jobs.

        Running jobs become interrupted, and no job begins by itself. Raises `StorageFailed`.
        """
        if waiting is not None:
            self._items.take_up(waiting)
        numbers = {row.id for row in known.jobs}
        for row in known.jobs:
            steps = known.steps.get(row.id, ())
            waits_for = frozenset(one for one in row.options.depends_on if one in numbers or one in self._items.order)
            self._items.add(QueueEntry(row, await self._record(row, steps), waits_for))
        interrupted = [item for item in self._items if item.row.state in _UNDER_WAY]

        def propose() -> list[Transaction]:
            entries = [entry for item in interrupted for entry in self._interrupted(item)]
            return [*entries, *self._mode(known.queue, bool(interrupted))]

        await self._shared.ledger.write(propose)

    def view(self) -> Recovery | None:
        """Return the job that waits for a person, with where the machine is now, None where none does."""
        item = self._items.interrupted
        if item is None:
            return None
        step, situation = self._situation(item)
        return Recovery(
            job=item.number,
            name=item.row.name,
            index=0 if step is None else step.task.index,
            step="" if step is None else step.task.label,
            phase="" if step is None else step.row.phase,
            since=self._shared.pausing.row.since,
            holding=situation.holding,
            state=self._shared.controller.state,
            choices=choices(situation),
        )

    async def recover(self, choice: str, holding: bool | None, *, resume_queue: bool, by: str) -> None:
        """Do what a person chose for the interrupted job.

        Raises `NotFound`, `InvalidValue`, `AnswerNeeded`, `StorageFailed`, and what the motions that remain are refused
        with; then everything is as it was.
        """
        item = self._items.interrupted
        if item is None:
            raise NotFound(what="interrupted job", number="now")
        step, situation = self._situation(item)
        decision = decide(situation, choice, holding)
        if decision.goes_on:
            ahead = await self._ahead(item, step, decision)
            await self._shared.foresight.require(ahead, self._pose(decision.holding))

        def propose() -> list[Transaction]:
            if item.row.state is not TaskState.INTERRUPTED:
                raise NotFound(what="interrupted job", number=item.number)
            return [*self._decided(item, step, decision), *self._resumed(item, by, resume_queue=resume_queue)]

        await self._shared.ledger.write(propose)
        if decision.holding is not None and self._shared.controller.state.gripper_closed:
            self._shared.robot.seen(holding=decision.holding)

    async def _record(self, row: JobRow, steps: tuple[StepRow, ...]) -> JobRecord | None:
        """Return what is known of a job's steps, None where none has begun or nobody can tell what they were."""
        if not steps:
            return None
        try:
            return JobRecord.kept(await self._shared.foresight.expanded_anyway(row.body), steps)
        except MayaError:
            return None

    def _interrupted(self, item: QueueEntry) -> list[Transaction]:
        steps = [] if item.record is None else item.record.steps
        under_way = [step for step in steps if step.state in _UNDER_WAY]
        entries = [self._changes.step(item, step, step.become(TaskState.INTERRUPTED)) for step in under_way]
        return [*entries, *self._changes.job(item, TaskState.INTERRUPTED)]

    def _mode(self, before: QueueRow, interrupted: bool) -> list[Transaction]:
        """Return the queue's mode after a restart: what waits, waits for a person."""
        pausing = self._shared.pausing
        pausing.take_up(before)
        if before.paused and not interrupted:
            if self._items.anything_waits or before.reason not in AUTOMATIC_REASONS:
                return []
            return [pausing.resume("")]
        if self._items.anything_waits or interrupted:
            pausing.take_up(QueueRow())
            pausing.pause("restart")
        return []

    def _situation(self, item: QueueEntry) -> tuple[StepRecord | None, RecoverySituation]:
        """Return the step that was under way, and all that a choice depends on."""
        holding = self._holding()
        if item.record is None:
            return None, RecoverySituation("", (), holding)
        step = next((one for one in item.record.steps if one.state is TaskState.INTERRUPTED), None)
        rest = tuple(one.task.primitive.command for one in item.record.remaining if one is not step)
        return step, RecoverySituation("" if step is None else step.task.primitive.command, rest, holding)

    def _holding(self) -> bool | None:
        """Return what the machine tells of the gripper: only that it is open is certain, and only while it answers."""
        state = self._shared.controller.state
        return None if state.mode is Mode.DISCONNECTED or state.gripper_closed else False

    async def _ahead(self, item: QueueEntry, step: StepRecord | None, decision: RecoveryDecision) -> list[Task]:
        """Return what would be done."""
        record = item.record or JobRecord(await self._shared.foresight.expanded(item.row.body))
        left_out = step if decision.step is not TaskState.QUEUED else None
        return [one.task for one in record.remaining if one is not left_out]

    def _pose(self, holding: bool | None) -> Pose:
        """Return where the robot is, with the gripper as a person has seen it."""
        pose = self._shared.robot.pose
        if holding is None or pose.gripper is GripperState.OPEN:
            return pose
        return pose._replace(gripper=GripperState.CLOSED if holding else GripperState.FOUND)

    def _decided(self, item: QueueEntry, step: StepRecord | None, decision: RecoveryDecision) -> list[Transaction]:
        if not decision.goes_on:
            return [entry._replace(sure=False) for entry in self._editing.cancelled(item, Cancelled())]
        entries = self._changes.job(item, TaskState.QUEUED)
        if step is not None and decision.step is not None:
            row = replace(step.become(decision.step), phase="" if decision.step is TaskState.QUEUED else step.row.phase)
            entries = [self._changes.step(item, step, row), *entries]
        return [entry._replace(sure=False) for entry in entries]

    def _resumed(self, item: QueueEntry, by: str, *, resume_queue: bool) -> list[Transaction]:
        """Return the change that lets the queue go on, unless another job waits for a person."""
        others = self._items.waiting(2)
        if not resume_queue or any(one is not item and one.row.state is TaskState.INTERRUPTED for one in others):
            return []
        return [self._shared.pausing.resume(by)]
