"""Zones for the service: read and changed one by one, in the form of the configuration."""

from __future__ import annotations

from collections.abc import Mapping

from maya_un.config.zones import MOST_ZONES, AnyZone, parse_zone
from maya_un.controller.protocol import Controller
from maya_un.errors import InvalidRequest, NotFound
from maya_un.kinematics.zones import Zone, written, zone_of


def zones_of(controller: Controller) -> list[AnyZone]:
    """Return the zones in force."""
    return [written(zone) for zone in controller.zones]


def put_zone(controller: Controller, data: Mapping[str, object]) -> AnyZone:
    """Keep out of one more zone, which takes the place of one of its name; return it as it is taken.

    Raises `InvalidRequest` with the key that makes it none, and where there are `MOST_ZONES`; `Busy` while something
    moves.
    """
    new = parse_zone(data)
    zones = {zone.name: zone for zone in controller.zones} | {new.name: zone_of(new)}
    if len(zones) > MOST_ZONES:
        raise InvalidRequest(key="zone", reason=f"at most {MOST_ZONES} zones may exist; remove one first")
    controller.set_zones(list(zones.values()))
    return new


def drop_zone(controller: Controller, name: str) -> None:
    """Keep out of a zone no longer; raises `NotFound`, and `Busy` while something moves."""
    left: list[Zone] = [zone for zone in controller.zones if zone.name != name]
    if len(left) == len(controller.zones):
        raise NotFound(what="zone", number=name)
    controller.set_zones(left)
