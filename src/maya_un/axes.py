"""The names of the axes, and of the directions of a jog.

Imports nothing, because `maya status` and `maya stop` need it: `maya_un.values` loads `dataclasses`, which is slow.
"""

AXES = ("a", "b", "c")
"""Names of the axes: a turns the boom, b and c are the two lines."""

JOG_AXES = (*AXES, "x", "y", "z", "r")
"""Directions of a jog: a joint, or the gripper along x, y, z or r, outward along the boom."""
