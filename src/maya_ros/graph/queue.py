"""The queue of the process layer, as a graph uses it."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import asdict
from typing import Any, Protocol

from maya_ros.graph import diagnostics
from maya_ros.graph.diagnostics import DiagnosticStatus
from maya_ros.graph.permissions import caller
from maya_ros.graph.protocol import Message
from maya_un.controller.protocol import Controller
from maya_un.errors import InvalidJob
from maya_un.process.spec.job import Job
from maya_un.robot.primitives import Primitive
from maya_un.schema.jobs import QueueMode, QueueView
from maya_un.service.access.operations import Caller, Operation, allowed
from maya_un.service.service import Service
from maya_un.values import Mode


class GateCall(Protocol):
    """The way through the gate (`api.gate.Gate.call`, `server.bridge.Bridge.call`)."""

    async def __call__(
        self, caller: Caller, operation: Operation, wish: Callable[[Service], Awaitable[Any]], subject: str = "", /
    ) -> Any:
        """Return what `wish` answers; raises what it and the gate raise."""
        ...


Asker = Callable[[], Awaitable[Caller]]
"""Returns the principal of the command."""


async def _sender() -> Caller:
    return caller()


class GraphQueue:
    """Passes requests of a graph to the gate.

    `view` returns the state of the queue, `controller` is the layer below. `who` returns the caller, by default the
    sender of the message.
    """

    def __init__(
        self, call: GateCall, view: Callable[[], QueueView], controller: Controller, who: Asker | None = None
    ) -> None:
        self._call = call
        self._view = view
        self._controller = controller
        self._who = _sender if who is None else who

    def status(self) -> DiagnosticStatus:
        """Return the status of the process layer."""
        return status_of(self._view(), self._controller)

    def told(self) -> Message:
        """Return the state of the queue as a message for /queue_status."""
        return told(self._view())

    async def append(self, primitives: Sequence[Primitive]) -> None:
        """Append one job of these primitives; it starts when its turn comes. Raises as `Service.submit` does."""
        job, by = job_of(primitives), await self._who()
        operation = Operation.SUBMIT if allowed(by.role, Operation.SUBMIT) else Operation.PROPOSE
        await self._call(by, operation, lambda service: service.submit(job, by=by), job.name)

    async def end_all(self) -> None:
        """Stop all motion on its path and cancel all jobs; raises `StorageFailed`.

        From a caller without the right `clear`, this only stops: waiting jobs stay, and the queue pauses.
        """
        by = await self._who()
        if allowed(by.role, Operation.CLEAR):
            await self._call(by, Operation.CLEAR, lambda service: service.direct.end_all(), "everything")
        else:
            await self._call(by, Operation.STOP, lambda service: service.stop())

    async def resume(self) -> None:
        """Continue the paused queue; raises `AnswerNeeded` while an interrupted job waits for a person."""
        by = await self._who()
        await self._call(by, Operation.RESUME, lambda service: service.queue.resume(by=by))

    async def recover(self, choice: str, holding: bool | None) -> None:
        """Decide about the interrupted job; raises as `api.queueing.QueueService.recover` does."""
        by = await self._who()
        await self._call(by, Operation.RESTART, lambda service: service.queue.recover(choice, holding, by=by), choice)


def job_of(primitives: Sequence[Primitive]) -> Job:
    """Return the job of some primitives; raises `InvalidJob` for none, for too many, and for a question."""
    steps = [_step(primitive, f"tasks.{place}") for place, primitive in enumerate(primitives)]
    name = primitives[0].command if len(primitives) == 1 else f"{len(primitives)} tasks"
    return Job.parse({"name": name, "steps": steps})


def status_of(view: QueueView, controller: Controller) -> DiagnosticStatus:
    """Return how the process floor is that shows this queue."""
    there = controller.state.mode is not Mode.DISCONNECTED
    recovery = view.recovery
    if recovery is not None:
        return diagnostics.interrupted(recovery.job, recovery.name, recovery.step, robot_there=there)
    running = "" if view.running is None else f"job {view.running.id} ({view.running.name})"
    paused = view.mode is not QueueMode.RUNNING
    return diagnostics.process(
        robot_there=there, paused=paused, running=running, queued=len(view.waiting), reason=view.reason
    )


def told(view: QueueView) -> Message:
    """Return how a queue is as plain data: numbers are those of jobs, sentences are in English.

    {"mode": "running", "reason": "", "running": 3, "waiting": 2, "interrupted": null}. An interrupted job is
    {"job": 3, "name": "...", "step": "pick", "phase": "lower", "choices": [...]}, each choice
    {"name": "redo", "meaning": "...", "needs_answer": true}.
    """
    recovery = view.recovery
    interrupted = None
    if recovery is not None:
        interrupted = {
            "job": recovery.job,
            "name": recovery.name,
            "step": recovery.step,
            "phase": recovery.phase,
            "choices": [asdict(choice) for choice in recovery.choices],
        }
    return {
        "mode": view.mode.value,
        "reason": view.reason,
        "running": None if view.running is None else view.running.id,
        "waiting": len(view.waiting),
        "interrupted": interrupted,
    }


def _step(primitive: Primitive, key: str) -> dict[str, object]:
    """Return a primitive as people write the step of a job."""
    if not primitive.in_jobs:
        raise InvalidJob(key=key, reason=f"{primitive.command} is a question; /maya_command answers it")
    return {primitive.command: primitive.argument.step(primitive.value)}
