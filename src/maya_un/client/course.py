"""A plan under way: the step that is next, and what the plan came to."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any, Generic, TypeVar, cast

from maya_un.client.steps import Emit, Plan, Step, StreamPlan

T = TypeVar("T")


class PlanRunner(Generic[T]):
    """Walks through a plan; whoever carries it out says after each `step` what came of it, until that is None."""

    def __init__(self, plan: Plan[T] | StreamPlan[Any]) -> None:
        self._steps: Generator[Any, Any, Any] = iter(plan)
        self._result: object = None
        self.step: Step | Emit[Any] | None = None
        self._go(lambda: next(self._steps))

    @property
    def result(self) -> T:
        """The result of the plan, after its last step."""
        return cast("T", self._result)

    def answered(self, answer: object) -> None:
        """Go on with the answer to the step; raises what the plan raises."""
        self._go(lambda: self._steps.send(answer))

    def failed(self, error: BaseException) -> None:
        """Go on where the plan has something to do about the error of its step; raises what it does not handle."""
        self._go(lambda: self._steps.throw(error))

    def close(self) -> None:
        """End it where it stands."""
        self._steps.close()

    def _go(self, on: Callable[[], Any]) -> None:
        self.step = None
        try:
            self.step = on()
        except StopIteration as end:
            self._result = end.value
