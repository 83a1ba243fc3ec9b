"""Whether the gripper can reach points, by which margins, and the shape of the workspace."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from maya_un.errors import Unreachable
from maya_un.kinematics.outline import outline, rings
from maya_un.kinematics.workspace import Workspace
from maya_un.schema.previews import Broken, Range, Reach, Reachability, SectionPoint, WorkspaceShape
from maya_un.service.margins import reached
from maya_un.values import Point


def reach_of(workspace: Workspace, point: Point) -> Reach:
    """Return the reachability of `point` [m] in `workspace`."""
    reasons = workspace.all_reasons(point)
    if reasons:
        broken = tuple(Broken(one.limit, one.zone, one.excess, one.unit, one.text) for one in reasons)
        return Reach(False, None, str(reasons[0]), _nearest(workspace, point), broken=broken)
    return reached(workspace, workspace.require(point), point)


def _nearest(workspace: Workspace, point: Point) -> Point | None:
    try:
        return workspace.nearest(point)
    except Unreachable:
        return None


def reachability_of(workspace: Workspace, points: Sequence[Point]) -> Reachability:
    """Return whether each of the `points` [m] is reachable in `workspace`."""
    found = workspace.reachable_many(np.array(points, dtype=np.float64).reshape(-1, 3))
    return Reachability(tuple(found.tolist()))


def shape_of(workspace: Workspace, z: float | None = None) -> WorkspaceShape:
    """Return the shape of a workspace, with its rings at a height `z` [m]."""
    edge = tuple(SectionPoint(d, up) for d, up in np.column_stack(outline(workspace)).tolist())
    found = () if z is None else tuple(Range(*ring) for ring in rings(workspace, z))
    return WorkspaceShape(Range(*workspace.boom), edge, z, found)
