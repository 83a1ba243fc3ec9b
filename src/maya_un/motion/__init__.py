"""Motion as mathematics: paths in joint space, the proof that they are safe, and their timing on the controller."""

from maya_un.motion.move import CoordinatedMove, Counts, Segment, commands
from maya_un.motion.path import JointPath, between, check_path, highest_point, lowest_point
from maya_un.motion.profile import Piece, Profile
from maya_un.motion.timing import Limits, plan

__all__ = [
    "CoordinatedMove",
    "Counts",
    "JointPath",
    "Limits",
    "Piece",
    "Profile",
    "Segment",
    "between",
    "check_path",
    "commands",
    "highest_point",
    "lowest_point",
    "plan",
]
