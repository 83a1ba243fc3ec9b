"""5xxx: the system itself: its configuration, its files, its environment."""

from __future__ import annotations

from maya_un.errors.base import RequestError


class InvalidConfig(RequestError):
    """A configuration key is unknown, out of range or contradicts another."""

    code = 5001


class AlreadyRunning(RequestError):
    """Another `maya up` of this user runs already."""

    code = 5004


class NothingToRevert(RequestError):
    """There is no calibration to take back, or its values were changed since."""

    code = 5006


class StorageFailed(RequestError):
    """A running service cannot write a change to the disk, and keeps nothing of it. At a start this is 5014."""

    code = 5007


class StorageDamaged(RequestError):
    """The file of the queue and its history is damaged; it is left as it is."""

    code = 5008


class StorageTooNew(RequestError):
    """The file of the queue was written by a newer version."""

    code = 5009


class StorageInUse(RequestError):
    """Another program keeps its queue in this file."""

    code = 5010


class MasterGone(RequestError):
    """No ROS master answers."""

    code = 5011


class RosMissing(RequestError):
    """A part of ROS is not installed here, or this Python cannot load it."""

    code = 5012


class StorageUnavailable(RequestError):
    """The file of the queue cannot be opened for writing: the disk is full or read-only. A later start may succeed.

    A service that runs already reports 5007 instead.
    """

    code = 5014


class WorkerFailed(RequestError):
    """The worker process that computes for the service ended, or cannot start."""

    code = 5020
