"""Send to clients in turns: answers always, messages of topics as fast as the client takes them."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import Protocol

from maya_ros.rosbridge.limits import ANSWERS_OWED, AT_ONCE, LONGEST_TURN, OWED
from maya_un.errors import StreamLagging

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


class SenderWire(Protocol):
    """What a sender needs of a wire: `full` while the other side is behind, `on_room` called when it is no more."""

    on_room: Callable[[], None] | None

    @property
    def full(self) -> bool:
        """Whether nothing more should be written now."""
        ...

    def write(self, frames: bytes) -> None:
        """Send whole frames without waiting."""
        ...

    def end(self, code: int, reason: str) -> None:
        """Close the connection."""
        ...


class Backlog:
    """What waits of one topic for a client that is behind: the newest `most` messages."""

    def __init__(self, most: int) -> None:
        self.most = most
        self.size = 0
        self._frames: deque[bytes] = deque()

    def __len__(self) -> int:
        return len(self._frames)

    def add(self, frames: bytes) -> int:
        """Add a message, and return by how many bytes there is more (or less) now."""
        before = self.size
        self._frames.append(frames)
        self.size += len(frames)
        while len(self._frames) > self.most:
            self.pop()
        return self.size - before

    def pop(self) -> bytes:
        """Take the oldest."""
        frames = self._frames.popleft()
        self.size -= len(frames)
        return frames


class Sender:
    """The way out to one client. Nothing here waits for it."""

    def __init__(self, outlet: SenderWire) -> None:
        self._outlet = outlet
        self._answers: deque[bytes] = deque()
        self._answers_size = 0
        self._behind: dict[Backlog, None] = {}
        self._owed = 0
        outlet.on_room = self._go_on

    @property
    def owed(self) -> int:
        """How much of topics waits for this client [bytes]."""
        return self._owed

    def answer(self, frames: bytes) -> None:
        """Send what the client waits for; one that takes no answers is disconnected."""
        if not self._outlet.full:
            self._outlet.write(frames)
            return
        self._answers.append(frames)
        self._answers_size += len(frames)
        if self._answers_size > ANSWERS_OWED:
            self._answers.clear()
            self._answers_size = 0
            self._outlet.end(StreamLagging.code, "answers are not read")

    def send(self, backlog: Backlog, frames: bytes) -> None:
        """Send a message of a topic now, or keep it until the client takes it and nothing newer has displaced it."""
        if not self._behind and not self._outlet.full:
            self._outlet.write(frames)
            return
        self._owed += backlog.add(frames)
        self._behind[backlog] = None
        while self._owed > OWED:
            self._drop()

    def forget(self, backlog: Backlog) -> None:
        """Send nothing any more of what waits."""
        if backlog in self._behind:
            del self._behind[backlog]
            self._owed -= backlog.size

    def _drop(self) -> None:
        fullest = max(self._behind, key=lambda one: one.size)
        self._owed -= len(fullest.pop())
        if not fullest:
            del self._behind[fullest]

    def _go_on(self) -> None:
        """Send what waits, answers first, then the topics in turn."""
        while self._answers and not self._outlet.full:
            frames = self._answers.popleft()
            self._answers_size -= len(frames)
            self._outlet.write(frames)
        while self._behind and not self._outlet.full:
            backlog = next(iter(self._behind))
            del self._behind[backlog]
            frames = backlog.pop()
            self._owed -= len(frames)
            if backlog:
                self._behind[backlog] = None
            self._outlet.write(frames)
