"""The paths of named poses and pallets: to methods of the service's `Teaching`, one to one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from fastapi import FastAPI, Response

from maya_un.api.service import Service
from maya_un.api.teaching import Teaching
from maya_un.errors import InvalidRequest, InvalidValue
from maya_un.server.bridge import Bridge
from maya_un.server.dates import now
from maya_un.server.exchange import Body, answer

T = TypeVar("T")


def add_poses(app: FastAPI, bridge: Bridge) -> None:
    """Add the paths of poses."""
    teaching = _Caller(bridge)

    @app.get("/v1/poses")
    async def poses() -> Response:
        """List all taught poses."""
        return answer(await teaching(Teaching.poses))

    @app.get("/v1/poses/{name:path}")
    async def pose(name: str) -> Response:
        """Tell where one pose is."""
        return answer(await teaching(lambda book: book.pose(name)))

    @app.put("/v1/poses/{name:path}")
    async def teach(name: str, replace: bool = False) -> Response:
        """Keep where the robot is under a name."""
        return answer(await teaching(lambda book: book.teach(name, now(), replacing=replace)))

    @app.patch("/v1/poses/{name:path}")
    async def rename(name: str, body: Body) -> Response:
        """Give a pose another name."""
        new = _name(body)
        return answer(await teaching(lambda book: book.rename_pose(name, new)))

    @app.delete("/v1/poses/{name:path}")
    async def forget(name: str) -> Response:
        """Forget a pose."""
        await teaching(lambda book: book.forget_pose(name))
        return answer({"forgotten": name})


def add_pallets(app: FastAPI, bridge: Bridge) -> None:
    """Add the paths of pallets."""
    teaching = _Caller(bridge)

    @app.get("/v1/pallets")
    async def pallets() -> Response:
        """List all taught pallets."""
        return answer(await teaching(Teaching.pallets))

    @app.get("/v1/pallets/{name:path}")
    async def pallet(name: str) -> Response:
        """Tell of one pallet."""
        return answer(await teaching(lambda book: book.pallet(name)))

    @app.put("/v1/pallets/{name:path}")
    async def teach_pallet(name: str, grid: Body, replace: bool = False) -> Response:
        """Keep a grid, spanned by its corners, under a name."""
        return answer(await teaching(lambda book: book.teach_pallet(name, grid, now(), replacing=replace)))

    @app.patch("/v1/pallets/{name:path}")
    async def rename_pallet(name: str, body: Body) -> Response:
        """Give a pallet another name."""
        new = _name(body)
        return answer(await teaching(lambda book: book.rename_pallet(name, new)))

    @app.delete("/v1/pallets/{name:path}")
    async def forget_pallet(name: str) -> Response:
        """Forget a pallet; the poses at its corners stay."""
        await teaching(lambda book: book.forget_pallet(name))
        return answer({"forgotten": name})


class _Caller:
    """Has wishes to the service's teaching carried out in its loop."""

    def __init__(self, bridge: Bridge) -> None:
        self._bridge = bridge

    async def __call__(self, wish: Callable[[Teaching], T]) -> T:
        async def carried_out(service: Service) -> T:
            return wish(service.teaching)

        return await self._bridge.call(carried_out)


def _name(body: dict[str, Any]) -> str:
    """Return the new name that a body holds, and nothing else; raises `InvalidRequest` and `InvalidValue`."""
    for key in sorted(set(body) ^ {"name"}):
        raise InvalidRequest(key=key, reason="it is missing" if key == "name" else "there is no such key")
    if not isinstance(body["name"], str):
        raise InvalidValue(key="name", value=repr(body["name"]), reason="it is a text")
    return body["name"]
