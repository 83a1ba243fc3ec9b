"""The paths that ask about the machine itself: its constants, what it can reach. Nothing moves."""

from __future__ import annotations

from typing import Annotated

from fastapi import Query, Response

from maya_un.api.access.operations import Operation
from maya_un.api.service import Service
from maya_un.config import Config
from maya_un.errors import Unreachable
from maya_un.schema.previews import Reach
from maya_un.server.asking import Ask
from maya_un.server.exchange import answer
from maya_un.server.routes import Routes
from maya_un.values import FARTHEST, Joints, Point

_TAG = "looking"

Length = Annotated[float, Query(ge=-FARTHEST, le=FARTHEST, allow_inf_nan=False, description="m")]
Angle = Annotated[float, Query(ge=-FARTHEST, le=FARTHEST, allow_inf_nan=False, description="rad")]


def add_geometry(routes: Routes) -> None:
    """Add the paths."""

    @routes.add("GET", "/v1/config", Operation.READ, tag=_TAG, gives=Config, client="config")
    async def config(ask: Ask) -> Response:
        """Return all constants of the machine, with the zones of this run."""
        return answer(await ask(_in_force))

    @routes.add("GET", "/v1/reach", Operation.READ, tag=_TAG, gives=Reach, client="reach")
    async def reach(ask: Ask, x: Length, y: Length, z: Length) -> Response:
        """Return whether a point [m] can be reached; if not, why, and the nearest point that can."""
        return answer(await ask.unless_left(lambda service: service.previews.reach(Point(x, y, z), ask.caller)))

    @routes.add("GET", "/v1/fk", Operation.READ, tag=_TAG, gives=Point, refuses=(Unreachable,), client="fk")
    async def fk(ask: Ask, a: Angle, b: Length, c: Length) -> Response:
        """Return the gripper point [m] of joints (rad, m, m)."""
        return answer(await ask(lambda service: service.previews.fk(Joints(a, b, c), ask.caller)))

    @routes.add("GET", "/v1/ik", Operation.READ, tag=_TAG, gives=Joints, refuses=(Unreachable,), client="ik")
    async def ik(ask: Ask, x: Length, y: Length, z: Length) -> Response:
        """Return the joints (rad, m, m) that hold the gripper at a point [m]."""
        return answer(await ask(lambda service: service.previews.ik(Point(x, y, z), ask.caller)))


async def _in_force(service: Service) -> Config:
    return service.config().model_copy(update={"zones": tuple(await service.zones())})
