"""The motion under way as a message. It is computed outside the robot's loop, from a snapshot."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

from maya_un.kinematics.mechanism import Mechanism
from maya_un.motion.move import CoordinatedMove
from maya_un.schema.robot import MotionView, NextStep, PathPoint

POINTS = 33
"""Number of points of a path."""


class MotionSnapshot(NamedTuple):
    """The motion under way: its move as predicted now, and when it began [s, loop time]; None at rest.

    `ahead` is the step after the running one.
    """

    move: CoordinatedMove | None
    began: float | None
    mechanism: Mechanism
    ahead: NextStep | None = None

    def view(self) -> MotionView:
        """Return it as a message, with points at equal distances along its path."""
        move = self.move
        if move is None:
            return MotionView(next=self.ahead)
        path = tuple(self._point(move, number / (POINTS - 1)) for number in range(POINTS))
        return MotionView(self.began, path, self.ahead)

    def _point(self, move: CoordinatedMove, share: float) -> PathPoint:
        way = share * move.profile.length
        time, joints = move.profile.when(way), move.position_after(way)
        return PathPoint(None if time == inf else time, joints, self.mechanism.fk(joints))
