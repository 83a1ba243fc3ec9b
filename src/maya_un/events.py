"""Events: facts in order, numbered from 1, never dropped and never merged.

State is something else (`values.State`, the latest value). A reader that comes late asks for what it missed by
number. Memory keeps the newest; a reader that is so slow that his next was forgotten is told, and slows nobody. Older
ones are what a journal kept of them.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType

from maya_un.errors import EventsForgotten

KEPT = 20_000
"""So many of the newest events are kept, and up to an eighth more."""

Listener = Callable[["Event"], None]
"""Told of every event, before anybody else goes on."""


class Kind(StrEnum):
    """What can happen; the first word on /maya_event (design: interface)."""

    CONNECTED = "connected"
    DISCONNECTED = "disconnected"
    NOT_HOMED = "not_homed"
    HOMING = "homing"
    HOMED = "homed"
    MOVING = "moving"
    IDLE = "idle"
    STOPPED = "stopped"
    PAUSED = "paused"
    RESUMED = "resumed"
    SPEED = "speed"
    ZONES = "zones"
    GRIPPER_OPEN = "gripper_open"
    GRIPPER_CLOSED = "gripper_closed"
    LIMIT = "limit"
    FAULT = "fault"
    ESTOP = "estop"
    RECOVERED = "recovered"
    PHASE = "phase"
    JOB = "job"
    STEP = "step"
    QUEUE = "queue"
    LEASE = "lease"
    STORAGE = "storage"
    RECORDING = "recording"


@dataclass(frozen=True, slots=True)
class Event:
    """One fact. `seq` counts from 1 without gaps; `time` is the event loop's [s]; `code` is 0 or an error's."""

    seq: int
    time: float
    kind: Kind
    code: int = 0
    detail: Mapping[str, object] = field(default_factory=lambda: MappingProxyType({}))

    def __str__(self) -> str:
        words = " ".join(f"{key}={value}" for key, value in self.detail.items())
        return f"{self.kind} {words}".rstrip()


class EventLog:
    """Numbers events, keeps the newest `kept` in order, hands every one of them to every reader.

    `clock` gives the time of an event [s], normally the event loop's `time`. `run` is the number of this start of the
    program, for whoever tells its events from those of another.
    """

    def __init__(self, clock: Callable[[], float], kept: int = KEPT) -> None:
        self._clock = clock
        self._kept = kept
        self._events: list[Event] = []
        self._forgotten = 0
        self._waiting: set[asyncio.Future[None]] = set()
        self._listeners: list[Listener] = []
        self.run = 1

    def __len__(self) -> int:
        return self._forgotten + len(self._events)

    @property
    def last(self) -> Event | None:
        """The newest event, None before the first."""
        return self._events[-1] if self._events else None

    @property
    def oldest(self) -> int:
        """Number of the oldest event that is kept; before the first, the number that it will have."""
        return self._forgotten + 1

    def emit(self, kind: Kind, code: int = 0, **detail: object) -> Event:
        """Add a fact and hand it to every listener and reader; returns it with its number."""
        event = Event(len(self) + 1, self._clock(), kind, code, MappingProxyType(detail))
        self._events.append(event)
        if len(self._events) > self._kept + self._kept // 8:
            self._forget()
        for waiting in self._waiting:
            if not waiting.done():
                waiting.set_result(None)
        for listener in tuple(self._listeners):
            listener(event)
        return event

    def since(self, seq: int) -> list[Event]:
        """Return all events numbered above `seq`; raises `EventsForgotten` where the first of them is not kept."""
        if max(0, seq) < self._forgotten:
            raise EventsForgotten(since=seq, oldest=self.oldest)
        return self._events[max(0, seq) - self._forgotten :]

    def heard_by(self, listener: Listener) -> None:
        """Call `listener` with every event from now on, before anybody else goes on."""
        self._listeners.append(listener)

    @contextmanager
    def listening(self, listener: Listener) -> Iterator[None]:
        """Call `listener` with every event while the block runs, before anybody else goes on."""
        self._listeners.append(listener)
        try:
            yield
        finally:
            self._listeners.remove(listener)

    async def follow(self, seq: int = 0) -> AsyncGenerator[Event]:
        """Yield every event numbered above `seq`, those past first, then as they come.

        Raises `EventsForgotten` for a reader that is too late, or falls too far behind.
        """
        while True:
            news = self.since(seq)
            for event in news:
                yield event
            seq = news[-1].seq if news else seq
            if len(self) <= seq:
                await self._next()

    async def _next(self) -> None:
        waiting: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiting.add(waiting)
        try:
            await waiting
        finally:
            self._waiting.discard(waiting)

    def _forget(self) -> None:
        """Drop the oldest, many at a time, so that an event costs the same however many there were."""
        dropped = len(self._events) - self._kept
        del self._events[:dropped]
        self._forgotten += dropped
