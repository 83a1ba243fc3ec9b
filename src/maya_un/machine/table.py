"""The table under the robot, the parts that stand on it, and the jaws that take them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import dist

Place = tuple[float, float, float]

REACH = 0.015
"""Closing jaws take a part whose grasp point is this near to the gripper point [m]."""

FALL = 0.005
"""A part that falls farther than this when the jaws open was dropped, not put down [m]."""


@dataclass(frozen=True, slots=True)
class PartDrop:
    """A part was let go at time `time` [s] and fell by `height` [m] to `place` [m]."""

    time: float
    name: str
    height: float
    place: Place


class PartTable:
    """Named parts, each known by its grasp point (x, y, z) [m]; at rest each keeps the z it was put there with.

    `closed` says whether the jaws are closed at power-up; jaws that are closed already take nothing.
    """

    def __init__(self, parts: Mapping[str, Place], *, closed: bool) -> None:
        self._places: dict[str, Place] = {}
        self._rest: dict[str, float] = {}
        self._closed = closed
        self._carried: str | None = None
        self._lift = 0.0
        for name, place in parts.items():
            self.add(name, place)

    @property
    def closed(self) -> bool:
        """Whether the jaws are closed."""
        return self._closed

    @property
    def carried(self) -> str | None:
        """The name of the part between the jaws, None where there is none."""
        return self._carried

    def add(self, name: str, place: Place) -> None:
        """Stand a part on the table. Raises `ValueError` where the name is taken."""
        if name in self._places:
            raise ValueError(f"a part called {name} is on the table already")
        x, y, z = place
        self._places[name] = (x, y, z)
        self._rest[name] = z

    def places(self, gripper: Place) -> dict[str, Place]:
        """Return where the parts are [m], with the gripper point at `gripper` [m]."""
        places = dict(self._places)
        if self._carried is not None:
            x, y, z = gripper
            places[self._carried] = (x, y, z + self._lift)
        return places

    def close(self, gripper: Place) -> str | None:
        """Close the jaws at `gripper` [m]; return the name of the part they take, if any.

        The jaws centre the part: its x and y become theirs, its height relative to them stays.
        """
        if self._closed:
            return None
        self._closed = True
        near = [(dist(place, gripper), name) for name, place in self._places.items()]
        distance, name = min(near, default=(REACH + 1.0, ""))
        if distance > REACH:
            return None
        self._carried = name
        self._lift = self._places[name][2] - gripper[2]
        return name

    def open(self, gripper: Place, time: float) -> PartDrop | None:
        """Open the jaws at `gripper` [m]; a part between them comes to rest below.

        Returns the drop where it fell farther than 5 mm.
        """
        self._closed = False
        name, self._carried = self._carried, None
        if name is None:
            return None
        x, y, z = gripper
        rest = self._places[name] = (x, y, self._rest[name])
        height = z + self._lift - rest[2]
        return PartDrop(time, name, height, rest) if height > FALL else None
