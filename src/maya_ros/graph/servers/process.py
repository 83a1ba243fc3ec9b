"""The process layer on a graph: its services and topics, and the queue that they use."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncGenerator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager
from contextvars import Context, copy_context
from dataclasses import asdict
from functools import partial
from typing import Any, NamedTuple, Protocol

from dmc41x3.i18n import phrase
from maya_ros.graph import diagnostics
from maya_ros.graph.conversions import primitive_from_message
from maya_ros.graph.diagnostics import DiagnosticStatus
from maya_ros.graph.outcome import failure, success
from maya_ros.graph.permissions import caller
from maya_ros.graph.protocol import Graph, GraphHandle, Message, Publisher
from maya_ros.graph.servers.tasks import (
    BackgroundTasks,
    Clock,
    clock_or_loop,
    diagnosed,
    every,
    log,
    tasks,
    trigger,
    with_values,
)
from maya_ros.graph.table import QUEUE_STATUS, RECOVER_QUEUE, RESUME_QUEUE, SEND_TASK, START_QUEUE, STOP_QUEUE, Row
from maya_un.controller.protocol import Controller
from maya_un.errors import InvalidJob, InvalidValue, MayaError
from maya_un.process.spec.job import Job
from maya_un.robot.primitives import Primitive
from maya_un.schema.jobs import QueueMode, QueueView
from maya_un.service.access.operations import Caller, Operation, allowed
from maya_un.service.service import Service
from maya_un.values import Mode

LOOK = 0.5
"""Period of the check for changes of the queue [s, real time]."""

_ANSWERS = {"": None, "yes": True, "no": False}


class ProcessLayer(Protocol):
    """The part of a process layer that this server needs."""

    @property
    def stops(self) -> int:
        """Number of stops and aborts of the robot so far."""
        ...

    async def append(self, primitives: Sequence[Primitive], stops: int) -> None:
        """Append one job of these primitives, at least one; it starts when its turn comes.

        If the robot was stopped after the number `stops`, the job waits, and the queue pauses.
        """
        ...

    async def end_all(self) -> None:
        """Cancel all motion, including a homing and direct commands, and all waiting jobs."""
        ...

    async def resume(self) -> None:
        """Continue the paused queue."""
        ...

    async def recover(self, choice: str, holding: bool | None) -> None:
        """Decide about an interrupted job; `holding` is whether the gripper holds a part (None: unknown)."""
        ...

    def status(self) -> DiagnosticStatus:
        """Return the status of the layer."""
        ...

    def told(self) -> Message:
        """Return the state of the queue, as plain data for JSON."""
        ...


class _Tasks(NamedTuple):
    """Tasks from a topic, the context of their message, and the number of stops when it came."""

    row: Row
    messages: Sequence[Message]
    context: Context
    stops: int


class ProcessServer:
    """Serves a process layer; `clock` stamps messages [s], `speed` is how fast the loop's clock runs."""

    def __init__(self, layer: ProcessLayer, *, clock: Clock | None = None, speed: float = 1.0) -> None:
        self._layer = layer
        self._clock = clock_or_loop(clock)
        self._speed = max(1.0, speed)
        self._refused = ""
        self._coming: asyncio.Queue[_Tasks] = asyncio.Queue()
        self._ends = 0
        self._ending = 0
        self._stops = 0  # number of stops with those of /stop_queue that are under way: they concern no later task
        self._ended_by = copy_context()

    @asynccontextmanager
    async def open(self, graph: Graph) -> AsyncGenerator[None]:
        """Serve the layer while the block runs."""
        async with tasks() as working:
            status = graph.advertise(
                QUEUE_STATUS.name, QUEUE_STATUS.type, latch=QUEUE_STATUS.latch, queue_size=QUEUE_STATUS.queue_size
            )
            held = [*self._topics(graph, working), *self._services(graph), status]
            working.begin(every(self._speed * LOOK, self._teller(status)), "status of the queue")
            working.begin(self._take(), "tasks from topics")
            working.begin(diagnosed(graph, self._statuses, self._clock, self._speed), "diagnostics")
            try:
                yield
            finally:
                for one in held:
                    one.close()

    def _topics(self, graph: Graph, working: BackgroundTasks) -> list[GraphHandle]:
        def stops() -> int:
            return max(self._stops, self._layer.stops)

        async def end_all() -> None:
            try:
                await self._layer.end_all()
            finally:
                self._ending -= 1
                if not self._ending:
                    self._stops = 0

        def send(message: Message) -> None:
            self._coming.put_nowait(_Tasks(SEND_TASK, [message], copy_context(), stops()))

        def start(message: Message) -> None:
            self._coming.put_nowait(_Tasks(START_QUEUE, message["tasks"], copy_context(), stops()))

        def stop(_: Message) -> None:
            self._ends += 1
            self._ending += 1
            self._stops = stops() + 1
            self._ended_by = copy_context()
            while not self._coming.empty():
                self._coming.get_nowait()
            working.begin(self._told(STOP_QUEUE, end_all), STOP_QUEUE.name)

        rows = ((SEND_TASK, send), (START_QUEUE, start), (STOP_QUEUE, stop))
        return [graph.subscribe(row.name, row.type, heard, queue_size=row.queue_size) for row, heard in rows]

    def _services(self, graph: Graph) -> list[GraphHandle]:
        async def resume() -> str:
            await self._layer.resume()
            return ""

        async def recover(request: Message) -> Message:
            try:
                await self._layer.recover(request["choice"], _answer(request["holding"]))
            except MayaError as error:
                return failure(error)
            return success()

        return [
            graph.serve(RESUME_QUEUE.name, RESUME_QUEUE.type, trigger(resume)),
            graph.serve(RECOVER_QUEUE.name, RECOVER_QUEUE.type, recover),
        ]

    def _teller(self, status: Publisher) -> Callable[[], None]:
        """Return a function that publishes the state of the queue if it has changed."""
        last = ""

        def tell() -> None:
            nonlocal last
            text = json.dumps(self._layer.told(), separators=(",", ":"))
            if text != last:
                last = text
                status.publish({"data": text})

        return tell

    async def _take(self) -> None:
        """Append the tasks of messages, in order. A job that is being appended during /stop_queue is cancelled as well.

        Each task is appended in the context of its message, which holds the principal of the command. Tasks that came
        before a stop wait like jobs of the queue.
        """
        loop = asyncio.get_running_loop()
        while True:
            tasks = await self._coming.get()
            ends = self._ends
            work = self._told(tasks.row, partial(self._append, tasks))
            await loop.create_task(work, context=tasks.context)
            if self._ends != ends:
                await loop.create_task(self._told(STOP_QUEUE, self._layer.end_all), context=self._ended_by)

    async def _append(self, tasks: _Tasks) -> None:
        if not tasks.messages:
            raise InvalidJob(key="tasks", reason="there is none")
        await self._layer.append([primitive_from_message(message) for message in tasks.messages], tasks.stops)

    async def _told(self, row: Row, work: Callable[[], Awaitable[None]]) -> None:
        """Do the work of a message; log a refusal and report it in /diagnostics, because a topic has no response."""
        try:
            await work()
        except MayaError as error:
            self._refused = f"{row.name}: {error.code} {error}"
            log.warning("%s", self._refused)
        else:
            self._refused = ""

    def _statuses(self) -> list[DiagnosticStatus]:
        return [with_values(self._layer.status(), {"last refused": self._refused})]


