"""The paths of named poses and pallets: to methods of the service's `TeachingService`, one to one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, TypeVar

from fastapi import Response

from maya_un.api.access.operations import Operation
from maya_un.api.service import Service
from maya_un.api.teaching import TeachingService
from maya_un.errors import Busy, FileUnreadable, FileUnwritable, NameTaken, NotConnected, NotHomed, NotTaught
from maya_un.schema.bodies import Forgotten, Name
from maya_un.schema.places import PalletInfo, TaughtPose
from maya_un.server.asking import Ask
from maya_un.server.dates import now
from maya_un.server.exchange import answer, sent, sent_as_written
from maya_un.server.routes import Routes
from maya_un.server.schemas import GRID

T = TypeVar("T")

NameBody = Annotated[Name, sent(Name)]
GridBody = Annotated[dict[str, Any], sent_as_written(GRID)]

_NAMES = {"another name": {"name": "shelf"}}
_GRIDS = {"three by four": {"corners": ["pose", [0.6, 1.0, 0.4], [0.4, 1.2, 0.4]], "rows": 3, "columns": 4}}
_READING = (FileUnreadable,)
_ONE = (NotTaught, FileUnreadable)
_TAKING = (NameTaken, FileUnreadable, FileUnwritable)


def add_poses(routes: Routes) -> None:
    """Add the paths of poses."""
    tag = "poses"

    @routes.add(
        "GET", "/v1/poses", Operation.READ, tag=tag, gives=list[TaughtPose], refuses=_READING, client="poses.all"
    )
    async def poses(ask: Ask) -> Response:
        """Return all taught poses, in the order in which they were taught."""
        return answer(await _taught(ask, TeachingService.poses))

    @routes.add(
        "GET", "/v1/poses/{name:path}", Operation.READ, tag=tag, gives=TaughtPose, refuses=_ONE, client="poses.get"
    )
    async def pose(ask: Ask, name: str) -> Response:
        """Return a taught pose; raises `NotTaught`."""
        return answer(await _taught(ask, lambda book: book.pose(name)))

    teaching = (*_TAKING, NotConnected, NotHomed, Busy)

    @routes.add(
        "PUT",
        "/v1/poses/{name:path}",
        Operation.TEACH,
        tag=tag,
        gives=TaughtPose,
        refuses=teaching,
        client="poses.teach",
    )
    async def teach(ask: Ask, name: str, replace: bool = False) -> Response:
        """Store the present position of the robot under a name.

        Raises `NameTaken` unless `replace` is true.
        """
        return answer(await _taught(ask, lambda book: book.teach(name, now(), replacing=replace)))

    @routes.add(
        "PATCH",
        "/v1/poses/{name:path}",
        Operation.TEACH,
        tag=tag,
        gives=TaughtPose,
        refuses=(NotTaught, *_TAKING),
        examples=_NAMES,
        client="poses.rename",
    )
    async def rename(ask: Ask, name: str, body: NameBody) -> Response:
        """Rename a pose."""
        return answer(await _taught(ask, lambda book: book.rename_pose(name, body.name)))

    forgetting = (*_ONE, FileUnwritable)

    @routes.add(
        "DELETE",
        "/v1/poses/{name:path}",
        Operation.TEACH,
        tag=tag,
        gives=Forgotten,
        refuses=forgetting,
        client="poses.forget",
    )
    async def forget(ask: Ask, name: str) -> Response:
        """Delete a pose."""
        await _taught(ask, lambda book: book.forget_pose(name))
        return answer(Forgotten(name))


def add_pallets(routes: Routes) -> None:
    """Add the paths of pallets."""
    tag = "pallets"

    @routes.add(
        "GET", "/v1/pallets", Operation.READ, tag=tag, gives=list[PalletInfo], refuses=_READING, client="pallets.all"
    )
    async def pallets(ask: Ask) -> Response:
        """Return all taught pallets, in the order in which they were taught."""
        return answer(await _taught(ask, TeachingService.pallets))

    @routes.add(
        "GET", "/v1/pallets/{name:path}", Operation.READ, tag=tag, gives=PalletInfo, refuses=_ONE, client="pallets.get"
    )
    async def pallet(ask: Ask, name: str) -> Response:
        """Return a taught pallet; raises `NotTaught`."""
        return answer(await _taught(ask, lambda book: book.pallet(name)))

    @routes.add(
        "PUT",
        "/v1/pallets/{name:path}",
        Operation.TEACH,
        tag=tag,
        gives=PalletInfo,
        refuses=(NotTaught, *_TAKING),
        examples=_GRIDS,
    )
    async def teach_pallet(ask: Ask, name: str, grid: GridBody, replace: bool = False) -> Response:
        """Store a grid, spanned by its corners, under a name."""
        return answer(await _taught(ask, lambda book: book.teach_pallet(name, grid, now(), replacing=replace)))

    @routes.add(
        "PATCH",
        "/v1/pallets/{name:path}",
        Operation.TEACH,
        tag=tag,
        gives=PalletInfo,
        refuses=(NotTaught, *_TAKING),
        examples=_NAMES,
        client="pallets.rename",
    )
    async def rename_pallet(ask: Ask, name: str, body: NameBody) -> Response:
        """Rename a pallet."""
        return answer(await _taught(ask, lambda book: book.rename_pallet(name, body.name)))

    forgetting = (*_ONE, FileUnwritable)

    @routes.add(
        "DELETE",
        "/v1/pallets/{name:path}",
        Operation.TEACH,
        tag=tag,
        gives=Forgotten,
        refuses=forgetting,
        client="pallets.forget",
    )
    async def forget_pallet(ask: Ask, name: str) -> Response:
        """Delete a pallet; the poses at its corners stay."""
        await _taught(ask, lambda book: book.forget_pallet(name))
        return answer(Forgotten(name))


async def _taught(ask: Ask, wish: Callable[[TeachingService], T]) -> T:
    """Carry out a request to the service's teaching in its loop."""

    async def carried_out(service: Service) -> T:
        return wish(service.teaching)

    return await ask(carried_out)
