"""3xxx: the work-piece."""

from __future__ import annotations

from maya_un.errors.base import RequestError


class GripperNotEmpty(RequestError):
    """A pick was asked for with the gripper closed."""

    code = 3001


class GripperEmpty(RequestError):
    """A place was asked for with the gripper open."""

    code = 3002
