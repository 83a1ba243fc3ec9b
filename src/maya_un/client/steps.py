"""Plans of the client: their steps, the plan runner, retry, and methods made from plans.

A plan is a generator: it yields steps, receives their answers, and returns the result. A blocking and an asynchronous
driver execute the same plans, so each request to the service is described only once.
"""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Callable, Coroutine, Generator, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Generic, NewType, ParamSpec, Protocol, TypeVar, cast, overload

from maya_un.client.request import Request
from maya_un.errors import ServiceNotAnswering, ServiceNotRunning, TooManyRequests

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)


@dataclass(frozen=True, slots=True)
class Sleep:
    """Sleep for `seconds` of real time."""

    seconds: float

    def __iter__(self) -> Generator[Sleep, Any, None]:
        """Yield this step."""
        yield self


@dataclass(frozen=True, slots=True)
class ReadClock:
    """Read a monotonic clock [s, real time]."""

    def __iter__(self) -> Generator[ReadClock, Any, float]:
        """Yield this step, and return the time."""
        return (yield self)


Line = NewType("Line", object)
"""An open websocket of a driver."""


@dataclass(frozen=True, slots=True)
class Connect:
    """Open the websocket at `path`; it is closed at the end of the plan, or when the plan connects again."""

    path: str

    def __iter__(self) -> Generator[Connect, Any, Line]:
        """Yield this step, and return the websocket."""
        return (yield self)


@dataclass(frozen=True, slots=True)
class Send:
    """Send a message over a websocket."""

    line: Line
    message: Mapping[str, object]

    def __iter__(self) -> Generator[Send, Any, None]:
        """Yield this step."""
        yield self


@dataclass(frozen=True, slots=True)
class Receive:
    """Wait for the next message of a websocket; with `now`, return None if no message has arrived yet."""

    line: Line
    now: bool = False

    def __iter__(self) -> Generator[Receive, Any, str | bytes | None]:
        """Yield this step, and return the message."""
        return (yield self)


@dataclass(frozen=True, slots=True)
class Emit(Generic[T]):
    """Pass a value to the iterator over the plan."""

    value: T


Step = Request[Any] | Sleep | ReadClock | Connect | Send | Receive
"""The steps that every driver executes."""


class Plan(Protocol[T_co]):
    """A sequence of steps with a result."""

    def __iter__(self) -> Generator[Step, Any, T_co]:
        """Start the plan."""
        ...


class StreamPlan(Protocol[T]):
    """A sequence of steps that emits items."""

    def __iter__(self) -> Generator[Step | Emit[T], Any, None]:
        """Start the plan."""
        ...


RunnerResult = TypeVar("RunnerResult")


class PlanRunner(Generic[RunnerResult]):
    """Runs a plan; the driver passes the outcome of each `step` to `answered` or `failed`, until `step` is None."""

    def __init__(self, plan: Plan[RunnerResult] | StreamPlan[Any]) -> None:
        self._steps: Generator[Any, Any, Any] = iter(plan)
        self._result: object = None
        self.step: Step | Emit[Any] | None = None
        self._go(lambda: next(self._steps))

    @property
    def result(self) -> RunnerResult:
        """The result of the plan, after its last step."""
        return cast("RunnerResult", self._result)

    def answered(self, answer: object) -> None:
        """Continue with the answer to the step; raises what the plan raises."""
        self._go(lambda: self._steps.send(answer))

    def failed(self, error: BaseException) -> None:
        """Raise the error of the step in the plan, and continue if the plan handles it; else raise it here."""
        self._go(lambda: self._steps.throw(error))

    def close(self) -> None:
        """End the plan at its current step."""
        self._steps.close()

    def _go(self, on: Callable[[], Any]) -> None:
        self.step = None
        try:
            self.step = on()
        except StopIteration as end:
            self._result = end.value


Retried = TypeVar("Retried")

RETRY_TIMEOUT = 20.0
"""Total waiting time for a service that does not answer [s]; a restart of `maya up` takes less."""

SHORTEST_PAUSE, LONGEST_PAUSE = 0.05, 2.0
"""The first and the longest pause [s]; each pause is twice the previous one."""


