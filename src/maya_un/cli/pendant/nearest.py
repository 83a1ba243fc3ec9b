"""Which limit is the nearest: distances of different kinds, made comparable."""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees, hypot
from typing import NamedTuple

from maya_un.kinematics.limits import unit
from maya_un.kinematics.workspace import Workspace
from maya_un.values import Joints

HEIGHT_OF_A_LOAD = 0.04
"""How much higher the gripper may go for each multiple of the load that is left [m].

Between tension limits of 2 and 5 times the load the ceiling in the midst of the default machine rises from 1.94 to
2.07 m. It only ranks the limits, so nothing hangs on its being exact.
"""


class LimitDistance(NamedTuple):
    """How far it is to a limit or a zone called `name`: `margin` in its `unit` ("m", "rad" or "load"), `rank` in m."""

    name: str
    margin: float
    unit: str
    rank: float

    def __str__(self) -> str:
        shown = {"m": f"{self.margin * 1e3:.1f} mm", "rad": f"{degrees(self.margin):.2f}°"}
        return f"{self.name} {shown.get(self.unit, f'{self.margin:.2f} × load')}"


def distances(workspace: Workspace, joints: Joints) -> list[LimitDistance]:
    """Return how far joints (rad, m, m) are from every limit and zone, the nearest first."""
    return sorted(_distances(workspace, joints), key=lambda distance: distance.rank)


def _distances(workspace: Workspace, joints: Joints) -> Iterator[LimitDistance]:
    margins = workspace.margins(joints)
    u, _ = workspace.mechanism.section(joints)
    metres = {"m": 1.0, "rad": hypot(workspace.mechanism.delta + u), "load": HEIGHT_OF_A_LOAD}
    for limit, margin in margins.limits.items():
        kind = unit(limit)
        yield LimitDistance(limit.value.replace("_", " "), margin, kind, margin * metres[kind])
    for zone, clearance in margins.zones:
        yield LimitDistance(f"zone {zone}", clearance, "m", clearance)
