"""The state of the gripper, tracked from commands and events; no sensor measures it."""

from __future__ import annotations

from enum import StrEnum

from maya_un.events import Event, EventLog, GripperClosed, GripperOpened, HomingBegun
from maya_un.values import State


class GripperState(StrEnum):
    """The gripper, as far as anybody knows.

    `found`: closed since before this connection, as a controller's outputs leave it at power-up, and homed since;
    taken to be empty, as one that a person has seen to be. `closed`: closed by command, or found closed under a
    homing that was taken over; it may hold a part.
    """

    OPEN = "open"
    FOUND = "found"
    CLOSED = "closed"


class GripperTracker:
    """Hears the events; `closing` is to be told before the gripper closes, `grasped` after a pick has closed it.

    A closing that is interrupted leaves no event, yet the jaws have moved and may hold a part. `seen` is a person's
    word, where nobody else can know.
    """

    def __init__(self, events: EventLog) -> None:
        self._commanded = False
        self._homing = False
        self._grasped = False
        self._seen_empty = False
        for event in events.since(events.oldest - 1):
            self._hear(event)
        events.heard_by(self._hear)

    def closing(self) -> None:
        """Remember that the gripper is being closed by command, whatever becomes of it."""
        self._commanded, self._grasped, self._seen_empty = True, False, False

    def grasped(self) -> None:
        """Remember that what closed the gripper last was a pick."""
        self._grasped = True

    def seen(self, *, holding: bool) -> None:
        """Remember what a person saw of the closed gripper; that it is empty holds until it is closed again."""
        self._commanded = self._grasped = holding
        self._seen_empty = not holding

    def state(self, state: State) -> GripperState:
        """Return what is known of the gripper in `state`."""
        if not state.gripper_closed:
            return GripperState.OPEN
        if self._seen_empty:
            return GripperState.FOUND
        taken_over = state.homed and not self._homing
        return GripperState.CLOSED if self._commanded or taken_over else GripperState.FOUND

    def holding(self, state: State) -> bool | None:
        """Return True after a pick, False with the gripper open or seen to be empty, None where nobody knows."""
        if not state.gripper_closed or self._seen_empty:
            return False
        return True if self._grasped else None

    def _hear(self, event: Event) -> None:
        match event:
            case GripperOpened():
                self._commanded = self._grasped = self._seen_empty = False
            case GripperClosed():
                self._commanded, self._grasped, self._seen_empty = True, False, False
            case HomingBegun():
                self._homing = True
            case _:
                pass
