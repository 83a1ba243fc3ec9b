"""The queue of the process floor, as its door offers it to a graph."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from typing import Any, Protocol

from maya_un.api.access.caller import Caller
from maya_un.api.access.operations import Operation, allowed
from maya_un.api.service import Service
from maya_un.controller.protocol import Controller
from maya_un.errors import InvalidJob
from maya_un.graph import diagnostics
from maya_un.graph.diagnostics import Status
from maya_un.graph.principals import caller
from maya_un.process.job import Job
from maya_un.process.view import QueueMode, QueueView
from maya_un.robot.approach import Approach
from maya_un.robot.can_teleop import CanTeleop
from maya_un.robot.gripper import Gripper
from maya_un.robot.home import Home
from maya_un.robot.line import Line
from maya_un.robot.move import MoveJoints
from maya_un.robot.pick import Pick
from maya_un.robot.place import Place
from maya_un.robot.primitives import Primitive
from maya_un.values import Mode


class Call(Protocol):
    """The way through the gate (`api.gate.Gate.call`, `server.bridge.Bridge.call`)."""

    async def __call__(
        self, caller: Caller, operation: Operation, wish: Callable[[Service], Awaitable[Any]], subject: str = "", /
    ) -> Any:
        """Return what `wish` answers; raises what it and the gate raise."""
        ...


Asker = Callable[[], Awaitable[Caller]]
"""Tells whose wish it is."""


async def _sender() -> Caller:
    return caller()


class Queue:
    """Takes what comes from a graph through the gate; `status` tells how the floor is.

    `who` tells whose wish it is: by default of whoever sent the message, as far as the graph knows.
    """

    def __init__(self, call: Call, status: Callable[[], Status], who: Asker | None = None) -> None:
        self._call = call
        self._who = _sender if who is None else who
        self.status = status

    async def append(self, primitives: Sequence[Primitive]) -> None:
        """Append one job of these primitives; it starts when its turn comes. Raises as `Service.submit` does."""
        job, by = job_of(primitives), await self._who()
        operation = Operation.SUBMIT if allowed(by.role, Operation.SUBMIT) else Operation.PROPOSE
        await self._call(by, operation, lambda service: service.submit(job, by=by), job.name)

    async def end_all(self) -> None:
        """Stop every movement on its path, whoever began it, and cancel all that waits; raises `StorageFailed`.

        For somebody who may not cancel what others submitted, it is a stop: what waits is paused.
        """
        by = await self._who()
        if allowed(by.role, Operation.CLEAR):
            await self._call(by, Operation.CLEAR, lambda service: service.direct.end_all(), "everything")
        else:
            await self._call(by, Operation.STOP, lambda service: service.stop())


def job_of(primitives: Sequence[Primitive]) -> Job:
    """Return the job of some primitives; raises `InvalidJob` for none, for too many, and for a question."""
    steps = [_step(primitive, f"tasks.{place}") for place, primitive in enumerate(primitives)]
    name = primitives[0].command if len(primitives) == 1 else f"{len(primitives)} tasks"
    return Job.parse({"name": name, "steps": steps})


def status_of(view: QueueView, controller: Controller) -> Status:
    """Return how the process floor is that shows this queue."""
    there = controller.state.mode is not Mode.DISCONNECTED
    running = "" if view.running is None else f"job {view.running.id} ({view.running.name})"
    paused = view.mode is not QueueMode.RUNNING
    return diagnostics.process(
        robot_there=there, paused=paused, running=running, queued=len(view.waiting), reason=view.reason
    )


def _step(primitive: Primitive, key: str) -> dict[str, object]:
    """Return a primitive as people write the step of a job."""
    match primitive:
        case Approach(target) | Pick(target) | Place(target) | Line(target):
            return {primitive.command: list(target)}
        case MoveJoints(joints):
            return {primitive.command: joints._asdict()}
        case Gripper(open_):
            return {primitive.command: "open" if open_ else "close"}
        case Home():
            return {primitive.command: True}
        case CanTeleop():
            raise InvalidJob(key=key, reason="can_teleop is a question; /maya_command answers it")
