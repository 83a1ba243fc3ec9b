"""The resources of a client: queue, places, users, submitted jobs, and the control lease."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator, Callable, Coroutine, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress
from functools import partial
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar, overload

from maya_un.client import methods, notebook, pictures, requests
from maya_un.client.awaiting import AwaitingDriver
from maya_un.client.blocking import BlockingDriver
from maya_un.client.methods import LeaseMethods
from maya_un.client.plans import jobs, resources, robot, streaming
from maya_un.client.plans.primitives import PrimitiveVerbs
from maya_un.client.steps import Awaiting, Blocking, Described, Plan, Stream, StreamPlan, Verb
from maya_un.errors import MayaError
from maya_un.schema.jobs import JobAccepted, JobReport
from maya_un.schema.people import LeaseTaken

T = TypeVar("T")


class RobotVerbs(methods.RobotMethods, PrimitiveVerbs):
    """The robot itself."""

    state = Verb(robot.state)
    states = Stream(streaming.states)
    events = Stream(streaming.events)
    command = Verb(robot.command)
    jog = Verb(robot.jog)
    stop = Verb(robot.stop)
    abort = Verb(robot.abort)
    preview = Verb(robot.preview)
    inspect = Verb(robot.inspect)
    plot = Verb(pictures.plot)
    twin_parts = Verb(robot.twin_parts)
    wait = Verb(jobs.wait)


class QueueVerbs(methods.QueueMethods):
    """The queue."""

    recovery = Verb(resources.recovery)
    change = Verb(resources.change)


class HistoryVerbs(methods.HistoryMethods):
    """The past."""

    every = Stream(jobs.every)


class PalletVerbs(methods.PalletsMethods):
    """Taught pallets."""

    teach = Verb(resources.teach_pallet)


class ZoneVerbs(methods.ZonesMethods):
    """Zones to keep out of, for this run."""

    keep_out = Verb(resources.keep_out)


class Resource(Blocking):
    """A resource of a blocking client."""

    def __init__(self, client: Blocking) -> None:
        self._client = client

    def perform(self, plan: Plan[T]) -> T:
        """Execute a plan and return its result; raises what the plan raises."""
        return self._client.perform(plan)

    def iterate(self, source: StreamPlan[T]) -> Iterator[T]:
        """Yield the items of a source as they arrive."""
        return self._client.iterate(source)


class AsyncResource(Awaiting):
    """A resource of an asynchronous client."""

    def __init__(self, client: Awaiting) -> None:
        self._client = client

    async def perform(self, plan: Plan[T]) -> T:
        """Execute a plan and return its result; raises what the plan raises."""
        return await self._client.perform(plan)

    def iterate(self, source: StreamPlan[T]) -> AsyncIterator[T]:
        """Yield the items of a source as they arrive."""
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


JobParameters = ParamSpec("JobParameters")
JobResult = TypeVar("JobResult")


class JobVerb(Described, Generic[JobParameters, JobResult]):
    """A verb about a job as a method of its handle, which supplies the job number."""

    def __init__(self, describe: Callable[Concatenate[int, JobParameters], Plan[JobResult]]) -> None:
        super().__init__(describe, given=1)
        self.describe = describe

    @overload
    def __get__(self, handle: None, owner: type[object]) -> JobVerb[JobParameters, JobResult]: ...
    @overload
    def __get__(self, handle: JobHandle, owner: type[object]) -> Callable[JobParameters, JobResult]: ...
    @overload
    def __get__(
        self, handle: AsyncJobHandle, owner: type[object]
    ) -> Callable[JobParameters, Coroutine[Any, Any, JobResult]]: ...
    def __get__(self, handle: JobHandle | AsyncJobHandle | None, owner: type[object]) -> Any:
        """Return the bound method of a handle, or the verb itself for the class."""
        return self if handle is None else self.bound(partial(self.describe, handle.id), handle.client.perform)


class _Job:
    """Methods of one job."""

    report = JobVerb(requests.report)
    wait = JobVerb(jobs.wait)
    cancel = JobVerb(requests.cancel)
    hold = JobVerb(requests.hold_job)
    release = JobVerb(requests.release_job)
    move = JobVerb(requests.move_job)
    change = JobVerb(resources.change)

    def __init__(self, job: JobAccepted) -> None:
        self.id = job.id
        self.name = job.name
        self.steps = job.steps

    def __repr__(self) -> str:
        return f"<job {self.id}, {self.name}: {self.steps} steps>"


class JobHandle(_Job):
    """A job of a `Client`. Iterating over it yields its `JobReport` now and after each change."""

    def __init__(self, client: Blocking, job: JobAccepted) -> None:
        super().__init__(job)
        self.client = client

    def __iter__(self) -> Iterator[JobReport]:
        return self.client.iterate(jobs.progress(self.id))

    def again(self, *, from_step: int | None = None) -> JobHandle:
        """Queue the job again as a new job, from `from_step` (from 1), by default the first step not done."""
        line = self.client.perform(requests.repeat_job(self.id, from_step=from_step))
        return JobHandle(self.client, JobAccepted(line.id, line.name, line.steps))

    def _repr_html_(self) -> str:
        return notebook.report(self.report())


class AsyncJobHandle(_Job):
    """A job of an `AsyncClient`. Iterating over it yields its `JobReport` now and after each change."""

    def __init__(self, client: Awaiting, job: JobAccepted) -> None:
        super().__init__(job)
        self.client = client

    def __aiter__(self) -> AsyncIterator[JobReport]:
        return self.client.iterate(jobs.progress(self.id))

    async def again(self, *, from_step: int | None = None) -> AsyncJobHandle:
        """Queue the job again as a new job, from `from_step` (from 1), by default the first step not done."""
        line = await self.client.perform(requests.repeat_job(self.id, from_step=from_step))
        return AsyncJobHandle(self.client, JobAccepted(line.id, line.name, line.steps))


class Lease(LeaseMethods, Resource):
    """The control lease: `with client.lease(note="calibration"): ...` holds it while the block runs."""

    def __init__(self, client: BlockingDriver) -> None:
        super().__init__(client)
        self._driver = client

    @contextmanager
    def __call__(self, note: str = "", *, force: bool = False) -> Iterator[LeaseTaken]:
        """Hold the lease while the block runs; `force` takes it from another holder.

        A thread renews the lease. After a loss of the lease, the next request in the block, or the end of the block,
        raises `LeaseLost`. Raises `LeaseHeld`, `NotAllowed`.
        """
        held = self._driver.held
        taken = self.perform(requests.take_lease(note=note, force=force))
        held.begin(taken.id)
        keeper = self._driver.beside()
        thread = threading.Thread(target=_keep, args=(keeper, taken), name="maya lease", daemon=True)
        thread.start()
        try:
            yield taken
            held.require()
        finally:
            keeper.close()
            thread.join()
            try:
                with suppress(MayaError):  # the lease is lost, or will expire
                    self.perform(resources.give_back())
            finally:
                held.end()


def _keep(keeper: BlockingDriver, taken: LeaseTaken) -> None:
    with suppress(MayaError):  # the block has ended
        keeper.perform(resources.kept(keeper.held, taken))


class AsyncLease(LeaseMethods, AsyncResource):
    """The control lease: `async with client.lease(note="calibration"): ...` holds it while the block runs."""

    def __init__(self, client: AwaitingDriver) -> None:
        super().__init__(client)
        self._driver = client

    @asynccontextmanager
    async def __call__(self, note: str = "", *, force: bool = False) -> AsyncIterator[LeaseTaken]:
        """Hold the lease while the block runs; `force` takes it from another holder.

        A task renews the lease. After a loss of the lease, the next request in the block, or the end of the block,
        raises `LeaseLost`. Raises `LeaseHeld`, `NotAllowed`.
        """
        held = self._driver.held
        taken = await self.perform(requests.take_lease(note=note, force=force))
        held.begin(taken.id)
        keeper = asyncio.create_task(self.perform(resources.kept(held, taken)), name="maya lease")
        try:
            yield taken
            held.require()
        finally:
            keeper.cancel()
            await asyncio.wait({keeper})
            try:
                with suppress(MayaError):  # the lease is lost, or will expire
                    await self.perform(resources.give_back())
            finally:
                held.end()
