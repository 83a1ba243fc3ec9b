"""Plans of the client: their steps, the plan runner, retry, and the methods made of plans.

A plan is a generator: it yields steps, is sent their answers, and returns what the verb answers. A driver that blocks
and one that awaits carry out the same plans, so that nothing about the service is said twice.
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
    """Let so many seconds of real time pass."""

    seconds: float

    def __iter__(self) -> Generator[Sleep, Any, None]:
        """Rest."""
        yield self


@dataclass(frozen=True, slots=True)
class ReadClock:
    """Look at a clock that only goes forth [s, real time]."""

    def __iter__(self) -> Generator[ReadClock, Any, float]:
        """Look."""
        return (yield self)


Line = NewType("Line", object)
"""An open websocket, whatever the driver has for one."""


@dataclass(frozen=True, slots=True)
class Connect:
    """Open the websocket at `path`; it is closed when the plan is over, or dials again."""

    path: str

    def __iter__(self) -> Generator[Connect, Any, Line]:
        """Dial."""
        return (yield self)


@dataclass(frozen=True, slots=True)
class Send:
    """Send a message over a websocket."""

    line: Line
    message: Mapping[str, object]

    def __iter__(self) -> Generator[Send, Any, None]:
        """Say it."""
        yield self


@dataclass(frozen=True, slots=True)
class Receive:
    """Wait for the next message of a websocket, with `now` only for one that is there: None where there is none."""

    line: Line
    now: bool = False

    def __iter__(self) -> Generator[Receive, Any, str | bytes | None]:
        """Listen."""
        return (yield self)


@dataclass(frozen=True, slots=True)
class Emit(Generic[T]):
    """Hand a value to whoever iterates over the plan."""

    value: T


Step = Request[Any] | Sleep | ReadClock | Connect | Send | Receive
"""The steps that every driver carries out."""


class Plan(Protocol[T_co]):
    """Steps in order, and what they come to."""

    def __iter__(self) -> Generator[Step, Any, T_co]:
        """Begin."""
        ...


class StreamPlan(Protocol[T]):
    """Steps in order, and items between them."""

    def __iter__(self) -> Generator[Step | Emit[T], Any, None]:
        """Begin."""
        ...


RunnerResult = TypeVar("RunnerResult")


class PlanRunner(Generic[RunnerResult]):
    """Walks through a plan; whoever carries it out says after each `step` what came of it, until that is None."""

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


Retried = TypeVar("Retried")

RETRY_TIMEOUT = 20.0
"""Total time to wait for a service that does not answer [s]; a `maya up` restarts in less."""

SHORTEST_PAUSE, LONGEST_PAUSE = 0.05, 2.0
"""The first rest, and the longest [s]; each is twice the one before."""


def persistently(
    request: Request[Retried], patience: float = RETRY_TIMEOUT
) -> Generator[Request[Retried] | Sleep, Any, Retried]:
    """Ask, and ask again where no answer came, until so much time was rested; raises what the last try raised.

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
    """A driver that carries plans out and returns when they are done."""

    @abstractmethod
    def perform(self, plan: Plan[VerbResult]) -> VerbResult:
        """Return what a plan comes to; raises what it raises."""

    @abstractmethod
    def iterate(self, source: StreamPlan[VerbResult]) -> Iterator[VerbResult]:
        """Yield the items of a plan as they come."""


class Awaiting(ABC):
    """A driver that carries plans out in an event loop."""

    @abstractmethod
    async def perform(self, plan: Plan[VerbResult]) -> VerbResult:
        """Return what a plan comes to; raises what it raises."""

    @abstractmethod
    def iterate(self, source: StreamPlan[VerbResult]) -> AsyncIterator[VerbResult]:
        """Yield the items of a plan as they come."""


class Described:
    """The common part of methods: docstrings and arguments, as help shows them."""

    def __init__(self, describe: Callable[..., Any], given: int = 0) -> None:
        self.__doc__ = describe.__doc__
        self.__name__ = describe.__name__
        self.__signature__ = _signature(describe, given)

    def bound(self, described: Callable[..., Any], carry_out: Callable[[Any], Any]) -> Callable[..., Any]:
        """Return the method that has a plan carried out."""

        def method(*args: Any, **kwargs: Any) -> Any:
            return carry_out(described(*args, **kwargs))

        method.__doc__, method.__name__, method.__qualname__ = self.__doc__, self.__name__, self.__name__
        method.__signature__ = self.__signature__  # type: ignore[attr-defined]
        return method


def _signature(describe: Callable[..., Any], given: int) -> inspect.Signature:
    """Return the arguments without those that are given, and what a plan comes to instead of the plan."""
    whole = inspect.signature(describe)
    inner = str(whole.return_annotation).partition("[")[2].removesuffix("]")
    return whole.replace(parameters=list(whole.parameters.values())[given:], return_annotation=inner or None)


class Verb(Described, Generic[VerbParameters, VerbResult]):
    """A method of a client: on one that blocks it returns the answer, on one that awaits a coroutine of it."""

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
        """Return the method of a client, or of the class the verb itself."""
        return self if client is None else self.bound(self.describe, client.perform)


class Stream(Described, Generic[VerbParameters, VerbResult]):
    """Like `Verb`, of what is iterated over."""

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
        """Return the method of a client, or of the class the stream itself."""
        return self if client is None else self.bound(self.describe, client.iterate)
