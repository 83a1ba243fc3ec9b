"""Paths of the gripper as geometry: through waypoints, straight in one of three spaces, with optional cut corners.

    joint          a, b, c [rad, m, m]    best for the axes: all move evenly in the same time
    cartesian      x, y, z [m]            the gripper moves straight
    cylindrical    a, d, z [rad, m, m]    the boom swings while distance and height change evenly

A line that is straight in one space is a curve in another. A corner with a blend is passed without a stop: the leg
before it slows down while the leg after it already speeds up, each evenly, so that parabolas cut the corner. Every
piece of a path, straight or not, is a quadratic Bézier curve here: three control points.

`overlap` computes a blend such that the leg before slows down exactly while the leg after speeds up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from itertools import pairwise
from math import hypot, inf, sqrt
from typing import NamedTuple

import numpy as np

from dmc41x3.i18n import phrase
from maya_un.config import Units
from maya_un.errors import InvalidValue, TrajectoryRefused
from maya_un.kinematics import Floats, Mechanism
from maya_un.motion.profile import Limits
from maya_un.values import FARTHEST, WITHIN, Joints, Point


class Space(StrEnum):
    """The coordinates in which a path is straight between its waypoints."""

    JOINT = "joint"
    CARTESIAN = "cartesian"
    CYLINDRICAL = "cylindrical"


Waypoint = tuple[float, float, float]


class Blend(NamedTuple):
    """How a corner is cut: from the distance `before` in front of the waypoint to the distance `after` past it [m].

    During the blend, the leg before slows down in the last share `fall` of the time, and the leg after speeds up in the
    first share `rise`. If both are 1 the blend is one parabola. If one leg reaches its speed quickly and the other does
    not, a small share for the quick one makes the corner as fast as both allow.
    """

    before: float
    after: float
    fall: float = 1.0
    rise: float = 1.0

    def scaled(self, factor: float) -> Blend:
        """Return the same blend, larger or smaller."""
        return self._replace(before=factor * self.before, after=factor * self.after)


_BACK = -0.99
"""Cosine of the angle between two legs below which a path turns back."""

_LEAST = 1e-6
"""A corner that is cut by less than this [m] is sharp."""

SHARP = Blend(0.0, 0.0)
"""No blend: the corner is passed next to rest."""


@dataclass(frozen=True)
class Path:
    """Waypoints in the coordinates of `space`, and a blend for each one between the ends.

    Without `blends` all corners are sharp. Two blends together may not be longer than the leg between them; otherwise
    they are shortened evenly. Raises `TrajectoryRefused` for fewer than two waypoints, `InvalidValue` for numbers that
    are not finite or beyond `FARTHEST`, and for blends that do not fit the waypoints.
    """

    space: Space
    waypoints: tuple[Waypoint, ...]
    blends: tuple[Blend, ...] = ()

    def __post_init__(self) -> None:
        if len(self.waypoints) < 2:
            raise TrajectoryRefused(reason="a path needs at least a start and an end")
        for waypoint in self.waypoints:
            if not all(abs(value) <= FARTHEST for value in waypoint):
                raise InvalidValue(key="target", value=tuple(waypoint), reason=WITHIN)
        if self.blends and len(self.blends) != len(self.waypoints) - 2:
            reason = phrase(
                "it must hold one for each of the {count} waypoints between the ends", count=len(self.waypoints) - 2
            )
            raise InvalidValue(key="blends", value=len(self.blends), reason=reason)
        for blend in self.blends:
            lengths, shares = blend[:2], blend[2:]
            if not all(0.0 <= length < inf for length in lengths) or not all(0.0 < share <= 1.0 for share in shares):
                raise InvalidValue(
                    key="blends", value=tuple(blend), reason="lengths are 0 or more, shares above 0 to 1"
                )

    @classmethod
    def joints(cls, *waypoints: Joints, blend: float = 0.0) -> Path:
        """Return the path straight in (a, b, c) through `waypoints`, all corners cut by `blend` [m]."""
        return cls._through(Space.JOINT, waypoints, blend)

    @classmethod
    def line(cls, *waypoints: Point, blend: float = 0.0) -> Path:
        """Return the path of a gripper that moves straight from point to point [m], all corners cut by `blend` [m]."""
        return cls._through(Space.CARTESIAN, waypoints, blend)

    @classmethod
    def swing(cls, *waypoints: Waypoint, blend: float = 0.0) -> Path:
        """Return the path straight in (a, d, z) [rad, m, m]: around axis a, all corners cut by `blend` [m]."""
        return cls._through(Space.CYLINDRICAL, waypoints, blend)

    @classmethod
    def _through(cls, space: Space, waypoints: Sequence[Waypoint], blend: float) -> Path:
        blends = (Blend(blend, blend),) * (len(waypoints) - 2) if blend else ()
        return cls(space, tuple((x, y, z) for x, y, z in waypoints), blends)

    @property
    def is_joint(self) -> bool:
        """Whether the path is straight in the joints, leg by leg, without blends."""
        return self.space is Space.JOINT and not any(min(blend.before, blend.after) > _LEAST for blend in self.blends)

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
        """Return the same path, starting exactly at `joints`."""
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
    def pieces(self) -> BezierPieces:
        """The path as consecutive curves."""
        return _pieces(self)


@dataclass(frozen=True)
class BezierPieces:
    """Consecutive quadratic Bézier curves, control points of shape (n, 3) each in the path's coordinates.

    The parameter p runs from 0 to n; piece ⌊p⌋ is at its share p − ⌊p⌋. `straight` (n,) is True for lines, `vias` is
    the parameter at which each waypoint between the ends is passed, `sharp` (n + 1,) is True at parameters of corners.
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
        share = parameters - index
        rest = 1.0 - share
        first, control, last = (corner.T.take(index, axis=1) for corner in (self.first, self.control, self.last))
        return (rest * (rest * first + 2.0 * share * control) + share * share * last).T


