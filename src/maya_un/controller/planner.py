"""The one check of all motion, and the plan that is sent: what is previewed is what is carried out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import isfinite

from maya_un.config import Config, Units
from maya_un.controller.protocol import Preview
from maya_un.controller.seek import SETTLE
from maya_un.errors import InvalidValue, TrajectoryRefused
from maya_un.kinematics.mechanism import Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.motion.move import CoordinatedMove, Counts
from maya_un.motion.path import JointPath, check_path, highest_point, lowest_point
from maya_un.motion.timing import Limits, plan
from maya_un.values import Joints

MOST_SEGMENTS = 511
"""Places in the controller's buffer of coordinated segments (Galil LM); a motion is sent whole before it begins."""

REMEMBERED = 1024
"""Previews kept: a job's legs are checked before it starts and again as it comes to them."""

AT_HAND = 8
"""Plans kept: a primitive's legs are previewed right before they are carried out. More would burden the collector."""


@dataclass(frozen=True, slots=True)
class Plan:
    """A path in whole counts, as joints (rad, m, m), and the move along it, None where it goes nowhere."""

    points: tuple[Joints, ...]
    move: CoordinatedMove | None


class Planner:
    """Checks paths against a workspace and times them. Equal questions get the remembered answer."""

    def __init__(self, config: Config, mechanism: Mechanism) -> None:
        self._limits = Limits.of(config)
        self._units = Units.of(config)
        self._mechanism = mechanism
        self._planned = lru_cache(maxsize=AT_HAND)(self._plan)
        self._previewed = lru_cache(maxsize=REMEMBERED)(self._preview)

    def plan(self, workspace: Workspace, points: Sequence[Joints], speed: float) -> Plan:
        """Return the plan of a path at `speed` (above 0 up to 1, of the limits).

        Raises `InvalidValue`, `Unreachable`, `PathRefused`, and `TrajectoryRefused` for more than the controller
        can hold.
        """
        return self._planned(workspace, self._counts(points, speed), speed)

    def preview(self, workspace: Workspace, points: Sequence[Joints], speed: float) -> Preview:
        """Return what the motion along a path will be; raises as `plan` does."""
        return self._previewed(workspace, self._counts(points, speed), speed)

    def _counts(self, points: Sequence[Joints], speed: float) -> tuple[Counts, ...]:
        if not 0.0 < speed <= 1.0:
            raise InvalidValue(key="speed", value=speed, reason="it must lie above 0 and at most at 1")
        for point in points:
            if not all(isfinite(value) for value in point):
                raise InvalidValue(key="target", value=tuple(point), reason="it must be finite")
        if len(points) > MOST_SEGMENTS:
            _too_long(f"it has {len(points)} points")
        return tuple(self._units.to_counts(point) for point in points)

    def _plan(self, workspace: Workspace, counts: tuple[Counts, ...], speed: float) -> Plan:
        points = tuple(self._units.to_joints(count) for count in counts)
        path = JointPath(points)
        check_path(workspace, path)
        move = plan(path, self._limits, self._units, speed)
        if len(move.segments) > MOST_SEGMENTS:
            _too_long(f"it needs {len(move.segments)} segments")
        return Plan(points, move if move.segments else None)

    def _preview(self, workspace: Workspace, counts: tuple[Counts, ...], speed: float) -> Preview:
        planned = self._planned(workspace, counts, speed)
        path = JointPath(planned.points)
        return Preview(
            duration=0.0 if planned.move is None else planned.move.duration + SETTLE,
            lowest=lowest_point(self._mechanism, path).z,
            highest=highest_point(self._mechanism, path).z,
            end=planned.points[-1],
        )


def _too_long(what: str) -> None:
    raise TrajectoryRefused(reason=f"{what}, the controller's buffer holds {MOST_SEGMENTS} segments")
