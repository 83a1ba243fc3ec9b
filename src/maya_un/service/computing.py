"""Work for callers of the service, in a worker process if there is one."""

from __future__ import annotations

from typing import TypeVar

from maya_un.service.access.operations import Caller
from maya_un.workers import Work, Workers

T = TypeVar("T")


class Computing:
    """Does the work of callers in `workers`, which serve all callers in turn; without workers at once, in this process.

    Every method raises the errors of the work, and with workers `TooMuchAsked`, `TakesTooLong`, `TooLarge` and
    `WorkerFailed`.
    """

    def __init__(self, workers: Workers | None) -> None:
        self.workers = workers

    async def value(self, by: Caller, work: Work[..., T], *args: object) -> T:
        """Return the result of `work`."""
        _, value = await self._done(by, work, *args)
        return value

    async def pieces(self, by: Caller, work: Work[..., None], *args: object) -> bytes:
        """Return the joined pieces that `work` yields."""
        parts, _ = await self._done(by, work, *args)
        return b"".join(parts)

    async def _done(self, by: Caller, work: Work[..., T], *args: object) -> tuple[list[bytes], T]:
        if self.workers is not None:
            return await self.workers.run(work, *args, whose=f"{by.name} {by.source}")
        parts: list[bytes] = []
        here = work(*args)
        while True:
            try:
                part = next(here)
            except StopIteration as end:
                return parts, end.value
            if part is not None:
                parts.append(part)
