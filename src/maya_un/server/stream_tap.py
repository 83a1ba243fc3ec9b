"""The source of the stream in the stack's loop: it hands events and states to the server's loop in batches."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import suppress
from typing import NamedTuple, Protocol

from maya_un.events import Event, JobAdvanced, LeaseChanged, QueueChanged, StepAdvanced
from maya_un.server.stream_messages import content
from maya_un.values import State

QUEUE_PERIOD = 0.1
"""The queue is looked at no more often than this [s, real time]."""

QUEUE_LOOK = 2.0
"""While somebody wants to see the queue, it is looked at so often without an event too, for predictions [s]."""

_STIRRING = (JobAdvanced, StepAdvanced, QueueChanged, LeaseChanged)
"""Events after which the queue is another."""


class StreamedService(Protocol):
    """The part of the service that the tap needs."""

    def watch(self) -> AsyncIterator[State]:
        """Yield the state now and every newer one; a slow reader skips to the newest."""
        ...

    def follow_events(self, seq: int = 0) -> AsyncIterator[Event]:
        """Yield every event numbered above `seq`, those past first, then as they come."""
        ...


class Batch(NamedTuple):
    """New data: events in order, the latest state, the latest view of the queue; None for unchanged ones."""

    events: list[Event]
    state: State | None
    queue: object


class StreamSource:
    """Lives in the stack's loop and looks at `source`; `hand_over` is called there with every batch.

    `view` answers how the queue stands. `speed` is how fast the loop's clock runs. Any thread may read `latest`, the
    newest state, and set `queue_wanted`, whether somebody wants to see the queue.
    """

    def __init__(
        self,
        source: StreamedService,
        view: Callable[[], Awaitable[object]],
        hand_over: Callable[[Batch], None],
        speed: float = 1.0,
    ) -> None:
        self._source = source
        self._view = view
        self._hand_over = hand_over
        self._speed = max(1.0, speed)
        self._events: list[Event] = []
        self._state: State | None = None
        self._told: object = None
        self._wanted = True
        self._queue: object = None
        self._flushing = False
        self._stirred = asyncio.Event()
        self._stirred.set()
        self._loop: asyncio.AbstractEventLoop | None = None
        self.latest: State | None = None
        self.queue_wanted = False

    async def run(self, since: int) -> None:
        """Look until cancelled; events are those numbered above `since`."""
        self._loop = asyncio.get_running_loop()
        async with asyncio.TaskGroup() as group:
            group.create_task(self._follow_states())
            group.create_task(self._follow_events(since))
            group.create_task(self._follow_queue())

    def want(self) -> None:
        """Have the next state handed over that says something else than the newest of now; from any thread.

        Read `latest` after this call, because states in between are not handed over.
        """
        state = self.latest
        self._told = None if state is None else content(state)
        self._wanted = True

    def look_at_queue(self) -> None:
        """Hand the queue over as it stands, soon; from any thread."""
        if self._loop is not None:
            with suppress(RuntimeError):  # the stack's loop has ended
                self._loop.call_soon_threadsafe(self._stirred.set)

    async def _follow_states(self) -> None:
        async for state in self._source.watch():
            self.latest = state
            if self._wanted and content(state) != self._told:
                self._wanted = False
                self._told = content(state)
                self._state = state
                self._flush_soon()

    async def _follow_events(self, since: int) -> None:
        async for event in self._source.follow_events(since):
            self._events.append(event)
            self._flush_soon()
            if isinstance(event, _STIRRING):
                self._stirred.set()

    async def _follow_queue(self) -> None:
        while True:
            with suppress(TimeoutError):
                async with asyncio.timeout(QUEUE_LOOK * self._speed if self.queue_wanted else None):
                    await self._stirred.wait()
            self._stirred.clear()
            if self.queue_wanted:
                self._queue = await self._view()
                self._flush_soon()
                await asyncio.sleep(QUEUE_PERIOD * self._speed)

    def _flush_soon(self) -> None:
        """Hand over at the end of this turn of the loop, with whatever else comes in it."""
        if not self._flushing:
            self._flushing = True
            asyncio.get_running_loop().call_soon(self._flush)

    def _flush(self) -> None:
        self._flushing = False
        batch = Batch(self._events, self._state, self._queue)
        self._events, self._state, self._queue = [], None, None
        with suppress(RuntimeError):  # the server's loop has ended
            self._hand_over(batch)
