"""One command at a time: it holds the slot, and the slot interrupts it when it must stop."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from math import inf
from typing import Any

from maya_un.errors import Busy, MayaError


class RunningCommand:
    """A command for motion or gripper that is running. `interrupted` completes with the error that ends it."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.interrupted: asyncio.Future[MayaError] = asyncio.get_running_loop().create_future()

    def interrupt(self, error: MayaError) -> None:
        """End the command with `error`, unless something else ended it first."""
        if not self.interrupted.done():
            self.interrupted.set_result(error)

    def check(self) -> None:
        """Raise the error that ends the command, if any."""
        if self.interrupted.done():
            raise self.interrupted.result()

    async def wait(self, until: float, news: asyncio.Future[Any] | None = None) -> None:
        """Wait until a loop time [s], which may be infinite, or until `news` come; raises the interrupting error."""
        remaining = until - asyncio.get_running_loop().time()
        if remaining > 0.0:
            awaited: set[asyncio.Future[Any]] = {self.interrupted}
            if news is not None:
                awaited.add(news)
            timeout = None if remaining == inf else remaining
            await asyncio.wait(awaited, timeout=timeout, return_when=asyncio.FIRST_COMPLETED)
        self.check()


class ExclusiveSlot:
    """Takes one command, and refuses the next with `Busy` until the first has ended."""

    def __init__(self) -> None:
        self.current: RunningCommand | None = None
        self._done = asyncio.Event()

    async def free(self) -> None:
        """Wait until the running command has ended."""
        while self.current is not None:
            await self._done.wait()

    @contextmanager
    def take(self, name: str) -> Iterator[RunningCommand]:
        """Hold the slot while the block runs; raises `Busy`."""
        if self.current is not None:
            raise Busy(doing=self.current.name)
        command = RunningCommand(name)
        self.current = command
        self._done.clear()
        try:
            yield command
        finally:
            self.current = None
            self._done.set()
