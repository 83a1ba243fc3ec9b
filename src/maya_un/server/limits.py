"""How often somebody may ask: a bucket of requests for every source, filled again at a steady rate."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

from maya_un.api.access.sources import counted
from maya_un.errors import TooManyRequests

_MOST_SOURCES = 10_000


@dataclass(frozen=True, slots=True)
class Rate:
    """So many requests a second in the long run, and `burst` at once."""

    per_second: float
    burst: float


class Buckets:
    """The buckets of all sources. A source whose bucket is full again is forgotten."""

    def __init__(self, rate: Rate) -> None:
        self._rate = rate
        self._left: dict[str, tuple[float, float]] = {}

    def __len__(self) -> int:
        return len(self._left)

    def take(self, source: str, now: float) -> None:
        """Take one request of `source` at `now` [s, loop time]; raises `TooManyRequests`."""
        name = counted(source)
        burst = self._rate.burst
        left, then = self._left.pop(name, (burst, now))
        left = min(burst, left + (now - then) * self._rate.per_second)
        if left < 1.0:
            self._left[name] = (left, now)
            wait = ceil((1.0 - left) / self._rate.per_second)
            seconds = f"{burst / self._rate.per_second:g}"
            raise TooManyRequests(limit=round(burst), seconds=seconds, wait=wait)
        self._left[name] = (left - 1.0, now)
        if len(self._left) > _MOST_SOURCES:
            del self._left[next(iter(self._left))]  # the source of the oldest request has the most in its bucket
