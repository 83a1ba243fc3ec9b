"""Jogging: straight along one axis of the joints or of space, as far as wished or as the workspace allows.

How far it allows is found in two steps. Places along the line tell where it leaves the workspace; then the way there is
proved as every path is (`maya_un.motion.proof`). What only the proof sees, a zone thinner than the places are apart,
is found by bisection on the proof itself: the way to a place is good as far as the way to any place behind it is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from maya_un.controller.planner import Planner
from maya_un.errors import InvalidValue, PathRefused, UnknownName, Unreachable
from maya_un.kinematics.mechanism import Floats, Mechanism
from maya_un.kinematics.workspace import Reason, Workspace
from maya_un.motion.path import Path
from maya_un.schema.robot import Jogged
from maya_un.values import AXES, FARTHEST, JOG_AXES, WITHIN, Joints, Point

MARGIN = 5e-4
"""A jog that a limit ends comes to rest this far before it (rad or m)."""

TOLERANCE = 1e-4
"""How exactly the limit is found (rad or m)."""

LONGEST = 10.0
"""No way in any workspace is longer (rad or m)."""

_PLACES = 512


@dataclass(frozen=True, slots=True)
class JogLine:
    """The line that a jog follows from where the robot is: places on it by the way along it (rad or m)."""

    here: Joints
    start: tuple[float, float, float]
    direction: tuple[float, float, float]
    in_space: bool

    @classmethod
    def along(cls, axis: str, here: Joints, mechanism: Mechanism) -> JogLine:
        """Return the line of one of `JOG_AXES` through `here`; raises `UnknownName`."""
        if axis in AXES:
            a, b, c = (float(axis == one) for one in AXES)
            return cls(here, (here.a, here.b, here.c), (a, b, c), in_space=False)
        directions = {
            "x": (1.0, 0.0, 0.0),
            "y": (0.0, 1.0, 0.0),
            "z": (0.0, 0.0, 1.0),
            "r": (sin(here.a), cos(here.a), 0.0),
        }
        if axis not in directions:
            raise UnknownName(name=axis, known=", ".join(JOG_AXES))
        x, y, z = mechanism.fk(here)
        return cls(here, (x, y, z), directions[axis], in_space=True)

    def at(self, way: float) -> Joints | Point:
        """Return the place `way` along the line: joints, or a point."""
        one, two, three = (start + way * share for start, share in zip(self.start, self.direction, strict=True))
        return Point(one, two, three) if self.in_space else Joints(one, two, three)

    def path(self, way: float, mechanism: Mechanism) -> Path:
        """Return the path to there."""
        there = self.at(way)
        if isinstance(there, Joints):
            return Path.joints(self.here, there)
        return Path.line(Point(*self.start), there).begun_at(mechanism, self.here)

    def reached(self, workspace: Workspace, ways: Floats) -> NDArray[np.bool_]:
        """Return which of the ways along the line (n,) end in the workspace, shape (n,)."""
        places = np.array(self.start) + ways[:, np.newaxis] * np.array(self.direction)
        return workspace.reachable_many(places) if self.in_space else workspace.contains_many(places)


class Jogging:
    """Works out how far a jog goes, by the check that all motion has."""

    def __init__(self, planner: Planner, mechanism: Mechanism) -> None:
        self._planner = planner
        self._mechanism = mechanism

    def path(self, axis: str, here: Joints, way: float) -> Path:
        """Return the path of a jog; raises `UnknownName`, and `InvalidValue` for a way that is none."""
        return JogLine.along(axis, here, self._mechanism).path(_sensible(way), self._mechanism)

    def within(self, workspace: Workspace, axis: str, here: Joints, way: float) -> Jogged:
        """Return how far of `way` (rad or m) the workspace allows, and what ends it there.

        Raises `UnknownName`, `InvalidValue`, and `Unreachable` where the robot stands outside the workspace.
        """
        line = JogLine.along(axis, here, self._mechanism)
        wanted = max(-LONGEST, min(LONGEST, _sensible(way)))
        if wanted == way and self._refusal(workspace, line, wanted) is None:
            return Jogged(axis, way)
        self._planner.prove(workspace, line.path(0.0, self._mechanism))
        good, bad = self._edge(workspace, line, wanted)
        if good and self._refusal(workspace, line, good) is not None:
            good, bad = _halved(lambda s: self._refusal(workspace, line, s) is None, 0.0, good)
        reason = workspace.why_not(line.at(bad)) or self._refusal(workspace, line, bad)
        kept = max(0.0, abs(good) - MARGIN)
        limit = reason.limit.value if isinstance(reason, Reason) else "path"
        return Jogged(axis, kept if wanted > 0.0 else 0.0 - kept, limit, str(reason))

    def _edge(self, workspace: Workspace, line: JogLine, wanted: float) -> tuple[float, float]:
        """Return the last way along the line that ends in the workspace before it is left, and one behind."""
        ways = np.linspace(0.0, wanted, _PLACES + 1)[1:]
        outside = np.flatnonzero(~line.reached(workspace, ways))
        if not len(outside):
            return wanted, wanted
        first = int(outside[0])
        last = float(ways[first - 1]) if first else 0.0
        return _halved(lambda s: workspace.why_not(line.at(s)) is None, last, float(ways[first]))

    def _refusal(self, workspace: Workspace, line: JogLine, way: float) -> PathRefused | Unreachable | None:
        try:
            self._planner.prove(workspace, line.path(way, self._mechanism))
        except (PathRefused, Unreachable) as refusal:
            return refusal
        return None


def _halved(good_at: Callable[[float], bool], good: float, bad: float) -> tuple[float, float]:
    """Return two ways closer than `TOLERANCE`, the nearer good, the farther not."""
    while abs(bad - good) > TOLERANCE:
        middle = 0.5 * (good + bad)
        if good_at(middle):
            good = middle
        else:
            bad = middle
    return good, bad


def _sensible(way: float) -> float:
    if not abs(way) <= FARTHEST:
        raise InvalidValue(key="distance", value=way, reason=WITHIN)
    return way
