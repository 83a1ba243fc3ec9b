"""Whether the gripper can reach a point: margins, or the broken limits and the nearest reachable point."""

from __future__ import annotations

from maya_un.errors import Unreachable
from maya_un.kinematics.limits import Limit, unit
from maya_un.kinematics.workspace import Workspace
from maya_un.schema.previews import Broken, Distance, Reach
from maya_un.values import Point


def reach_of(workspace: Workspace, point: Point) -> Reach:
    """Return the reachability of `point` [m] in `workspace`."""
    reasons = workspace.all_reasons(point)
    if reasons:
        broken = tuple(Broken(one.limit, one.zone, one.excess, one.unit, one.text) for one in reasons)
        return Reach(False, None, str(reasons[0]), _nearest(workspace, point), broken=broken)
    joints = workspace.require(point)
    found = workspace.margins(joints)
    distances = [Distance(limit, "", margin, unit(limit)) for limit, margin in found.limits.items()]
    distances += [Distance(Limit.ZONE, zone, clearance, "m") for zone, clearance in found.zones]
    pulls = (workspace.tension_limit - found.tension_b, workspace.tension_limit - found.tension_c)
    return Reach(True, joints, None, point, tuple(distances), pulls)


def _nearest(workspace: Workspace, point: Point) -> Point | None:
    try:
        return workspace.nearest(point)
    except Unreachable:
        return None
