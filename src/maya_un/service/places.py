"""Places for the service: zones, taught poses and pallets. Units are m and rad."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from pydantic import ValidationError

from dmc41x3.i18n import phrase
from maya_un.config.model import MOST_ZONES, AnyZone, parse_zone
from maya_un.controller.protocol import Controller
from maya_un.errors import Busy, InvalidRequest, InvalidValue, NotConnected, NotFound, NotHomed, NotTaught
from maya_un.events import EventLog, PlacesChanged
from maya_un.kinematics.zones import Zone, written, zone_of
from maya_un.process.spec.job import Grid
from maya_un.process.spec.poses import PoseStore, TaughtPallet
from maya_un.schema.jobs import PalletInfo, TaughtPose
from maya_un.validation import reason_of
from maya_un.values import Joints, Mode


def zones_of(controller: Controller) -> list[AnyZone]:
    """Return the current zones."""
    return [written(zone) for zone in controller.zones]


def put_zone(controller: Controller, data: Mapping[str, object]) -> AnyZone:
    """Add a keep-out zone, or replace the zone with the same name; return the zone with all defaults.

    Raises `InvalidRequest` for an invalid key, or if there would be more than `MOST_ZONES` zones, and `Busy` while the
    robot moves.
    """
    new = parse_zone(data)
    zones = {zone.name: zone for zone in controller.zones} | {new.name: zone_of(new)}
    if len(zones) > MOST_ZONES:
        raise InvalidRequest(
            key="zone", reason=phrase("at most {most} zones may exist; remove one first", most=MOST_ZONES)
        )
    controller.set_zones(list(zones.values()))
    return new


def drop_zone(controller: Controller, name: str) -> None:
    """Remove a keep-out zone; raises `NotFound`, and `Busy` during a motion."""
    left: list[Zone] = [zone for zone in controller.zones if zone.name != name]
    if len(left) == len(controller.zones):
        raise NotFound(what="zone", number=name)
    controller.set_zones(left)


_AT_REST = {Mode.IDLE, Mode.FAULT, Mode.NOT_HOMED}


def at_rest(controller: Controller) -> Joints:
    """Return the joints at rest (rad, m, m); raises `NotConnected`, `NotHomed`, and `Busy` while the robot moves."""
    state = controller.state
    if state.mode is Mode.DISCONNECTED:
        raise NotConnected
    if state.mode not in _AT_REST or state.moving:
        raise Busy(doing=state.mode.value)
    if not state.homed or state.joints is None:
        raise NotHomed(command=controller.config.homing_command)
    return state.joints


class TeachingService:
    """Reads and changes `store`; each change is an event in `events`, if given.

    `here` returns the joints of the place to teach, and raises an error if there is none. A corner without z is at
    `grasp_height` [m]. Every method raises `FileUnreadable` if the file is not valid; those that change it raise
    `FileUnwritable`.
    """

    def __init__(
        self, store: PoseStore, grasp_height: float, here: Callable[[], Joints], events: EventLog | None = None
    ) -> None:
        self._store = store
        self._events = events
        self._grasp_height = grasp_height
        self._here = here

    def poses(self) -> list[TaughtPose]:
        """Return all poses, in the order in which they were taught."""
        return list(self._store.taught().poses.values())

    def pose(self, name: str) -> TaughtPose:
        """Return a pose; raises `NotTaught`."""
        poses = self._store.taught().poses
        _require("pose", name, poses)
        return poses[name]

    def teach(self, name: str, date: str, joints: Joints | None = None, *, replacing: bool = False) -> TaughtPose:
        """Store `joints` (rad, m, m), by default those of the current position, under `name`, with the `date`.

        Raises what `here` raises, `InvalidValue` for an invalid name, and `NameTaken`; with `replacing`, it replaces a
        pose of that name.
        """
        taught = self._store.teach(name, self._here() if joints is None else joints, date, replacing=replacing)
        self._changed(name)
        return taught

    def forget_pose(self, name: str) -> None:
        """Remove a pose; raises `NotTaught`, and `InvalidValue` if it is the corner of a pallet."""
        self.pose(name)
        self._forget(name)

    def rename_pose(self, old: str, new: str) -> TaughtPose:
        """Rename a pose; raises `NotTaught`, `NameTaken`, and `InvalidValue` for an invalid name."""
        self.pose(old)
        self._rename(old, new)
        return self.pose(new)

    def pallets(self) -> list[PalletInfo]:
        """Return all pallets, in the order in which they were taught."""
        return [self._told(pallet) for pallet in self._store.taught().pallets.values()]

    def pallet(self, name: str) -> PalletInfo:
        """Return a pallet; raises `NotTaught`."""
        pallets = self._store.taught().pallets
        _require("pallet", name, pallets)
        return self._told(pallets[name])

    def teach_pallet(self, name: str, grid: Mapping[str, object], date: str, *, replacing: bool = False) -> PalletInfo:
        """Store a pallet of `corners` (names of poses, or points), `rows` and `columns`, taught on `date`.

        Raises `InvalidRequest` for a missing, extra or invalid key, `InvalidValue` for corners that span no grid and
        for an invalid name, and `NameTaken`; with `replacing`, it replaces a pallet of that name.
        """
        self._store.teach_pallet(name, _grid(grid), date, self._grasp_height, replacing=replacing)
        self._changed(name)
        return self.pallet(name)

    def forget_pallet(self, name: str) -> None:
        """Remove a pallet; the poses at its corners stay. Raises `NotTaught`."""
        self.pallet(name)
        self._forget(name)

    def rename_pallet(self, old: str, new: str) -> PalletInfo:
        """Rename a pallet; raises `NotTaught`, `NameTaken`, and `InvalidValue` for an invalid name."""
        self.pallet(old)
        self._rename(old, new)
        return self.pallet(new)

    def _forget(self, name: str) -> None:
        self._store.forget(name)
        self._changed(name)

    def _rename(self, old: str, new: str) -> None:
        self._store.rename(old, new)
        self._changed(new)

    def _changed(self, name: str) -> None:
        if self._events is not None:
            self._events.emit(PlacesChanged(name))

    def _told(self, taught: TaughtPallet) -> PalletInfo:
        name, grid = taught.name, taught.grid
        try:
            pallet = self._store.taught().spanned(name, grid, self._grasp_height)
        except InvalidValue as error:
            return PalletInfo(name, grid.rows, grid.columns, None, None, None, (str(error),), taught.taught)
        shape = pallet.shape
        return PalletInfo(
            name=name,
            rows=pallet.rows,
            columns=pallet.columns,
            corners=pallet.corners,
            flatness=shape.flatness,
            squareness=shape.squareness,
            remarks=shape.remarks,
            taught=taught.taught,
        )


def _require(what: str, name: str, known: Mapping[str, object]) -> None:
    if name not in known:
        raise NotTaught(what=what, name=name, known=", ".join(known) or "none yet")


def _grid(data: Mapping[str, object]) -> Grid:
    try:
        return Grid.model_validate(dict(data))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"]) or "pallet"
        raise InvalidRequest(key=key, reason=reason_of(first)) from error
