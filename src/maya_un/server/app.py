"""The HTTP interface, version 1: paths to methods of the Service, one to one."""

from __future__ import annotations

from typing import Annotated

from fastapi import FastAPI, Query, Response
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException

from maya_un import __version__
from maya_un.api.messages import EventMessage
from maya_un.api.service import MOST_SAMPLES
from maya_un.errors import MayaError, NotFound
from maya_un.server import problems
from maya_un.server.bridge import Bridge
from maya_un.server.exchange import Body, answer
from maya_un.server.guard import Guard
from maya_un.server.moving import add_moving
from maya_un.server.teaching import add_pallets, add_poses
from maya_un.server.zoning import add_zones

LONGEST_WAIT = 60.0
"""Longest wait for a new event [s, real time]."""


def create_app(bridge: Bridge) -> FastAPI:
    """Return the application that hands every request to the service behind `bridge`.

    Every error, ours or the framework's, is answered as problem+json with its code.
    """
    app = FastAPI(title="Maya-UN", version=__version__, docs_url=None, redoc_url=None)
    app.add_middleware(Guard)
    app.add_exception_handler(MayaError, problems.on_maya_error)
    app.add_exception_handler(RequestValidationError, problems.on_validation_error)
    app.add_exception_handler(HTTPException, problems.on_http_error)
    _add_reading(app, bridge)
    _add_jobs(app, bridge)
    _add_wishes(app, bridge)
    add_moving(app, bridge)
    add_poses(app, bridge)
    add_pallets(app, bridge)
    add_zones(app, bridge)
    return app


def _add_reading(app: FastAPI, bridge: Bridge) -> None:
    @app.get("/v1/health")
    async def health() -> Response:
        """Answer without asking the robot: the server lives."""
        return answer({"status": "ok", "version": __version__})

    @app.get("/v1/status")
    async def status() -> Response:
        """Tell the latest state of the robot and of the queue."""
        return answer(await bridge.call(lambda service: service.status()))

    @app.get("/v1/events")
    async def events(
        since: Annotated[int, Query(ge=0)] = 0, wait: Annotated[float, Query(ge=0, le=LONGEST_WAIT)] = 0.0
    ) -> Response:
        """Return the events numbered above `since`; without any, wait up to `wait` seconds for one."""
        return answer([EventMessage.of(event) for event in await bridge.events(since, wait)])

    @app.get("/v1/twin")
    async def twin() -> Response:
        """Tell where the parts on the twin's table stand, by the mechanics' own record."""
        if bridge.parts is None:
            raise NotFound(what="twin", number="on a real machine")
        return answer({"parts": bridge.parts()})


def _add_jobs(app: FastAPI, bridge: Bridge) -> None:
    @app.post("/v1/jobs")
    async def submit(job: Body) -> Response:
        """Append a job to the queue."""
        return answer(await bridge.call(lambda service: service.submit(job)), 202)

    @app.get("/v1/jobs")
    async def jobs() -> Response:
        """List all jobs, oldest first."""
        return answer(await bridge.call(lambda service: service.jobs()))

    @app.get("/v1/jobs/{job}")
    async def report(job: int) -> Response:
        """Tell how one job stands, step by step."""
        return answer(await bridge.call(lambda service: service.job(job)))

    @app.delete("/v1/jobs/{job}")
    async def cancel(job: int) -> Response:
        """Cancel a job; the one under way stops on its path."""
        return answer(await bridge.call(lambda service: service.cancel(job)))

    @app.post("/v1/preview")
    async def preview(job: Body) -> Response:
        """Tell what a job would be, step by step; nothing moves."""
        return answer(await bridge.call(lambda service: service.preview(job)))

    @app.post("/v1/inspect")
    async def inspect(job: Body, samples: Annotated[int, Query(ge=2, le=MOST_SAMPLES)] = 200) -> Response:
        """Tell what a job would be in detail: profiles of the axes, least margins, the longest stop; nothing moves."""
        return answer(await bridge.call(lambda service: service.inspect(job, samples=samples)))


def _add_wishes(app: FastAPI, bridge: Bridge) -> None:
    @app.post("/v1/tasks")
    async def task(primitive: Body, wait: bool = False) -> Response:
        """Append one wish to the queue as a job of one step; with `wait`, answer when it has ended."""
        report = await bridge.call(lambda service: service.wish(primitive, wait=wait))
        return answer(report, 200 if wait else 202)

    @app.post("/v1/stop")
    async def stop() -> Response:
        """Stop on the path, now; tell how long and how far it still goes."""
        return answer(await bridge.call(lambda service: service.stop()))

    @app.post("/v1/abort")
    async def abort() -> Response:
        """Stop without deceleration."""
        await bridge.call(lambda service: service.abort())
        return answer({"aborted": True})

    @app.post("/v1/recover")
    async def recover() -> Response:
        """Clear a fault once its cause is gone; nothing moves."""
        await bridge.call(lambda service: service.recover())
        return answer({"recovered": True})
