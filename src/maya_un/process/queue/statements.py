"""Carry out the statements of a job: waits, outputs, inputs, and questions to the operator.

A stop and a cancellation end a wait at once. In a pause its clock stands, and neither an input nor an answer ends it.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping

from dmc41x3.i18n import phrase
from maya_un.controller.protocol import Controller
from maya_un.errors import Cancelled, Faulted, InputTimeout, InternalError, InvalidValue, NotConnected, Stopped
from maya_un.events import InputAwaited, QuestionAsked
from maya_un.process.queue.entries import OpenQuestion, QueueEntry
from maya_un.process.spec.statements import (
    CANCEL,
    ELSE,
    THEN,
    AskOperator,
    Condition,
    JobStatement,
    SetOutput,
    Wait,
    WaitFor,
)
from maya_un.process.spec.tasks import Task
from maya_un.values import Mode, State

LOOK = 0.05
"""Period of reading an input [s]: that of the data records."""


_ROUNDING = 1e-6
"""A rest of a wait up to this [s] is over: differences of the clock are rounded, and would leave rests for ever."""


class StatementRunner:
    """Carries out statements with a controller."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller

    async def run(self, item: QueueEntry, task: Task, statement: JobStatement, answers: Mapping[int, str]) -> str:
        """Do a statement of a job; return the answer to a question, the branch of an `if`, "" for other statements.

        `answers` are those to earlier questions, by task. Raises `InputTimeout`, `Cancelled` for the answer that ends
        the job, `Stopped`, `Faulted`, `NotConnected`, and the errors of `Controller.output` and `Controller.input`.
        """
        item.waiting = True
        try:
            await self._until(_always, 0.0)  # the end of a pause
            match statement:
                case Wait():
                    await self._until(None, statement.seconds)
                case SetOutput():
                    number = statement.number(self._controller.config.controller, task.place)
                    await self._controller.output(number, on=statement.to == "on")
                case WaitFor():
                    await self._input(item, task, statement)
                case AskOperator():
                    return await self._answer(item, task, statement)
                case Condition():
                    return THEN if await self._holds(task, statement, answers) else ELSE
                case _:
                    raise InternalError(reason=repr(statement))
        finally:
            item.waiting = False
            item.question = None
        return ""

    async def _input(self, item: QueueEntry, task: Task, statement: WaitFor) -> None:
        number = statement.number(self._controller.config.controller, task.place)
        wanted = statement.level == "on"

        async def there() -> bool:
            return await self._controller.input(number) is wanted

        if not await there():
            self._controller.events.emit(InputAwaited(item.number, task.index, number, statement.level))
        if not await self._until(there, statement.within):
            shown = f"{statement.input} ({number})" if isinstance(statement.input, str) else number
            raise InputTimeout(input=shown, number=number, level=statement.level, seconds=statement.within or 0.0)

    async def _holds(self, task: Task, condition: Condition, answers: Mapping[int, str]) -> bool:
        if condition.input is None:
            return answers.get(task.asked) == condition.answer
        number = condition.number(self._controller.config.controller, task.place)
        return await self._controller.input(number) is (condition.level == "on")

    async def _answer(self, item: QueueEntry, task: Task, statement: AskOperator) -> str:
        loop = asyncio.get_running_loop()
        item.question = question = OpenQuestion(task.index, statement.question, statement.choices, loop.create_future())
        asked = QuestionAsked(item.number, task.index, statement.question, " / ".join(statement.choices))
        self._controller.events.emit(asked)

        async def answered() -> bool:
            return question.answered.done()

        await self._until(answered, None, question.answered)
        answer = question.answered.result()
        if answer == CANCEL:
            raise Cancelled
        return answer

    async def _until(
        self,
        holds: Callable[[], Awaitable[bool]] | None,
        seconds: float | None,
        news: asyncio.Future[str] | None = None,
    ) -> bool:
        """Return True once `holds`, False after `seconds` [s]; time in a pause counts for neither.

        `holds` is called every `LOOK` [s], or after every newer state and once `news` is done. Raises `Stopped`,
        `Faulted`, `NotConnected`.
        """
        loop, stops = asyncio.get_running_loop(), self._controller.stops
        left, newer = seconds, _Newer(self._controller)
        try:
            while True:
                state = self._controller.state
                _require_able(state)
                if self._controller.stops != stops:
                    raise Stopped
                paused = state.mode is Mode.PAUSED
                if not paused and holds is not None and await holds():
                    return True
                if not paused and left is not None and left <= _ROUNDING:
                    return False
                began = loop.time()
                bound = None if paused else left
                if holds is not None and news is None:  # reading an input makes a newer state itself
                    await asyncio.sleep(LOOK if bound is None else min(LOOK, bound))
                else:
                    await newer.wait(bound, None if paused else news)
                if not paused and left is not None:
                    left -= loop.time() - began
        finally:
            await newer.close()


class _Newer:
    """Waits for newer states of a controller."""

    def __init__(self, controller: Controller) -> None:
        self._states = controller.watch()
        self._next: asyncio.Task[State] | None = None
        self._over = False

    async def wait(self, seconds: float | None, news: asyncio.Future[str] | None) -> None:
        """Return after a newer state, after `seconds` [s], or once `news` is done."""
        if self._next is None and not self._over:
            self._next = asyncio.ensure_future(anext(self._states))
        awaited = {one for one in (self._next, news) if one is not None}
        if awaited:
            await asyncio.wait(awaited, timeout=seconds, return_when=asyncio.FIRST_COMPLETED)
        else:
            await asyncio.sleep(LOOK if seconds is None else seconds)
        if self._next is not None and self._next.done():
            self._over = self._next.exception() is not None
            self._next = None

    async def close(self) -> None:
        """Stop waiting."""
        if self._next is not None:
            self._next.cancel()
            await asyncio.wait({self._next})


def require_choice(question: OpenQuestion, answer: str) -> None:
    """Raise `InvalidValue` for an answer that the question does not offer."""
    if answer not in question.choices:
        choices = ", ".join(question.choices)
        raise InvalidValue(
            key="answer", value=repr(answer), reason=phrase("it must be one of {choices}", choices=choices)
        )


def _require_able(state: State) -> None:
    if state.mode is Mode.DISCONNECTED:
        raise NotConnected
    if state.mode is Mode.FAULT:
        raise Faulted(fault=state.fault.message if state.fault else "")


async def _always() -> bool:
    return True