def _answer(word: str) -> bool | None:
    """Return whether the gripper holds a part, by a word, None for the empty word; raises `InvalidValue`."""
    if word not in _ANSWERS:
        raise InvalidValue(key="holding", value=repr(word), reason="it is yes, no or empty")
    return _ANSWERS[word]


class GateCall(Protocol):
    """Calls an operation through the gate (`service.service.Gate.call`, `http.bridge.Bridge.carry`)."""

    async def __call__(
        self, caller: Caller, operation: Operation, work: Callable[[Service], Awaitable[Any]], subject: str = "", /
    ) -> Any:
        """Return the result of `work`; raises what `work` and the gate raise."""
        ...


Asker = Callable[[], Awaitable[Caller]]
"""Returns the principal of the command."""


async def sender() -> Caller:
    """Return the sender of the message."""
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
        self._who = sender if who is None else who

    def status(self) -> DiagnosticStatus:
        """Return the status of the process layer."""
        return status_of(self._view(), self._controller)

    def told(self) -> Message:
        """Return the state of the queue as a message for /queue_status."""
        return queue_message(self._view())

    @property
    def stops(self) -> int:
        """Number of stops and aborts of the robot so far."""
        return self._controller.stops

    async def append(self, primitives: Sequence[Primitive], stops: int) -> None:
        """Append one job of these primitives; it starts when its turn comes. Raises as `Service.submit` does.

        If the robot was stopped after the number `stops`, the job waits, and the queue pauses.
        """
        job, by = job_of(primitives), await self._who()
        operation = Operation.SUBMIT if allowed(by.role, Operation.SUBMIT) else Operation.PROPOSE

        async def submit(service: Service) -> None:
            await service.submit(job, by=by, stopped=self.stops > stops)

        await self._call(by, operation, submit, job.name)

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
        """Decide about the interrupted job; raises as `service.queueing.QueueService.recover` does."""
        by = await self._who()
        await self._call(by, Operation.RESTART, lambda service: service.queue.recover(choice, holding, by=by), choice)


