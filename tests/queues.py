"""Queues on a fake controller: jobs to submit, a journal that can fail or be cut off, restarts."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

from maya_un.errors import StorageFailed
from maya_un.events import Event, JobAdvanced, StepAdvanced
from maya_un.process.journal import tables
from maya_un.process.journal.protocol import JobOptions, JobRow, RequestOwner, StepRow
from maya_un.process.journal.sqlite import MemoryJournal
from maya_un.process.lease import ControlLease
from maya_un.process.process import Process
from maya_un.process.queue.editing import SubmitRequest
from maya_un.process.spec.job import Job
from maya_un.robot.robot import MayaRobot
from maya_un.schema.jobs import TRANSITIONS, TaskState
from tests.fakes import FakeController
from tests.virtual_time import elapse

CUBE = {"cube": [0.50, 1.10]}
TRAY = {"tray": [1.10, 0.50]}
PICK_AND_PLACE = ({"pick": "cube"}, {"place": "tray"})


def job(*steps: Any, name: str = "job", repeat: int = 1) -> Job:
    """Return a job with a cube and a tray."""
    return Job.parse({"name": name, "parts": CUBE, "places": TRAY, "steps": list(steps), "repeat": repeat})


def submit_request(owner: str = "ana", *, key: str = "", proposal: bool = False, **options: Any) -> SubmitRequest:
    """Return who asks and how."""
    return SubmitRequest(RequestOwner(owner, "test"), JobOptions(**options), key, proposal=proposal)


class FrailJournal(MemoryJournal):
    """A journal in memory whose writes fail while `broken` gives a reason, and never return once it is `cut` off.

    Earlier writes survive in it, as in the file of a killed program.
    """

    def __init__(self) -> None:
        super().__init__()
        self.broken = ""
        self.cut = False
        self.slow = 0.0

    async def add(self, *jobs: JobRow) -> None:
        """Keep new jobs."""
        await self._frail()
        await super().add(*jobs)

    async def save(self, *changes: tables.Change) -> None:
        """Keep newer versions."""
        await self._frail()
        await super().save(*changes)

    def now(self, number: int) -> tuple[JobRow, tuple[StepRow, ...]]:
        """Return what is kept of a job at this instant."""
        found = tables.job(self._connection, number)
        assert found is not None
        return found

    def trace(self, listener: Callable[[str], None] | None) -> None:
        """Tell every statement from now on."""
        self._connection.set_trace_callback(listener)

    async def _frail(self) -> None:
        if self.slow:
            await elapse(self.slow)
        if self.cut:
            await asyncio.get_running_loop().create_future()
        if self.broken:
            raise StorageFailed(reason=self.broken)


@dataclass
class QueueBench:
    """A process on a fake controller, and what it needs. `events` are those of its run."""

    controller: FakeController
    robot: MayaRobot
    journal: FrailJournal
    lease: ControlLease
    process: Process

    def check_announcements(self) -> None:
        """From now on have every announcement of a job or a step looked up in the journal, before anybody hears it."""
        self.controller.events.heard_by(self._check)

    def _check(self, event: Event) -> None:
        if isinstance(event, JobAdvanced):
            row, _ = self.journal.now(int(str(event.detail["job"])))
            assert _is_or_follows(row.state, row.code, event)
        elif isinstance(event, StepAdvanced) and "attempt" not in event.detail:
            _, steps = self.journal.now(int(str(event.detail["job"])))
            kept = {step.index: step for step in steps}[int(str(event.detail["index"]))]
            assert _is_or_follows(kept.state, kept.code, event)

    def told(self, kind: type[Event]) -> list[Event]:
        """Return the events of a kind."""
        return [event for event in self.controller.events.since(0) if isinstance(event, kind)]

    def states(self, number: int) -> list[str]:
        """Return the states of a job, in the order in which they were announced."""
        jobs = (event.detail for event in self.told(JobAdvanced))
        return [str(detail["state"]) for detail in jobs if detail["job"] == number]

    async def until(self, number: int, index: int, state: str = "running") -> None:
        """Wait until a step of a job is in a state."""
        async for event in self.controller.events.follow():
            detail = event.detail
            if isinstance(event, StepAdvanced) and (detail["job"], detail["index"], detail["state"]) == (
                number,
                index,
                state,
            ):
                return


@dataclass
class Machine:
    """The parts that survive the program: the journal, and the fake controller's gripper and place."""

    journal: FrailJournal = field(default_factory=FrailJournal)
    homed: bool = True
    closed: bool = False

    @asynccontextmanager
    async def running(self) -> AsyncIterator[QueueBench]:
        """Start the program for the length of the block, and end it gracefully."""
        layer = await self.started()
        try:
            yield layer
        finally:
            await layer.process.close()
            layer.lease.close()

    async def started(self) -> QueueBench:
        """Start the program."""
        controller = FakeController(homed=self.homed, closed=self.closed)
        robot = MayaRobot(controller, controller.config)
        lease = ControlLease(controller.events)
        process = Process(robot, controller, controller.config, journal=self.journal, lease=lease)
        layer = QueueBench(controller, robot, self.journal, lease, process)
        await process.open()
        return layer

    async def kill(self, layer: QueueBench) -> None:
        """End the program at this instant: nothing that it had not written is known any more."""
        self.journal.cut = True
        self.closed, self.homed = layer.controller.state.gripper_closed, layer.controller.state.homed
        while tasks := asyncio.all_tasks() - {asyncio.current_task()}:
            for task in tasks:
                task.cancel()
            await asyncio.wait(tasks, timeout=1.0)
        layer.lease.close()
        self.journal.cut, self.journal.broken = False, "the program was killed"
        await layer.process.close()  # pending writes in memory are lost
        self.journal.broken = ""


def _is_or_follows(kept: TaskState, code: int, event: Event) -> bool:
    """Tell whether what is kept is what an event tells, or came after it: a disk that failed takes several at once."""
    told = TaskState(str(event.detail["state"]))
    after, ahead = set[TaskState](), [told]
    while ahead:
        following = TRANSITIONS[ahead.pop()] - after
        after |= following
        ahead += following
    return (kept is told and code == event.code) or kept in after
