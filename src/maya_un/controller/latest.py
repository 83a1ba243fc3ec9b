"""The latest state, for any number of watchers."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable

from maya_un.values import State


class StateBroadcaster:
    """Holds the newest `state` and hands it to whoever watches; nobody waits for a slow watcher."""

    def __init__(self, state: State) -> None:
        self.state = state
        self._newer = asyncio.Event()

    def show(self, state: State) -> None:
        """Put a newer state in the place of the last, and wake whoever watches."""
        self.state = state
        self._newer.set()
        self._newer.clear()

    async def watch(self, shown: State | None = None) -> AsyncIterator[State]:
        """Yield the state now, unless it is the one `shown` before, and every newer one.

        A slow reader skips to the newest.
        """
        while True:
            if self.state is not shown:
                shown = self.state
                yield shown
            else:
                await self._newer.wait()

    async def until(self, holds: Callable[[], bool]) -> None:
        """Return when something holds; it is looked at now and whenever a newer state is shown."""
        while not holds():
            await self._newer.wait()
