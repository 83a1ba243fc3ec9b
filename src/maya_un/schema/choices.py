"""Choices and bounds that commands and messages share. The parser of all commands loads this module: it is small."""

from __future__ import annotations

from enum import StrEnum
from typing import Literal

LogLevel = Literal["debug", "info", "warning", "error", "critical"]
"""A level of the log, in ascending order."""

RoleName = Literal["viewer", "student", "operator", "admin"]
"""The role of a user, in ascending order of rights."""

MOST_PRIORITY = 100
"""The greatest priority of a job; the least is its negative."""

MOST_RETRIES = 10
"""The greatest number of repetitions of a failed step."""


class OnFailure(StrEnum):
    """Effect of a refused job on the queue; after a fault of the machine the queue always pauses."""

    CONTINUE = "continue"
    PAUSE = "pause"


class RecoveryChoice(StrEnum):
    """The decision about an interrupted job.

    `resume` repeats the interrupted step, or counts it as done if the gripper shows that it was done; `redo` repeats
    it; `skip` leaves it out; `abort` ends the job.
    """

    RESUME = "resume"
    REDO = "redo"
    SKIP = "skip"
    ABORT = "abort"


PauseTime = Literal["after step", "now"]
"""When the queue pauses: after the running step, or now, with the step held on its path."""

QueueEnd = Literal["first", "last"]
"""An end of the queue."""
