"""Fields of job files and taught places: names, coordinates, joints, counts, as pydantic reads them."""

from __future__ import annotations

from collections.abc import Callable
from math import isnan, nan
from reprlib import repr
from typing import Annotated, Self, TypeVar

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, PlainValidator, model_validator

from maya_un.errors import InvalidValue
from maya_un.process.pallet import check_counts
from maya_un.robot.primitives.arguments import read_joints, read_point
from maya_un.values import Joints, Point

T = TypeVar("T")

Coordinates = tuple[float, ...]
"""x, y and perhaps z [m]."""


def point_of(coordinates: Coordinates, grasp_height: float) -> Point:
    """Return coordinates as a point; z left out means `grasp_height` [m]."""
    x, y, *z = coordinates
    return Point(x, y, *(z or [grasp_height]))


def _explained(read: Callable[[], T]) -> T:
    try:
        return read()
    except InvalidValue as error:
        value = error.details["value"]
        place = str(error.details["key"]).removeprefix("it").removeprefix(".")
        raise ValueError(f"{place + ': ' * bool(place)}{error.details['reason']}, not {value}") from error


def _coordinates(value: object) -> Coordinates:
    point = _explained(lambda: read_point(value, "it", nan))
    return (point.x, point.y) if isnan(point.z) else tuple(point)


def _spot(value: object) -> str | Coordinates:
    return value if isinstance(value, str) else _coordinates(value)


def _joints(value: object) -> Joints:
    return _explained(lambda: read_joints(value, "it"))


def _goal(value: object) -> str | Joints:
    return value if isinstance(value, str) else _joints(value)


def _whole(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError(f"it must be a whole number, not {repr(value)}")  # noqa: TRY004 - pydantic's way
    return value


def _printable(name: str) -> str:
    if not name.isprintable():
        raise ValueError("a name is made of characters that can be printed")
    return name


Name = Annotated[str, Field(min_length=1, max_length=64), AfterValidator(_printable)]
"""A name that a job gives."""

Spot = Annotated[str | Coordinates, PlainValidator(_spot)]
"""A place: by its name, or as [x, y] or [x, y, z] in m."""

Place = Annotated[Coordinates, PlainValidator(_coordinates)]
"""A place as [x, y] or [x, y, z] in m."""

Goal = Annotated[str | Joints, PlainValidator(_goal)]
"""Joints: by the name of a taught pose, or as [a, b, c] in rad and m."""

JointValues = Annotated[Joints, PlainValidator(_joints)]
"""Joints as [a, b, c] in rad and m."""

Whole = Annotated[int, BeforeValidator(_whole)]
"""A whole number; neither 2.0 nor true is one."""


class Grid(BaseModel):
    """A pallet as written: two to four corners in the order in which one reads, how many rows and columns.

    Corners are places or names of places; `Pallet.spanned` tells how many a grid needs.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    corners: Annotated[tuple[Spot, ...], Field(min_length=1)]
    rows: Whole
    columns: Whole

    @model_validator(mode="after")
    def _possible(self) -> Self:
        check_counts(self.rows, self.columns, len(self.corners))
        return self
