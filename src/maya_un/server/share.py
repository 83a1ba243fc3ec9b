"""A share of the loop for work that may wait, like telling of the past, however many ask for it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

SHARE = 0.2
"""The share of the loop's time for all readers of the past together."""

LONGEST_PAUSE = 0.25
"""After a turn the next begins no later than this [s]; a turn may have taken long because others took the time."""


class LoopShare:
    """Gives turns, one after the other in the order asked for; behind each the loop is left to others for a while.

    The longer a turn took, the longer the pause, so that all of them have `share` of the time.
    """

    def __init__(self, share: float = SHARE) -> None:
        self._rest = 1.0 / share - 1.0
        self._turn = asyncio.Lock()
        self._free_at = 0.0

    @asynccontextmanager
    async def turn(self) -> AsyncIterator[None]:
        """Wait for a turn, which lasts as long as the block; nobody is to be waited for in it who may never answer."""
        loop = asyncio.get_running_loop()
        async with self._turn:
            await asyncio.sleep(self._free_at - loop.time())
            began = loop.time()
            try:
                yield
            finally:
                ended = loop.time()
                self._free_at = ended + min(self._rest * (ended - began), LONGEST_PAUSE)
