"""When the waypoints of a path are passed, worked out from where the robot says it is.

How fast it goes may change on the way, so time alone does not tell. But it keeps to the planned way, and is never
faster than planned: of the places that it may have come to since the last look, the nearest is where it is.
"""

from __future__ import annotations

from math import dist

from maya_un.config import Units
from maya_un.controller.planner import MotionPlan
from maya_un.controller.run import OnVia
from maya_un.values import Joints

_PLACES = 48
"""Places looked at between the last one and the farthest possible."""

_SLACK = 0.5
"""What was said may have been on its way for so long [s]."""

_ROUNDING = 1e-6


class Vias:
    """Tells `on_via` the waypoints between the ends of `plan` as they are passed, in order, each once.

    `began` is when it began [s, the loop's].
    """

    def __init__(self, plan: MotionPlan, units: Units, on_via: OnVia, began: float) -> None:
        self._move = plan.move
        self._times = () if plan.move is None else plan.move.via_times()
        self._scale = units.per_unit
        self._on_via = on_via
        self._gone = 0.0
        self._looked = began
        self._passed = 0

    def at(self, joints: Joints, now: float) -> None:
        """Take notice of where the robot is (rad, m, m) at loop time `now` [s]."""
        if self._move is None or self._passed >= len(self._times):
            return
        farthest = min(self._move.duration, self._gone + (now - self._looked) + _SLACK)
        times = [self._gone + (farthest - self._gone) * place / _PLACES for place in range(_PLACES + 1)]
        self._gone = min(times, key=lambda time: self._away(time, joints))
        self._looked = now
        while self._passed < len(self._times) and self._times[self._passed] <= self._gone + _ROUNDING:
            self._tell()

    def finish(self) -> None:
        """Tell the rest: the end is reached."""
        while self._passed < len(self._times):
            self._tell()

    def _tell(self) -> None:
        self._passed += 1
        self._on_via(self._passed - 1)

    def _away(self, time: float, joints: Joints) -> float:
        assert self._move is not None
        place = self._move.position_at(time)
        return dist(
            [value * scale for value, scale in zip(place, self._scale, strict=True)],
            [value * scale for value, scale in zip(joints, self._scale, strict=True)],
        )
