"""The motion under way as a message. It is computed outside the robot's loop, from a snapshot."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

from maya_un.kinematics.mechanism import Mechanism
from maya_un.motion.move import CoordinatedMove
from maya_un.schema.robot import MotionView, PathPoint

POINTS = 33
"""Number of points of a path."""


class MotionSnapshot(NamedTuple):
    """The motion under way: its move as predicted now, and when it began [s, loop time]."""

    move: CoordinatedMove
    began: float
    mechanism: Mechanism

    def view(self) -> MotionView:
        """Return it as a message, with points at equal ways along its path."""
        return MotionView(self.began, tuple(self._point(number / (POINTS - 1)) for number in range(POINTS)))

    def _point(self, share: float) -> PathPoint:
        way = share * self.move.profile.length
        time, joints = self.move.profile.when(way), self.move.position_after(way)
        return PathPoint(None if time == inf else time, joints, self.mechanism.fk(joints))
