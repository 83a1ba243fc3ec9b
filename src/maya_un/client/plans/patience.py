"""How long the client waits, and what it asks again where the connection broke: only what may be said twice."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, TypeVar

from maya_un.client.request import Request
from maya_un.client.steps import Sleep
from maya_un.errors import ServiceNotAnswering, ServiceNotRunning, TooManyRequests

T = TypeVar("T")

PATIENCE = 20.0
"""Total time to wait for a service that does not answer [s]; a `maya up` restarts in less."""

SHORTEST, LONGEST = 0.05, 2.0
"""The first rest, and the longest [s]; each is twice the one before."""


def persistently(request: Request[T], patience: float = PATIENCE) -> Generator[Request[T] | Sleep, Any, T]:
    """Ask, and ask again where no answer came, until so much time was rested; raises what the last try raised.

    For requests that only read, and for those with an idempotency key.
    """
    rested, rest = 0.0, SHORTEST
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
            pause, rest = rest, min(2.0 * rest, LONGEST)
        yield from Sleep(pause)
        rested += pause


def _asked_to_wait(error: TooManyRequests) -> float:
    try:
        return max(SHORTEST, float(str(error.details["wait"])))
    except (KeyError, ValueError):
        return 1.0