def job_of(primitives: Sequence[Primitive]) -> Job:
    """Return the job of some primitives; raises `InvalidJob` for none, for too many, and for a question."""
    steps = [_step(primitive, f"tasks.{place}") for place, primitive in enumerate(primitives)]
    name = primitives[0].command if len(primitives) == 1 else f"{len(primitives)} tasks"
    return Job.parse({"name": name, "steps": steps})


def status_of(view: QueueView, controller: Controller) -> DiagnosticStatus:
    """Return the status of the process layer with this queue."""
    there = controller.state.mode is not Mode.DISCONNECTED
    recovery = view.recovery
    if recovery is not None:
        return diagnostics.interrupted(recovery.job, recovery.name, recovery.step, robot_there=there)
    running = "" if view.running is None else f"job {view.running.id} ({view.running.name})"
    paused = view.mode is not QueueMode.RUNNING
    return diagnostics.process(
        robot_there=there, paused=paused, running=running, queued=len(view.waiting), reason=str(view.reason)
    )


def queue_message(view: QueueView) -> Message:
    """Return the state of a queue as plain data: numbers are those of jobs, sentences are in English.

    {"mode": "running", "reason": "", "running": 3, "waiting": 2, "interrupted": null, "question": null}. A question has
    its job, its step, its text and its choices. An interrupted job is {"job": 3,
    "name": "...", "step": "pick", "phase": "lower", "choices": [...]}, each choice {"name": "redo", "meaning": "...",
    "needs_answer": true}.
    """
    recovery, question = view.recovery, view.question
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
        "reason": str(view.reason),
        "running": None if view.running is None else view.running.id,
        "waiting": len(view.waiting),
        "interrupted": interrupted,
        "question": None if question is None or not question.open else asdict(question),
    }


def _step(primitive: Primitive, key: str) -> dict[str, object]:
    """Return a primitive as a step in a job file."""
    if not primitive.in_jobs:
        raise InvalidJob(
            key=key, reason=phrase("{command} is a question; /maya_command answers it", command=primitive.command)
        )
    return {primitive.command: primitive.argument.step(primitive.value)}
