"""When the jobs that wait will have ended, each worked out in the background from where the one before it ends.

Nothing of it is sent, and the loop is not held (`foresight`).
A prediction is computed again only if the job, or its start position, has changed.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import NamedTuple

from maya_un.errors import MayaError
from maya_un.process.foresight import JobComputer
from maya_un.process.homing_time import HomingTime
from maya_un.process.items import QueueEntries, QueueEntry
from maya_un.process.preview import JobOutlook
from maya_un.process.tasks import Task
from maya_un.process.written import Body
from maya_un.robot.plan import Pose
from maya_un.robot.protocol import Robot
from maya_un.schema.states import TaskState

AHEAD = 50
"""So many jobs that wait are predicted."""

_WHOSE = "forecast"


class Etas(NamedTuple):
    """When which jobs will have ended [s from now], and whether homings among them make that an estimate."""

    at: dict[int, float]
    estimated: bool


class _Known(NamedTuple):
    """The plan of a job, and the start position for which it was computed."""

    body: Body
    left: int
    start: Pose
    course: JobOutlook


class Forecast:
    """Predicts the first jobs that wait; `under_way` tells which job runs.

    Held jobs, and jobs that wait for them, do not count: nobody knows when they begin. How long a homing takes is
    estimated (`homing`).
    """

    def __init__(
        self,
        robot: Robot,
        items: QueueEntries,
        foresight: JobComputer,
        under_way: Callable[[], QueueEntry | None],
        homing: HomingTime,
    ) -> None:
        self._robot = robot
        self._items = items
        self._foresight = foresight
        self._under_way = under_way
        self._homing = homing
        self._known: dict[int, _Known] = {}
        self._task: asyncio.Task[None] | None = None
        self._stale = False
        self._closed = False

    def renew(self) -> None:
        """Work it out again, because something has changed."""
        self._stale = True
        if self._task is None and len(self._items.order) and not self._closed:
            self._task = asyncio.get_running_loop().create_task(self._work(), name="forecast")

    def predicted(self, item: QueueEntry) -> float | None:
        """Return how long a job will take [s], homings apart; None where it is not worked out, or would be refused."""
        known = self._known.get(item.number)
        if known is None or known.body is not item.row.body or known.course.preview.refusal is not None:
            return None
        return known.course.preview.duration

    def etas(self, now: float) -> Etas:
        """Return when jobs will have ended, from loop time `now` [s] on, at full speed; those that can be told."""
        passed, homings = 0.0, 0
        found: dict[int, float] = {}
        running = self._under_way()
        if running is not None:
            left = self._left(running, now)
            if left is None:
                return Etas(found, estimated=False)
            found[running.number] = passed = left
            homings = _homings_left(running)
        for item in self._in_turn(running):
            duration = self.predicted(item)
            if duration is None:
                break
            known = sum(step.duration is None for step in self._known[item.number].course.preview.steps)
            passed += duration + known * self._homing.seconds
            homings += known
            found[item.number] = passed
        return Etas(found, estimated=homings > 0)

    def _in_turn(self, running: QueueEntry | None) -> list[QueueEntry]:
        """Return the jobs that will begin without anybody's word, in that order: what is held does not."""
        ahead = [item for item in self._items.waiting(AHEAD) if item is not running]
        ahead = [item for item in ahead if item.row.state is not TaskState.HELD]
        over = set[int]() if running is None else {running.number}
        turns: list[QueueEntry] = []
        while (item := next((one for one in ahead if one.waits_for <= over), None)) is not None:
            turns.append(item)
            over.add(item.number)
            ahead.remove(item)
        return turns

    def _left(self, item: QueueEntry, now: float) -> float | None:
        """Return how long the job under way will still take [s], None before it has been checked."""
        record = item.record
        if record is None or record.preview is None:
            return None
        tally, step = record.tally, record.under_way
        current = 0.0
        if step is not None and not step.state.ended:
            current = self._homing.seconds if step.row.predicted is None else step.row.predicted
        whole = tally.predicted + tally.homings * self._homing.seconds
        return max(0.0, whole - min(now - record.current_since, current))

    async def close(self) -> None:
        """Work out nothing more."""
        self._closed = True
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait({self._task})

    async def _work(self) -> None:
        try:
            while self._stale:
                self._stale = False
                await self._ahead()
        finally:
            self._task = None

    async def _ahead(self) -> None:
        """Work out job after job; ends early where something changes, to begin again."""
        running = self._under_way()
        end = None if running is None or running.record is None else running.record.end
        pose = self._robot.pose if end is None else end
        waiting = [item for item in self._items.waiting(AHEAD) if item is not running]
        self._known = {item.number: self._known[item.number] for item in waiting if item.number in self._known}
        turns = self._in_turn(running)
        for item in turns:
            course = await self._course(item, pose)
            if self._stale or course is None:
                return
            pose = course.end
        for item in waiting:
            if item not in turns and (self._stale or await self._course(item, pose) is None):
                return

    async def _course(self, item: QueueEntry, start: Pose) -> JobOutlook | None:
        """Return what a job comes to from `start`, None where that cannot be told."""
        left = -1 if item.record is None else len(item.record.remaining)
        known = self._known.get(item.number)
        if known is not None and known.body is item.row.body and (known.left, known.start) == (left, start):
            return known.course
        try:
            course = await self._foresight.walk(await self._tasks(item), start, whose=_WHOSE)
        except MayaError:
            return None
        if not self._stale:
            self._known[item.number] = _Known(item.row.body, left, start, course)
        return course

    async def _tasks(self, item: QueueEntry) -> list[Task]:
        if item.record is not None:
            return [step.task for step in item.record.remaining]
        return list((await self._foresight.expanded(item.row.body, item.row.steps, whose=_WHOSE)).tasks)


def _homings_left(item: QueueEntry) -> int:
    """Return how many homings are ahead of the job under way, the one that goes on included."""
    return 0 if item.record is None else item.record.tally.homings
