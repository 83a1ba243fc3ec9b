"""The HTTP interface, version 1: maps paths one to one to methods of the Service."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from fastapi import FastAPI
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException

from maya_un import __version__
from maya_un.errors import MayaError
from maya_un.http import errors
from maya_un.http.bridge import Bridge
from maya_un.http.connections import Rights
from maya_un.http.exchange import on_validation_error
from maya_un.http.metrics import Metrics
from maya_un.http.middleware import RequestGuard
from maya_un.http.origins import OriginPolicy
from maya_un.http.routes.calibration import add_calibration
from maya_un.http.routes.diagnosis import add_diagnosis
from maya_un.http.routes.jobs import add_jobs, add_previews, add_tasks, add_texts
from maya_un.http.routes.people import add_lease, add_sessions, add_tokens, add_users
from maya_un.http.routes.places import add_geometry, add_pallets, add_poses, add_zones
from maya_un.http.routes.queue import add_ordering, add_queue, add_recovery
from maya_un.http.routes.robot import add_datum, add_moving
from maya_un.http.routes.system import add_keeping, add_reading, add_recordings, add_system
from maya_un.http.routes.twin import add_twin
from maya_un.http.routing import Routes
from maya_un.http.stream.server import add_stream


def create_app(
    bridge: Bridge,
    edge: OriginPolicy | None = None,
    metrics: Metrics | None = None,
    addresses: Sequence[str] = (),
) -> FastAPI:
    """Return the application that passes every request to the service behind `bridge`.

    `edge` decides which requests are accepted; `metrics` counts them. `addresses` are the URLs for other computers.
    Every error, Maya's or the framework's, is answered as problem+json with its code.
    """
    # Without a name, a path would be redirected to that of the list, which a client would take for success.
    app = FastAPI(
        title="Maya-UN", version=__version__, docs_url=None, redoc_url=None, openapi_url=None, redirect_slashes=False
    )
    routes = all_routes()
    app.router.routes += routes.router.routes  # `include_router` would build each route again
    app.state.rules = routes.rules
    app.state.bridge = bridge
    app.state.rights = Rights(bridge)
    app.state.metrics = metrics or Metrics()
    app.state.addresses = tuple(addresses)
    policy = edge or OriginPolicy()
    app.add_middleware(RequestGuard, edge=policy, metrics=app.state.metrics)
    app.add_exception_handler(MayaError, errors.on_maya_error)
    app.add_exception_handler(RequestValidationError, on_validation_error)
    app.add_exception_handler(HTTPException, errors.on_http_error)
    add_stream(app, bridge, readers=policy.readers)
    return app


@cache
def all_routes() -> Routes:
    """Return the routes that all applications of this process share, because building them takes 0.2 s."""
    routes = Routes()
    add_system(routes)
    add_reading(routes)
    add_geometry(routes)
    add_jobs(routes)
    add_previews(routes)
    add_texts(routes)
    add_tasks(routes)
    add_queue(routes)
    add_recovery(routes)
    add_ordering(routes)
    add_moving(routes)
    add_datum(routes)
    add_lease(routes)
    add_poses(routes)
    add_pallets(routes)
    add_zones(routes)
    add_sessions(routes)
    add_users(routes)
    add_tokens(routes)
    add_recordings(routes)
    add_keeping(routes)
    add_diagnosis(routes)
    add_calibration(routes)
    add_twin(routes)
    return routes
