"""Motion as mathematics: paths in joint space, the proof that they are safe, and their timing on the controller."""

from maya_un.motion.move import CoordinatedMove, Counts, Knots, Segment, commands, lay
from maya_un.motion.path import Blend, Path, Route, Space
from maya_un.motion.profile import Limits, ProfilePiece, SpeedProfile
from maya_un.motion.proof import between
from maya_un.motion.timing import plan

__all__ = [
    "Blend",
    "CoordinatedMove",
    "Counts",
    "Knots",
    "Limits",
    "Path",
    "ProfilePiece",
    "Route",
    "Segment",
    "Space",
    "SpeedProfile",
    "between",
    "commands",
    "lay",
    "plan",
]
