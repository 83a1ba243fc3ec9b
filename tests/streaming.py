"""A service that is looked at through the stream: its states, events and queue are what a test makes them."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from dataclasses import dataclass, replace
from typing import Any, cast

from maya_un.api.messages import EventMessage
from maya_un.api.service import Service
from maya_un.events import Event, EventLog, Kind
from maya_un.values import Mode, State

REST = State(
    time=0.0,
    mode=Mode.IDLE,
    homed=False,
    counts=(0, 0, 0),
    joints=None,
    point=None,
    velocity=(0.0, 0.0, 0.0),
    moving=False,
    motors_on=(True, True, True),
    forward_limit=(False, False, False),
    reverse_limit=(False, False, False),
    stop_code=(0, 0, 0),
    gripper_closed=False,
    progress=None,
    fault=None,
)
"""A state; tests count in `counts[0]`."""


@dataclass(frozen=True, slots=True)
class Facts:
    """As much of a status as the stream looks at."""

    run: int
    last_event: int
    speed: float = 1.0


class Watched:
    """Stands in for a service; everything is changed in the loop that it lives in.

    Past events up to `forgotten` are no longer there.
    """

    def __init__(self, run: int = 1, speed: float = 1.0) -> None:
        self.run = run
        self.speed = speed
        self.log = EventLog(lambda: asyncio.get_running_loop().time())
        self.state = REST
        self.shown: dict[str, Any] = {"mode": "running"}
        self.views = 0
        self.forgotten = 0
        self._newer = asyncio.Event()

    @property
    def service(self) -> Service:
        """It, as the service that it stands in for."""
        return cast("Service", self)

    @property
    def queue(self) -> Watched:
        """It, as the queue."""
        return self

    @property
    def history(self) -> Watched:
        """It, as the history."""
        return self

    def show(self, **changes: Any) -> None:
        """Publish a state that differs from the last in this, and in its time."""
        self.state = replace(self.state, time=asyncio.get_running_loop().time(), **changes)
        self._newer.set()
        self._newer.clear()

    def count(self) -> int:
        """Publish a state that counts one further, and return that number."""
        further = self.state.counts[0] + 1
        self.show(counts=(further, 0, 0))
        return further

    def happen(self, times: int = 1, kind: Kind = Kind.PHASE, **detail: object) -> None:
        """Add events, without more of a kind that leaves the queue as it is."""
        for _ in range(times):
            self.log.emit(kind, 0, **detail)

    async def status(self) -> Facts:
        """Return what the stream begins with."""
        return Facts(self.run, len(self.log), self.speed)

    async def watch(self) -> AsyncIterator[State]:
        """Yield the state and every newer one."""
        shown: State | None = None
        while True:
            if self.state is not shown:
                shown = self.state
                yield shown
            else:
                await self._newer.wait()

    def follow_events(self, seq: int = 0) -> AsyncIterator[Event]:
        """Yield the events above `seq`."""
        return self.log.follow(seq)

    def view(self) -> dict[str, Any]:
        """Return how the queue stands."""
        self.views += 1
        return self.shown

    async def events(self, run: int, above: int = 0, limit: int = 1000) -> list[EventMessage]:
        """Return past events."""
        assert run == self.run
        return [EventMessage.of(event) for event in self.log.since(max(above, self.forgotten))[:limit]]
