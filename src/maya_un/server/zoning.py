"""The paths of zones: to methods of the service, one to one."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import Response

from maya_un.api.access.operations import Operation
from maya_un.config.zones import AnyZone, ZoneConfig
from maya_un.errors import Busy, InvalidRequest, NotFound
from maya_un.schema.bodies import Removed
from maya_un.server.asking import Ask
from maya_un.server.exchange import answer, sent_as_written
from maya_un.server.routes import Routes
from maya_un.server.schemas import ZONE

_TAG = "zones"

ZoneBody = Annotated[dict[str, Any], sent_as_written(ZONE)]

_BOXES = {"a box": {"kind": "box", "low": [0.1, 1.0, 0.0], "high": [0.3, 1.5, 0.6]}}


def add_zones(routes: Routes) -> None:
    """Add the paths of zones."""

    @routes.add("GET", "/v1/zones", Operation.READ, tag=_TAG, gives=list[ZoneConfig], client="zones.all")
    async def zones(ask: Ask) -> Response:
        """Return the zones that the robot keeps out of."""
        return answer(await ask(lambda service: service.zones()))

    @routes.add(
        "PUT", "/v1/zones/{name:path}", Operation.ZONES, tag=_TAG, gives=AnyZone, refuses=(Busy,), examples=_BOXES
    )
    async def put_zone(ask: Ask, name: str, body: ZoneBody) -> Response:
        """Add a zone to keep out of, for this run.

        It replaces a zone of the same name.
        """
        if body.get("name", name) != name:
            raise InvalidRequest(key="name", reason="it is another than that of the path")
        return answer(await ask(lambda service: service.set_zone({**body, "name": name})))

    @routes.add(
        "DELETE",
        "/v1/zones/{name:path}",
        Operation.ZONES,
        tag=_TAG,
        gives=Removed,
        refuses=(NotFound, Busy),
        client="zones.allow",
    )
    async def remove_zone(ask: Ask, name: str) -> Response:
        """Remove a zone, for this run."""
        await ask(lambda service: service.remove_zone(name))
        return answer(Removed(name))
