"""`maya_un.Client`: the blocking client of a running Maya."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Self, Unpack

from maya_un.client import notebook
from maya_un.client.blocking import BlockingDriver
from maya_un.client.jobs import JobLike
from maya_un.client.plans import jobs
from maya_un.client.resources import (
    History,
    JobHandle,
    Lease,
    Pallets,
    Poses,
    Queue,
    Recordings,
    RobotVerbs,
    Users,
    Zones,
)
from maya_un.client.transport import finder, trusted
from maya_un.client.twin import FAST, TwinProcess


class Client(RobotVerbs, BlockingDriver):
    """A running Maya, twin or robot, over HTTP and websocket. Units are m, rad, s.

    By default it connects to the `maya up` of this user with that user's token; `url` and `token`, or $MAYA_URL and
    $MAYA_TOKEN, select another service. `ca` is the certificate file of a service with a self-signed certificate.
    `queue`, `history`, `poses`, `pallets`, `zones`, `users`, `recordings` and `lease` are its resources. Methods raise
    the errors of `maya_un.errors` that the robot raised. No request is sent before the first call.
    """

    def __init__(
        self, url: str | None = None, *, token: str | None = None, ca: str | os.PathLike[str] | None = None
    ) -> None:
        super().__init__(finder(url, token), trusted(ca))
        self.queue = Queue(self)
        self.history = History(self)
        self.poses = Poses(self)
        self.pallets = Pallets(self)
        self.zones = Zones(self)
        self.users = Users(self)
        self.recordings = Recordings(self)
        self.lease = Lease(self)
        self._twin: TwinProcess | None = None
        notebook.register()

    @classmethod
    def twin(
        cls,
        *,
        speed: float = FAST,
        seed: int = 0,
        table: JobLike | None = None,
        parts: Mapping[str, Sequence[float]] | None = None,
    ) -> Self:
        """Start a twin and return its client; the twin ends when the client is closed, or when this program ends.

        It runs `speed` times as fast as the machine. `table` is a job whose parts stand on its table; or name them:
        `parts={"cube": (0.5, 1.1)}`. `seed` determines the position of the robot at power-up. Raises the
        error of a twin that does not start.
        """
        twin = TwinProcess(speed=speed, seed=seed, table=table, parts=parts)
        client = cls(twin.service.url, token="")
        client._twin = twin
        return client

    def submit(self, job: JobLike, **options: Unpack[jobs.SubmitOptions]) -> JobHandle:
        """Append a job to the queue and return its handle.

        `options` are priority (-100 to 100), held, depends_on (numbers of jobs), notes, on_failure ("continue" or
        "pause"), retries, stepwise. The job is submitted once, even if the connection breaks.
        """
        return JobHandle(self, self.perform(jobs.submit(job, **options)).job)

    def job(self, number: int) -> JobHandle:
        """Return the handle of a job in the queue or history; raises `NotFound`."""
        return JobHandle(self, self.perform(jobs.known(number)))

    def close(self) -> None:
        """Close all connections, and end the twin that was started with this client."""
        super().close()
        if self._twin is not None:
            self._twin.close()

    def __enter__(self) -> Self:
        """Return the client, for use in a block."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the client."""
        self.close()

    def __repr__(self) -> str:
        return f"<Maya at {self.address}>"
