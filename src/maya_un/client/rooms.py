"""What can be said to a running Maya, sorted as its service is; every verb is one of the plans."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator
from typing import TypeVar

from maya_un.client import pictures
from maya_un.client.plans import asking, history, jobs, leasing, moving, queue, streaming, teaching
from maya_un.client.plans.primitives import PrimitiveVerbs
from maya_un.client.steps import Plan, Source
from maya_un.client.verb import Awaiting, Blocking, Stream, Verb

T = TypeVar("T")


class Verbs(PrimitiveVerbs):
    """What can be said to the robot itself."""

    status = Verb(asking.status)
    state = Verb(asking.state)
    states = Stream(streaming.states)
    events = Stream(streaming.events)
    wish = Verb(moving.wish)
    jog = Verb(moving.jog)
    stop = Verb(moving.stop)
    abort = Verb(moving.abort)
    pause = Verb(moving.pause)
    resume = Verb(moving.resume)
    speed = Verb(moving.speed)
    recover = Verb(moving.recover)
    preview = Verb(asking.preview)
    inspect = Verb(asking.inspect)
    plot = Verb(pictures.plot)
    reach = Verb(asking.reach)
    fk = Verb(asking.fk)
    ik = Verb(asking.ik)
    config = Verb(asking.config)
    twin_parts = Verb(asking.twin_parts)
    report = Verb(jobs.report)
    wait = Verb(jobs.wait)
    cancel = Verb(jobs.cancel)


class QueueVerbs:
    """What can be said about the queue."""

    view = Verb(queue.view)
    pause = Verb(queue.pause)
    resume = Verb(queue.resume)
    step = Verb(queue.step)
    clear = Verb(queue.clear)
    recovery = Verb(queue.recovery)
    recover = Verb(queue.recover)
    hold = Verb(queue.hold)
    release = Verb(queue.release)
    move = Verb(queue.move)
    change = Verb(queue.change)
    again = Verb(queue.again)


class HistoryVerbs:
    """What can be asked about the past."""

    page = Verb(history.page)
    every = Stream(history.every)
    audit = Verb(history.audit)


class PoseVerbs:
    """What can be said about taught poses."""

    all = Verb(teaching.poses)
    get = Verb(teaching.pose)
    teach = Verb(teaching.teach)
    forget = Verb(teaching.forget_pose)
    rename = Verb(teaching.rename_pose)


class PalletVerbs:
    """What can be said about taught pallets."""

    all = Verb(teaching.pallets)
    get = Verb(teaching.pallet)
    teach = Verb(teaching.teach_pallet)
    forget = Verb(teaching.forget_pallet)
    rename = Verb(teaching.rename_pallet)


class ZoneVerbs:
    """What can be said about zones to keep out of, for this run."""

    all = Verb(teaching.zones)
    keep_out = Verb(teaching.keep_out)
    allow = Verb(teaching.allow)


class LeaseVerbs:
    """What can be said about the control lease."""

    view = Verb(leasing.view)
    offer = Verb(leasing.offer)
    ask = Verb(leasing.ask)


class Room(Blocking):
    """A room of a client that blocks."""

    def __init__(self, client: Blocking) -> None:
        self._client = client

    def perform(self, plan: Plan[T]) -> T:
        """Return what a plan comes to; raises what it raises."""
        return self._client.perform(plan)

    def iterate(self, source: Source[T]) -> Iterator[T]:
        """Yield the items of a plan as they come."""
        return self._client.iterate(source)


class AsyncRoom(Awaiting):
    """A room of a client that awaits."""

    def __init__(self, client: Awaiting) -> None:
        self._client = client

    async def perform(self, plan: Plan[T]) -> T:
        """Return what a plan comes to; raises what it raises."""
        return await self._client.perform(plan)

    def iterate(self, source: Source[T]) -> AsyncIterator[T]:
        """Yield the items of a plan as they come."""
        return self._client.iterate(source)


class Queue(QueueVerbs, Room):
    """The queue."""


class AsyncQueue(QueueVerbs, AsyncRoom):
    """The queue."""


class History(HistoryVerbs, Room):
    """What happened."""


class AsyncHistory(HistoryVerbs, AsyncRoom):
    """What happened."""


class Poses(PoseVerbs, Room):
    """Taught poses."""


class AsyncPoses(PoseVerbs, AsyncRoom):
    """Taught poses."""


class Pallets(PalletVerbs, Room):
    """Taught pallets."""


class AsyncPallets(PalletVerbs, AsyncRoom):
    """Taught pallets."""


class Zones(ZoneVerbs, Room):
    """Zones to keep out of."""


class AsyncZones(ZoneVerbs, AsyncRoom):
    """Zones to keep out of."""