def _pieces(path: Path) -> BezierPieces:
    """Return the legs, shortened by the blends at their ends, and the blends between them."""
    corners = np.array(path.waypoints)
    cuts = _cuts(path)
    found = _Found()
    last = len(corners) - 2
    for leg in range(last + 1):
        one, two = corners[leg], corners[leg + 1]
        after, before = cuts[leg].after, cuts[leg + 1].before
        if after + before < 1.0 - 1e-12:
            begin, end = one + (two - one) * after, two + (one - two) * before
            found.add(begin, 0.5 * (begin + end), end, straight=True, corner=cuts[leg + 1].before == 0.0)
        if leg == last:
            break
        if before > 0.0:
            _round(found, one, two, corners[leg + 2], cuts[leg + 1])
        else:
            found.vias.append(float(len(found.curves)))
    first, control, end = (np.array(column) for column in zip(*found.curves, strict=True))
    sharp = (True, *found.corners[:-1], True)
    return BezierPieces(first, control, end, tuple(found.straight), tuple(found.vias), sharp)


class _Found:
    """The pieces during their collection."""

    def __init__(self) -> None:
        self.curves: list[tuple[Floats, Floats, Floats]] = []
        self.straight: list[bool] = []
        self.corners: list[bool] = []
        self.vias: list[float] = []

    def add(self, first: Floats, control: Floats, last: Floats, *, straight: bool, corner: bool) -> None:
        self.curves.append((first, control, last))
        self.straight.append(straight)
        self.corners.append(corner)


def _round(found: _Found, one: Floats, two: Floats, three: Floats, cut: Blend) -> None:
    """Add the curves of a corner, divided where a leg begins to slow down and where one has finished speeding up."""
    moments = sorted({0.0, 1.0 - cut.fall, cut.rise, 1.0})
    spans = [(begin, end) for begin, end in pairwise(moments) if end - begin > 1e-9]

    def at(moment: float) -> Floats:
        left, gone = cut.before * _risen(1.0 - moment, cut.fall), cut.after * _risen(moment, cut.rise)
        return two + (one - two) * left + (three - two) * gone

    found.vias.append(len(found.curves) + 0.5 * len(spans))
    for begin, end in spans:
        first, last, middle = at(begin), at(end), at(0.5 * (begin + end))
        found.add(first, 2.0 * middle - 0.5 * (first + last), last, straight=False, corner=False)


def _risen(moment: float, rise: float) -> float:
    """Return the share of a blend that the leg after it has passed at a moment (0 to 1) of it.

    It speeds up evenly until `rise`, then keeps its speed. The leg before does the same backwards in time.
    """
    gone = moment * moment / (2.0 * rise) if moment < rise else moment - 0.5 * rise
    return gone / (1.0 - 0.5 * rise)


def _cuts(path: Path) -> list[Blend]:
    """Return the blend at every waypoint, with its lengths as shares of the legs beside it."""
    blends = [SHARP, *(path.blends or (SHARP,) * (len(path.waypoints) - 2)), SHARP]
    lengths = [_length(path.space, *pair) for pair in pairwise(path.waypoints)]
    fits = [1.0] * len(blends)
    for leg, length in enumerate(lengths):
        wanted = blends[leg].after + blends[leg + 1].before
        if wanted > length:
            fits[leg] = min(fits[leg], length / wanted)
            fits[leg + 1] = min(fits[leg + 1], length / wanted)
    cuts = [SHARP] * len(blends)
    for via in range(1, len(blends) - 1):
        blend, fit = blends[via], fits[via]
        if fit * min(blend.before, blend.after) > _LEAST and not _turns_back(*path.waypoints[via - 1 : via + 2]):
            before, after = fit * blend.before / lengths[via - 1], fit * blend.after / lengths[via]
            cuts[via] = blend._replace(before=min(before, 1.0), after=min(after, 1.0))
    return cuts


