"""Plans carried out against a script, with a clock of their own: no socket, no waiting."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from maya_un.client.request import Request
from maya_un.client.steps import Connect, Emit, Line, Plan, PlanRunner, ReadClock, Receive, Send, Sleep, StreamPlan

T = TypeVar("T")

Script = Callable[[Request[Any]], Any]
"""From a request to its answer; an exception that it returns is raised into the plan."""


class Player:
    """Carries plans out; `asked` are the requests in order, `now` is what the rests come to [s].

    `heard` are the messages of a websocket in order, an exception among them breaks the connection there; `said` has
    the messages of the plan.
    """

    def __init__(self, script: Script | None = None, heard: list[Any] | None = None) -> None:
        self._script = script
        self.heard = heard or []
        self.asked: list[Request[Any]] = []
        self.said: list[Any] = []
        self.dialled = 0
        self.now = 0.0

    def perform(self, plan: Plan[T]) -> T:
        """Return what a plan comes to."""
        course: PlanRunner[T] = PlanRunner(plan)
        while course.step is not None:
            self._advance(course)
        return course.result

    def items(self, source: StreamPlan[T], most: int) -> list[T]:
        """Return the first items of a source."""
        course: PlanRunner[None] = PlanRunner(source)
        found: list[T] = []
        while course.step is not None and len(found) < most:
            if isinstance(course.step, Emit):
                found.append(course.step.value)
            self._advance(course)
        course.close()
        return found

    @property
    def paths(self) -> list[str]:
        """The requests, in short."""
        return [f"{request.method} {request.path}" for request in self.asked]

    def _advance(self, course: PlanRunner[Any]) -> None:
        answer = self._answer(course.step)
        if isinstance(answer, BaseException):
            course.failed(answer)
        else:
            course.answered(answer)

    def _answer(self, step: object) -> Any:  # noqa: PLR0911 - one answer a kind of step
        match step:
            case Request():
                self.asked.append(step)
                assert self._script is not None
                return self._script(step)
            case Sleep(seconds):
                self.now += seconds
                return None
            case ReadClock():
                return self.now
            case Connect():
                self.dialled += 1
                return Line(object())
            case Send(_, message):
                self.said.append(message)
                return None
            case Receive(_, now):
                if now and (not self.heard or isinstance(self.heard[0], BaseException)):
                    return None
                return self.heard.pop(0)
            case _:
                return None
