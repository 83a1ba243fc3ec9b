"""5xxx: the configuration, files and environment of the program."""

from __future__ import annotations

from dmc41x3.i18n import Phrase
from maya_un.errors.base import RequestError


class InvalidConfig(
    RequestError,
    code=5001,
    en="The configuration has an error at {key} = {value}: {reason}. Correct it, then run `maya config check`.",
):
    """A configuration key is unknown, out of range or contradicts another."""

    key: str | Phrase
    value: object | Phrase
    reason: Phrase


class ConfigExists(
    RequestError,
    code=5018,
    en="The file {path} exists already. Edit it, or name another file: `maya config init FILE`.",
):
    """A new configuration has the name of a file that exists."""

    path: object


class AlreadyRunning(
    RequestError,
    code=5004,
    en="`maya up` or the ROS nodes are running already (process {pid}). Use them, or end them first.",
):
    """Another `maya up` of this user runs already."""

    pid: object


class NothingToRevert(RequestError, code=5006, en="No calibration can be reverted in {path}: {reason}."):
    """No calibration can be reverted, or its values were changed since."""

    path: object
    reason: Phrase


class StorageFailed(
    RequestError,
    code=5007,
    en="Maya could not write the request to the disk ({reason}), so it did not accept it. Free space on the "
    "disk or correct its permissions, then try again.",
):
    """A running service cannot write a change to the disk, and stores nothing of it. At a start this is 5014."""

    reason: Phrase


class StorageDamaged(
    RequestError,
    code=5008,
    en="{path} is damaged ({reason}) and was not changed. Restore a backup (`maya queue restore`), or move the "
    "file away to begin with an empty one.",
):
    """The file of the queue and its history is damaged; it stays unchanged."""

    path: object
    reason: Phrase


class StorageTooNew(
    RequestError,
    code=5009,
    en="{path} was written by a newer version ({found}; this version reads up to {known}). Use that "
    "version, or another file.",
):
    """The file of the queue was written by a newer version."""

    path: object
    found: int | str
    known: int | str


class StorageInUse(
    RequestError,
    code=5010,
    en="{path} is in use by process {pid}. End that process first, or use another file.",
):
    """Another program uses this file for its queue."""

    path: object
    pid: object


class MasterGone(
    RequestError,
    code=5011,
    en="No ROS master answers at {uri}. Start `roscore` or a `roslaunch`. If the master runs elsewhere, set "
    "ROS_MASTER_URI to its address.",
):
    """No ROS master answers."""

    uri: str


class RosMissing(
    RequestError,
    code=5012,
    en="This program cannot use ROS ({reason}). On Debian and Ubuntu, `scripts/ros` installs everything "
    "that is needed.",
):
    """A part of ROS is not installed here, or this Python cannot load it."""

    reason: Phrase


class Ros2Missing(
    RequestError,
    code=5016,
    en="Maya cannot join a ROS 2 graph: the package {name} is not installed. "
    "Run `pip install cyclonedds` in the Python environment of Maya. For Linux on ARM there is no such package: use "
    "`--rosbridge` there.",
):
    """`maya up --ros2` without the library that speaks DDS."""

    name: str


class Ros2NotJoined(
    RequestError,
    code=5017,
    en="Maya cannot join the ROS 2 graph of domain {domain}: DDS did not start. Check $CYCLONEDDS_URI and the network "
    "interfaces; the lines above name the cause.",
):
    """DDS refuses its configuration, or finds no network."""

    domain: int


class StorageUnavailable(
    RequestError,
    code=5014,
    en="{path} cannot be opened for writing now ({reason}), so nothing was started. Free space on the disk, "
    "or mount it for writing, then start again. If systemd runs this service, systemd starts it again by "
    "itself.",
):
    """The file of the queue cannot be opened for writing: the disk is full or read-only. A later start may succeed.

    A service that runs already reports 5007 instead.
    """

    path: object
    reason: Phrase


class WorkerFailed(
    RequestError,
    code=5020,
    en="The worker process failed ({reason}), so there is no result. Nothing has moved. Try again. If that fails "
    "too, read the log and restart `maya up`.",
):
    """The worker process that computes for the service ended, or cannot start."""

    reason: Phrase