def _turns_back(one: Waypoint, two: Waypoint, three: Waypoint) -> bool:
    """Return whether a path turns back: it has no corner to cut and must stop."""
    to = [there - here for here, there in zip(one, two, strict=True)]
    fro = [there - here for here, there in zip(two, three, strict=True)]
    along = sum(before * behind for before, behind in zip(to, fro, strict=True))
    return along < _BACK * hypot(*to) * hypot(*fro)


def _length(space: Space, one: Waypoint, two: Waypoint) -> float:
    """Return the approximate way of the gripper on a leg [m]; joints count as they are, an angle at 1 m."""
    across, second, third = (there - here for here, there in zip(one, two, strict=True))
    if space is Space.CYLINDRICAL:
        across *= 0.5 * (one[1] + two[1])
    return hypot(across, second, third)


def from_joints(space: Space, mechanism: Mechanism, joints: Joints) -> Waypoint:
    """Return joints (rad, m, m) in the coordinates of `space`; raises `Unreachable` if the lines cannot meet."""
    if space is Space.JOINT:
        return joints.a, joints.b, joints.c
    x, y, z = mechanism.fk(joints)
    return (x, y, z) if space is Space.CARTESIAN else (joints.a, hypot(x, y), z)


def to_joints(space: Space, mechanism: Mechanism, coordinates: Floats) -> Floats:
    """Return coordinates of `space`, shape (n, 3), as joints of shape (n, 3) [rad, m, m].

    Above the anchors, where the lines cannot hold the gripper, b and c are nan.
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


def boom_angles(space: Space, mechanism: Mechanism, coordinates: Floats) -> Floats:
    """Return the first column of `to_joints` alone, (n,) [rad]."""
    if space is Space.CARTESIAN:
        return mechanism.angles(coordinates[:, 0], coordinates[:, 1])
    return coordinates[:, 0]


Route = Path | Sequence[Joints]
"""A requested way: a path, or joints connected by straight lines in joint space."""


_STEP = 1e-4


class LegLimits(NamedTuple):
    """Limits of the axes along a leg: speed [m/s] and acceleration [m/s²] of the gripper.

    `lines` is the share of their speed that the lines need for it, from 0 to 1: 1 if the lines are the limit.
    """

    speed: float
    acceleration: float
    lines: float

    def after(self, run_up: float) -> float:
        """Return the speed that is reached from rest over a run-up [m]."""
        return min(self.speed, sqrt(2.0 * self.acceleration * run_up))


def pace(
    space: Space, start: Waypoint, end: Waypoint, length: float, mechanism: Mechanism, units: Units, limits: Limits
) -> LegLimits:
    """Return the limits of the axes near `start` on the way to `end`, which is `length` away [m].

    They follow from the direction there; the timing handles bends.
    """
    share = min(1.0, _STEP / length)
    near = [one + (two - one) * share for one, two in zip(start, end, strict=True)]
    here, there = to_joints(space, mechanism, np.array([start, near]))
    ways = zip((there - here).tolist(), units.per_unit, strict=True)
    rates = [max(abs(way) * per_unit / (share * length), 1e-9) for way, per_unit in ways]
    speeds = [speed / rate for speed, rate in zip(limits.speed, rates, strict=True)]
    slowest = map(min, limits.acceleration, limits.deceleration)
    acceleration = min(most / rate for most, rate in zip(slowest, rates, strict=True))
    return LegLimits(min(speeds), acceleration, min(speeds) / min(speeds[1:]))


def overlap(before: LegLimits, speed_before: float, behind: LegLimits, room: float) -> Blend:
    """Return the blend in which the leg before slows down from `speed_before` [m/s] while the leg after speeds up.

    `room` is the greatest length of the blend on the leg after [m].
    """
    speed = behind.speed
    slowing, rising = speed_before / before.acceleration, speed / behind.acceleration
    whole = max(slowing, rising)
    after = speed * (whole - 0.5 * rising)
    if after > room:
        return _tight(before, speed_before, behind, room)
    return Blend(speed_before * (whole - 0.5 * slowing), after, slowing / whole, rising / whole)


def reversed_blend(blend: Blend) -> Blend:
    """Return the blend of the same corner, passed in the opposite direction."""
    return Blend(blend.after, blend.before, blend.rise, blend.fall)


def _tight(before: LegLimits, speed_before: float, behind: LegLimits, room: float) -> Blend:
    """Return a blend for a short leg after it: one parabola, as long as that leg's acceleration requires."""
    whole = sqrt(2.0 * room / behind.acceleration)
    slowing = min(whole, speed_before / before.acceleration)
    return Blend(before.acceleration * slowing * (whole - 0.5 * slowing), room, slowing / whole, 1.0)
