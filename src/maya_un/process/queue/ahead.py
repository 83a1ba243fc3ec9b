"""The step after the running one, with its path, for those who watch. A worker plans it, when somebody looks."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import replace

from maya_un.errors import MayaError
from maya_un.events import Event, EventLog, StepAdvanced
from maya_un.process.computation import JobComputer
from maya_un.process.queue.entries import QueueEntry
from maya_un.process.queue.report import StepRecord
from maya_un.process.spec.statements import JobStatement
from maya_un.process.spec.tasks import Task
from maya_un.robot.plan_builder import Pose
from maya_un.robot.robot import Robot
from maya_un.schema.jobs import TaskState
from maya_un.schema.robot import NextStep

POINTS = 64
"""Maximum number of points of a path."""


class StepAhead:
    """Shows the next step of the job that `running` returns; `computer` computes its path."""

    def __init__(
        self, robot: Robot, computer: JobComputer, running: Callable[[], QueueEntry | None], events: EventLog
    ) -> None:
        self._robot = robot
        self._computer = computer
        self._running = running
        self._start: Pose | None = None
        self._shown: NextStep | None = None
        self._task: asyncio.Task[None] | None = None
        events.heard_by(self._hear)

    def look(self) -> NextStep | None:
        """Return the next step, None without one. Once its path is computed, a new object is returned."""
        item = self._running()
        record = None if item is None else item.record
        if item is None or record is None:
            return self._show(None)
        remaining = record.remaining
        for place, step in enumerate(remaining):
            if step.state is TaskState.QUEUED:
                shown = self._shown
                if shown is None or (shown.job, shown.step) != (item.number, step.task.index):
                    self._show(_described(item.number, step.task))
                    self._plan(remaining[: place + 1])
                return self._shown
        return self._show(None)

    async def close(self) -> None:
        """Stop the computation."""
        task = self._task
        self._show(None)
        if task is not None:
            await asyncio.wait({task})

    def _hear(self, event: Event) -> None:
        """Remember where a step begins: the robot is at rest there."""
        if isinstance(event, StepAdvanced) and event.state == TaskState.RUNNING and event.attempt is None:
            self._start = self._robot.pose

    def _show(self, step: NextStep | None) -> NextStep | None:
        if self._task is not None:
            self._task.cancel()
            self._task = None
        self._shown = step
        return step

    def _plan(self, steps: Sequence[StepRecord]) -> None:
        """Compute the path of the last of some steps; the others are under way."""
        start = self._robot.pose if len(steps) == 1 else self._start
        if start is not None:
            work = self._planned([step.task for step in steps], start)
            self._task = asyncio.get_running_loop().create_task(work, name="step ahead")

    async def _planned(self, tasks: Sequence[Task], start: Pose) -> None:
        try:
            points = await self._computer.path_ahead([task.action for task in tasks], start, POINTS)
        except MayaError:
            return
        if self._shown is not None:
            self._shown = replace(self._shown, points=points)


def _described(job: int, task: Task) -> NextStep:
    action = task.action
    if isinstance(action, JobStatement):
        return NextStep(job, task.index, task.label, action.command, None)
    target = action.argument.plain(action.value)
    if isinstance(target, list):
        x, y, z = target
        target = (x, y, z)
    assert target is None or isinstance(target, bool | tuple)
    return NextStep(job, task.index, task.label, action.command, target)
