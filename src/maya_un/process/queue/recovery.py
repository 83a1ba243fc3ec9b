"""Recover an interrupted job: the choices, and the effect of each of them.

The choices are computed without side effects; only a user chooses.

The program cannot know whether the gripper holds a part: the power may have failed at any time. So the user must answer
wherever the next steps depend on it. Only one fact comes from the machine: an open gripper is empty.

Jobs that an earlier run left are loaded when the queue opens, shown, and left to a user's decision.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

from dmc41x3.i18n import phrase
from maya_un.errors import AnswerNeeded, Cancelled, InvalidValue, MayaError, NotFound
from maya_un.process.journal.protocol import JobRow, QueueRow, StepRow, Unfinished
from maya_un.process.queue.changes import Changes, Transaction
from maya_un.process.queue.editing import JobEditor
from maya_un.process.queue.entries import QueueEntries, QueueEntry
from maya_un.process.queue.report import JobRecord, StepRecord
from maya_un.process.queue.runner import RunnerContext
from maya_un.process.queue_order import QueueOrder
from maya_un.process.spec.statements import Condition
from maya_un.process.spec.tasks import ACTIONS, Task
from maya_un.robot.plan_builder import Pose
from maya_un.robot.primitives.primitive import PartEffect
from maya_un.schema.choices import RecoveryChoice
from maya_un.schema.jobs import Choice, PauseReason, Recovery, TaskState
from maya_un.values import GripperState, Mode

QUESTION = phrase("Does the gripper hold a part?")


@dataclass(frozen=True, slots=True)
class RecoverySituation:
    """An interrupted job: the `command` of the interrupted step ("" between two), and those of the steps after it.

    `holding` is False if the machine reports an open gripper, None if only a user can see. The interrupted step is
    `needed` if later steps depend on its outcome: a question or an `if`.
    """

    command: str
    rest: tuple[str, ...]
    holding: bool | None
    needed: bool = False


class RecoveryDecision(NamedTuple):
    """The effect of a choice: the step's next state (None if no step was running), and whether the job continues.

    `holding` is whether the gripper holds a part, None if it does not matter.
    """

    step: TaskState | None
    goes_on: bool
    holding: bool | None


def choices(situation: RecoverySituation) -> tuple[Choice, ...]:
    """Return the available choices."""
    step = situation.command
    if not step:
        meanings = {RecoveryChoice.RESUME: "go on with the next step", RecoveryChoice.ABORT: "end the job as cancelled"}
    else:
        meanings = {
            RecoveryChoice.RESUME: _resumed(step),
            RecoveryChoice.REDO: f"do the {step} again",
            RecoveryChoice.SKIP: f"leave the {step} out and go on with the next step",
            RecoveryChoice.ABORT: "end the job as cancelled",
        }
        if situation.needed:
            del meanings[RecoveryChoice.SKIP]
    return tuple(Choice(one.value, meaning, _needs_answer(situation, one)) for one, meaning in meanings.items())


def decide(situation: RecoverySituation, choice: str, holding: bool | None) -> RecoveryDecision:
    """Return the effect of `choice`; `holding` is the user's answer whether the gripper holds a part (None: no answer).

    Raises `InvalidValue` for an unavailable choice or a contradiction of the machine, and `AnswerNeeded`.
    """
    offered = [one.name for one in choices(situation)]
    if choice not in offered:
        raise InvalidValue(
            key="choice",
            value=repr(str(choice)),
            reason=phrase("it must be one of {choices}", choices=", ".join(offered)),
        )
    if holding and situation.holding is False:
        raise InvalidValue(key="holding", value="true", reason="the gripper is open")
    chosen = RecoveryChoice(choice)
    if holding is None and _needs_answer(situation, chosen):
        raise AnswerNeeded(
            question=QUESTION,
            options=phrase("add `--holding yes` or `--holding no`; over HTTP, holding: true or false"),
        )
    known = situation.holding if holding is None else holding
    if chosen is RecoveryChoice.ABORT:
        return RecoveryDecision(TaskState.CANCELLED if situation.command else None, goes_on=False, holding=known)
    if not situation.command:
        return RecoveryDecision(None, goes_on=True, holding=known)
    if chosen is RecoveryChoice.SKIP:
        return RecoveryDecision(TaskState.SKIPPED, goes_on=True, holding=known)
    done = chosen is RecoveryChoice.RESUME and known is _held_after(situation.command)
    return RecoveryDecision(TaskState.DONE if done else TaskState.QUEUED, goes_on=True, holding=known)


def _held_after(command: str) -> bool | str:
    """Return whether the gripper holds a part after a step, "whatever" if the step does not determine it."""
    return {PartEffect.TAKES: True, PartEffect.PUTS: False}.get(ACTIONS[command].part, "whatever")


def _resumed(command: str) -> str:
    match ACTIONS[command].part:
        case PartEffect.TAKES:
            return f"with the part in the gripper the {command} counts as done, otherwise do it again"
        case PartEffect.PUTS:
            return f"with the gripper empty the {command} counts as done, otherwise do it again"
        case _:
            return f"do the {command} again, which does no harm, and go on"


def _needs_answer(situation: RecoverySituation, chosen: RecoveryChoice) -> bool:
    """Whether a user must answer what the gripper holds: the next steps depend on it and the machine cannot know.

    An open gripper does not prove that a place has happened: it may have opened when the power failed.
    """
    if chosen is RecoveryChoice.ABORT:
        return False
    if chosen is RecoveryChoice.RESUME and situation.command and ACTIONS[situation.command].part is PartEffect.PUTS:
        return True
    again = chosen in {RecoveryChoice.RESUME, RecoveryChoice.REDO} and situation.command
    return situation.holding is None and _matters([*([situation.command] if again else []), *situation.rest])


def _matters(commands: Iterable[str]) -> bool:
    """Whether these steps depend on what the gripper holds: the first step that concerns a part takes or puts one."""
    commands = list(commands)
    parts = [ACTIONS[command].part for command in commands]
    if Condition.command in commands:  # the first such step depends on a branch
        return bool({PartEffect.TAKES, PartEffect.PUTS} & set(parts))
    return next((part for part in parts if part is not PartEffect.NONE), None) in {PartEffect.TAKES, PartEffect.PUTS}


_UNDER_WAY = {TaskState.RUNNING, TaskState.PAUSED}


class JobRecoverer:
    """Handles interrupted jobs, one after the other."""

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

        await self._shared.transactions.write(propose)

    def view(self) -> Recovery | None:
        """Return the interrupted job that waits for a user, with the machine's present state, or None."""
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

    async def recover(
        self, choice: str, holding: bool | None, *, resume_queue: bool, by: str, job: int | None = None
    ) -> None:
        """Apply a user's choice to the interrupted job, which `job` names.

        Raises `NotFound`, `InvalidValue`, `AnswerNeeded`, `StorageFailed`, and the refusal of a remaining motion; after
        an error nothing has changed.
        """
        item = self._items.interrupted
        if item is None:
            raise NotFound(what="interrupted job", number="now")
        if job not in (None, item.number):
            raise NotFound(what="interrupted job", number=job)
        step, situation = self._situation(item)
        decision = decide(situation, choice, holding)
        if decision.goes_on:
            ahead = await self._ahead(item, step, decision)
            await self._shared.computer.require(ahead, self._pose(decision.holding))

        def propose() -> list[Transaction]:
            if item.row.state is not TaskState.INTERRUPTED:
                raise NotFound(what="interrupted job", number=item.number)
            return [*self._decided(item, step, decision), *self._resumed(item, by, resume_queue=resume_queue)]

        await self._shared.transactions.write(propose)
        if decision.holding is not None and self._shared.controller.state.gripper_closed:
            self._shared.robot.seen(holding=decision.holding)

    async def _record(self, row: JobRow, steps: tuple[StepRow, ...]) -> JobRecord | None:
        """Return the record of a job's steps, None if none has begun or the stored job cannot be expanded."""
        if not steps:
            return None
        try:
            return JobRecord.kept(await self._shared.computer.expanded_anyway(row.body), steps)
        except MayaError:
            return None

    def _interrupted(self, item: QueueEntry) -> list[Transaction]:
        steps = [] if item.record is None else item.record.steps
        under_way = [step for step in steps if step.state in _UNDER_WAY]
        entries = [self._changes.step(item, step, step.become(TaskState.INTERRUPTED)) for step in under_way]
        return [*entries, *self._changes.job(item, TaskState.INTERRUPTED)]

    def _mode(self, before: QueueRow, interrupted: bool) -> list[Transaction]:
        """Return the change of the queue's mode after a restart; if jobs wait, pause until a user resumes."""
        pausing = self._shared.pausing
        pausing.take_up(before)
        if before.paused and not interrupted:
            if self._items.anything_waits or not before.automatic:
                return []
            return [pausing.resume("")]
        if self._items.anything_waits or interrupted:
            pausing.take_up(QueueRow())
            pausing.pause(PauseReason.RESTART)
        return []

    def _situation(self, item: QueueEntry) -> tuple[StepRecord | None, RecoverySituation]:
        """Return the interrupted step, None without one, and the situation on which a choice depends."""
        holding = self._holding()
        if item.record is None:
            return None, RecoverySituation("", (), holding)
        step = next((one for one in item.record.steps if one.state is TaskState.INTERRUPTED), None)
        others = [one.task for one in item.record.remaining if one is not step]
        rest = tuple(task.action.command for task in others)
        if step is None:
            return None, RecoverySituation("", rest, holding)
        needed = bool(step.task.branches) or any(task.asked == step.task.index for task in others)
        return step, RecoverySituation(step.task.action.command, rest, holding, needed)

    def _holding(self) -> bool | None:
        """Return False if the controller answers and the gripper is open, else None: only an open one is certain."""
        state = self._shared.controller.state
        return None if state.mode is Mode.DISCONNECTED or state.gripper_closed else False

    async def _ahead(self, item: QueueEntry, step: StepRecord | None, decision: RecoveryDecision) -> list[Task]:
        """Return the tasks that the decision leaves to do."""
        record = item.record or await JobRecord.new(await self._shared.computer.expanded(item.row.body))
        left_out = step if decision.step is not TaskState.QUEUED else None
        return [one.task for one in record.remaining if one is not left_out]

    def _pose(self, holding: bool | None) -> Pose:
        """Return the robot's pose, with the gripper as the user has seen it."""
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
        """Return the change that resumes the queue, unless another interrupted job waits for a user."""
        others = self._items.waiting(2)
        if not resume_queue or any(one is not item and one.row.state is TaskState.INTERRUPTED for one in others):
            return []
        return [self._shared.pausing.resume(by)]
