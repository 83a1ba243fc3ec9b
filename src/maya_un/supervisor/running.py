"""Carry out a process: each step when those before it are done and its robot has no other step of the process.

A failed step holds back those that come after it; all others go on. When nothing else can be done, `run` ends and a
person decides what becomes of it; then another run goes on. Everything is in the record before it happens, so a process
that was interrupted goes on. A command that was sent is sent again under its id, which the robot carries out once.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from uuid import uuid4

from maya_un.errors import DecisionNeeded
from maya_un.graph.step_text import StepEnd, StepProgress
from maya_un.supervisor.lab import Supervisor
from maya_un.supervisor.process import ProcessStep
from maya_un.supervisor.record import ProcessRecord, ProcessStepState
from maya_un.supervisor.step import Step, command_text

Tell = Callable[[ProcessStep, StepProgress | StepEnd], None]
"""Is told of every report and every result."""

_OVER = frozenset({ProcessStepState.DONE, ProcessStepState.SKIPPED})


class FleetProcessRunner:
    """Carries out the process of a record over `lab`."""

    def __init__(self, record: ProcessRecord, lab: Supervisor, tell: Tell | None = None) -> None:
        self._record = record
        self._lab = lab
        self._tell = tell or (lambda _step, _report: None)
        self._sorter = record.process.sorter()
        self._ready: list[str] = []
        self._busy: dict[str, asyncio.Task[None]] = {}

    async def run(self) -> None:
        """Carry out all that is left.

        Raises `DecisionNeeded` if a failed step holds the rest back, `ProcessAborted` if a person ended the process.
        """
        self._record.require_not_aborted()
        self._sorter.prepare()
        try:
            while self._sorter.is_active():
                self._begin()
                if self._busy:
                    await self._next()
                else:
                    raise self._decision_needed()
        finally:
            for task in self._busy.values():
                task.cancel()
            await asyncio.gather(*self._busy.values(), return_exceptions=True)

    def _begin(self) -> None:
        """Begin every step that can begin."""
        while found := self._sorter.get_ready():
            self._ready.extend(found)
            for id_ in found:
                self._pass(id_)
        for id_ in sorted(self._ready, key=self._rank):
            step = self._record.process.steps[id_]
            if step.robot not in self._busy and self._record.entries[id_].state is not ProcessStepState.FAILED:
                self._ready.remove(id_)
                self._busy[step.robot] = asyncio.create_task(self._carry_out(step), name=f"step {id_}")

    def _rank(self, id_: str) -> tuple[bool, int]:
        """Return the place of a step among those of its robot: sent ones first, then by the order of the file."""
        return self._record.entries[id_].state is not ProcessStepState.SENT, list(self._record.entries).index(id_)

    def _pass(self, id_: str) -> None:
        """Let the steps after a step begin if it is over."""
        if id_ in self._ready and self._record.entries[id_].state in _OVER:
            self._ready.remove(id_)
            self._sorter.done(id_)

    async def _next(self) -> None:
        """Wait until a step ends."""
        done, _ = await asyncio.wait(self._busy.values(), return_when=asyncio.FIRST_COMPLETED)
        for robot, task in tuple(self._busy.items()):
            if task in done:
                del self._busy[robot]
                task.result()

    async def _carry_out(self, step: ProcessStep) -> None:
        sent = self._send(step)
        async for report in sent:
            self._tell(step, report)
        result = await sent.outcome()
        self._record.ended(step.id, result)
        self._tell(step, result)
        self._ready.append(step.id)
        self._pass(step.id)

    def _send(self, step: ProcessStep) -> Step:
        entry = self._record.entries[step.id]
        if entry.state is not ProcessStepState.SENT or entry.id is None or entry.text is None:
            id_ = str(uuid4())
            text = command_text(id_, step.robot, step.command, step.args, self._record.process.deadline)
            self._record.sent(step.id, id_, text)
            return self._lab.send(id_, step.robot, text)
        return self._lab.send(entry.id, step.robot, entry.text)

    def _decision_needed(self) -> DecisionNeeded:
        id_ = self._record.failed()[0]
        result = self._record.entries[id_].result
        assert result is not None
        robot = self._record.process.steps[id_].robot
        return DecisionNeeded(step=id_, robot=robot, code=result.code, error=result.error)
