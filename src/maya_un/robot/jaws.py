"""What the gripper may hold. No sensor tells, so it is what was commanded, remembered from the events."""

from __future__ import annotations

from enum import StrEnum

from maya_un.events import EventLog, Kind
from maya_un.values import State


class Jaws(StrEnum):
    """The gripper, as far as anybody knows.

    `found`: closed since before this connection, as a controller's outputs leave it at power-up, and homed since;
    taken to be empty. `closed`: closed by command, or found closed under a homing that was taken over; it may
    hold a part.
    """

    OPEN = "open"
    FOUND = "found"
    CLOSED = "closed"


class JawsMemory:
    """Follows the events; `closing` is to be told before the gripper closes, `grasped` after a pick has closed it.

    A closing that is interrupted leaves no event, yet the jaws have moved and may hold a part.
    """

    def __init__(self, events: EventLog) -> None:
        self._events = events
        self._seen = 0
        self._commanded = False
        self._homing = False
        self._grasped = False

    def closing(self) -> None:
        """Remember that the gripper is being closed by command, whatever becomes of it."""
        self._follow()
        self._commanded, self._grasped = True, False

    def grasped(self) -> None:
        """Remember that what closed the gripper last was a pick."""
        self._follow()
        self._grasped = True

    def jaws(self, state: State) -> Jaws:
        """Return what is known of the gripper in `state`."""
        self._follow()
        if not state.gripper_closed:
            return Jaws.OPEN
        taken_over = state.homed and not self._homing
        return Jaws.CLOSED if self._commanded or taken_over else Jaws.FOUND

    def holding(self, state: State) -> bool | None:
        """Return True after a pick, False with the gripper open, None where it is closed for other reasons."""
        self._follow()
        if not state.gripper_closed:
            return False
        return True if self._grasped else None

    def _follow(self) -> None:
        for event in self._events.since(self._seen):
            match event.kind:
                case Kind.GRIPPER_OPEN:
                    self._commanded = self._grasped = False
                case Kind.GRIPPER_CLOSED:
                    self._commanded, self._grasped = True, False
                case Kind.HOMING:
                    self._homing = True
                case _:
                    pass
        self._seen = len(self._events)
