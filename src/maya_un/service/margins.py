"""The distances of a place, and of the robot, to the limits of the workspace. It needs no arrays, and imports fast."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

from maya_un.kinematics.limits import Limit, Margins, unit
from maya_un.kinematics.ranges import Ranges
from maya_un.schema.previews import Distance, NearestLimits, Reach
from maya_un.values import Joints, Point

if TYPE_CHECKING:
    from maya_un.kinematics.workspace import Workspace


def reached(ranges: Ranges, joints: Joints, point: Point) -> Reach:
    """Return the reachability of a `point` [m] that is reachable by `joints` (rad, m, m)."""
    found = ranges.margins(joints)
    pulls = (ranges.tension_limit - found.tension_b, ranges.tension_limit - found.tension_c)
    return Reach(True, joints, None, point, _distances(found), pulls)


class MarginSnapshot(NamedTuple):
    """The position of the robot in its workspace (rad, m, m).

    Call `view` outside the robot's loop: it computes for 0.1 ms for each zone.
    """

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
