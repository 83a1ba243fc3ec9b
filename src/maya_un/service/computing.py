"""Computations for callers: in worker processes where there are some, else at once."""

from __future__ import annotations

from typing import TypeVar

from maya_un.service.access.operations import Caller
from maya_un.workers import Work, Workers

T = TypeVar("T")


def whose(by: Caller) -> str:
    """Return the client of a caller's requests, as workers name it."""
    return f"{by.name} {by.source}"


async def computed(workers: Workers | None, by: Caller, work: Work[..., T], *args: object) -> T:
    """Return the result of `work`; raises its errors, and with workers `TooMuchAsked`, `TakesTooLong`, `WorkerFailed`.

    Without workers it blocks the loop, which only dry runs and tests do.
    """
    if workers is not None:
        return (await workers.run(work, *args, whose=whose(by))).value
    here = work(*args)
    while True:
        try:
            next(here)
        except StopIteration as end:
            return end.value
