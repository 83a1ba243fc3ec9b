"""Zones to keep out of, as they are written: in the configuration, and wherever one is handed in."""

from __future__ import annotations

from collections.abc import Mapping
from math import hypot
from typing import Annotated, Literal, Self

from pydantic import Field, TypeAdapter, ValidationError, model_validator

from maya_un.config.base import ConfigSection, Contradiction, Metres, flaw
from maya_un.errors import InvalidRequest

MOST_ZONES = 100
"""Most zones; each one makes the planning of every step longer."""

Coordinate = Annotated[float, Field(ge=-10.0, le=10.0)]
"""A coordinate in the base frame [m]; the bounds catch millimetres."""

Place = Annotated[tuple[Coordinate, Coordinate, Coordinate], Field(strict=False)]
"""x, y, z [m]."""

Name = Annotated[
    str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,39}$", description="its own: letters, digits, - and _")
]
Margin = Annotated[float, Field(ge=0.0, le=1.0, description="kept clear around it, for gripper and part [m]")]
Lines = Annotated[bool, Field(description="the two lines keep out too, not only the gripper")]


class BoxConfig(ConfigSection):
    """A box with edges along x, y and z."""

    name: Name
    kind: Annotated[Literal["box"], Field(description="box, cylinder or half_space")]
    low: Annotated[Place, Field(description="x, y, z of the corner where all three are smallest [m]")]
    high: Annotated[Place, Field(description="x, y, z of the corner where all three are greatest [m]")]
    margin: Margin = 0.05
    lines: Lines = True

    @model_validator(mode="after")
    def _has_volume(self) -> Self:
        if not all(low < high for low, high in zip(self.low, self.high, strict=True)):
            raise Contradiction("low", self.low, "each of its coordinates must be smaller than that of high")
        return self


class CylinderConfig(ConfigSection):
    """A cylinder that stands upright."""

    name: Name
    kind: Annotated[Literal["cylinder"], Field(description="box, cylinder or half_space")]
    x: Annotated[Coordinate, Field(description="x of its axis [m]")]
    y: Annotated[Coordinate, Field(description="y of its axis [m]")]
    radius: Annotated[Metres, Field(description="its radius [m]")]
    low: Annotated[Coordinate, Field(description="z of its bottom [m]")]
    high: Annotated[Coordinate, Field(description="z of its top [m]")]
    margin: Margin = 0.05
    lines: Lines = True

    @model_validator(mode="after")
    def _has_volume(self) -> Self:
        if self.low >= self.high:
            raise Contradiction("low", self.low, "it must be smaller than high")
        return self


class HalfSpaceConfig(ConfigSection):
    """All of one side of a plane."""

    name: Name
    kind: Annotated[Literal["half_space"], Field(description="box, cylinder or half_space")]
    point: Annotated[Place, Field(description="x, y, z of any place on the plane [m]")]
    normal: Annotated[Place, Field(description="direction out of the forbidden side, of any length")]
    margin: Margin = 0.05
    lines: Lines = False

    @model_validator(mode="after")
    def _has_direction(self) -> Self:
        if not hypot(*self.normal) > 1e-6:
            raise Contradiction("normal", self.normal, "it must point somewhere")
        return self


AnyZone = BoxConfig | CylinderConfig | HalfSpaceConfig
"""A zone as it is written."""

ZoneConfig = Annotated[AnyZone, Field(discriminator="kind")]
"""The same for a model: `kind` says which of the three it is."""

KINDS: dict[str, type[AnyZone]] = {"box": BoxConfig, "cylinder": CylinderConfig, "half_space": HalfSpaceConfig}
"""All kinds of zones by name."""

_ADAPTER: TypeAdapter[AnyZone] = TypeAdapter(ZoneConfig)


def parse_zone(keys: Mapping[str, object]) -> AnyZone:
    """Return the zone that somebody hands in; raises `InvalidRequest` with the key and why."""
    try:
        return _ADAPTER.validate_python(dict(keys))
    except ValidationError as error:
        found = flaw(error, tuple(KINDS))
        raise InvalidRequest(key=found.key or "zone", reason=found.reason) from error
