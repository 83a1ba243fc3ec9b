"""/maya_event: the text of each event, and the publisher that sends every event in order.

    idle {"mode":"idle","homed":true,"moving":false,"gripper_closed":false,"override":1.0,
          "strokes":[[-3.1,3.1],[0.6,2.2],[0.7,2.3]],"fault":null,"code":0,"detail":{}}

The last event is latched, so a new subscriber gets the whole state from it. `strokes` are the ranges of a, b, c
(rad, m, m) that homing measured, null before it. `fault` is {"code", "message"} or null. `code` is that of the
event's error, 0 without one. `detail` holds all other fields of the event.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from typing import Protocol

from dmc41x3.i18n import phrase
from maya_ros.graph.protocol import Publisher
from maya_un.errors import InvalidMessage, MayaError
from maya_un.events import (
    DECLARED,
    ControllerEvent,
    Disconnected,
    Event,
    FaultEntered,
    HomingBegun,
    HomingNeeded,
    Listener,
    MotionBegun,
    MotionEnded,
    MotionPaused,
)
from maya_un.kinematics.workspace import Workspace
from maya_un.values import Mode, Notice, State

Strokes = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]
"""Ranges of a, b, c (rad, m, m)."""

REFUSED = "refused"
"""The word for a refused command on a topic; its code gives the reason."""

_BY_MODE = {
    Mode.DISCONNECTED: Disconnected,
    Mode.NOT_HOMED: HomingNeeded,
    Mode.HOMING: HomingBegun,
    Mode.IDLE: MotionEnded,
    Mode.MOVING: MotionBegun,
    Mode.PAUSED: MotionPaused,
    Mode.STOPPING: MotionBegun,
    Mode.FAULT: FaultEntered,
}
_BEGINS = {MotionBegun.word: Mode.MOVING, HomingBegun.word: Mode.HOMING}
_AT_REST = frozenset({Mode.IDLE, Mode.NOT_HOMED})


def words() -> list[str]:
    """Return every word with which a message on /maya_event begins."""
    return [*(word for word, event in DECLARED.items() if issubclass(event, ControllerEvent)), REFUSED]


@dataclass(frozen=True, slots=True)
class ControllerCondition:
    """Condition of the controller layer; `strokes` is None before homing."""

    mode: Mode
    homed: bool
    moving: bool
    gripper_closed: bool
    override: float = 1.0
    strokes: Strokes | None = None
    fault: Notice | None = None

    @classmethod
    def of(cls, state: State, workspace: Workspace) -> ControllerCondition:
        """Return the condition of a state; once homed, with the strokes of the workspace."""
        strokes = (workspace.boom, workspace.line_b, workspace.line_c) if state.homed else None
        return cls(
            state.mode, state.homed, state.moving, state.gripper_closed, state.override, strokes, state.fault
        )  # fmt: skip

    @property
    def word(self) -> str:
        """The event word for this condition alone, without an event."""
        return _BY_MODE[self.mode].word


@dataclass(frozen=True, slots=True)
class ReportedEvent:
    """An event on the graph: its word, the condition of the layer, its code, and its other fields."""

    word: str
    standing: ControllerCondition
    code: int = 0
    detail: Mapping[str, object] = field(default_factory=dict[str, object])

    @classmethod
    def of(cls, event: Event, standing: ControllerCondition) -> ReportedEvent:
        """Return an event with the condition to report.

        The start of a motion is reported as moving, before the axes move and the state shows it.
        """
        mode = _BEGINS.get(event.kind)
        if mode is not None and standing.mode in _AT_REST:
            standing = replace(standing, mode=mode, moving=True)
        return cls(event.kind, standing, event.code, event.detail)

    def text(self) -> str:
        """Return the text of the message on the topic."""
        standing = self.standing
        data = {
            "mode": standing.mode.value,
            "homed": standing.homed,
            "moving": standing.moving,
            "gripper_closed": standing.gripper_closed,
            "override": standing.override,
            "strokes": standing.strokes,
            "fault": None if standing.fault is None else _noticed(standing.fault),
            "code": self.code,
            "detail": dict(self.detail),
        }
        return f"{self.word} {json.dumps(data, separators=(',', ':'), ensure_ascii=False, default=str)}"


def read(text: str) -> ReportedEvent:
    """Return the event of a message on the topic; raises `InvalidMessage` for a text of another form."""
    word, _, rest = text.partition(" ")
    if word not in words():
        raise InvalidMessage(
            name="/maya_event", reason=phrase("it begins with {word!r}, which is no word of it", word=word[:40])
        )
    try:
        data = json.loads(rest)
        fault, strokes = data["fault"], data["strokes"]
        standing = ControllerCondition(
            Mode(data["mode"]),
            bool(data["homed"]),
            bool(data["moving"]),
            bool(data["gripper_closed"]),
            float(data["override"]),
            None if strokes is None else _ranges(strokes),
            None if fault is None else Notice(int(fault["code"]), str(fault["message"])),
        )
        return ReportedEvent(word, standing, int(data["code"]), dict(data["detail"]))
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise InvalidMessage(
            name="/maya_event", reason=phrase("the text after the word is not a valid state ({error!r})", error=error)
        ) from None


def _noticed(notice: Notice) -> dict[str, object]:
    return {"code": notice.code, "message": notice.message}


def _ranges(data: object) -> Strokes:
    if not isinstance(data, list):
        raise TypeError("strokes are a list")
    a, b, c = ((float(low), float(high)) for low, high in data)
    return a, b, c


class EventSource(Protocol):
    """Source of events (`events.EventLog`)."""

    def listening(self, listener: Listener) -> AbstractContextManager[None]:
        """Call `listener` with every event while the block runs, in order."""
        ...


class ControllerView(Protocol):
    """Readable part of a controller layer."""

    @property
    def state(self) -> State:
        """Latest state."""
        ...

    @property
    def workspace(self) -> Workspace:
        """The workspace; its strokes are the measured ones once the robot is homed."""
        ...


class EventPublisher:
    """Publishes events of `layer` on `publisher` in the loop's next turn, when the state shows their effect."""

    def __init__(self, layer: ControllerView, publisher: Publisher) -> None:
        self._layer = layer
        self._publisher = publisher
        self._news: list[Event] = []
        self._told = self._standing()
        self._differed = False
        self.say(self._told.word)

    def hear(self, event: Event) -> None:
        """Take an event; only events of the controller layer are published."""
        if isinstance(event, ControllerEvent):
            self._later(event, asyncio.get_running_loop().call_soon)

    def say(self, word: str, error: MayaError | None = None, **detail: object) -> None:
        """Publish a word that is no event of the layer."""
        self._flush()
        if error is not None:
            detail["message"] = str(error)
        self._tell(ReportedEvent(word, self._standing(), 0 if error is None else error.code, detail))

    def refused(self, topic: str, error: MayaError) -> None:
        """Publish that a command on a topic was refused or failed."""
        self.say(REFUSED, error, topic=topic)

    def look(self) -> None:
        """Publish a condition that changed without an event, at the second difference in a row; called periodically."""
        standing = self._standing()
        differs = not self._news and (standing.mode, standing.homed) != (self._told.mode, self._told.homed)
        if differs and self._differed:
            self.say(standing.word)
            differs = False
        self._differed = differs

    def _later(self, event: Event, soon: Callable[[Callable[[], None]], object]) -> None:
        self._news.append(event)
        if len(self._news) == 1:
            soon(self._flush)

    def _flush(self) -> None:
        news, self._news = self._news, []
        standing = self._standing() if news else self._told
        for event in news:
            self._tell(ReportedEvent.of(event, standing))

    def _tell(self, told: ReportedEvent) -> None:
        self._told = told.standing
        self._publisher.publish({"data": told.text()})

    def _standing(self) -> ControllerCondition:
        return ControllerCondition.of(self._layer.state, self._layer.workspace)
