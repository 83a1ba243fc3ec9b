"""The paths of zones: to methods of the service, one to one."""

from __future__ import annotations

from fastapi import FastAPI, Response

from maya_un.errors import InvalidRequest
from maya_un.server.bridge import Bridge
from maya_un.server.exchange import Body, answer


def add_zones(app: FastAPI, bridge: Bridge) -> None:
    """Add the paths of zones."""

    @app.get("/v1/zones")
    async def zones() -> Response:
        """List the zones that the robot keeps out of."""
        return answer(await bridge.call(lambda service: service.zones()))

    @app.put("/v1/zones/{name:path}")
    async def put(name: str, body: Body) -> Response:
        """Keep out of one more zone, for this run."""
        if body.get("name", name) != name:
            raise InvalidRequest(key="name", reason="it is another than that of the path")
        return answer(await bridge.call(lambda service: service.set_zone({**body, "name": name})))

    @app.delete("/v1/zones/{name:path}")
    async def remove(name: str) -> Response:
        """Keep out of a zone no longer, for this run."""
        await bridge.call(lambda service: service.remove_zone(name))
        return answer({"removed": name})
