"""One wish at a time: who is at it, and how it learns that somebody said stop."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from math import inf
from typing import Any

from maya_un.errors import Busy, MayaError


class RunningCommand:
    """A motion or gripper wish under way. `interrupted` completes with the error that is to end it."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.interrupted: asyncio.Future[MayaError] = asyncio.get_running_loop().create_future()

    def interrupt(self, error: MayaError) -> None:
        """End the wish with `error`, unless something else ended it first."""
        if not self.interrupted.done():
            self.interrupted.set_result(error)

    def check(self) -> None:
        """Raise the error that is to end the wish, if there is one."""
        if self.interrupted.done():
            raise self.interrupted.result()

    async def wait(self, until: float, news: asyncio.Future[Any] | None = None) -> None:
        """Wait until a loop time [s], which may be infinite, or until `news` come; raises what interrupts the wish."""
        remaining = until - asyncio.get_running_loop().time()
        if remaining > 0.0:
            awaited: set[asyncio.Future[Any]] = {self.interrupted}
            if news is not None:
                awaited.add(news)
            timeout = None if remaining == inf else remaining
            await asyncio.wait(awaited, timeout=timeout, return_when=asyncio.FIRST_COMPLETED)
        self.check()


class ExclusiveSlot:
    """Takes one wish and refuses the next with `Busy` until the first is done."""

    def __init__(self) -> None:
        self.current: RunningCommand | None = None
        self._done = asyncio.Event()

    async def free(self) -> None:
        """Wait until the wish under way is done."""
        while self.current is not None:
            await self._done.wait()

    @contextmanager
    def take(self, name: str) -> Iterator[RunningCommand]:
        """Hold the desk for the block; raises `Busy`."""
        if self.current is not None:
            raise Busy(doing=self.current.name)
        wish = RunningCommand(name)
        self.current = wish
        self._done.clear()
        try:
            yield wish
        finally:
            self.current = None
            self._done.set()
