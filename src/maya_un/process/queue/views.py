"""Views of the queue: lines, queue views and reports, with the expected end of each waiting job.

`Forecast` computes the ends in the background, each from where the job before it ends. It computes an end again only if
the job or its start has changed. Nothing is sent, and the loop is not blocked (`process.computation`). No plan contains
the duration of a homing: `HomingTime` takes it from the last homing, and before the first one from a bound.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Literal, NamedTuple

from maya_un.config import Config, Units
from maya_un.errors import MayaError, NotFound
from maya_un.events import (
    DatumGiven,
    Event,
    EventLog,
    GripperClosed,
    GripperOpened,
    HomingBegun,
    HomingDone,
    HomingNeeded,
    SpeedChanged,
)
from maya_un.process.computation import REPORT, JobComputer
from maya_un.process.journal.protocol import Filter, JobRow, Journal, StepRow
from maya_un.process.outlook import JobOutlook
from maya_un.process.queue.entries import QueueEntries, QueueEntry
from maya_un.process.queue.recovery import JobRecoverer
from maya_un.process.queue.report import JobSnapshot, Slices, line_of, report_of
from maya_un.process.queue.runner import RunnerContext
from maya_un.process.queue.scheduler import Scheduler
from maya_un.process.spec.statements import AskOperator
from maya_un.process.spec.stored import Body, as_written
from maya_un.process.spec.tasks import Task
from maya_un.robot.plan_builder import Pose
from maya_un.robot.robot import Robot
from maya_un.schema.jobs import JobLine, JobReport, OperatorQuestion, PauseReason, QueueMode, QueueView, TaskState
from maya_un.schema.previews import JobPreview
from maya_un.values import Notice

_STROKES = 2.0
"""Number of times that each line passes its stroke, with the ways between the switches and the slow approaches."""


class HomingTime:
    """Measures homings; `seconds` is the estimated duration of the next one [s], at any speed override."""

    def __init__(self, config: Config, events: EventLog) -> None:
        self.seconds = _bound(config)
        self._began: float | None = None
        events.heard_by(self._hear)

    def _hear(self, event: Event) -> None:
        if isinstance(event, HomingBegun):
            self._began = event.time
        elif isinstance(event, HomingDone) and self._began is not None:
            self.seconds = event.time - self._began
            self._began = None


def _bound(config: Config) -> float:
    a, b, c = config.axes.a, config.axes.b, config.axes.c
    lines = (b.maximum - b.minimum) + (c.maximum - c.minimum)
    turn = (a.maximum - a.minimum) * Units.of(config).per_unit[0] / a.speed_counts
    return _STROKES * lines / config.homing.speed + turn


AHEAD = 50
"""Number of waiting jobs that are predicted."""

_WHOSE = "forecast"

_STARTS = (HomingDone, HomingNeeded, DatumGiven, GripperOpened, GripperClosed)
"""Events that change whether a job can begin."""


class Etas(NamedTuple):
    """The expected ends of jobs [s from now], and whether homings make them an estimate."""

    at: dict[int, float]
    estimated: bool


class _Known(NamedTuple):
    """The outlook of a job, and the start pose for which it was computed."""

    body: Body
    left: int
    start: Pose
    course: JobOutlook


class Forecast:
    """Predicts the first waiting jobs; `under_way` returns the running job.

    Held jobs, and jobs that wait for them, do not count, because their start is unknown. The duration of a homing is
    estimated (`homing`).
    """

    def __init__(
        self,
        robot: Robot,
        items: QueueEntries,
        computer: JobComputer,
        under_way: Callable[[], QueueEntry | None],
        homing: HomingTime,
    ) -> None:
        self._robot = robot
        self._items = items
        self._computer = computer
        self._under_way = under_way
        self._homing = homing
        self._known: dict[int, _Known] = {}
        self._ratio = 1.0
        self._task: asyncio.Task[None] | None = None
        self._stale = False
        self._closed = False

    def renew(self) -> None:
        """Compute the forecast again, because something has changed."""
        self._stale = True
        if self._task is None and len(self._items.order) and not self._closed:
            self._task = asyncio.get_running_loop().create_task(self._work(), name="forecast")

    def predicted(self, item: QueueEntry) -> float | None:
        """Return how long a job will take [s], without homings; None if it is not computed, or would be refused."""
        preview = self._preview(item)
        return None if preview is None or preview.refusal is not None else preview.duration

    def obstacle(self, item: QueueEntry) -> Notice | None:
        """Return the error with which a waiting job would fail as things are, None without one or if unknown."""
        preview = None if item is self._under_way() else self._preview(item)
        return None if preview is None or preview.refusal is None else preview.refusal.notice

    def _preview(self, item: QueueEntry) -> JobPreview | None:
        known = self._known.get(item.number)
        return None if known is None or known.body is not item.row.body else known.course.preview

    def hear(self, event: Event) -> None:
        """After a change of the speed override, count the motion under way as if it had always had the new one.

        A job may begin in one state of the robot only, so compute again what waits when that state has changed.
        """
        if isinstance(event, _STARTS) and self._under_way() is None:
            self.renew()
        if not isinstance(event, SpeedChanged):
            return
        running = self._under_way()
        record = None if running is None else running.record
        if record is not None and record.under_way is not None and record.under_way.row.predicted is not None:
            record.current_since = event.time - (event.time - record.current_since) * self._ratio / event.ratio
        self._ratio = event.ratio

    def etas(self, now: float, ratio: float) -> Etas:
        """Return the expected ends of jobs, from loop time `now` [s] on, as far as they are known.

        They hold for the speed override `ratio`. It does not change homings, which have speeds of their own.
        """
        passed, homings = 0.0, 0
        found: dict[int, float] = {}
        running = self._under_way()
        if running is not None:
            left = self._left(running, now, ratio)
            if left is None:
                return Etas(found, estimated=False)
            found[running.number] = passed = left
            homings = _homings_left(running)
        for item in self._in_turn(running):
            duration = self.predicted(item)
            if duration is None:
                break
            known = sum(step.duration is None for step in self._known[item.number].course.preview.steps)
            passed += duration / ratio + known * self._homing.seconds
            homings += known
            found[item.number] = passed
        return Etas(found, estimated=homings > 0)

    def _in_turn(self, running: QueueEntry | None) -> list[QueueEntry]:
        """Return the jobs that will begin without a user's action, in that order; held jobs will not."""
        ahead = [item for item in self._items.waiting(AHEAD) if item is not running]
        ahead = [item for item in ahead if item.row.state is not TaskState.HELD]
        over = set[int]() if running is None else {running.number}
        turns: list[QueueEntry] = []
        while (item := next((one for one in ahead if one.waits_for <= over), None)) is not None:
            turns.append(item)
            over.add(item.number)
            ahead.remove(item)
        return turns

    def _left(self, item: QueueEntry, now: float, ratio: float) -> float | None:
        """Return the remaining duration of the job under way [s], None before it has been checked."""
        record = item.record
        if record is None or record.preview is None:
            return None
        tally, step = record.tally, record.under_way
        current = 0.0
        if step is not None and not step.state.ended:
            current = self._homing.seconds if step.row.predicted is None else step.row.predicted / ratio
        whole = tally.predicted / ratio + tally.homings * self._homing.seconds
        return max(0.0, whole - min(now - record.current_since, current))

    async def close(self) -> None:
        """Stop the computation."""
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
        """Compute one job after the other; return early if something changes, to begin again."""
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
        """Return the outlook of a job from `start`, None if it cannot be computed."""
        left = -1 if item.record is None else len(item.record.remaining)
        known = self._known.get(item.number)
        if known is not None and known.body is item.row.body and (known.left, known.start) == (left, start):
            return known.course
        try:
            answers = {} if item.record is None else item.record.answers
            course = await self._computer.walk(await self._tasks(item), start, answers, whose=_WHOSE)
        except MayaError:
            return None
        if not self._stale:
            self._known[item.number] = _Known(item.row.body, left, start, course)
        return course

    async def _tasks(self, item: QueueEntry) -> list[Task]:
        if item.record is not None:
            return [step.task for step in item.record.remaining]
        return list((await self._computer.expanded(item.row.body, item.row.steps, whose=_WHOSE)).tasks)


