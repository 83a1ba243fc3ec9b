"""A stand-in for the service, and a client of the application around it in the same loop."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass
from typing import Any, cast

import httpx

from maya_un.events import Event, EventLog
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.metrics import Metrics
from maya_un.http.origins import OriginPolicy
from maya_un.process.journal.protocol import Filter, JobOptions
from maya_un.schema.robot import EventMessage, HeldJog, Jogged, SteeredJog
from maya_un.service.access.operations import Caller
from maya_un.service.service import Service
from maya_un.values import State, StopReport
from tests.streaming import REST


@dataclass(frozen=True)
class Now:
    """As much of a status as is looked at."""

    run: int = 3
    state: State = REST


class ServiceStandIn:
    """Answers like a service, notes what it was asked, and fails on demand."""

    def __init__(self) -> None:
        self.log = EventLog(lambda: 0.0)
        self.asked: list[tuple[object, ...]] = []
        self.error: Exception | None = None
        self.hangs = False
        self.stops = 0
        self.now = Now()
        self.history = self
        self.previews = self
        self.options, self.key = JobOptions(), ""
        self.released = asyncio.Event()

    def _note(self, *what: object) -> None:
        self.asked.append(what)
        if self.error is not None:
            raise self.error

    failing = ""
    """Why nothing can be written down."""

    async def check_storage(self) -> str:
        return self.failing

    async def status(self) -> Now:
        self._note("status")
        if self.hangs:
            await asyncio.Future()
        return self.now

    async def events(self, run: int, above: int, limit: int) -> list[EventMessage]:
        return [EventMessage.of(event) for event in self.log.since(above)[:limit]] if run == Now().run else []

    async def submit(self, job: dict[str, Any], *, by: Caller, options: JobOptions, key: str) -> dict[str, int]:
        self.options, self.key = options, key
        self._note("submit", job)
        return {"id": 1}

    async def command(
        self, primitive: dict[str, Any], *, wait: bool, by: Caller, options: JobOptions, key: str
    ) -> dict[str, bool]:
        self.options, self.key = options, key
        self._note("command", primitive, wait)
        if wait:
            await self.released.wait()
        return {"waited": wait}

    async def job(self, number: int) -> dict[str, int]:
        self._note("job", number)
        return {"id": number}

    async def page(self, which: Filter) -> list[int]:
        self._note("page", which)
        return []

    async def cancel(self, number: int, *, by: Caller) -> dict[str, int]:
        self._note("cancel", number)
        return {"id": number}

    async def preview(self, job: dict[str, Any], *, by: Caller) -> bytes:
        self._note("preview", job)
        return b'{"duration":1.0}'

    async def jog(self, axis: str, distance: float, *, speed: float, clip: bool) -> Jogged:
        self._note("jog", axis, distance, speed, clip)
        return Jogged(axis, distance)

    async def jog_hold(self, axis: str, direction: int, *, speed: float, press: str | None) -> HeldJog:
        self._note("jog_hold", axis, direction, speed, press)
        return HeldJog(axis, direction, moving=True)

    async def jog_vector(self, vector: tuple[float, float, float], *, press: str | None) -> SteeredJog:
        self._note("jog_vector", vector, press)
        return SteeredJog(vector, moving=True)

    async def jog_release(self, press: str | None) -> None:
        self._note("jog_release", press)

    async def pause(self) -> StopReport:
        self._note("pause")
        return StopReport(True, 0.5, (0.0, 0.01, 0.02))

    async def resume(self) -> None:
        self._note("resume")

    async def speed(self, ratio: float) -> None:
        self._note("speed", ratio)

    async def stop(self) -> StopReport:
        self._note("stop")
        return StopReport(True, 0.5, (0.0, 0.01, 0.02))

    async def abort(self) -> None:
        self._note("abort")

    async def recover(self, *, take_over: bool = False) -> None:
        self._note("recover", *(["take over"] if take_over else []))

    def follow_events(self, seq: int) -> AsyncIterator[Event]:
        return self.log.follow(seq)


def app_client(
    service: ServiceStandIn,
    *,
    edge: OriginPolicy | None = None,
    metrics: Metrics | None = None,
    source: str = "127.0.0.1",
    addresses: Sequence[str] = (),
) -> httpx.AsyncClient:
    """Return a client at the address `source` of the application around `service`, within the running loop."""
    bridge = Bridge(asyncio.get_running_loop(), cast("Service", service))
    app = create_app(bridge, edge, metrics, addresses)
    transport = httpx.ASGITransport(app, raise_app_exceptions=False, client=(source, 1))
    return httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1:4133")


def problem(response: httpx.Response) -> dict[str, Any]:
    """Return a refusal, after checking what every refusal has."""
    assert response.headers["content-type"] == "application/problem+json"
    body = response.json()
    assert body["status"] == response.status_code
    assert body["type"] == f"urn:maya:error:{body['code']}"
    assert body["detail"] and body["title"] and isinstance(body["details"], dict)
    assert "Traceback" not in response.text
    return body
