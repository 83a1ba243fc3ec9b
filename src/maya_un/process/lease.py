"""The control lease: at every instant at most one drives the robot, and everybody can see who.

Whoever takes it says again and again that he is still there; one that is silent for its patience loses it, and what he
held moving stops. It passes on visibly: the holder offers it to somebody, who takes it. Stop needs no lease.
"""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from maya_un.errors import LeaseHeld, LeaseLost, LeaseNeeded
from maya_un.events import EventLog, Kind

PATIENCE = 10.0
"""A lease that is not renewed for so long ends [s, real time]."""

OFFER = 60.0
"""An offer stands for so long [s, real time]."""

_ROUNDING = 1e-6

OnChange = Callable[[str], None]
"""Told why the holder changed: taken, released, expired, handed over, broken."""


@dataclass(frozen=True, slots=True)
class Holder:
    """Who drives: his name, from where, since when [s, loop time], what he says about it.

    `id` is what he shows; nobody else is told it. One that is `implicit` drives for the length of one wish.
    """

    name: str
    source: str
    since: float
    note: str = ""
    id: str = ""
    implicit: bool = False


class Lease:
    """Who drives. `speed` is how fast the loop's clock runs: patience is in the time of whoever asks.

    `on_change` callbacks are told of every change of the holder, after it, before anybody else goes on.
    """

    def __init__(self, events: EventLog, speed: float = 1.0) -> None:
        self._events = events
        self._scale = max(1.0, speed)
        self._holder: Holder | None = None
        self._patience = PATIENCE
        self._until = 0.0
        self._watch: asyncio.TimerHandle | None = None
        self._offered: tuple[str, float] | None = None
        self._wishes = 0
        self._ended: dict[str, str] = {}
        self.on_change: list[OnChange] = []

    @property
    def holder(self) -> Holder | None:
        """Who drives now, None where nobody does."""
        return self._holder

    @property
    def offered_to(self) -> str | None:
        """To whom it is offered, None where to nobody."""
        if self._offered is None or self._now() > self._offered[1]:
            return None
        return self._offered[0]

    @property
    def expires_in(self) -> float | None:
        """When it ends without being renewed [s, real time], None where nobody holds it or it is implicit."""
        if self._holder is None or self._holder.implicit:
            return None
        return max(0.0, (self._until - self._now()) / self._scale)

    def may_begin(self, owner: str) -> bool:
        """Tell whether a job of `owner` may begin: nobody drives, or he does."""
        return self._holder is None or self._holder.name == owner

    def take(
        self, name: str, source: str, *, note: str = "", patience: float = PATIENCE, force: bool = False
    ) -> Holder:
        """Become the driver; with `force` also where somebody else is. Raises `LeaseHeld`."""
        before = self._holder
        if before is not None and not force and self.offered_to != name:
            raise self._held(before)
        why = "taken" if before is None else "broken" if self.offered_to != name else "handed over"
        return self._become(name, source, note, patience, why)

    def renew(self, lease: str) -> Holder:
        """Say that one is still there; raises `LeaseLost`."""
        holder = self.require(lease)
        self._until = self._now() + self._patience
        return holder

    def release(self, lease: str) -> None:
        """Give it back; raises `LeaseLost`."""
        self.require(lease)
        self._end("released")

    def offer(self, name: str) -> None:
        """Let `name` take it within a minute, from the holder too."""
        self._offered = (name, self._now() + OFFER * self._scale)
        self._tell("offered", to=name)

    def ask(self, name: str) -> None:
        """Let the holder know that `name` would like to drive."""
        self._tell("asked", by=name)

    def require(self, lease: str) -> Holder:
        """Return the holder if `lease` is his; raises `LeaseNeeded`, `LeaseHeld`, `LeaseLost`."""
        holder = self._holder
        if lease and holder is not None and secrets.compare_digest(holder.id, lease):
            return holder
        if lease:
            raise LeaseLost(reason=self._ended.get(lease, "it is not known here"))
        raise LeaseNeeded if holder is None else self._held(holder)

    @contextmanager
    def driving(self, name: str, source: str) -> Iterator[None]:
        """Hold the lease for the length of the block without showing one; several blocks of one name share it.

        Raises `LeaseHeld` where somebody else drives. Whoever drives already, in his own name, goes on driving.
        """
        holder = self._holder
        if holder is not None and holder.name != name:
            raise self._held(holder)
        if holder is not None and not holder.implicit:
            yield
            return
        if holder is None:
            self._holder = Holder(name, source, self._now(), implicit=True)
            self._changed("taken")
        self._wishes += 1
        try:
            yield
        finally:
            self._wishes -= 1
            if self._wishes == 0 and self._holder is not None and self._holder.implicit:
                self._end("released")

    def close(self) -> None:
        """Forget the watch; the loop ends."""
        if self._watch is not None:
            self._watch.cancel()
            self._watch = None

    def _become(self, name: str, source: str, note: str, patience: float, why: str) -> Holder:
        if self._holder is not None:
            self._remember(self._holder, why)
        self._offered = None
        self._holder = Holder(name, source, self._now(), note, secrets.token_urlsafe(16))
        self._patience = patience * self._scale
        self._until = self._now() + self._patience
        self._watch_it()
        self._changed(why)
        return self._holder

    def _end(self, why: str) -> None:
        assert self._holder is not None
        self._remember(self._holder, why)
        self._holder = None
        self.close()
        self._changed(why)

    def _remember(self, holder: Holder, why: str) -> None:
        """Keep why the last leases ended, so that who shows one is told."""
        if holder.id:
            self._ended[holder.id] = why
            while len(self._ended) > 100:
                del self._ended[next(iter(self._ended))]

    def _watch_it(self) -> None:
        self.close()
        self._watch = asyncio.get_running_loop().call_at(self._until, self._look)

    def _look(self) -> None:
        """End a lease that was not renewed, or look again when it is due."""
        self._watch = None
        if self._holder is None or self._holder.implicit:
            return
        if self._now() < self._until - _ROUNDING:
            self._watch_it()
        else:
            self._end("expired")

    def _changed(self, why: str) -> None:
        self._tell(why)
        for told in tuple(self.on_change):
            told(why)

    def _tell(self, why: str, **detail: object) -> None:
        holder = self._holder
        name, source = ("", "") if holder is None else (holder.name, holder.source)
        self._events.emit(Kind.LEASE, change=why, holder=name, source=source, **detail)

    def _held(self, holder: Holder) -> LeaseHeld:
        seconds = (self._now() - holder.since) / self._scale
        return LeaseHeld(holder=holder.name, since=f"{seconds:.0f} s")

    def _now(self) -> float:
        return asyncio.get_running_loop().time()
