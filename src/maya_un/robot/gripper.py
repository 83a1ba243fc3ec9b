"""The state of the gripper, tracked from commands and events; no sensor measures it."""

from __future__ import annotations

from maya_un.events import Event, EventLog, GripperClosed, GripperOpened, HomingBegun
from maya_un.values import GripperState, State


class GripperTracker:
    """Tracks the gripper by events; call `closing` before the gripper closes, and `grasped` after a pick has closed it.

    An interrupted closing emits no event, but the jaws have moved and may hold a part. `seen` is a user's observation,
    where no program can know.
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
        """Remember that a command closes the gripper, even if it is interrupted."""
        self._commanded, self._grasped, self._seen_empty = True, False, False

    def grasped(self) -> None:
        """Remember that a pick closed the gripper last."""
        self._grasped = True

    def seen(self, *, holding: bool) -> None:
        """Remember a user's observation of the closed gripper; "empty" holds until it is closed again."""
        self._commanded = self._grasped = holding
        self._seen_empty = not holding

    def state(self, state: State) -> GripperState:
        """Return the known state of the gripper in `state`."""
        if not state.gripper_closed:
            return GripperState.OPEN
        if self._seen_empty:
            return GripperState.FOUND
        taken_over = state.homed and not self._homing
        return GripperState.CLOSED if self._commanded or taken_over else GripperState.FOUND

    def holding(self, state: State) -> bool | None:
        """Return True after a pick, False with the gripper open or seen to be empty, None if unknown."""
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
