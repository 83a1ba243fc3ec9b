"""The HTTP interface, version 1: paths to methods of the Service, one to one."""

from __future__ import annotations

from fastapi import FastAPI, Response
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException

from maya_un import __version__
from maya_un.errors import MayaError
from maya_un.server import problems
from maya_un.server.bodies import Health
from maya_un.server.bridge import Bridge
from maya_un.server.edge import Edge
from maya_un.server.exchange import answer
from maya_un.server.guard import Guard
from maya_un.server.jobs import add_jobs, add_previews, add_tasks
from maya_un.server.moving import add_moving
from maya_un.server.queueing import add_ordering, add_queue, add_recovery
from maya_un.server.reading import add_reading
from maya_un.server.routes import Routes
from maya_un.server.teaching import add_pallets, add_poses
from maya_un.server.zoning import add_zones


def create_app(bridge: Bridge, edge: Edge | None = None) -> FastAPI:
    """Return the application that hands every request to the service behind `bridge`; `edge` says whom it lets in.

    Every error, ours or the framework's, is answered as problem+json with its code.
    """
    app = FastAPI(title="Maya-UN", version=__version__, docs_url=None, redoc_url=None, openapi_url=None)
    app.state.bridge = bridge
    app.add_middleware(Guard, edge=edge or Edge())
    app.add_exception_handler(MayaError, problems.on_maya_error)
    app.add_exception_handler(RequestValidationError, problems.on_validation_error)
    app.add_exception_handler(HTTPException, problems.on_http_error)
    routes = Routes(app)
    _add_health(routes)
    add_reading(routes, bridge)
    add_jobs(routes)
    add_previews(routes)
    add_tasks(routes)
    add_queue(routes)
    add_recovery(routes)
    add_ordering(routes)
    add_moving(routes)
    add_poses(routes)
    add_pallets(routes)
    add_zones(routes)
    return app


def _add_health(routes: Routes) -> None:
    @routes.add("GET", "/v1/health", tag="server", gives=Health)
    async def health() -> Response:
        """Answer without asking the robot: the server lives."""
        return answer(Health("ok", __version__))
