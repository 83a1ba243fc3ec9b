"""Taught poses and pallets, each with its name, and the rule for names.

One name belongs to one of them. On the command line and in a job they stand where a place stands, so a name cannot
be taken for a number or for a cell.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from maya_un.errors import InvalidValue
from maya_un.process.pallet import Pallet
from maya_un.process.spots import Grid, point_of
from maya_un.schema.places import TaughtPose
from maya_un.values import Point

_NAME = re.compile(r"[^\W\d_][\w.-]{0,63}")


def checked_name(name: object) -> str:
    """Return `name`; raises `InvalidValue` where it may not be one."""
    if not isinstance(name, str) or _NAME.fullmatch(name) is None:
        reason = "a name is a letter and up to 63 letters, digits, dots, hyphens and underscores"
        raise InvalidValue(key="name", value=repr(name), reason=reason)
    return name


@dataclass(frozen=True, slots=True)
class TaughtPallet:
    """A grid of places; its corners are points or names of taught poses."""

    name: str
    grid: Grid
    taught: str


@dataclass(frozen=True, slots=True)
class TaughtPlaces:
    """All poses and pallets by their names, in the order in which they were taught."""

    poses: Mapping[str, TaughtPose] = field(default_factory=dict[str, TaughtPose])
    pallets: Mapping[str, TaughtPallet] = field(default_factory=dict[str, TaughtPallet])

    @property
    def names(self) -> tuple[str, ...]:
        """All names that are taken."""
        return (*self.poses, *self.pallets)

    def pallet(self, name: str, grasp_height: float) -> Pallet:
        """Return the grid of a taught pallet as it is now; a corner without z is at `grasp_height` [m].

        Raises `InvalidValue` where its corners are not what they were when it was taught.
        """
        return self.spanned(name, self.pallets[name].grid, grasp_height)

    def spanned(self, name: str, grid: Grid, grasp_height: float) -> Pallet:
        """Return the pallet `name` that `grid` describes; raises `InvalidValue` for corners that span none."""
        corners = [self._corner(name, corner, grasp_height) for corner in grid.corners]
        try:
            return Pallet.spanned(corners, grid.rows, grid.columns)
        except ValueError as error:
            raise InvalidValue(key=name, value="(a grid)", reason=str(error)) from error

    def _corner(self, pallet: str, corner: str | tuple[float, ...], grasp_height: float) -> Point:
        if not isinstance(corner, str):
            return point_of(corner, grasp_height)
        point = self.poses[corner].point if corner in self.poses else None
        if point is None:
            raise InvalidValue(key=f"{pallet}.corners", value=repr(corner), reason="it is no taught pose with a place")
        return point
