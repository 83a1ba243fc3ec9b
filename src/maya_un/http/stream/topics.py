"""Topics of the stream: values of which a reader gets the newest one, at once and after each change.

A topic is declared once. The key of `subscribe`, the message, and the reference page follow from it.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from maya_un.events import (
    Event,
    GripperClosed,
    GripperOpened,
    JobAdvanced,
    LeaseChanged,
    QuestionAnswered,
    QuestionAsked,
    QueueChanged,
    StepAdvanced,
)
from maya_un.schema.fleet import FleetView
from maya_un.schema.jobs import QueueView
from maya_un.schema.people import Permissions
from maya_un.schema.previews import NearestLimits
from maya_un.schema.robot import LinkView, MotionView, Signals, TableView
from maya_un.service.access.operations import LOCAL, Caller
from maya_un.service.margins import MarginSnapshot
from maya_un.service.motion import MotionSnapshot
from maya_un.service.permissions import as_permissions

if TYPE_CHECKING:  # a client of another service, for example the node rosbridge, starts sooner without it
    from maya_un.service.service import Service

PERIOD = 0.1
"""Shortest period of reading a topic [s, real time]."""


class Audience(NamedTuple):
    """The reader of a topic: the caller, as far as the rights depend on it, and the language."""

    caller: Caller
    language: str


EVERYBODY = Audience(LOCAL, "en")
"""The audience of a topic that all readers get alike."""


@dataclass(frozen=True)
class StreamTopic:
    """A value of the type `gives`: `view` reads it from the service for a caller, in the stack's loop.

    While it has readers, it is read after an event of the types in `after`, after a state with which `source` returns
    another value than before, and at least once in `look` [s, real time], unless that is None. `shown` makes the
    message in the server's loop, in the language of the reader. Only a `personal` topic differs between readers.
    """

    name: str
    gives: Any
    view: Callable[[Service, Caller], Any]
    look: float | None
    after: tuple[type[Event], ...] = ()
    source: Callable[[Service], object] = lambda service: None
    shown: Callable[[Any, str], object] = lambda value, language: value
    personal: bool = False


QUEUE = StreamTopic(
    "queue",
    QueueView,
    lambda service, caller: service.queue.view(),
    look=2.0,  # for updated predictions
    after=(JobAdvanced, StepAdvanced, QueueChanged, QuestionAsked, QuestionAnswered, LeaseChanged),
)


def _motion(snapshot: MotionSnapshot | None, _language: str) -> MotionView:
    return MotionView() if snapshot is None else snapshot.view()


MOTION = StreamTopic(
    "motion",
    MotionView,
    lambda service, caller: service.motion(),
    look=10.0,
    after=(StepAdvanced,),
    source=lambda service: (service.move, service.next_step()),
    shown=_motion,
)

LINK = StreamTopic("link", LinkView, lambda service, caller: service.link(), look=1.0)

SIGNALS = StreamTopic("signals", Signals | None, lambda service, caller: service.signals(), look=0.1)

TABLE = StreamTopic(
    "table",
    TableView,
    lambda service, caller: service.table(),
    look=2.0,  # for parts that are not moved by the gripper
    after=(StepAdvanced, GripperClosed, GripperOpened),
    source=lambda service: service.state.gripper_closed,
)


def _margins(snapshot: MarginSnapshot | None, _language: str) -> NearestLimits:
    return NearestLimits() if snapshot is None else snapshot.view()


MARGINS = StreamTopic("margins", NearestLimits, lambda service, caller: service.margins(), look=0.5, shown=_margins)

CAN = StreamTopic(
    "can",
    Permissions,
    lambda service, caller: service.refusals(caller),
    look=None,  # some reasons name a time, which is no change
    after=(LeaseChanged, JobAdvanced),
    source=lambda service: service.circumstances,
    shown=as_permissions,
    personal=True,
)

FLEET = StreamTopic(
    "fleet",
    FleetView,
    lambda service, caller: service.fleet.view(),
    look=1.0,  # for a robot that sends no states
    source=lambda service: service.fleet.changes,
)

TOPICS = {topic.name: topic for topic in (QUEUE, MOTION, LINK, SIGNALS, MARGINS, TABLE, CAN, FLEET)}
"""All topics by name."""


class TopicSource:
    """Reads a topic of `service` in the stack's loop for the callers `wanted`, and passes the values to `found`.

    `speed` is the speed of the loop's clock relative to real time. Any thread may set `wanted` and call `look`.
    """

    def __init__(
        self, topic: StreamTopic, service: Service, found: Callable[[Mapping[Caller, object]], None], speed: float
    ) -> None:
        self._topic = topic
        self._service = service
        self._found = found
        self._speed = speed
        self._stirred = asyncio.Event()
        self._stirred.set()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._origin: object = None
        self.wanted = frozenset[Caller]()

    def look(self) -> None:
        """Read the topic soon; from any thread."""
        if self._loop is not None:
            with suppress(RuntimeError):  # the stack's loop has ended
                self._loop.call_soon_threadsafe(self._stirred.set)

    def saw(self, event: Event) -> None:
        """Read the topic soon if the event changes it."""
        if isinstance(event, self._topic.after):
            self._stirred.set()

    def saw_state(self) -> None:
        """Read the topic soon if its source has another value than at the last look."""
        if self.wanted and not self._stirred.is_set() and self._topic.source(self._service) != self._origin:
            self._stirred.set()

    async def run(self) -> None:
        """Read the topic until cancelled."""
        self._loop = asyncio.get_running_loop()
        while True:
            with suppress(TimeoutError):
                async with asyncio.timeout(self._patience):
                    await self._stirred.wait()
            self._stirred.clear()
            wanted = self.wanted
            if wanted:
                self._origin = self._topic.source(self._service)
                self._found({caller: self._topic.view(self._service, caller) for caller in wanted})
                await asyncio.sleep(PERIOD * self._speed)

    @property
    def _patience(self) -> float | None:
        """The longest time without a look [s, loop time], None without a bound."""
        look = self._topic.look
        return None if look is None or not self.wanted else (look - PERIOD) * self._speed
