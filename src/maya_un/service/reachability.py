"""Whether the gripper can reach points, by which margins, the margins of the robot, and the shape of the workspace."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from maya_un.errors import Unreachable
from maya_un.kinematics.limits import Limit, Margins, unit
from maya_un.kinematics.outline import outline, rings
from maya_un.kinematics.workspace import Workspace
from maya_un.schema.previews import (
    Broken,
    Distance,
    NearestLimits,
    Range,
    Reach,
    Reachability,
    SectionPoint,
    WorkspaceShape,
)
from maya_un.values import Joints, Point


def reach_of(workspace: Workspace, point: Point) -> Reach:
    """Return the reachability of `point` [m] in `workspace`."""
    reasons = workspace.all_reasons(point)
    if reasons:
        broken = tuple(Broken(one.limit, one.zone, one.excess, one.unit, one.text) for one in reasons)
        return Reach(False, None, str(reasons[0]), _nearest(workspace, point), broken=broken)
    joints = workspace.require(point)
    found = workspace.margins(joints)
    pulls = (workspace.tension_limit - found.tension_b, workspace.tension_limit - found.tension_c)
    return Reach(True, joints, None, point, _distances(found), pulls)


def _nearest(workspace: Workspace, point: Point) -> Point | None:
    try:
        return workspace.nearest(point)
    except Unreachable:
        return None


class MarginSnapshot(NamedTuple):
    """The position of the robot in its workspace (rad, m, m). A zone takes 0.1 ms, so the robot's loop has no time."""

    workspace: Workspace
    joints: Joints

    def view(self) -> NearestLimits:
        """Return the nearest limits."""
        return _nearest_limits(self.workspace, self.joints)


@lru_cache(maxsize=4)
def _nearest_limits(workspace: Workspace, joints: Joints) -> NearestLimits:
    least: dict[str, Distance] = {}
    for one in _distances(workspace.margins(joints)):
        if one.unit not in least or one.margin < least[one.unit].margin:
            least[one.unit] = one
    return NearestLimits(tuple(least.values()))


def _distances(found: Margins) -> tuple[Distance, ...]:
    distances = [Distance(limit, "", margin, unit(limit)) for limit, margin in found.limits.items()]
    return (*distances, *(Distance(Limit.ZONE, zone, clearance, "m") for zone, clearance in found.zones))


def reachability_of(workspace: Workspace, points: Sequence[Point]) -> Reachability:
    """Return whether each of the `points` [m] is reachable in `workspace`."""
    found = workspace.reachable_many(np.array(points, dtype=np.float64).reshape(-1, 3))
    return Reachability(tuple(found.tolist()))


def shape_of(workspace: Workspace, z: float | None = None) -> WorkspaceShape:
    """Return the shape of a workspace, with its rings at a height `z` [m]."""
    edge = tuple(SectionPoint(d, up) for d, up in np.column_stack(outline(workspace)).tolist())
    found = () if z is None else tuple(Range(*ring) for ring in rings(workspace, z))
    return WorkspaceShape(Range(*workspace.boom), edge, z, found)
