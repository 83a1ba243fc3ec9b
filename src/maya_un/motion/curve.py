"""Ways of the gripper as geometry: through waypoints, straight in one of three spaces, corners cut if wished.

    joint          a, b, c [rad, m, m]    what the axes do best: every axis goes its own way in the same time
    cartesian      x, y, z [m]            the gripper goes straight
    cylindrical    a, d, z [rad, m, m]    the boom swings while distance and height change evenly

Between two spaces a straight line is a curve. A corner with a blend is left that far before the waypoint and reached
again that far behind it, on a parabola (the quadratic Bézier curve with the waypoint as its control point), so that it
is passed without a stop. Every piece of a path, straight or not, is such a curve here: three control points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from math import hypot, isfinite

import numpy as np

from maya_un.errors import InvalidValue, TrajectoryRefused
from maya_un.kinematics import Floats, Mechanism
from maya_un.values import Joints, Point


class Space(StrEnum):
    """In which coordinates a path is straight between its waypoints."""

    JOINT = "joint"
    CARTESIAN = "cartesian"
    CYLINDRICAL = "cylindrical"


Waypoint = tuple[float, float, float]


@dataclass(frozen=True)
class Path:
    """Waypoints in the coordinates of `space`, and for each one between the ends how far its corner is cut [m].

    A blend of 0 is a sharp corner, which is passed next to rest. `blends` may be left out, which means no blends; a
    blend is at most half of a leg between two corners, and all of a leg at an end. Raises `TrajectoryRefused` for fewer
    than two waypoints, `InvalidValue` for numbers that are not finite and for blends that do not fit the waypoints.
    """

    space: Space
    waypoints: tuple[Waypoint, ...]
    blends: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if len(self.waypoints) < 2:
            raise TrajectoryRefused(reason="a path needs at least a start and an end")
        for waypoint in self.waypoints:
            if not all(isfinite(value) for value in waypoint):
                raise InvalidValue(key="target", value=tuple(waypoint), reason="it must be finite")
        if self.blends and len(self.blends) != len(self.waypoints) - 2:
            reason = f"it must hold one number for each of the {len(self.waypoints) - 2} waypoints between the ends"
            raise InvalidValue(key="blends", value=self.blends, reason=reason)
        if not all(0.0 <= blend < float("inf") for blend in self.blends):
            raise InvalidValue(key="blends", value=self.blends, reason="it must hold lengths of 0 or more")

    @classmethod
    def joints(cls, *waypoints: Joints, blend: float = 0.0) -> Path:
        """Return the path straight in (a, b, c) through `waypoints`, all corners cut by `blend` [m]."""
        return cls._through(Space.JOINT, waypoints, blend)

    @classmethod
    def line(cls, *waypoints: Point, blend: float = 0.0) -> Path:
        """Return the path of a gripper that goes straight from point to point [m], all corners cut by `blend` [m]."""
        return cls._through(Space.CARTESIAN, waypoints, blend)

    @classmethod
    def swing(cls, *waypoints: Waypoint, blend: float = 0.0) -> Path:
        """Return the path straight in (a, d, z) [rad, m, m]: around axis a, all corners cut by `blend` [m]."""
        return cls._through(Space.CYLINDRICAL, waypoints, blend)

    @classmethod
    def _through(cls, space: Space, waypoints: Sequence[Waypoint], blend: float) -> Path:
        blends = (blend,) * (len(waypoints) - 2) if blend else ()
        return cls(space, tuple((x, y, z) for x, y, z in waypoints), blends)

    @property
    def is_joint(self) -> bool:
        """Whether it is straight in the joints, leg by leg, without blends."""
        return self.space is Space.JOINT and not any(self.blends)

    def end(self, mechanism: Mechanism) -> Joints:
        """Return the joints of the last waypoint (rad, m, m)."""
        return self._joints(mechanism, self.waypoints[-1])

    def start(self, mechanism: Mechanism) -> Joints:
        """Return the joints of the first waypoint (rad, m, m)."""
        return self._joints(mechanism, self.waypoints[0])

    def vias(self, mechanism: Mechanism) -> list[Joints]:
        """Return the joints of all waypoints, cut corners included (rad, m, m)."""
        return [self._joints(mechanism, waypoint) for waypoint in self.waypoints]

    def begun_at(self, mechanism: Mechanism, joints: Joints) -> Path:
        """Return the same path from exactly `joints` on."""
        first = from_joints(self.space, mechanism, joints)
        return Path(self.space, (first, *self.waypoints[1:]), self.blends)

    def _joints(self, mechanism: Mechanism, waypoint: Waypoint) -> Joints:
        match self.space:
            case Space.JOINT:
                return Joints(*waypoint)
            case Space.CARTESIAN:
                return mechanism.ik(Point(*waypoint))
            case Space.CYLINDRICAL:
                a, b, c = to_joints(self.space, mechanism, np.array([waypoint]))[0]
                return Joints(float(a), float(b), float(c))

    @cached_property
    def pieces(self) -> Pieces:
        """The path as curves one after the other."""
        return _pieces(self)


@dataclass(frozen=True)
class Pieces:
    """Quadratic Bézier curves one after the other, control points of shape (n, 3) each in the path's coordinates.

    The parameter p runs from 0 to n; piece ⌊p⌋ is at its share p − ⌊p⌋. `straight` (n,) tells which are lines, `vias` is
    the parameter at which each waypoint between the ends is passed, `sharp` (n + 1,) which parameters are corners.
    """

    first: Floats
    control: Floats
    last: Floats
    straight: tuple[bool, ...]
    vias: tuple[float, ...]
    sharp: tuple[bool, ...]

    def __len__(self) -> int:
        return len(self.straight)

    def at(self, parameters: Floats) -> Floats:
        """Return the coordinates at `parameters` of shape (m,), as shape (m, 3)."""
        index = np.minimum(parameters.astype(np.intp), len(self.straight) - 1)
        share = (parameters - index)[:, np.newaxis]
        rest = 1.0 - share
        first, control, last = self.first[index], self.control[index], self.last[index]
        return rest * (rest * first + 2.0 * share * control) + share * share * last


def _pieces(path: Path) -> Pieces:
    """Return the legs, shortened by the blends at their ends, and the blends between them."""
    corners = np.array(path.waypoints)
    blends = (0.0, *(path.blends or (0.0,) * (len(corners) - 2)), 0.0)
    before, after = _cuts(path, blends)
    curves: list[tuple[Floats, Floats, Floats]] = []
    straight: list[bool] = []
    vias: list[float] = []
    sharp = [True]
    last_leg = len(corners) - 2
    for leg in range(last_leg + 1):
        one, two = corners[leg], corners[leg + 1]
        begin, end = one + (two - one) * after[leg], two + (one - two) * before[leg + 1]
        if after[leg] + before[leg + 1] < 1.0 - 1e-12:
            curves.append((begin, 0.5 * (begin + end), end))
            straight.append(True)
            sharp.append(before[leg + 1] == 0.0)
        if leg == last_leg:
            break
        if before[leg + 1] > 0.0:
            onward = corners[leg + 2]
            curves.append((end, two, two + (onward - two) * after[leg + 1]))
            straight.append(False)
            sharp.append(False)
            vias.append(len(straight) - 0.5)
        else:
            vias.append(float(len(straight)))
    sharp[-1] = True
    first, control, last = (np.array(column) for column in zip(*curves, strict=True))
    return Pieces(first, control, last, tuple(straight), tuple(vias), tuple(sharp))


def _cuts(path: Path, blends: Sequence[float]) -> tuple[list[float], list[float]]:
    """Return for every waypoint the share of the leg before it and of the leg after it that its blend takes."""
    lengths = [_length(path.space, *pair) for pair in zip(path.waypoints, path.waypoints[1:], strict=False)]
    before, after = [0.0] * len(blends), [0.0] * len(blends)
    last = len(lengths) - 1
    for via in range(1, len(blends) - 1):
        room_before = lengths[via - 1] * (1.0 if via == 1 else 0.5)
        room_after = lengths[via] * (1.0 if via == last else 0.5)
        reach = min(blends[via], room_before, room_after)
        if reach > 0.0:
            before[via], after[via] = reach / lengths[via - 1], reach / lengths[via]
    return before, after


def _length(space: Space, one: Waypoint, two: Waypoint) -> float:
    """Return about how far the gripper goes on a leg [m]; joints count as they are, an angle at 1 m."""
    across, second, third = (there - here for here, there in zip(one, two, strict=True))
    if space is Space.CYLINDRICAL:
        across *= 0.5 * (one[1] + two[1])
    return hypot(across, second, third)


def from_joints(space: Space, mechanism: Mechanism, joints: Joints) -> Waypoint:
    """Return joints (rad, m, m) in the coordinates of `space`; raises `Unreachable` where the lines cannot meet."""
    if space is Space.JOINT:
        return tuple(joints)
    x, y, z = mechanism.fk(joints)
    return (x, y, z) if space is Space.CARTESIAN else (joints.a, hypot(x, y), z)


def to_joints(space: Space, mechanism: Mechanism, coordinates: Floats) -> Floats:
    """Return coordinates of `space`, shape (n, 3), as joints of shape (n, 3) [rad, m, m].

    Above the anchors, where no line holds anything, b and c are nan.
    """
    if space is Space.JOINT:
        return coordinates
    if space is Space.CARTESIAN:
        return mechanism.ik_many(coordinates)
    out = np.empty_like(coordinates)
    u = coordinates[:, 1] - mechanism.delta
    h = mechanism.reach_down - coordinates[:, 2]
    square = np.where(h >= 0.0, h * h, np.nan)
    out[:, 0] = coordinates[:, 0]
    out[:, 1] = np.sqrt(square + u * u)
    out[:, 2] = np.sqrt(square + (mechanism.width - u) ** 2)
    return out
