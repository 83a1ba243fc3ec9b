"""Maya's mechanism as mathematics: where the gripper is, what the lines carry, what can be reached.

Everything here is pure: no time, no wire, no state. Lengths are in metres, angles in radians, line tensions in
multiples of the load.
"""

from maya_un.kinematics.mechanism import Floats, Mechanism
from maya_un.kinematics.section import Section
from maya_un.kinematics.statics import hanging, slack, tension
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
