"""The fleet for displays: the robots of a broker and their latest steps, as the messages at the broker show them."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import Any

from maya_un.coms.schemas import CONNECTIONS
from maya_un.errors import MayaError
from maya_un.schema.fleet import FleetLink, FleetRobot, FleetRobotState, FleetStep, FleetView
from maya_un.steps.text import LONGEST_ID, StepEnd, StepState, content_of
from maya_un.supervisor.lab import ONLINE, Event
from maya_un.supervisor.step import progress_of, result_of
from maya_un.values import Notice

MOST_ROBOTS = 200
"""Greatest number of robots that are listed."""

MOST_LAST = 5
"""Greatest number of ended steps of a robot that are listed."""

_MOST_OPEN = 1000
"""Greatest number of steps of a robot without a result that are remembered; the robot accepts as many."""

_MOST_OTHERS = 10_000
"""Greatest number of robots that are counted besides the listed ones."""

_LONGEST_NAME, _LONGEST_ERROR = 64, 500
"""Greatest lengths of texts [characters]; longer ones are cut."""


@dataclass(slots=True)
class _RobotRecord:
    """The known facts about a robot; `open` are its steps without a result by id, in the order of their arrival."""

    connection: str | None = None
    since: str | None = None
    heard: str | None = None
    open: dict[str, FleetStep] = field(default_factory=dict[str, FleetStep])
    last: deque[FleetStep] = field(default_factory=lambda: deque[FleetStep](maxlen=MOST_LAST))

    def view(self, name: str) -> FleetRobot:
        running = next((step for step in self.open.values() if step.state == "executing"), None)
        waiting = len(self.open) - (running is not None)
        return FleetRobot(
            name, self._state(running, waiting), self.since, self.heard, running, waiting, tuple(self.last)
        )

    def _state(self, running: FleetStep | None, waiting: int) -> FleetRobotState:
        if self.connection != ONLINE:
            return "unknown" if self.connection is None else "offline" if self.connection == "OFFLINE" else "lost"
        if running is not None:
            return "working"
        if waiting:
            return "waiting"
        return "failed" if self.last and self.last[0].state == "failed" else "idle"

    def sent(self, data: Mapping[str, Any], date: str) -> None:
        """Note a command, unless it repeats an earlier one."""
        id_ = data["id"]
        if not isinstance(id_, str) or not id_ or len(id_) > LONGEST_ID or id_ in self.open or self._ended(id_):
            return
        content, supervisor = content_of(data), data.get("supervisor")
        by = supervisor[:_LONGEST_NAME] if isinstance(supervisor, str) and supervisor else None
        self.open[id_] = FleetStep(id_, "sent", date, content["command"], content["args"], by)
        if len(self.open) > _MOST_OPEN:
            del self.open[next(iter(self.open))]

    def reported(self, data: Mapping[str, Any], date: str) -> None:
        """Note the progress or the result of a step."""
        id_ = data.get("id")
        if not isinstance(id_, str) or len(id_) > LONGEST_ID or self._ended(id_):
            return
        progress, result = progress_of(data), result_of(data)
        step = self.open.get(id_, FleetStep(id_, "sent", date))
        if result is not None:
            if result.content is None:  # else it refuses another command with the id of this step
                self.open.pop(id_, None)
                self.last.appendleft(_ended(step, result, date))
        elif progress is not None and progress.state is StepState.EXECUTING:
            if step.state != "executing":
                self._begin(replace(step, state="executing", since=date))
        elif progress is not None and step.state == "sent":
            self.open[id_] = replace(step, state="accepted", since=date)

    def _begin(self, step: FleetStep) -> None:
        """Note that a step is carried out. Robots keep the order of commands, so results of earlier ones were lost.

        A step whose command was not seen was sent before all others.
        """
        ids = list(self.open)
        later = ids[ids.index(step.id) + 1 :] if step.id in self.open else ids
        self.open = {step.id: step} | {id_: self.open[id_] for id_ in later}

    def _ended(self, id_: str) -> bool:
        return any(step.id == id_ for step in self.last)


class FleetBoard:
    """The fleet of the broker at the address `broker`: takes the events of `Supervisor.watch` in their order.

    The dates of its views are those of the arrival of the messages, because clocks of robots differ.
    """

    def __init__(self, broker: str) -> None:
        self._view = FleetView("connecting", broker)
        self._robots: dict[str, _RobotRecord] = {}
        self._others: set[str] = set()

    def view(self) -> FleetView:
        """Return the present view."""
        robots = tuple(record.view(name) for name, record in sorted(self._robots.items()))
        return replace(self._view, robots=robots, more=len(self._others))

    def take(self, event: Event, date: str) -> None:
        """Note an event that arrived at a date."""
        match event.kind:
            case "broker" if event.data["error"] is None:
                self._connected(date)
            case "broker":
                self._lost(Notice(event.data["code"], event.data["error"]), date)
            case "removed":
                self._robots.pop(event.robot, None)
                self._others.discard(event.robot)
            case "refused":
                self._view = replace(self._view, refused=True)
            case _:
                self._note(event, date)

    def failed(self, error: MayaError, date: str) -> None:
        """Note that the broker was not reached."""
        self._lost(Notice(error.code, str(error)), date)

    def _connected(self, date: str) -> None:
        """Note a connection; robots are unknown until the broker has shown their presence."""
        self._link("connected", date, None)
        for record in self._robots.values():
            record.connection = record.since = None

    def _lost(self, trouble: Notice, date: str) -> None:
        self._link("connecting" if self._view.link == "connecting" else "lost", date, trouble)

    def _link(self, link: FleetLink, date: str, trouble: Notice | None) -> None:
        since = self._view.since if link == self._view.link else date
        self._view = replace(self._view, link=link, since=since, trouble=trouble, refused=False)

    def _note(self, event: Event, date: str) -> None:
        record = self._robots.get(event.robot)
        if event.kind == "connection":
            self._note_connection(event, record, date)
        elif record is not None:
            if event.kind == "commands":
                record.sent(event.data, date)
            else:
                record.heard = date
                record.reported(event.data, date)

    def _note_connection(self, event: Event, record: _RobotRecord | None, date: str) -> None:
        found = event.data.get("connection")
        if found not in CONNECTIONS or not 0 < len(event.robot) <= _LONGEST_NAME:
            return
        if record is None:
            record = self._added(event.robot)
        if record is not None:
            if found != record.connection:
                record.since = None if event.retained else date
            record.connection = found
            record.heard = record.heard if event.retained else date

    def _added(self, name: str) -> _RobotRecord | None:
        """Return a new record, None if there are too many."""
        if len(self._robots) < MOST_ROBOTS:
            self._others.discard(name)
            return self._robots.setdefault(name, _RobotRecord())
        if len(self._others) < _MOST_OTHERS:
            self._others.add(name)
        return None


def _ended(step: FleetStep, result: StepEnd, date: str) -> FleetStep:
    error = None if result.error is None else result.error[:_LONGEST_ERROR]
    code = None if result.code is None else result.code[:_LONGEST_NAME]
    duration = _seconds(step.since, date) if step.state == "executing" else None
    state = "done" if error is None else "failed"
    return replace(step, state=state, since=date, duration=duration, error=error, code=code)


def _seconds(began: str, ended: str) -> float:
    """Return the time between two dates [s]; the clock of the computer may have been set back meanwhile."""
    return max(0.0, (datetime.fromisoformat(ended) - datetime.fromisoformat(began)).total_seconds())
