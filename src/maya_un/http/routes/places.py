"""Routes of places: the workspace, zones, taught poses and pallets."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, TypeVar

from fastapi import Query, Response

from maya_un.config import Config
from maya_un.config.model import AnyZone, ZoneConfig
from maya_un.errors import (
    Busy,
    FileUnreadable,
    FileUnwritable,
    InvalidConfig,
    InvalidRequest,
    NameTaken,
    NotConnected,
    NotFound,
    NotHomed,
    NotTaught,
    TakesTooLong,
    TooLarge,
    TooMuchAsked,
    Unreachable,
    WorkerFailed,
)
from maya_un.http.dates import now
from maya_un.http.exchange import answer, sent, sent_as_written, sent_long
from maya_un.http.openapi import config_schema, pallet_schema, zone_schema
from maya_un.http.request_context import Ask
from maya_un.http.routing import Routes
from maya_un.schema.bodies import Forgotten, Name, PlaceToTeach, Points, Removed
from maya_un.schema.configuration import ConfigCheck, ConfigSchema
from maya_un.schema.jobs import PalletInfo, TaughtPose
from maya_un.schema.previews import Reach, Reachability, WorkspaceShape
from maya_un.service.access.operations import Operation
from maya_un.service.places import TeachingService
from maya_un.service.service import Service
from maya_un.values import FARTHEST, Joints, Point

_WORKSPACE = "looking"

Length = Annotated[float, Query(ge=-FARTHEST, le=FARTHEST, allow_inf_nan=False, description="m")]
Height = Annotated[
    float | None, Query(ge=-FARTHEST, le=FARTHEST, allow_inf_nan=False, description="height of the rings [m]")
]
Angle = Annotated[float, Query(ge=-FARTHEST, le=FARTHEST, allow_inf_nan=False, description="rad")]

ConfigBody = Annotated[dict[str, Any] | bytes, sent_long(config_schema)]

_CONFIGS = {
    "single settings": {"settings": {"geometry": {"height": 2.36}, "axes": {"a": {"jerk_counts": None}}}},
    "a whole file": {"text": "[geometry]\nheight = 2.36\n"},
}
_CONFIG_REFUSALS = (FileUnreadable, TooMuchAsked, TakesTooLong, TooLarge, WorkerFailed)

PointsBody = Annotated[Points, sent(Points)]


def add_geometry(routes: Routes) -> None:
    """Add the routes for the configuration, reach and kinematics."""

    @routes.add("GET", "/v1/config", Operation.READ, tag=_WORKSPACE, gives=Config, client="config")
    async def config(ask: Ask) -> Response:
        """Return all constants of the machine, with the zones of this run."""
        return answer(await ask(_in_force))

    @routes.add("GET", "/v1/config/schema", Operation.READ, tag=_WORKSPACE, gives=ConfigSchema, client="config_schema")
    async def config_schema(ask: Ask) -> Response:
        """Return the settings of the configuration: units, ranges, defaults, and descriptions in every language."""

        async def found(service: Service) -> ConfigSchema:
            return service.configuring.schema()

        return answer(await ask(found))

    @routes.add(
        "POST",
        "/v1/config/check",
        Operation.READ,
        tag=_WORKSPACE,
        gives=ConfigCheck,
        refuses=_CONFIG_REFUSALS,
        examples=_CONFIGS,
        client="check_config",
    )
    async def check_config(ask: Ask, config: ConfigBody) -> Response:
        """Check a configuration without writing it.

        Return its mistakes, or its differences from the configuration in force and from the defaults.
        """
        return answer(await ask.unless_left(lambda service: service.configuring.check(config, ask.caller)))

    @routes.add(
        "PUT",
        "/v1/config",
        Operation.CONFIGURE,
        tag=_WORKSPACE,
        gives=ConfigCheck,
        refuses=(InvalidConfig, FileUnwritable, *_CONFIG_REFUSALS),
        examples=_CONFIGS,
        client="put_config",
    )
    async def put_config(ask: Ask, config: ConfigBody) -> Response:
        """Write the configuration file, for the next start of the program.

        Return its differences from the configuration in force and from the defaults. A file with mistakes is not
        written. Comments in the file stay where single settings change.
        """
        return answer(await ask(lambda service: service.configuring.write(config, ask.caller)))

    @routes.add("GET", "/v1/reach", Operation.READ, tag=_WORKSPACE, gives=Reach, client="reach")
    async def reach(ask: Ask, x: Length, y: Length, z: Length) -> Response:
        """Check whether a point [m] is reachable. If it is not, return the reason and the nearest reachable point."""
        return answer(await ask.unless_left(lambda service: service.previews.reach(Point(x, y, z), ask.caller)))

    @routes.add(
        "POST",
        "/v1/reach",
        Operation.READ,
        tag=_WORKSPACE,
        gives=Reachability,
        examples={"a corner of the table, and its middle": {"points": [[0.1, 0.4, 0.4], [0.6, 1.0, 0.4]]}},
        client="reach_many",
    )
    async def reach_many(ask: Ask, body: PointsBody) -> Response:
        """Check whether each of up to 500 points [m] is reachable."""
        points = [Point(*point) for point in body.points]
        return answer(await ask.unless_left(lambda service: service.previews.reach_many(points, ask.caller)))

    @routes.add("GET", "/v1/workspace", Operation.READ, tag=_WORKSPACE, gives=WorkspaceShape, client="workspace")
    async def workspace(ask: Ask, z: Height = None) -> Response:
        """Return the shape of the workspace without zones, with its rings at the height `z` if it is given.

        The shape changes when the robot is homed, because homing measures the strokes of the axes.
        """
        return answer(await ask.unless_left(lambda service: service.previews.shape(z, ask.caller)))

    @routes.add("GET", "/v1/fk", Operation.READ, tag=_WORKSPACE, gives=Point, refuses=(Unreachable,), client="fk")
    async def fk(ask: Ask, a: Angle, b: Length, c: Length) -> Response:
        """Forward kinematics: return the gripper point [m] for joints (rad, m, m)."""
        return answer(await ask(lambda service: service.previews.fk(Joints(a, b, c), ask.caller)))

    @routes.add("GET", "/v1/ik", Operation.READ, tag=_WORKSPACE, gives=Joints, refuses=(Unreachable,), client="ik")
    async def ik(ask: Ask, x: Length, y: Length, z: Length) -> Response:
        """Inverse kinematics: return the joints (rad, m, m) for a gripper point [m]."""
        return answer(await ask(lambda service: service.previews.ik(Point(x, y, z), ask.caller)))


async def _in_force(service: Service) -> Config:
    return service.config().model_copy(update={"zones": tuple(await service.zones())})


_ZONES = "zones"

ZoneBody = Annotated[dict[str, Any], sent_as_written(zone_schema)]

_BOXES = {"a box": {"kind": "box", "low": [0.1, 1.0, 0.0], "high": [0.3, 1.5, 0.6]}}


def add_zones(routes: Routes) -> None:
    """Add the routes of zones."""

    @routes.add("GET", "/v1/zones", Operation.READ, tag=_ZONES, gives=list[ZoneConfig], client="zones.all")
    async def zones(ask: Ask) -> Response:
        """Return all keep-out zones."""
        return answer(await ask(lambda service: service.zones()))

    @routes.add(
        "PUT", "/v1/zones/{name:path}", Operation.ZONES, tag=_ZONES, gives=AnyZone, refuses=(Busy,), examples=_BOXES
    )
    async def put_zone(ask: Ask, name: str, body: ZoneBody) -> Response:
        """Add a keep-out zone, or replace the zone with this name. It is valid until `maya up` ends."""
        if body.get("name", name) != name:
            raise InvalidRequest(key="name", reason="it differs from the name in the path")
        return answer(await ask(lambda service: service.set_zone({**body, "name": name})))

    @routes.add(
        "DELETE",
        "/v1/zones/{name:path}",
        Operation.ZONES,
        tag=_ZONES,
        gives=Removed,
        refuses=(NotFound, Busy),
        client="zones.allow",
    )
    async def remove_zone(ask: Ask, name: str) -> Response:
        """Remove a zone until `maya up` ends."""
        await ask(lambda service: service.remove_zone(name))
        return answer(Removed(name))


T = TypeVar("T")

NameBody = Annotated[Name, sent(Name)]
PlaceBody = Annotated[PlaceToTeach, sent(PlaceToTeach, optional=True)]
GridBody = Annotated[dict[str, Any], sent_as_written(pallet_schema)]

_NAMES = {"another name": {"name": "shelf"}}
_GRIDS = {"three by four": {"corners": ["pose", [0.6, 1.0, 0.4], [0.4, 1.2, 0.4]], "rows": 3, "columns": 4}}
_READING = (FileUnreadable,)
_ONE = (NotTaught, FileUnreadable)
_TAKING = (NameTaken, FileUnreadable, FileUnwritable)


def add_poses(routes: Routes) -> None:
    """Add the routes of poses."""
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
        """Return a taught pose; 4010 NotTaught if there is none."""
        return answer(await _taught(ask, lambda teaching: teaching.pose(name)))

    teaching = (*_TAKING, NotConnected, NotHomed, Busy, Unreachable)

    @routes.add(
        "PUT",
        "/v1/poses/{name:path}",
        Operation.TEACH,
        tag=tag,
        gives=TaughtPose,
        refuses=teaching,
        examples={"a place to which the robot need not move": {"point": [0.6, 1.0, 0.4]}},
        client="poses.teach",
    )
    async def teach(ask: Ask, name: str, body: PlaceBody, replace: bool = False) -> Response:
        """Store the present position of the robot, or the `point` [m], under a name. Nothing moves.

        If the name exists, the request is refused (4011 NameTaken) unless `replace` is true. A pose of a `point` has
        the joints that hold the gripper there; the robot must reach it.
        """
        joints = None
        if body.point is not None:
            point = Point(*body.point)
            joints = await ask(lambda service: service.previews.ik(point, ask.caller))
        return answer(await _taught(ask, lambda teaching: teaching.teach(name, now(), joints, replacing=replace)))

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
        return answer(await _taught(ask, lambda teaching: teaching.rename_pose(name, body.name)))

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
        await _taught(ask, lambda teaching: teaching.forget_pose(name))
        return answer(Forgotten(name))


def add_pallets(routes: Routes) -> None:
    """Add the routes of pallets."""
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
        """Return a taught pallet; 4010 NotTaught if there is none."""
        return answer(await _taught(ask, lambda teaching: teaching.pallet(name)))

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
        """Store a pallet under a name.

        `corners` are the first cell, the last cell of the first row, the first cell of the last row and, optionally,
        the last cell. A single row or column needs only its two ends.
        """
        return answer(await _taught(ask, lambda teaching: teaching.teach_pallet(name, grid, now(), replacing=replace)))

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
        return answer(await _taught(ask, lambda teaching: teaching.rename_pallet(name, body.name)))

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
        await _taught(ask, lambda teaching: teaching.forget_pallet(name))
        return answer(Forgotten(name))


async def _taught(ask: Ask, work: Callable[[TeachingService], T]) -> T:
    """Carry out `work` on the service's teaching in the stack's loop."""

    async def carried_out(service: Service) -> T:
        return work(service.teaching)

    return await ask(carried_out)
