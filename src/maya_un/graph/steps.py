"""Steps of a process that comes from elsewhere: /step_command, carried out as a task, answered on /step_result.

Every command has one result. An id is carried out at most once, whatever happens: that it begins is on the disk before
anything moves, and what was under way when this program ended is never repeated; its result is `INTERRUPTED`. The same
command once more is answered with the result that there is. One step at a time: another one meanwhile is refused, and
may come again.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from typing import Any, NamedTuple
from uuid import uuid4

from maya_un.api.access.operations import Operation
from maya_un.errors import Busy, Cancelled, InternalError, KeyReused, MayaError, NodeGone, StorageFailed
from maya_un.graph.attended import Permit, anything
from maya_un.graph.primitives import to_message
from maya_un.graph.protocol import Ended, Graph, Message, Outcome, Publisher
from maya_un.graph.step import INTERRUPTED, Result, Step, id_of, read, step_of
from maya_un.graph.step_store import Kept, StepStore
from maya_un.graph.table import STEP_COMMAND, STEP_RESULT, TASK

_LOOK = 0.5
"""How often it is looked whether anybody listens to results [s]."""

Do = Callable[[Message], Awaitable[Ended]]
"""Has the goal of a task carried out; raises `NodeGone` where nobody is there to do so."""

_UNKNOWN = (
    f"{INTERRUPTED}: the program ended while this step was under way. It is not known how far it came, and it is not "
    "repeated; look at the robot."
)
_NAMELESS = "it came without an id, so the same command again would be carried out again"


class _Ending(NamedTuple):
    """Code and sentence of what ended a step early; and whether any of it can have been done."""

    error: tuple[str | None, str | None]
    begun: bool = True

    @classmethod
    def by(cls, error: MayaError, *, begun: bool = True) -> _Ending:
        return cls((str(error.code), str(error)), begun)


class _UnderWay(NamedTuple):
    """The step under way, and its result to come."""

    id: str
    result: asyncio.Task[Result]


class Steps:
    """Carries out steps, one at a time, each at most once.

    `do` has a task carried out, `date` tells the date (ISO 8601, UTC); a target is checked by the robot floor. `permit`
    raises where nobody may ask for a step.
    """

    def __init__(self, store: StepStore, do: Do, date: Callable[[], str], permit: Permit = anything) -> None:
        self._permit = permit
        self._store = store
        self._do = do
        self._date = date
        self._turn = asyncio.Lock()
        self._under_way: _UnderWay | None = None
        self._doing: asyncio.Task[Ended] | None = None
        self._closed = False

    async def take_up(self) -> list[Result]:
        """Return the results that nobody was told before the program ended: what was under way is `INTERRUPTED`."""
        return [await self._taken_up(kept) for kept in await self._store.unfinished()]

    async def answer(self, text: str) -> Result:
        """Return how the step ended that a command asks for, or why it is refused; never raises a `MayaError`."""
        date, id_ = self._date(), None
        warnings: tuple[str, ...] = ()
        try:
            data = read(text)
            id_ = id_of(data)
            if id_ is None:
                id_, warnings = f"maya-{uuid4().hex}", (_NAMELESS,)
            step = step_of(data, id_)
            step = replace(step, warnings=(*warnings, *step.warnings))
            self._permit(Operation.WISH)
            task = await self._admitted(step, date)
        except MayaError as error:
            return Result.refused(id_, error, date, warnings)
        return task if isinstance(task, Result) else await asyncio.shield(task)

    async def told(self, result: Result) -> None:
        """Keep that somebody was told of a result; where that cannot be, the next run tells it again."""
        with suppress(StorageFailed):
            await self._store.told(result)

    async def close(self) -> None:
        """End the step under way on its path, and return when its result is kept."""
        self._closed = True
        if self._doing is not None:
            self._doing.cancel()
        if self._under_way is not None:
            await asyncio.wait({self._under_way.result})

    async def _admitted(self, step: Step, date: str) -> Result | asyncio.Task[Result]:
        """Begin a step, or return what is known of it; raises `KeyReused`, `Busy`, `StorageFailed`."""
        async with self._turn:
            kept = await self._store.find(step.id)
            under_way = self._under_way
            if kept is not None:
                if kept.digest != step.digest:
                    raise KeyReused(key=step.id)
                if under_way is not None and under_way.id == step.id:
                    return under_way.result
                return kept.result or await self._taken_up(kept)
            if under_way is not None:
                raise Busy(doing=f"step {under_way.id}")
            if self._closed:
                raise Cancelled
            await self._store.begin(step.id, step.digest, date, step.warnings)
            task = asyncio.get_running_loop().create_task(self._carry_out(step, date), name="step")
            self._under_way = _UnderWay(step.id, task)
            return task

    async def _carry_out(self, step: Step, started: str) -> Result:
        """Carry out a step that is kept as begun, and keep how it ended."""
        self._doing = asyncio.get_running_loop().create_task(self._ended(step), name="step's task")
        try:
            await asyncio.wait({self._doing})
            ending = _ending(self._doing)
            code, sentence = ending.error
            result = Result(step.id, sentence, code, started, self._date(), step.warnings)
            await self._keep(result, begun=ending.begun)
            return result
        finally:
            self._under_way = self._doing = None

    async def _ended(self, step: Step) -> Ended:
        return await self._do({"task": to_message(step.primitive)})

    async def _keep(self, result: Result, *, begun: bool) -> None:
        """Keep a result, or forget a step of which nothing was done, so that it may come again.

        Where that cannot be written, the step will be `INTERRUPTED` for the next run of this program.
        """
        assert result.id is not None
        try:
            await (self._store.end(result.id, result) if begun else self._store.forget(result.id))
        except MayaError as error:
            message = f"the result of step {result.id} was not kept: {error}"
            asyncio.get_running_loop().call_exception_handler({"message": message, "exception": error})

    async def _taken_up(self, kept: Kept) -> Result:
        """Return the result of a step that is not under way, `INTERRUPTED` where it has none."""
        if kept.result is not None:
            return kept.result
        result = Result(kept.id, _UNKNOWN, INTERRUPTED, kept.started, self._date(), kept.warnings)
        await self._store.end(kept.id, result)
        return result


@asynccontextmanager
async def bridged(
    graph: Graph, store: StepStore, date: Callable[[], str], permit: Permit = anything
) -> AsyncIterator[Steps]:
    """Carry out the steps of /step_command on the robot behind /task while the block runs, as far as `permit` says.

    First the results are told that an earlier run could not tell, as soon as anybody listens.
    """
    steps = Steps(store, lambda goal: graph.do(TASK.name, TASK.type, goal), date, permit)
    publisher = graph.advertise(STEP_RESULT.name, STEP_RESULT.type, queue_size=STEP_RESULT.queue_size)
    tasks: set[asyncio.Task[None]] = set()

    def begin(work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        tasks.add(task)
        task.add_done_callback(tasks.discard)

    async def answer(text: str) -> None:
        await _tell(publisher, steps, await steps.answer(text))

    for result in await steps.take_up():
        begin(_tell(publisher, steps, result))
    heard = graph.subscribe(
        STEP_COMMAND.name,
        STEP_COMMAND.type,
        lambda message: begin(answer(message["data"])),
        queue_size=STEP_COMMAND.queue_size,
    )
    try:
        yield steps
    finally:
        heard.close()
        await steps.close()
        await _settled(tasks)
        publisher.close()


async def _tell(publisher: Publisher, steps: Steps, result: Result) -> None:
    """Publish a result as soon as anybody listens; who was told is kept, so that the next run does not tell again."""
    while not publisher.readers:  # noqa: ASYNC110 - they come and go elsewhere, and nobody says so
        await asyncio.sleep(_LOOK)
    publisher.publish({"data": result.text})
    await steps.told(result)


async def _settled(tasks: set[asyncio.Task[None]]) -> None:
    """Let what can be told now be told, and end what waits for a listener."""
    if tasks:
        await asyncio.wait(tasks, timeout=_LOOK / 2)
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


def _ending(doing: asyncio.Task[Ended]) -> _Ending:
    """Return how a step's task ended."""
    if doing.cancelled():
        return _Ending.by(Cancelled())
    defect = doing.exception()
    if isinstance(defect, MayaError):
        return _Ending.by(defect, begun=not isinstance(defect, NodeGone))
    if defect is not None:
        doing.get_loop().call_exception_handler({"message": "a step failed", "exception": defect})
        return _Ending.by(InternalError(reason=repr(defect)))
    ended = doing.result()
    if ended.outcome is Outcome.SUCCEEDED:
        return _Ending((None, None))
    if not ended.result:
        return _Ending.by(NodeGone(node=TASK.sources[0]))
    code, message = str(ended.result.get("code", "")), str(ended.result.get("message", ""))
    return _Ending((code, message), begun=ended.outcome is not Outcome.REJECTED or code != str(Busy.code))
