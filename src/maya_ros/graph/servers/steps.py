"""Steps of remote processes on a graph: commands from /step_command, one result for each on /step_result.

Steps run one at a time, in the order in which they were accepted. The store records that a step is accepted, begins and
ends; the robot moves only after that. An id runs at most once, and the same command again gets the stored result. After
a crash nothing runs by itself: every step without a result ends as `INTERRUPTED`. A step that does not succeed ends the
waiting steps, because a process continues only from where its last step left the robot.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, AsyncIterator, Awaitable, Callable, Coroutine, Mapping
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from math import inf
from typing import Any
from uuid import uuid4

from dmc41x3.i18n import phrase
from maya_ros.graph import diagnostics
from maya_ros.graph.conversions import primitive_to_message
from maya_ros.graph.permissions import Permit, anything
from maya_ros.graph.protocol import GoalResult, GoalStatus, Graph, Message, Publisher
from maya_ros.graph.servers.tasks import Clock, clock_or_loop, diagnosed, tasks
from maya_ros.graph.table import EVENT, STEP_COMMAND, STEP_RESULT, STEP_ROBOT, STEP_STATUS, TASK
from maya_un.errors import (
    Busy,
    Cancelled,
    InternalError,
    KeyReused,
    MayaError,
    NodeGone,
    StepExpired,
    StepNotBegun,
    StepOfOtherRobot,
    StorageFailed,
)
from maya_un.events import EmergencyStopped, FaultEntered, LimitHit, MotionStopped
from maya_un.service.access.operations import Operation
from maya_un.steps.command import StepCommand, step_of
from maya_un.steps.store import StepStore, StoredStep
from maya_un.steps.text import (
    INTERRUPTED,
    QUIET,
    RobotIdentity,
    StepEnd,
    StepProgress,
    StepState,
    content_of,
    id_of,
    read,
)

MOST_WAITING = 1000
"""Largest number of waiting steps; further ones are refused."""

_MOST_UNSTORED = 1000
"""Largest number of refusals that are remembered although they could not be stored."""

_LOOK = 0.5
"""Period of the check for subscribers to results [s]."""

_STOPS = frozenset(event.word for event in (MotionStopped, LimitHit, FaultEntered, EmergencyStopped))
"""Events of the robot after which no waiting step may begin."""

Do = Callable[[Message], Awaitable[GoalResult]]
"""Carries out the goal of a task; raises `NodeGone` if no node serves it."""

Ending = tuple[str | None, str | None]
"""Code and sentence of the error that ended a step, None and None after success."""

_UNKNOWN = (
    f"{INTERRUPTED}: the program ended while this step was under way. It is not known how far the step came, and it is "
    "not repeated. Look at the robot."
)
_UNTOUCHED = (
    f"{INTERRUPTED}: the program ended before this step began. Send it again under another id if it is still needed."
)
_NAMELESS = "it came without an id, so the same command again would be carried out again"


class Steps:
    """Carry out steps in order, each at most once.

    `do` carries out a task, `date` returns the date (ISO 8601, UTC). `name` is the name of this robot, which refuses
    the steps of another one. `permit` raises if the graph may not request a step. `report` receives every change of a
    step's state. The robot checks targets itself. `quiet` is `QUIET` in the loop's time [s].
    """

    def __init__(
        self,
        store: StepStore,
        do: Do,
        date: Callable[[], str],
        *,
        name: str | None = None,
        permit: Permit = anything,
        report: Callable[[StepProgress], None] | None = None,
        quiet: float = QUIET,
    ) -> None:
        self._store = store
        self._do = do
        self._date = date
        self._name = name
        self._permit = permit
        self._report = report or (lambda _: None)
        self._admission = asyncio.Lock()
        self._order = asyncio.Lock()
        self._waiting: dict[str, asyncio.Task[StepEnd]] = {}
        self._latest: dict[str, StepProgress] = {}  # of the steps in `_waiting`
        self._digests: dict[str, str] = {}  # of the steps in `_waiting`
        self._unstored: dict[str, StoredStep] = {}
        self._doing: asyncio.Task[GoalResult] | None = None
        self._halts = 0
        self._quiet = quiet
        self._refuse_until = -inf
        self._closed = False

    async def take_up(self) -> list[StepEnd]:
        """Return the results that no client received before the program ended; the other steps end as `INTERRUPTED`."""
        return [await self._interrupted(kept) for kept in await self._store.unfinished()]

    async def answer(self, text: str) -> StepEnd:
        """Return the result of a command, or why it is refused; raises no `MayaError`."""
        date, id_ = self._date(), None
        warnings: tuple[str, ...] = ()
        data: dict[str, Any] = {}
        try:
            data = read(text)
            id_ = id_of(data)
            if id_ is None:
                id_, warnings = f"maya-{uuid4().hex}", (_NAMELESS,)
            step = await self._step_of(data, id_)
            step = replace(step, warnings=(*warnings, *step.warnings))
            try:
                answer = await self._admitted(step, date)
            except StorageFailed as error:
                return self._not_stored(step, StepEnd.refused(id_, error, date, step.warnings))
        except MayaError as error:
            content = content_of(data) if isinstance(error, KeyReused) else None
            return StepEnd.refused(id_, error, date, warnings, content)
        return answer if isinstance(answer, StepEnd) else await asyncio.shield(answer)

    async def _step_of(self, data: Mapping[str, Any], id_: str) -> StepCommand:
        """Return the step of a command. If the command is invalid and its id is known, raise `KeyReused`."""
        try:
            return step_of(data, id_)
        except MayaError as error:
            if id_ in self._waiting or await self._known(id_) is not None:
                raise KeyReused(key=id_) from error
            raise

    async def _known(self, id_: str) -> StoredStep | None:
        """Return the step with an id, None if it is unknown; raises `StorageFailed`, so look in `_waiting` first."""
        return await self._store.find(id_) or self._unstored.get(id_)

    def _not_stored(self, step: StepCommand, result: StepEnd) -> StepEnd:
        """Remember and return the refusal of a step that could not be stored: the same command does not run later."""
        self._unstored[step.id] = StoredStep(
            step.id, step.digest, result.started, step.warnings, result, told=True, begun=None
        )
        if len(self._unstored) > _MOST_UNSTORED:
            del self._unstored[next(iter(self._unstored))]
        return result

    async def told(self, result: StepEnd) -> None:
        """Store that a client received a result; if the store fails, the next run sends the result again."""
        with suppress(StorageFailed):
            await self._store.told(result)

    def halt(self) -> None:
        """Cancel the step under way, and let no step begin that was sent before.

        Commands can still be on their way through a broker. They come without a break, so steps are refused until none
        has come for `quiet`.
        """
        self._halts += 1
        self._refuse_until = asyncio.get_running_loop().time() + self._quiet
        if self._doing is not None:
            self._doing.cancel()

    async def close(self) -> None:
        """End every step, and return when all results are stored."""
        self._closed = True
        self.halt()
        while self._waiting:
            await asyncio.wait(self._waiting.values())

    async def _admitted(self, step: StepCommand, date: str) -> StepEnd | asyncio.Task[StepEnd]:
        """Accept a step, or return its known result; raises the `MayaError` that refuses it."""
        async with self._admission:
            if step.id in self._waiting:  # the store may fail, and a step that runs must not be reported as refused
                return self._under_way(step)
            kept = await self._known(step.id)
            if kept is not None:
                _require_same(step, kept.digest)
                return await self._interrupted(kept)
            try:
                self._check(step)
            except MayaError as error:
                return await self._refused(step, error, date)
            begins, halts = not self._waiting, self._halts
            await self._store.accept(step.id, step.digest, date, step.warnings, begins=begins)
            work = self._carry_out(step, date, halts, begins=begins)
            task = asyncio.get_running_loop().create_task(work, name=f"step {step.id}")
            self._waiting[step.id], self._digests[step.id] = task, step.digest
            task.add_done_callback(lambda _: self._forget(step.id))
            self._tell(StepProgress(step.id, StepState.ACCEPTED, date))
            return task

    def _under_way(self, step: StepCommand) -> asyncio.Task[StepEnd]:
        """Return the task of a step that waits or runs; raises `KeyReused` if it has other content.

        Its latest report is repeated: who sends a command again may have missed it, and sends no other one before.
        """
        _require_same(step, self._digests[step.id])
        self._report(self._latest[step.id])
        return self._waiting[step.id]

    def _tell(self, progress: StepProgress) -> None:
        self._latest[progress.id] = progress
        self._report(progress)

    def _forget(self, id_: str) -> None:
        del self._waiting[id_], self._latest[id_], self._digests[id_]

    async def _refused(self, step: StepCommand, error: MayaError, date: str) -> StepEnd:
        """Store a refusal as a result, so that the same command does not run later when the reason has gone."""
        result = StepEnd.refused(step.id, error, date, step.warnings)
        await self._store.refuse(step.id, step.digest, result)
        return result

    def _check(self, step: StepCommand) -> None:
        """Raise the `MayaError` that refuses a step, if there is a reason."""
        self._permit(Operation.COMMAND)
        if self._closed:
            raise Cancelled
        now = asyncio.get_running_loop().time()
        if now < self._refuse_until:
            self._refuse_until = now + self._quiet
            raise StepNotBegun
        if step.robot is not None and self._name is not None and step.robot != self._name:
            raise StepOfOtherRobot(robot=step.robot, name=self._name)
        if len(self._waiting) >= MOST_WAITING:
            raise Busy(doing=phrase("{most:d} steps", most=MOST_WAITING))
        self._require_in_time(step)

    def _require_in_time(self, step: StepCommand) -> None:
        if step.expired(self._date()):
            raise StepExpired(deadline=step.deadline)

    async def _carry_out(self, step: StepCommand, accepted: str, halts: int, *, begins: bool) -> StepEnd:
        """Carry out an accepted step in its turn, and store how it ended; `halts` is the count at its acceptance.

        With `begins`, the store has already recorded the start of the step.
        """
        async with self._order:
            try:
                code, sentence = await self._ended(step, halts, begins=begins)
            except MayaError as error:
                code, sentence = str(error.code), str(error)
            result = StepEnd(step.id, sentence, code, accepted, self._date(), step.warnings)
            if code not in (None, str(StepNotBegun.code)):
                self._halts += 1  # the steps that wait now do not begin
            await self._stored(result)
            return result

    async def _ended(self, step: StepCommand, halts: int, *, begins: bool) -> Ending:
        """Carry out a step in its turn, and return how it ended; raises the `MayaError` for which it does not begin."""
        if halts != self._halts:
            raise Cancelled if self._closed else StepNotBegun()
        self._require_in_time(step)
        date = self._date()
        if not begins:
            await self._store.begin(step.id, date)
        if halts != self._halts:
            raise StepNotBegun
        self._tell(StepProgress(step.id, StepState.EXECUTING, date))
        self._doing = asyncio.get_running_loop().create_task(self._task(step), name="step's task")
        try:
            await asyncio.wait({self._doing})
            return _ending(self._doing)
        finally:
            self._doing = None

    async def _task(self, step: StepCommand) -> GoalResult:
        return await self._do({"task": primitive_to_message(step.primitive)})

    async def _stored(self, result: StepEnd) -> None:
        """Store a result, and try again until that succeeds. Only a stored result is sent.

        Otherwise the next run of this program would report the step as `INTERRUPTED`, a second result. If this run ends
        first, INTERRUPTED is the only result. Steps that wait meanwhile do not begin.
        """
        assert result.id is not None
        failed = False
        while True:
            try:
                await self._store.end(result.id, result)
            except MayaError as error:
                if not failed:
                    message = f"the result of step {result.id} waits until it can be stored: {error}"
                    asyncio.get_running_loop().call_exception_handler({"message": message, "exception": error})
                failed = True
                self._halts += 1
            else:
                return
            if self._closed:
                raise asyncio.CancelledError
            await asyncio.sleep(self._quiet)

    async def _interrupted(self, kept: StoredStep) -> StepEnd:
        """Return the result of a step that is not under way, `INTERRUPTED` if it has none."""
        if kept.result is not None:
            return kept.result
        sentence = _UNKNOWN if kept.begun else _UNTOUCHED
        result = StepEnd(kept.id, sentence, INTERRUPTED, kept.started, self._date(), kept.warnings)
        await self._store.end(kept.id, result)
        return result


def _require_same(step: StepCommand, digest: str) -> None:
    """Raise `KeyReused` if a step does not have the content of an earlier one with its id."""
    if digest != step.digest:
        raise KeyReused(key=step.id)


@asynccontextmanager
async def bridged(
    graph: Graph,
    store: StepStore,
    date: Callable[[], str],
    permit: Permit = anything,
    *,
    name: str | None = None,
    speed: float = 1.0,
) -> AsyncIterator[Steps]:
    """Carry out the steps of /step_command with /task while the block runs, as far as `permit` allows.

    /step_robot publishes the name of the robot and its journal. Results that an earlier run could not send are sent
    once a client subscribes. After a stop or a fault of the robot, steps that were waiting do not begin. The loop's
    clock runs at `speed`.
    """
    results = graph.advertise(STEP_RESULT.name, STEP_RESULT.type, queue_size=STEP_RESULT.queue_size)
    status = graph.advertise(STEP_STATUS.name, STEP_STATUS.type, queue_size=STEP_STATUS.queue_size)
    steps = Steps(
        store,
        lambda goal: graph.do(TASK.name, TASK.type, goal),
        date,
        name=name,
        permit=permit,
        quiet=QUIET * speed,
        report=lambda progress: status.publish({"data": progress.text}),
    )
    tasks: set[asyncio.Task[None]] = set()

    def begin(work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        tasks.add(task)
        task.add_done_callback(tasks.discard)

    async def answer(text: str) -> None:
        await _send(results, steps, await steps.answer(text))

    def happened(event: Message) -> None:
        if event["data"].partition(" ")[0] in _STOPS:
            steps.halt()

    for result in await steps.take_up():
        begin(_send(results, steps, result))
    events = graph.subscribe(EVENT.name, EVENT.type, happened, queue_size=EVENT.queue_size)
    commands = graph.subscribe(
        STEP_COMMAND.name,
        STEP_COMMAND.type,
        lambda message: begin(answer(message["data"])),
        queue_size=STEP_COMMAND.queue_size,
    )
    robot = graph.advertise(STEP_ROBOT.name, STEP_ROBOT.type, latch=STEP_ROBOT.latch, queue_size=STEP_ROBOT.queue_size)
    robot.publish({"data": RobotIdentity(name or "", store.journal).text})
    try:
        yield steps
    finally:
        commands.close()
        await steps.close()
        await _settled(tasks)
        for held in (events, results, status, robot):
            held.close()


async def _send(publisher: Publisher, steps: Steps, result: StepEnd) -> None:
    """Publish a result once a client subscribes, and store that it was received."""
    while not publisher.readers:  # noqa: ASYNC110 - the graph does not report when a subscriber comes
        await asyncio.sleep(_LOOK)
    publisher.publish({"data": result.text})
    await steps.told(result)


async def _settled(tasks: set[asyncio.Task[None]]) -> None:
    """Send what can be sent now, and cancel what waits for a subscriber."""
    if tasks:
        await asyncio.wait(tasks, timeout=_LOOK / 2)
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


def _ending(doing: asyncio.Task[GoalResult]) -> Ending:
    """Return how a step's task ended."""
    if doing.cancelled():
        return str(Cancelled.code), str(Cancelled())
    defect = doing.exception()
    if isinstance(defect, MayaError):
        return str(defect.code), str(defect)
    if defect is not None:
        doing.get_loop().call_exception_handler({"message": "a step failed", "exception": defect})
        return str(InternalError.code), str(InternalError(reason=repr(defect)))
    ended = doing.result()
    if ended.outcome is GoalStatus.SUCCEEDED:
        return None, None
    if not ended.result:
        return str(NodeGone.code), str(NodeGone(node=TASK.sources[0]))
    return str(ended.result.get("code", "")), str(ended.result.get("message", ""))


