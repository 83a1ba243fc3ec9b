"""The HTTP interface, version 1: paths to methods of the Service, one to one."""

from __future__ import annotations

from fastapi import FastAPI
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException

from maya_un import __version__
from maya_un.errors import MayaError
from maya_un.server import problems
from maya_un.server.bridge import Bridge
from maya_un.server.edge import OriginPolicy
from maya_un.server.geometry import add_geometry
from maya_un.server.guard import RequestGuard
from maya_un.server.jobs import add_jobs, add_previews, add_tasks
from maya_un.server.keeping import add_keeping
from maya_un.server.leasing import add_lease
from maya_un.server.metrics import Metrics
from maya_un.server.moving import add_moving
from maya_un.server.people import add_sessions, add_tokens, add_users
from maya_un.server.queueing import add_ordering, add_queue, add_recovery
from maya_un.server.reading import add_reading
from maya_un.server.recordings import add_recordings
from maya_un.server.rights import Rights
from maya_un.server.routes import Routes
from maya_un.server.stream import add_stream
from maya_un.server.system import add_system
from maya_un.server.teaching import add_pallets, add_poses
from maya_un.server.zoning import add_zones


def create_app(bridge: Bridge, edge: OriginPolicy | None = None, metrics: Metrics | None = None) -> FastAPI:
    """Return the application that hands every request to the service behind `bridge`.

    `edge` says whom it lets in, `metrics` count. Every error, ours or the framework's, is answered as problem+json with
    its code.
    """
    app = FastAPI(title="Maya-UN", version=__version__, docs_url=None, redoc_url=None, openapi_url=None)
    app.state.bridge = bridge
    app.state.rights = Rights(bridge)
    counted = metrics or Metrics()
    app.add_middleware(RequestGuard, edge=edge or OriginPolicy(), metrics=counted)
    app.add_exception_handler(MayaError, problems.on_maya_error)
    app.add_exception_handler(RequestValidationError, problems.on_validation_error)
    app.add_exception_handler(HTTPException, problems.on_http_error)
    routes = Routes(app)
    add_system(routes, app, bridge, counted)
    add_reading(routes, bridge)
    add_geometry(routes)
    add_jobs(routes)
    add_previews(routes)
    add_tasks(routes)
    add_queue(routes)
    add_recovery(routes)
    add_ordering(routes)
    add_moving(routes)
    add_lease(routes)
    add_poses(routes)
    add_pallets(routes)
    add_zones(routes)
    add_sessions(routes, bridge)
    add_users(routes)
    add_tokens(routes)
    add_recordings(routes)
    add_keeping(routes, bridge)
    add_stream(app, bridge)
    return app
