"""A job that was submitted: waited for, followed, cancelled, without saying its number again."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Coroutine, Iterator
from functools import partial
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar, overload

from maya_un.client import looks, requests
from maya_un.client.plans import jobs, queue
from maya_un.client.steps import Plan
from maya_un.client.verb import Awaiting, Blocking, Described
from maya_un.schema.jobs import JobAccepted, JobReport

P = ParamSpec("P")
T = TypeVar("T")


class JobVerb(Described, Generic[P, T]):
    """A verb about a job, as a method of its handle, which knows the number."""

    def __init__(self, describe: Callable[Concatenate[int, P], Plan[T]]) -> None:
        super().__init__(describe, given=1)
        self.describe = describe

    @overload
    def __get__(self, handle: None, owner: type[object]) -> JobVerb[P, T]: ...
    @overload
    def __get__(self, handle: JobHandle, owner: type[object]) -> Callable[P, T]: ...
    @overload
    def __get__(self, handle: AsyncJobHandle, owner: type[object]) -> Callable[P, Coroutine[Any, Any, T]]: ...
    def __get__(self, handle: JobHandle | AsyncJobHandle | None, owner: type[object]) -> Any:
        """Return the method of a handle, or of the class the verb itself."""
        return self if handle is None else self.bound(partial(self.describe, handle.id), handle.client.perform)


class _Job:
    """Methods of one job."""

    report = JobVerb(requests.report)
    wait = JobVerb(jobs.wait)
    cancel = JobVerb(requests.cancel)
    hold = JobVerb(requests.hold_job)
    release = JobVerb(requests.release_job)
    move = JobVerb(requests.move_job)
    change = JobVerb(queue.change)

    def __init__(self, job: JobAccepted) -> None:
        self.id = job.id
        self.name = job.name
        self.steps = job.steps

    def __repr__(self) -> str:
        return f"<job {self.id}, {self.name}: {self.steps} steps>"


class JobHandle(_Job):
    """A job of a `Client`. Iterating over it yields its `JobReport` now, and whenever something of it goes on."""

    def __init__(self, client: Blocking, job: JobAccepted) -> None:
        super().__init__(job)
        self.client = client

    def __iter__(self) -> Iterator[JobReport]:
        return self.client.iterate(jobs.progress(self.id))

    def again(self, *, from_step: int | None = None) -> JobHandle:
        """Queue the job once more, as a new one, from a step (from 1) on: the first that was not done."""
        line = self.client.perform(requests.repeat_job(self.id, from_step=from_step))
        return JobHandle(self.client, JobAccepted(line.id, line.name, line.steps))

    def _repr_html_(self) -> str:
        return looks.report(self.report())


class AsyncJobHandle(_Job):
    """A job of an `AsyncClient`. Iterating over it yields its `JobReport` now, and whenever something of it goes on."""

    def __init__(self, client: Awaiting, job: JobAccepted) -> None:
        super().__init__(job)
        self.client = client

    def __aiter__(self) -> AsyncIterator[JobReport]:
        return self.client.iterate(jobs.progress(self.id))

    async def again(self, *, from_step: int | None = None) -> AsyncJobHandle:
        """Queue the job once more, as a new one, from a step (from 1) on: the first that was not done."""
        line = await self.client.perform(requests.repeat_job(self.id, from_step=from_step))
        return AsyncJobHandle(self.client, JobAccepted(line.id, line.name, line.steps))
