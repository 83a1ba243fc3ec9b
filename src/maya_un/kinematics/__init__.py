"""Maya's mechanism as mathematics: the gripper's position, the tensions of the lines, the reachable space.

Everything here is pure: no time, no input or output, no state. Lengths are in metres, angles in radians, line tensions
in multiples of the load. Names are imported when they are used: `closed` and `ranges` alone need no arrays.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from maya_un.kinematics.closed import tension
    from maya_un.kinematics.mechanism import Floats, Mechanism, hanging, slack
    from maya_un.kinematics.section import Section
    from maya_un.kinematics.workspace import Limit, Margins, Reason, Stroke, Verdict, Workspace
    from maya_un.kinematics.zones import Box, Cylinder, HalfSpace, Zone

__all__ = [
    "Box",
    "Cylinder",
    "Floats",
    "HalfSpace",
    "Limit",
    "Margins",
    "Mechanism",
    "Reason",
    "Section",
    "Stroke",
    "Verdict",
    "Workspace",
    "Zone",
    "hanging",
    "slack",
    "tension",
]

_HOMES = {
    "closed": ("tension",),
    "mechanism": ("Floats", "Mechanism", "hanging", "slack"),
    "section": ("Section",),
    "workspace": ("Limit", "Margins", "Reason", "Stroke", "Verdict", "Workspace"),
    "zones": ("Box", "Cylinder", "HalfSpace", "Zone"),
}


def __getattr__(name: str) -> Any:
    """Return a name that a module of this package defines."""
    for home, names in _HOMES.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{home}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