def _homings_left(item: QueueEntry) -> int:
    """Return how many homings remain in the job under way, including a running one."""
    return 0 if item.record is None else item.record.tally.homings


SHOWN = AHEAD
"""Number of waiting jobs that are shown: those that are predicted."""

_NO_ETAS: Mapping[int, float] = MappingProxyType({})


class QueueViews:
    """Shows `items`, and other jobs from the `journal`. `speed` is the speed of the loop's clock."""

    def __init__(
        self,
        shared: RunnerContext,
        items: QueueEntries,
        scheduler: Scheduler,
        recovering: JobRecoverer,
        *,
        speed: float,
    ) -> None:
        self._shared = shared
        self._items = items
        self._scheduler = scheduler
        self._recovering = recovering
        self._speed = speed
        self.slices = Slices()
        homing = HomingTime(shared.robot.config, shared.controller.events)
        self._forecast = Forecast(shared.robot, items, shared.computer, lambda: scheduler.running, homing)
        shared.controller.events.heard_by(self._forecast.hear)
        items.on_change = self._forecast.renew

    @property
    def _journal(self) -> Journal:
        return self._shared.transactions.journal

    @property
    def mode(self) -> QueueMode:
        """The mode of the queue: running, pausing or paused."""
        if not self._shared.pausing.paused:
            return QueueMode.RUNNING
        running = self._scheduler.running
        return QueueMode.PAUSING if running is not None and not running.direct else QueueMode.PAUSED

    @property
    def reason(self) -> PauseReason | Literal[""]:
        """Why the queue is paused, "" while it runs."""
        return self._shared.pausing.row.reason

    def line(self, number: int) -> JobLine:
        """Return the line of a job that has not ended, or ended lately; raises `NotFound`."""
        return self._line(self._items.get(number))

    def lines(self) -> list[JobLine]:
        """Return a line for every job that has not ended, or ended lately, in order of submission."""
        parked = [self._items.get(number) for number in self._items.parked]
        return [self._line(item) for item in sorted({*self._items, *parked}, key=lambda item: item.number)]

    def line_of(self, row: JobRow) -> JobLine:
        """Return the line of a stored job, with the newer data in memory if there is any."""
        item = self._items.in_memory(row.id)
        if item is None:
            return line_of(row, position=self._items.order.place_of(row.id))
        return self._line(item)

    async def page(self, which: Filter) -> list[JobLine]:
        """Return the lines of a page of jobs."""
        return await self.slices.each(self.line_of, await self._journal.page(which))

    async def found_line(self, number: int) -> JobLine:
        """Return the line of any job, also of one that ended long ago; raises `NotFound`."""
        row, _ = await self.found(number)
        return self.line_of(row)

    def first_lines(self) -> tuple[JobLine, ...]:
        """Return the lines of the job under way and of the first waiting jobs."""
        etas, running = self._etas().at, self._scheduler.running
        under_way = () if running is None else (self._line(running, etas),)
        return (*under_way, *self._waiting(etas))

    def view(self) -> QueueView:
        """Return the present view of the queue."""
        row, running = self._shared.pausing.row, self._scheduler.running
        etas, estimated = self._etas()
        return QueueView(
            mode=self.mode,
            reason=row.reason,
            by=row.by,
            since=row.since,
            running=None if running is None else self._line(running, etas),
            waiting=self._waiting(etas),
            counts=self._items.counts,
            finish_at=self._shared.dates(max(etas.values()) / self._speed) if etas else None,
            recovery=self._recovering.view(),
            estimated=estimated,
            question=self.question,
        )

    @property
    def question(self) -> OperatorQuestion | None:
        """The question of the job under way, or that of an interrupted step, which is asked again."""
        running = self._scheduler.running
        if running is not None and running.question is not None and not running.question.answered.done():
            asked = running.question
            return OperatorQuestion(running.number, running.row.name, asked.index, asked.question, asked.choices)
        item = self._items.interrupted
        steps = [] if item is None or item.record is None else item.record.steps
        for step in steps:
            ask = step.task.action
            if item is not None and step.state is TaskState.INTERRUPTED and isinstance(ask, AskOperator):
                return OperatorQuestion(
                    item.number, item.row.name, step.task.index, ask.question, ask.choices, open=False
                )
        return None

    async def found(self, number: int) -> tuple[JobRow, tuple[StepRow, ...]]:
        """Return a job with its steps, from memory or from the journal; raises `NotFound`."""
        item = self._items.find(number)
        if item is not None:
            return item.row, () if item.record is None else tuple(step.row for step in item.record.steps)
        known = await self._journal.job(number)
        if known is None:
            raise NotFound(what="job", number=number)
        return known

    async def report(self, number: int) -> JobReport:
        """Return the present report of a job, also of one that ended long ago; raises `NotFound`."""
        item = self._items.find(number)
        row, steps = await self.found(number)
        expansion = None
        if item is None or item.record is None:
            expansion = await self._shared.computer.expanded(row.body, whose=REPORT)
        async with self.slices.turn:
            # An edit may have come meanwhile. The version in the report must be that of the steps in the report.
            if item is not None and item.record is not None:
                snapshot = JobSnapshot.of(self._line(item), item.row, item.record)
            else:
                assert expansion is not None
                snapshot = JobSnapshot.kept(self.line_of(row), row, expansion, steps)
            return await report_of(snapshot)

    async def body(self, number: int) -> Body:
        """Return a job as it was written; raises `NotFound`."""
        row, _ = await self.found(number)
        return as_written(row.body)

    async def close(self) -> None:
        """Stop the forecast."""
        await self._forecast.close()

    def _waiting(self, etas: Mapping[int, float]) -> tuple[JobLine, ...]:
        running = self._scheduler.running
        return tuple(self._line(item, etas) for item in self._items.waiting(SHOWN) if item is not running)

    def _etas(self) -> Etas:
        """Return the expected ends of jobs [s, loop time from now], none while the queue is paused."""
        if self._shared.pausing.paused:
            return Etas({}, estimated=False)
        return self._forecast.etas(asyncio.get_running_loop().time(), self._shared.controller.state.override)

    def _line(self, item: QueueEntry, etas: Mapping[int, float] = _NO_ETAS) -> JobLine:
        done = None if item.record is None else item.record.done
        return line_of(
            item.row,
            position=self._items.order.place_of(item.number),
            done=done,
            eta=etas.get(item.number),
            predicted=None if item.row.state.ended else self._forecast.predicted(item),
            direct=item.direct,
            obstacle=None if item.row.state.ended else self._forecast.obstacle(item),
        )
