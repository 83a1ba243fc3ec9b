"""The path across the table: from the gripper's place over the parts to above a target, and down to it.

    start ┐                  ┌ above the target
          │  K1 ─ swing ─ K2 │
          └ up            down ┘

Below the clearance height, which clears the parts, the gripper moves straight up or down. Above it the boom swings
while distance and height change evenly. The corners lie above the clearance height and are passed without a stop: the
lines come to rest while the boom already turns. Paths are tried in this order, and the first one that passes the
controller's check is taken: with corners as wide as the axes require, tighter, with a stop; then the same at greater
heights, over obstacles.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import hypot

from maya_un.config import Config, Units
from maya_un.controller.protocol import Preview
from maya_un.errors import PathRefused, TrajectoryRefused, Unreachable
from maya_un.kinematics.mechanism import Mechanism
from maya_un.motion.path import (
    SHARP,
    Blend,
    LegLimits,
    Path,
    Route,
    Space,
    Waypoint,
    from_joints,
    overlap,
    pace,
    reversed_blend,
)
from maya_un.motion.profile import Limits
from maya_un.values import Joints

TOLERANCE = 1e-5
"""Places closer than this [m] are the same: ten counts of a line."""

_LIFTS = (0.0, 0.05, 0.1, 0.2, 0.4, 0.8)
"""Heights above the needed one at which a path is tried [m]."""

_WIDTHS = (1.0, 0.4, 0.0)
"""Widths of the corners that are tried, as shares of the width that the axes require."""

_LEAST_WIDTH = 0.2
"""If the lines limit the swing as well, a wider corner only raises the path."""

Check = Callable[[Route], Preview]


@dataclass(frozen=True, slots=True)
class Transfer:
    """A path that passed the check: `arrival` is the number of the via above the target, None without one."""

    path: Path
    preview: Preview
    arrival: int | None


class TransferPlanner:
    """Plans paths across the table of one machine. `smooth` corners are passed without a stop."""

    def __init__(self, config: Config, mechanism: Mechanism, *, smooth: bool) -> None:
        self._mechanism = mechanism
        self._units = Units.of(config)
        self._limits = Limits.of(config)
        self._smooth = smooth

    def plan(self, check: Check, start: Joints, goal: Joints, transfer_height: float) -> Transfer:
        """Return a path from `start` to `goal` that crosses above `transfer_height` [m], and its preview by `check`.

        Raises the error of `check` for the first path tried.
        """
        here = from_joints(Space.CYLINDRICAL, self._mechanism, start)
        there = from_joints(Space.CYLINDRICAL, self._mechanism, goal)
        refusal: PathRefused | Unreachable | TrajectoryRefused | None = None
        for path, arrival in self._ways(here, there, transfer_height):
            try:
                return Transfer(path, check(path), arrival)
            except (PathRefused, Unreachable, TrajectoryRefused) as error:
                refusal = refusal or error
        assert refusal is not None, "there is always a first way to try"
        raise refusal

    def _ways(self, here: Waypoint, there: Waypoint, transfer_height: float) -> Iterator[tuple[Path, int | None]]:
        across = _apart(here, there)
        if across < TOLERANCE:
            yield Path.swing(here, there), None
            return
        widths = _WIDTHS if self._smooth else (0.0,)
        for lift in _LIFTS:
            if lift > 0.0 and transfer_height + lift >= self._mechanism.reach_down:
                return
            for width in widths:
                way = self._over(here, there, transfer_height + lift, across, width)
                if way is not None:
                    yield way

    def _over(
        self, here: Waypoint, there: Waypoint, transfer_height: float, across: float, width: float
    ) -> tuple[Path, int | None] | None:
        """Return the path above `transfer_height` with corners of `width`, and the number of its via above the end.

        Return None if a corner would reach above the anchors: just below them the gripper hardly accelerates.
        """
        first, last = here, there
        begin, finish = SHARP, SHARP
        rises, falls = transfer_height - here[2] > TOLERANCE, transfer_height - there[2] > TOLERANCE
        if rises:
            begin = self._corner(here, there, transfer_height, across, width)
            first = (here[0], here[1], transfer_height + begin.before)
        if falls:
            finish = reversed_blend(self._corner(there, here, transfer_height, across, width))
            last = (there[0], there[1], transfer_height + finish.after)
        if width > 0.0 and max(first[2], last[2]) >= self._mechanism.reach_down:
            return None
        corners = [(first, begin)] * rises + [(last, finish)] * falls
        waypoints = (here, *(corner for corner, _ in corners), there)
        blends = tuple(blend for _, blend in corners)
        return Path(Space.CYLINDRICAL, waypoints, blends), len(blends) - 1 if falls else None

    def _corner(self, low: Waypoint, far: Waypoint, transfer_height: float, across: float, width: float) -> Blend:
        """Return the blend between straight up from `low` and the swing towards `far`."""
        if width == 0.0 or transfer_height >= self._mechanism.reach_down:
            return SHARP
        top = (low[0], low[1], transfer_height)
        upwards = self._pace(top, (low[0], low[1], transfer_height + 0.01), 0.01)
        onwards = self._pace(top, (far[0], far[1], transfer_height), across)
        width *= max(_LEAST_WIDTH, 1.0 - onwards.lines)
        return overlap(upwards, upwards.after(transfer_height - low[2]), onwards, 0.5 * across).scaled(width)

    def _pace(self, start: Waypoint, end: Waypoint, length: float) -> LegLimits:
        return pace(Space.CYLINDRICAL, start, end, length, self._mechanism, self._units, self._limits)


def _apart(here: Waypoint, there: Waypoint) -> float:
    """Return the approximate way of the gripper on the swing [m]."""
    return hypot((there[0] - here[0]) * 0.5 * (here[1] + there[1]), there[1] - here[1])
