"""Events: facts in order, numbered from 1, never dropped and never merged.

State is something else (`values.State`, the latest value). A reader that comes late asks for what it missed by
number; a reader that is slow has its own queue, so it slows nobody.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType


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
    """Numbers events, keeps them in order, hands every one of them to every reader.

    `clock` gives the time of an event [s], normally the event loop's `time`.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._events: list[Event] = []
        self._queues: set[asyncio.Queue[Event]] = set()
        self._listeners: list[Callable[[Event], None]] = []

    def __len__(self) -> int:
        return len(self._events)

    @property
    def last(self) -> Event | None:
        """The newest event, None before the first."""
        return self._events[-1] if self._events else None

    def emit(self, kind: Kind, code: int = 0, **detail: object) -> Event:
        """Add a fact and hand it to every listener and subscriber; returns it with its number."""
        event = Event(len(self._events) + 1, self._clock(), kind, code, MappingProxyType(detail))
        self._events.append(event)
        for queue in self._queues:
            queue.put_nowait(event)
        for listener in tuple(self._listeners):
            listener(event)
        return event

    def since(self, seq: int) -> list[Event]:
        """Return all events numbered above `seq`."""
        return self._events[max(0, seq) :]

    @contextmanager
    def listening(self, listener: Callable[[Event], None]) -> Iterator[None]:
        """Call `listener` with every event while the block runs, before anybody else goes on."""
        self._listeners.append(listener)
        try:
            yield
        finally:
            self._listeners.remove(listener)

    async def follow(self, seq: int = 0) -> AsyncGenerator[Event]:
        """Yield every event numbered above `seq`, those past first, then as they come."""
        queue: asyncio.Queue[Event] = asyncio.Queue()
        for event in self.since(seq):
            queue.put_nowait(event)
        self._queues.add(queue)
        try:
            while True:
                yield await queue.get()
        finally:
            self._queues.discard(queue)
