"""A verb is described once, as a function that returns a plan, and is a method of both clients."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Callable, Coroutine, Iterator
from typing import Any, Generic, ParamSpec, TypeVar, overload

from maya_un.client.steps import Plan, StreamPlan

P = ParamSpec("P")
T = TypeVar("T")


class Blocking(ABC):
    """A driver that carries plans out and returns when they are done."""

    @abstractmethod
    def perform(self, plan: Plan[T]) -> T:
        """Return what a plan comes to; raises what it raises."""

    @abstractmethod
    def iterate(self, source: StreamPlan[T]) -> Iterator[T]:
        """Yield the items of a plan as they come."""


class Awaiting(ABC):
    """A driver that carries plans out in an event loop."""

    @abstractmethod
    async def perform(self, plan: Plan[T]) -> T:
        """Return what a plan comes to; raises what it raises."""

    @abstractmethod
    def iterate(self, source: StreamPlan[T]) -> AsyncIterator[T]:
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


class Verb(Described, Generic[P, T]):
    """A method of a client: on one that blocks it returns the answer, on one that awaits a coroutine of it."""

    def __init__(self, describe: Callable[P, Plan[T]]) -> None:
        super().__init__(describe)
        self.describe = describe

    @overload
    def __get__(self, client: None, owner: type[object]) -> Verb[P, T]: ...
    @overload
    def __get__(self, client: Blocking, owner: type[object]) -> Callable[P, T]: ...
    @overload
    def __get__(self, client: Awaiting, owner: type[object]) -> Callable[P, Coroutine[Any, Any, T]]: ...
    def __get__(self, client: Blocking | Awaiting | None, owner: type[object]) -> Any:
        """Return the method of a client, or of the class the verb itself."""
        return self if client is None else self.bound(self.describe, client.perform)


class Stream(Described, Generic[P, T]):
    """Like `Verb`, of what is iterated over."""

    def __init__(self, describe: Callable[P, StreamPlan[T]]) -> None:
        super().__init__(describe)
        self.describe = describe

    @overload
    def __get__(self, client: None, owner: type[object]) -> Stream[P, T]: ...
    @overload
    def __get__(self, client: Blocking, owner: type[object]) -> Callable[P, Iterator[T]]: ...
    @overload
    def __get__(self, client: Awaiting, owner: type[object]) -> Callable[P, AsyncIterator[T]]: ...
    def __get__(self, client: Blocking | Awaiting | None, owner: type[object]) -> Any:
        """Return the method of a client, or of the class the stream itself."""
        return self if client is None else self.bound(self.describe, client.iterate)
