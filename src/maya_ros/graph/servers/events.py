"""The publisher of /maya_event: every event in order, and how everything stands with each."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Protocol

from maya_ros.graph.events import REFUSED, ControllerCondition, ReportedEvent
from maya_ros.graph.protocol import Publisher
from maya_un.errors import MayaError
from maya_un.events import ControllerEvent, Event, Listener
from maya_un.kinematics.workspace import Workspace
from maya_un.values import State


class EventSource(Protocol):
    """Where events can be heard (`events.EventLog`)."""

    def listening(self, listener: Listener) -> AbstractContextManager[None]:
        """Call `listener` with every event while the block runs, in order."""
        ...


class ControllerView(Protocol):
    """What can be looked at of a controller floor."""

    @property
    def state(self) -> State:
        """Latest state."""
        ...

    @property
    def workspace(self) -> Workspace:
        """Where it can go; strokes as measured once homed."""
        ...


class EventPublisher:
    """Tells events of `floor` on `publisher`, in the loop's next turn, when the state shows what they say."""

    def __init__(self, floor: ControllerView, publisher: Publisher) -> None:
        self._floor = floor
        self._publisher = publisher
        self._news: list[Event] = []
        self._told = self._standing()
        self._differed = False
        self.say(self._told.word)

    def hear(self, event: Event) -> None:
        """Take an event; those that are nobody's business outside are left out."""
        if isinstance(event, ControllerEvent):
            self._later(event, asyncio.get_running_loop().call_soon)

    def say(self, word: str, error: MayaError | None = None, **detail: object) -> None:
        """Tell something that is no event of the floor."""
        self._flush()
        if error is not None:
            detail["message"] = str(error)
        self._tell(ReportedEvent(word, self._standing(), 0 if error is None else error.code, detail))

    def refused(self, wish: str, error: MayaError) -> None:
        """Tell that a wish on a topic was refused, or failed."""
        self.say(REFUSED, error, wish=wish)

    def look(self) -> None:
        """Tell how it stands where that has changed and no event said so, seen twice: called now and then."""
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
        return ControllerCondition.of(self._floor.state, self._floor.workspace)