class TaskServer:
    """Carries out steps with /task; `store` records them, `date` returns the date (ISO 8601, UTC).

    `permit` raises if the graph may not request a step; `name` is the robot's.
    """

    def __init__(
        self,
        store: StepStore,
        date: Callable[[], str],
        *,
        clock: Clock | None = None,
        speed: float = 1.0,
        permit: Permit = anything,
        name: str | None = None,
    ) -> None:
        self._permit = permit
        self._name = name
        self._store = store
        self._date = date
        self._clock = clock_or_loop(clock)
        self._speed = max(1.0, speed)

    @asynccontextmanager
    async def open(self, graph: Graph) -> AsyncGenerator[Steps]:
        """Serve while the block runs; at its end, the step under way is cancelled and its result is stored."""
        task = graph.subscribe(f"{TASK.name}/status", "actionlib_msgs/GoalStatusArray", lambda _: None)

        def statuses() -> list[diagnostics.DiagnosticStatus]:
            return [diagnostics.bridge("firebase bridge", there=bool(task.writers))]

        async with (
            tasks() as working,
            bridged(graph, self._store, self._date, self._permit, name=self._name, speed=self._speed) as steps,
        ):
            working.begin(diagnosed(graph, statuses, self._clock, self._speed), "diagnostics")
            try:
                yield steps
            finally:
                task.close()
