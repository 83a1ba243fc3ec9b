"""Joints for a position of the gripper, and the reverse, both checked against every limit and zone."""

from maya_robot.model import model
from maya_un.values import Joints, Point


def joints(x: float, y: float, z: float) -> Joints:
    """Return a [rad], b, c [m] for the gripper at x, y, z [m]; raises `maya_un.errors.Unreachable`."""
    return model().ik(Point(x, y, z))


def place(a: float, b: float, c: float) -> Point:
    """Return the gripper position [m] at joints a [rad], b, c [m]; raises `maya_un.errors.Unreachable`."""
    return model().fk(Joints(a, b, c))
