"""The order of requests: one slice for each client, in turn, and of each client the oldest request first."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any

from maya_un.errors import TooMuchAsked

OPEN = 4
"""Most people whose requests are under way at once in a worker; others need no memory yet."""


@dataclass(eq=False, slots=True)
class WorkRequest:
    """Something to be worked out: `payload` says what, `whose` for whom.

    `began` tells that the worker knows it, `parts` what it has handed over, `again` that it was begun once more
    after a worker had failed. It is `dropped` where nobody waits for it any more.
    """

    number: int
    whose: str
    payload: bytes
    answer: Future[Any] = field(default_factory=Future[Any])
    parts: list[Any] = field(default_factory=list[Any])
    began: bool = False
    again: bool = False
    dropped: bool = False


class RoundRobin:
    """Holds requests, `most` in all and `each` of one principal; callers ensure that one thread acts at a time."""

    def __init__(self, most: int, each: int) -> None:
        self._most = most
        self._each = each
        self._waiting: dict[str, deque[WorkRequest]] = {}

    def __len__(self) -> int:
        return sum(map(len, self._waiting.values()))

    def __iter__(self) -> Any:
        return (request for requests in self._waiting.values() for request in requests)

    def put(self, request: WorkRequest, each: int | None = None) -> None:
        """Take a request in, where there are not `each` of the same one already; raises `TooMuchAsked`."""
        each = self._each if each is None else each
        if len(self._waiting.get(request.whose, ())) >= each:
            raise TooMuchAsked(most=each)
        if len(self) >= self._most:
            raise TooMuchAsked(most=self._most)
        self._waiting.setdefault(request.whose, deque()).append(request)

    def next(self) -> WorkRequest | None:
        """Return the request whose turn it is, and let the others of the circle come before its next; None for none."""
        began = sum(requests[0].began for requests in self._waiting.values())
        for whose, requests in self._waiting.items():
            if requests[0].began or began < OPEN:
                self._waiting[whose] = self._waiting.pop(whose)
                return requests[0]
        return None

    def remove(self, request: WorkRequest) -> None:
        """Take a request out."""
        requests = self._waiting.get(request.whose)
        if requests is not None and request in requests:
            requests.remove(request)
            if not requests:
                del self._waiting[request.whose]

    def each(self, do: Callable[[WorkRequest], None]) -> None:
        """Do something to all of them."""
        for request in list(self):
            do(request)
