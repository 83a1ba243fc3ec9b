"""The known state of the robot, composed of all received facts."""

from __future__ import annotations

import json
from typing import Any

from maya_ui.robot import Cell, Choice, Fact, Happened, Joints, Position, Presence, Queue, Standing, Under

BUSY = frozenset({"homing", "moving", "stopping"})
"""The modes in which the controller layer does something."""


class Seen:
    """The newest fact of each kind. Facts of a layer that has left the graph do not count."""

    def __init__(self) -> None:
        self.presence = Presence()
        self.under: Under | None = None
        self.cell: Cell | None = None
        self.queue = Queue()
        self._standing: Standing | None = None
        self._position: Position | None = None
        self._joints: Joints | None = None

    def take(self, fact: Fact) -> None:
        """Take a fact."""
        if isinstance(fact, Happened):
            self._standing = fact.standing or self._standing
        elif isinstance(fact, Position):
            self._position = fact
        elif isinstance(fact, Joints):
            self._joints = fact
        elif isinstance(fact, Presence):
            self._meet(fact)
        elif isinstance(fact, Under):
            self.under = fact
        elif isinstance(fact, Cell):
            self.cell = fact
        elif isinstance(fact, Queue):
            self.queue = fact
        elif self.under is not None and self.under.command is fact.command:
            self.under = None

    def _meet(self, presence: Presence) -> None:
        # The last event is sent once to a new subscriber, and may come before the layer's actions are found.
        if self.presence.controller and not presence.controller:
            self._standing = self._position = self._joints = None
        if not presence.process:
            self.queue = Queue()
        self.presence = presence

    @property
    def here(self) -> bool:
        """Whether the controller layer is present, publishes, and has reported its state."""
        return self.presence.controller and not self.presence.silent and self._standing is not None

    @property
    def standing(self) -> Standing:
        """The reported state; disconnected without a report."""
        return self._standing if self.here and self._standing is not None else Standing()

    @property
    def connected(self) -> bool:
        """Whether the controller layer has a connection to the machine (or its twin)."""
        return self.standing.mode != "disconnected"

    @property
    def busy(self) -> bool:
        """Whether something is under way."""
        return self.under is not None or self.standing.mode in BUSY

    @property
    def position(self) -> Position | None:
        """Position of the gripper, None if unknown."""
        return self._position if self.connected and self.standing.homed else None

    @property
    def joints(self) -> Joints | None:
        """The joints, None if unknown."""
        return self._joints if self.connected and self.standing.homed else None


def event(text: str) -> Happened:
    """Return the event in a text on /maya_event; unreadable parts are left out."""
    word, _, rest = text.partition(" ")
    try:
        data = json.loads(rest) if rest else None
    except ValueError:
        data = None
    if not isinstance(data, dict):
        return Happened(word, detail={"text": rest} if rest else {})
    detail = data.get("detail")
    detail = detail if isinstance(detail, dict) else {}
    code = str(data.get("code") or "")
    message = data.get("message") or detail.get("message") or ""
    return Happened(word, _standing(data), code, str(message), detail)


def queue(text: str) -> Queue | None:
    """Return the queue in a text on /queue_status, None if it is unreadable."""
    try:
        data = json.loads(text)
        job = data.get("interrupted")
        if job is None:
            return Queue(str(data["mode"]), str(data.get("reason", "")))
        choices = tuple(
            Choice(str(one["name"]), holding)
            for one in job["choices"]
            for holding in (("yes", "no") if one.get("needs_answer") else ("",))
        )
        name = f"{job['job']} ({job['name']})"
        return Queue(str(data["mode"]), str(data.get("reason", "")), name, str(job.get("step", "")), choices)
    except (ValueError, KeyError, TypeError, AttributeError):
        return None


def _standing(data: dict[str, Any]) -> Standing | None:
    if "mode" not in data:
        return None
    fault = data.get("fault") or {}
    closed = data.get("gripper_closed")
    return Standing(
        mode=str(data["mode"]),
        homed=bool(data.get("homed")),
        moving=bool(data.get("moving")),
        gripper_closed=None if closed is None else bool(closed),
        override=_ratio(data.get("override")),
        fault_code=str(fault.get("code", "")),
        fault=str(fault.get("message", "")),
    )


def _ratio(value: object) -> float:
    return float(value) if isinstance(value, (int, float)) else 1.0
