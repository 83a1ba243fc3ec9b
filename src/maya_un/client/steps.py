"""Steps that the client's plans yield to a driver: values, no input or output.

A plan is a generator: it yields steps, is sent their answers, and returns what the verb answers. A driver that blocks
and one that awaits carry out the same plans, so that nothing about the service is said twice.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, Generic, NamedTuple, NewType, Protocol, TypeVar
from urllib.parse import quote, urlencode

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)

TIMEOUT = 10.0
"""Longest wait for an ordinary answer [s]."""

Scalar = str | int | float | bool | None


class Answer(NamedTuple):
    """The type of an answer, named and not imported: `many` stands for a list of it."""

    module: str
    name: str
    many: bool = False

    def load(self) -> Any:
        """Import the type and return it."""
        kind = getattr(import_module(self.module), self.name)
        return list[kind] if self.many else kind


NOTHING = type(None)
"""The answer is not read."""

DATA: type[dict[str, Any]] = dict
"""The answer is read as JSON."""


@dataclass(frozen=True, slots=True)
class Request(Generic[T]):
    """A request, and the type of its `answer`; a plan of a single step.

    Values of the `query` that are None or empty are left out. `timeout` [s] is the longest wait for the answer. `key`
    is the idempotency key: the same key with the same request is the same request. An `urgent` request has a
    connection of its own, so that it waits for no other.
    """

    method: str
    path: str
    answer: type[T] | Answer
    query: Mapping[str, Scalar | Sequence[Scalar]] = field(default_factory=dict[str, Any])
    body: object = None
    timeout: float = TIMEOUT
    key: str = ""
    urgent: bool = False

    @property
    def target(self) -> str:
        """The path with the query."""
        said: list[tuple[str, str]] = []
        for key, values in self.query.items():
            several = values if isinstance(values, Sequence) and not isinstance(values, str) else (values,)
            said += [(key, _text(value)) for value in several if value is not None and value != ""]
        return self.path + ("?" + urlencode(said, errors="surrogatepass") if said else "")

    def __iter__(self) -> Generator[Request[T], Any, T]:
        """Ask, and return the answer."""
        return (yield self)


@dataclass(frozen=True, slots=True)
class Rest:
    """Let so many seconds of real time pass."""

    seconds: float

    def __iter__(self) -> Generator[Rest, Any, None]:
        """Rest."""
        yield self


@dataclass(frozen=True, slots=True)
class Clock:
    """Look at a clock that only goes forth [s, real time]."""

    def __iter__(self) -> Generator[Clock, Any, float]:
        """Look."""
        return (yield self)


Line = NewType("Line", object)
"""An open websocket, whatever the driver has for one."""


@dataclass(frozen=True, slots=True)
class Dial:
    """Open the websocket at `path`; it is closed when the plan is over, or dials again."""

    path: str

    def __iter__(self) -> Generator[Dial, Any, Line]:
        """Dial."""
        return (yield self)


@dataclass(frozen=True, slots=True)
class Say:
    """Send a message over a websocket."""

    line: Line
    message: Mapping[str, object]

    def __iter__(self) -> Generator[Say, Any, None]:
        """Say it."""
        yield self


@dataclass(frozen=True, slots=True)
class Hear:
    """Wait for the next message of a websocket, with `now` only for one that is there: None where there is none."""

    line: Line
    now: bool = False

    def __iter__(self) -> Generator[Hear, Any, str | bytes | None]:
        """Listen."""
        return (yield self)


@dataclass(frozen=True, slots=True)
class Item(Generic[T]):
    """Hand a value to whoever iterates over the plan."""

    value: T


Step = Request[Any] | Rest | Clock | Dial | Say | Hear
"""The steps that every driver carries out."""


class Plan(Protocol[T_co]):
    """Steps in order, and what they come to."""

    def __iter__(self) -> Generator[Step, Any, T_co]:
        """Begin."""
        ...


class Source(Protocol[T]):
    """Steps in order, and items between them."""

    def __iter__(self) -> Generator[Step | Item[T], Any, None]:
        """Begin."""
        ...


def _text(value: Scalar) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def quoted(name: str) -> str:
    """Return a name as a part of a path, whatever is in it."""
    return quote(name, safe="", errors="surrogatepass")


def said(body: Mapping[str, object]) -> dict[str, object]:
    """Return a body without what is None."""
    return {key: value for key, value in body.items() if value is not None}


def get(path: str, answer: type[T], timeout: float = TIMEOUT, **query: Scalar | Sequence[Scalar]) -> Request[T]:
    """Return the request for what stands at `path`."""
    return Request("GET", path, answer, query, timeout=timeout)
