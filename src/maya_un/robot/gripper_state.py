"""The known state of the gripper; no sensor measures it."""

from __future__ import annotations

from enum import StrEnum


class GripperState(StrEnum):
    """The gripper, as far as anybody knows.

    `found`: closed since before this connection, as a controller's outputs leave it at power-up, and homed since;
    taken to be empty, as one that a person has seen to be. `closed`: closed by command, or found closed under a
    homing that was taken over; it may hold a part.
    """

    OPEN = "open"
    FOUND = "found"
    CLOSED = "closed"
