"""How often somebody may be wrong: failed attempts to sign in are counted by where they come from."""

from __future__ import annotations

from collections import deque
from math import ceil

from maya_un.api.access.sources import counted
from maya_un.errors import TooManyRequests

LIMIT = 10
"""Failed attempts of one source within `WINDOW`."""

WINDOW = 60.0
"""How long a failed attempt counts [s, real time]."""

_MOST_SOURCES = 10_000


class Attempts:
    """Counts attempts by source; `scale` is how fast the loop's clock runs.

    An attempt counts from its beginning, so that many at a time are not all let in before the first has failed.
    """

    def __init__(self, scale: float = 1.0) -> None:
        self._scale = max(1.0, scale)
        self._by_source: dict[str, deque[float]] = {}

    def begin(self, source: str, now: float) -> None:
        """Count an attempt at `now` [s, loop time]; raises `TooManyRequests`."""
        source = counted(source)
        window = WINDOW * self._scale
        past = self._by_source.pop(source, None) or deque[float]()
        self._by_source[source] = past
        while past and past[0] <= now - window:
            past.popleft()
        if len(past) >= LIMIT:
            wait = ceil((past[0] + window - now) / self._scale)
            raise TooManyRequests(limit=LIMIT, seconds=f"{WINDOW:.0f}", wait=wait)
        past.append(now)
        if len(self._by_source) > _MOST_SOURCES:
            del self._by_source[next(iter(self._by_source))]

    def succeeded(self, source: str) -> None:
        """Take the latest attempt back: it was right."""
        source = counted(source)
        past = self._by_source.get(source)
        if past:
            past.pop()
        if not past:
            self._by_source.pop(source, None)