def persistently(
    request: Request[Retried], patience: float = RETRY_TIMEOUT
) -> Generator[Request[Retried] | Sleep, Any, Retried]:
    """Send a request, and repeat it without an answer until the pauses add up to `patience` [s]; raises the last error.

    For requests that only read, and for those with an idempotency key.
    """
    rested, rest = 0.0, SHORTEST_PAUSE
    while True:
        try:
            return (yield from request)
        except TooManyRequests as error:
            if rested >= patience:
                raise
            pause = _asked_to_wait(error)
        except (ServiceNotAnswering, ServiceNotRunning):
            if rested >= patience:
                raise
            pause, rest = rest, min(2.0 * rest, LONGEST_PAUSE)
        yield from Sleep(pause)
        rested += pause


def _asked_to_wait(error: TooManyRequests) -> float:
    try:
        return max(SHORTEST_PAUSE, float(str(error.details["wait"])))
    except (KeyError, ValueError):
        return 1.0


VerbParameters = ParamSpec("VerbParameters")
VerbResult = TypeVar("VerbResult")


class Blocking(ABC):
    """A driver that executes plans and returns when they are done."""

    @abstractmethod
    def perform(self, plan: Plan[VerbResult]) -> VerbResult:
        """Return the result of a plan; raises what the plan raises."""

    @abstractmethod
    def iterate(self, source: StreamPlan[VerbResult]) -> Iterator[VerbResult]:
        """Yield the items of a plan as they arrive."""


class Awaiting(ABC):
    """A driver that executes plans in an event loop."""

    @abstractmethod
    async def perform(self, plan: Plan[VerbResult]) -> VerbResult:
        """Return the result of a plan; raises what the plan raises."""

    @abstractmethod
    def iterate(self, source: StreamPlan[VerbResult]) -> AsyncIterator[VerbResult]:
        """Yield the items of a plan as they arrive."""


class Described:
    """The common part of methods: docstring and signature for `help`."""

    def __init__(self, describe: Callable[..., Any], given: int = 0) -> None:
        self.__doc__ = describe.__doc__
        self.__name__ = describe.__name__
        self.__signature__ = _signature(describe, given)

    def bound(self, described: Callable[..., Any], carry_out: Callable[[Any], Any]) -> Callable[..., Any]:
        """Return a method that executes the plan of its arguments."""

        def method(*args: Any, **kwargs: Any) -> Any:
            return carry_out(described(*args, **kwargs))

        method.__doc__, method.__name__, method.__qualname__ = self.__doc__, self.__name__, self.__name__
        method.__signature__ = self.__signature__  # type: ignore[attr-defined]
        return method


def _signature(describe: Callable[..., Any], given: int) -> inspect.Signature:
    """Return the signature without the given parameters, with the result of the plan as return type."""
    whole = inspect.signature(describe)
    inner = str(whole.return_annotation).partition("[")[2].removesuffix("]")
    return whole.replace(parameters=list(whole.parameters.values())[given:], return_annotation=inner or None)


class Verb(Described, Generic[VerbParameters, VerbResult]):
    """A method of a client: a blocking client returns the answer, an asynchronous client a coroutine."""

    def __init__(self, describe: Callable[VerbParameters, Plan[VerbResult]]) -> None:
        super().__init__(describe)
        self.describe = describe

    @overload
    def __get__(self, client: None, owner: type[object]) -> Verb[VerbParameters, VerbResult]: ...
    @overload
    def __get__(self, client: Blocking, owner: type[object]) -> Callable[VerbParameters, VerbResult]: ...
    @overload
    def __get__(
        self, client: Awaiting, owner: type[object]
    ) -> Callable[VerbParameters, Coroutine[Any, Any, VerbResult]]: ...
    def __get__(self, client: Blocking | Awaiting | None, owner: type[object]) -> Any:
        """Return the bound method of a client, or the verb itself for the class."""
        return self if client is None else self.bound(self.describe, client.perform)


class Stream(Described, Generic[VerbParameters, VerbResult]):
    """Like `Verb`, for plans that emit items."""

    def __init__(self, describe: Callable[VerbParameters, StreamPlan[VerbResult]]) -> None:
        super().__init__(describe)
        self.describe = describe

    @overload
    def __get__(self, client: None, owner: type[object]) -> Stream[VerbParameters, VerbResult]: ...
    @overload
    def __get__(self, client: Blocking, owner: type[object]) -> Callable[VerbParameters, Iterator[VerbResult]]: ...
    @overload
    def __get__(self, client: Awaiting, owner: type[object]) -> Callable[VerbParameters, AsyncIterator[VerbResult]]: ...
    def __get__(self, client: Blocking | Awaiting | None, owner: type[object]) -> Any:
        """Return the bound method of a client, or the stream itself for the class."""
        return self if client is None else self.bound(self.describe, client.iterate)
