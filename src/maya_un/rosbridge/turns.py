"""Turns of the loop, shared by all clients: who says much at once delays others no more than who says little."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable

from maya_un.rosbridge.limits import AT_ONCE, LONGEST_TURN

Step = Callable[[], bool]
"""Carries out one message of a client; tells whether another can be carried out now."""


class MessageScheduler:
    """Carries out messages of all clients in line, one of each, so many in a turn of the loop.

    What a message sets going runs in the loop's turns too: were more begun in one than it can bear, each hop of a stop
    that somebody else asks for would wait for all of them. `clock` tells the time [s], normally the running loop's.
    """

    def __init__(self, clock: Callable[[], float] | None = None) -> None:
        self._loop = asyncio.get_running_loop()
        self._clock = clock or self._loop.time
        self._waiting: deque[Step] = deque()
        self._left = 0
        self._until = 0.0
        self._running = False

    def give(self, step: Step) -> None:
        """Call `step` again and again until it tells that there is no more, now and in later turns."""
        self._waiting.append(step)
        if not self._running:
            self._begin()
        self._work()

    def _begin(self) -> None:
        self._running = True
        self._left = AT_ONCE
        self._until = self._clock() + LONGEST_TURN
        self._loop.call_soon(self._end)

    def _work(self) -> None:
        while self._waiting and self._left:
            self._left -= 1
            step = self._waiting.popleft()
            if step():
                self._waiting.append(step)
            if self._clock() >= self._until:
                self._left = 0

    def _end(self) -> None:
        """Begin the next turn, if there is anything to do in it."""
        self._running = False
        if self._waiting:
            self._begin()
            self._work()
