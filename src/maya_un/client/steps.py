"""Steps that the client's plans yield to a driver: values, no input or output.

A plan is a generator: it yields steps, is sent their answers, and returns what the verb answers. A driver that blocks
and one that awaits carry out the same plans, so that nothing about the service is said twice.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import dataclass
from typing import Any, Generic, NewType, Protocol, TypeVar

from maya_un.client.request import Request

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
