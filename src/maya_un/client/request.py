"""A request to a running Maya as a value. The command line loads this module at every start: it imports little."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from importlib import import_module
from typing import Any, Generic, NamedTuple, TypeVar
from urllib.parse import quote, urlencode

T = TypeVar("T")

TIMEOUT = 10.0
"""Longest wait for an ordinary answer [s]."""

Scalar = str | int | float | bool | None


class Answer(NamedTuple):
    """The type of an answer as module and name, to be imported late; with `many`, the answer is a list of it."""

    module: str
    name: str
    many: bool = False

    def load(self) -> Any:
        """Import the type and return it."""
        kind = getattr(import_module(self.module), self.name)
        return list[kind] if self.many else kind


NOTHING = type(None)
"""The content of the answer is ignored."""

DATA: type[dict[str, Any]] = dict
"""The answer is read as JSON."""


class Request(Generic[T]):
    """A request, and the type of its `answer`; a plan of a single step.

    Values of the `query` that are None are left out. `timeout` [s] is the longest wait for the answer. `key` is the
    idempotency key: a repeated request with the same key is carried out once. The key is sent as a header, so a key
    that is not printable ASCII raises `InvalidValue`. An `urgent` request uses a separate connection, so it waits for
    no other.
    """

    __slots__ = ("answer", "body", "key", "method", "path", "query", "timeout", "urgent")

    def __init__(
        self,
        method: str,
        path: str,
        answer: type[T] | Answer,
        query: Mapping[str, Scalar | Sequence[Scalar]] | None = None,
        body: object = None,
        timeout: float = TIMEOUT,
        key: str = "",
        urgent: bool = False,
    ) -> None:
        if key and not (key.isascii() and key.isprintable() and key == key.strip()):
            from maya_un.errors import InvalidValue  # noqa: PLC0415  # not needed at the start of the command line

            raise InvalidValue(
                key="key", value=repr(key), reason="it must be printable ASCII, without spaces around it"
            )
        self.method = method
        self.path = path
        self.answer: type[T] | Answer = answer
        self.query: Mapping[str, Scalar | Sequence[Scalar]] = query or {}
        self.body = body
        self.timeout = timeout
        self.key = key
        self.urgent = urgent

    @property
    def target(self) -> str:
        """The path with the query."""
        pairs: list[tuple[str, str]] = []
        for key, values in self.query.items():
            several = values if isinstance(values, Sequence) and not isinstance(values, str) else (values,)
            pairs += [(key, _text(value)) for value in several if value is not None]
        return self.path + ("?" + urlencode(pairs, errors="surrogatepass") if pairs else "")

    def within(self, timeout: float) -> Request[T]:
        """Return the same request with another timeout of the answer [s]."""
        return self._copy(timeout, self.urgent)

    def urgently(self) -> Request[T]:
        """Return the same request, to be sent over a separate connection."""
        return self._copy(self.timeout, urgent=True)

    def _copy(self, timeout: float, urgent: bool) -> Request[T]:
        return Request(self.method, self.path, self.answer, self.query, self.body, timeout, self.key, urgent)

    def __iter__(self) -> Generator[Request[T], Any, T]:
        """Send the request, and return its answer."""
        return (yield self)

    def __repr__(self) -> str:
        return f"<{self.method} {self.target} {self.body!r}>"


def get(path: str, answer: type[T], timeout: float = TIMEOUT, **query: Scalar | Sequence[Scalar]) -> Request[T]:
    """Return the request that reads `path`."""
    return Request("GET", path, answer, query, timeout=timeout)


def quoted(name: str) -> str:
    """Return a name as a part of a path; any character is allowed, and any name but "" is one part of the path."""
    if name in {".", ".."}:  # httpx would interpret them as path segments
        return "%2E" * len(name)
    return quote(name, safe="", errors="surrogatepass")


def changed(pairs: Mapping[str, tuple[Any, Any]]) -> dict[str, Any]:
    """Return the values that differ from their defaults; `pairs` contains tuples of value and default."""
    return {key: value for key, (value, default) in pairs.items() if not _same(value, default)}


def _same(value: object, default: object) -> bool:
    """Return whether a value equals its default; True differs from 1, but an empty list equals an empty tuple."""
    if default == ():
        return isinstance(value, Sequence) and not value
    return type(value) is type(default) and value == default


def _text(value: Scalar) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
