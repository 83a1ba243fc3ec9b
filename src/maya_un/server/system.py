"""The paths of the server itself: does it live, is the robot ready, what does it count, what can be asked."""

from __future__ import annotations

from fastapi import FastAPI, Request, Response

from maya_un import __version__
from maya_un.api.access.operations import Operation
from maya_un.api.service import Service
from maya_un.schema.encoding import to_json
from maya_un.schema.jobs import QueueView
from maya_un.schema.robot import Health, Readiness, Status
from maya_un.server.asking import Ask
from maya_un.server.bridge import Bridge
from maya_un.server.exchange import answer
from maya_un.server.language import language_of
from maya_un.server.metrics import CONTENT_TYPE, Metrics
from maya_un.server.openapi import document
from maya_un.server.routes import Routes
from maya_un.server.wellness import readiness, storage_of

_TAG = "server"


def add_system(routes: Routes, app: FastAPI, bridge: Bridge, metrics: Metrics) -> None:
    """Add the paths."""

    @routes.add("GET", "/v1/health", tag=_TAG, gives=Health)
    async def health() -> Response:
        """Answer that the process lives. The robot is not asked: the answer is the same while its loop hangs."""
        return answer(Health("ok", __version__))

    @routes.add("GET", "/v1/ready", tag=_TAG, gives=Readiness, also=(503,))
    async def ready(request: Request) -> Response:
        """Ask the robot's loop, for 1 s at most, whether commands can be carried out; tell what prevents it."""
        found = await readiness(bridge, language_of(request.headers))
        return answer(found, 200 if found.ready else 503)

    @routes.add("GET", "/metrics", Operation.READ, tag=_TAG, gives=str, media=CONTENT_TYPE)
    async def prometheus(ask: Ask) -> Response:
        """Tell Prometheus what is counted."""
        status, queue = await ask(_standing)
        return Response(metrics.text(status, queue, storage_of(bridge)), media_type=CONTENT_TYPE)

    @routes.add("GET", "/v1/openapi.json", tag=_TAG, gives=dict[str, object])
    async def openapi() -> Response:
        """Tell what can be asked here, as an OpenAPI document."""
        return Response(to_json(document(app)), media_type="application/json")


async def _standing(service: Service) -> tuple[Status, QueueView]:
    return await service.status(), service.queue.view()
