"""`maya_un.AsyncClient`: the client of a running Maya for an event loop."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Mapping, Sequence
from typing import Self, Unpack

from maya_un.client import notebook
from maya_un.client.awaiting import AwaitingDriver
from maya_un.client.jobs import JobLike
from maya_un.client.plans import jobs
from maya_un.client.resources import (
    AsyncHistory,
    AsyncJobHandle,
    AsyncLease,
    AsyncPallets,
    AsyncPoses,
    AsyncQueue,
    AsyncRecordings,
    AsyncUsers,
    AsyncZones,
    RobotVerbs,
)
from maya_un.client.transport import finder, trusted
from maya_un.client.twin import FAST, TwinProcess


class AsyncClient(RobotVerbs, AwaitingDriver):
    """The API of `Client` for `asyncio`: methods return awaitables, and streams are iterated with `async for`.

    A task that is cancelled while it waits for a primitive stops the robot on its path.
    """

    def __init__(
        self, url: str | None = None, *, token: str | None = None, ca: str | os.PathLike[str] | None = None
    ) -> None:
        super().__init__(finder(url, token), trusted(ca))
        self.queue = AsyncQueue(self)
        self.history = AsyncHistory(self)
        self.poses = AsyncPoses(self)
        self.pallets = AsyncPallets(self)
        self.zones = AsyncZones(self)
        self.users = AsyncUsers(self)
        self.recordings = AsyncRecordings(self)
        self.lease = AsyncLease(self)
        self._twin: TwinProcess | None = None
        notebook.register()

    @classmethod
    async def twin(
        cls,
        *,
        speed: float = FAST,
        seed: int = 0,
        table: JobLike | None = None,
        parts: Mapping[str, Sequence[float]] | None = None,
    ) -> Self:
        """Start a twin and return its client; the arguments are those of `Client.twin`."""
        twin = await asyncio.to_thread(TwinProcess, speed=speed, seed=seed, table=table, parts=parts)
        client = cls(twin.service.url, token="")
        client._twin = twin
        return client

    async def submit(self, job: JobLike, **options: Unpack[jobs.SubmitOptions]) -> AsyncJobHandle:
        """Append a job to the queue and return its handle; `options` as for `Client.submit`."""
        return AsyncJobHandle(self, (await self.perform(jobs.submit(job, **options))).job)

    async def job(self, number: int) -> AsyncJobHandle:
        """Return the handle of a job in the queue or history; raises `NotFound`."""
        return AsyncJobHandle(self, await self.perform(jobs.known(number)))

    async def close(self) -> None:
        """Close all connections, and end the twin that was started with this client."""
        await super().close()
        if self._twin is not None:
            await asyncio.to_thread(self._twin.close)

    async def __aenter__(self) -> Self:
        """Return the client, for use in a block."""
        return self

    async def __aexit__(self, *_: object) -> None:
        """Close the client."""
        await self.close()

    def __repr__(self) -> str:
        return f"<Maya at {self.address}>"
