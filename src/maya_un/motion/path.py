"""Paths that are straight in (a, b, c); `maya_un.motion.proof` says whether they are safe."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from maya_un.errors import TrajectoryRefused
from maya_un.kinematics import Mechanism, Workspace
from maya_un.motion.clearance import highest, lowest
from maya_un.motion.proof import between, prove
from maya_un.values import Joints, Point

__all__ = ["JointPath", "between", "check_path", "highest_point", "lowest_point"]


@dataclass(frozen=True, slots=True)
class JointPath:
    """Waypoints joined by straight lines in (a, b, c).

    Raises `TrajectoryRefused` for fewer than two waypoints.
    """

    waypoints: tuple[Joints, ...]

    def __post_init__(self) -> None:
        if len(self.waypoints) < 2:
            raise TrajectoryRefused(reason="a path needs at least a start and an end")

    @classmethod
    def through(cls, *waypoints: Joints) -> JointPath:
        """Return the path through the given waypoints."""
        return cls(waypoints)

    @property
    def start(self) -> Joints:
        """First waypoint."""
        return self.waypoints[0]

    @property
    def end(self) -> Joints:
        """Last waypoint."""
        return self.waypoints[-1]

    def legs(self) -> Iterator[tuple[Joints, Joints]]:
        """Yield the ends of every straight segment, in order."""
        return pairwise(self.waypoints)


def check_path(workspace: Workspace, path: JointPath) -> None:
    """Prove that every point of the path is in the workspace, or refuse it (see `maya_un.motion.proof.prove`)."""
    prove(workspace, np.array(path.waypoints), range(1, len(path.waypoints) - 1))


def lowest_point(mechanism: Mechanism, path: JointPath) -> Point:
    """Return the point of the path where the gripper is lowest; raises `Unreachable` where the lines cannot meet."""
    return lowest(mechanism, path.waypoints)


def highest_point(mechanism: Mechanism, path: JointPath) -> Point:
    """Return the point of the path where the gripper is highest; raises as `lowest_point` does."""
    return highest(mechanism, path.waypoints)
