"""The resources of a client: each has the generated methods of its operations, and those that take several requests."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator
from typing import TypeVar

from maya_un.client import methods, pictures
from maya_un.client.plans import jobs, moving, places, previews, queue, streaming
from maya_un.client.plans.primitives import PrimitiveVerbs
from maya_un.client.steps import Plan, StreamPlan
from maya_un.client.verb import Awaiting, Blocking, Stream, Verb

T = TypeVar("T")


class RobotVerbs(methods.RobotMethods, PrimitiveVerbs):
    """The robot itself."""

    state = Verb(previews.state)
    states = Stream(streaming.states)
    events = Stream(streaming.events)
    wish = Verb(moving.wish)
    jog = Verb(moving.jog)
    stop = Verb(moving.stop)
    abort = Verb(moving.abort)
    preview = Verb(previews.preview)
    inspect = Verb(previews.inspect)
    plot = Verb(pictures.plot)
    twin_parts = Verb(previews.twin_parts)
    wait = Verb(jobs.wait)


class QueueVerbs(methods.QueueMethods):
    """The queue."""

    recovery = Verb(queue.recovery)
    change = Verb(queue.change)


class HistoryVerbs(methods.HistoryMethods):
    """The past."""

    every = Stream(jobs.every)


class PalletVerbs(methods.PalletsMethods):
    """Taught pallets."""

    teach = Verb(places.teach_pallet)


class ZoneVerbs(methods.ZonesMethods):
    """Zones to keep out of, for this run."""

    keep_out = Verb(places.keep_out)


class Resource(Blocking):
    """A resource of a client that blocks."""

    def __init__(self, client: Blocking) -> None:
        self._client = client

    def perform(self, plan: Plan[T]) -> T:
        """Carry a plan out and return its result; raises what the plan raises."""
        return self._client.perform(plan)

    def iterate(self, source: StreamPlan[T]) -> Iterator[T]:
        """Yield the items of a source as they come."""
        return self._client.iterate(source)


class AsyncResource(Awaiting):
    """A resource of a client that awaits."""

    def __init__(self, client: Awaiting) -> None:
        self._client = client

    async def perform(self, plan: Plan[T]) -> T:
        """Carry a plan out and return its result; raises what the plan raises."""
        return await self._client.perform(plan)

    def iterate(self, source: StreamPlan[T]) -> AsyncIterator[T]:
        """Yield the items of a source as they come."""
        return self._client.iterate(source)


class Queue(QueueVerbs, Resource):
    """The queue."""


class AsyncQueue(QueueVerbs, AsyncResource):
    """The queue."""


class History(HistoryVerbs, Resource):
    """The past."""


class AsyncHistory(HistoryVerbs, AsyncResource):
    """The past."""


class Poses(methods.PosesMethods, Resource):
    """Taught poses."""


class AsyncPoses(methods.PosesMethods, AsyncResource):
    """Taught poses."""


class Pallets(PalletVerbs, Resource):
    """Taught pallets."""


class AsyncPallets(PalletVerbs, AsyncResource):
    """Taught pallets."""


class Zones(ZoneVerbs, Resource):
    """Zones to keep out of, for this run."""


class AsyncZones(ZoneVerbs, AsyncResource):
    """Zones to keep out of, for this run."""


class Users(methods.UsersMethods, Resource):
    """Users and their tokens."""


class AsyncUsers(methods.UsersMethods, AsyncResource):
    """Users and their tokens."""


class Recordings(methods.RecordingsMethods, Resource):
    """The recordings of the flight recorder."""


class AsyncRecordings(methods.RecordingsMethods, AsyncResource):
    """The recordings of the flight recorder."""
