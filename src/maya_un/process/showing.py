"""The queue and its jobs as others see them: lines, views, reports, also of what ended long ago."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from types import MappingProxyType

from maya_un.errors import NotFound
from maya_un.process.forecast import AHEAD, Etas, Forecast
from maya_un.process.foresight import REPORT
from maya_un.process.homing_time import HomingTime
from maya_un.process.items import QueueEntries, QueueEntry
from maya_un.process.journal.protocol import Filter, Journal
from maya_un.process.journal.rows import JobRow, StepRow
from maya_un.process.recovering import JobRecoverer
from maya_un.process.report import JobSnapshot, line_of, report_of
from maya_un.process.runner import RunnerContext
from maya_un.process.slices import Slices
from maya_un.process.turns import Scheduler
from maya_un.process.written import Body, as_written, version_of
from maya_un.schema.jobs import JobLine, JobReport, QueueMode, QueueView

SHOWN = AHEAD
"""So many jobs that wait are shown: those that are predicted."""

_NO_ETAS: Mapping[int, float] = MappingProxyType({})


class QueueViews:
    """Shows `items`, and what the `journal` keeps of others. `speed` is how fast the loop's clock runs."""

    def __init__(
        self,
        shared: RunnerContext,
        items: QueueEntries,
        turns: Scheduler,
        recovering: JobRecoverer,
        *,
        speed: float,
    ) -> None:
        self._shared = shared
        self._items = items
        self._turns = turns
        self._recovering = recovering
        self._speed = speed
        self.slices = Slices()
        homing = HomingTime(shared.robot.config, shared.controller.events)
        self._forecast = Forecast(shared.robot, items, shared.foresight, lambda: turns.running, homing)
        items.on_change = self._forecast.renew

    @property
    def _journal(self) -> Journal:
        return self._shared.ledger.journal

    @property
    def mode(self) -> QueueMode:
        """Whether jobs begin."""
        if not self._shared.pausing.paused:
            return QueueMode.RUNNING
        running = self._turns.running
        return QueueMode.PAUSING if running is not None and not running.direct else QueueMode.PAUSED

    @property
    def reason(self) -> str:
        """Why the queue is paused, "" while it runs."""
        return self._shared.pausing.row.reason

    def line(self, number: int) -> JobLine:
        """Return the line of a job that has not ended, or ended lately; raises `NotFound`."""
        return self._line(self._items.get(number))

    def lines(self) -> list[JobLine]:
        """Return a line for every job that has not ended, or ended lately, in the order they came."""
        parked = [self._items.get(number) for number in self._items.parked]
        return [self._line(item) for item in sorted({*self._items, *parked}, key=lambda item: item.number)]

    def line_of(self, row: JobRow) -> JobLine:
        """Return the line of a kept job, as it is now where more is known than was kept."""
        item = self._items.in_memory(row.id)
        if item is None:
            return line_of(row, position=self._items.order.place_of(row.id))
        return self._line(item)

    async def page(self, which: Filter) -> list[JobLine]:
        """Return the lines of a page of jobs."""
        return await self.slices.each(self.line_of, await self._journal.page(which))

    async def found_line(self, number: int) -> JobLine:
        """Return the line of any job, also of one long ended; raises `NotFound`."""
        row, _ = await self.found(number)
        return self.line_of(row)

    def first_lines(self) -> tuple[JobLine, ...]:
        """Return the job under way and the first that wait."""
        etas, running = self._etas().at, self._turns.running
        under_way = () if running is None else (self._line(running, etas),)
        return (*under_way, *self._waiting(etas))

    def view(self) -> QueueView:
        """Return the queue now."""
        row, running = self._shared.pausing.row, self._turns.running
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
        )

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
        """Return what is known of a job now, also of one long ended; raises `NotFound`."""
        item = self._items.find(number)
        row, steps = await self.found(number)
        expansion = None
        if item is None or item.record is None:
            expansion = await self._shared.foresight.expanded(row.body, whose=REPORT)
        async with self.slices.turn:
            if item is not None and item.record is not None:
                snapshot = JobSnapshot.of(self._line(item), item.record, version_of(item.row.body))
            else:
                assert expansion is not None
                snapshot = JobSnapshot.kept(self.line_of(row), expansion, steps, version_of(row.body))
            return await report_of(snapshot)

    async def body(self, number: int) -> Body:
        """Return a job as it was written; raises `NotFound`."""
        row, _ = await self.found(number)
        return as_written(row.body)

    async def close(self) -> None:
        """Predict nothing more."""
        await self._forecast.close()

    def _waiting(self, etas: Mapping[int, float]) -> tuple[JobLine, ...]:
        running = self._turns.running
        return tuple(self._line(item, etas) for item in self._items.waiting(SHOWN) if item is not running)

    def _etas(self) -> Etas:
        """Return when jobs will have ended [s, loop time from now], none while the queue is paused."""
        if self._shared.pausing.paused:
            return Etas({}, estimated=False)
        ratio = self._shared.controller.state.override
        etas = self._forecast.etas(asyncio.get_running_loop().time())
        return Etas({number: eta / ratio for number, eta in etas.at.items()}, etas.estimated)

    def _line(self, item: QueueEntry, etas: Mapping[int, float] = _NO_ETAS) -> JobLine:
        done = None if item.record is None else item.record.done
        return line_of(
            item.row,
            position=self._items.order.place_of(item.number),
            done=done,
            eta=etas.get(item.number),
            predicted=None if item.row.state.ended else self._forecast.predicted(item),
            direct=item.direct,
        )
