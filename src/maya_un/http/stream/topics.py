"""Topics of the stream: values of which a reader gets the newest one, at once and after each change.

A topic is declared once. The key of `subscribe`, the message, and the reference page follow from it.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from maya_un.events import Event, GripperClosed, GripperOpened, JobAdvanced, LeaseChanged, QueueChanged, StepAdvanced
from maya_un.schema.jobs import QueueView
from maya_un.schema.robot import LinkView, MotionView, Signals, TableView
from maya_un.service.motion import MotionSnapshot
from maya_un.service.service import Service

PERIOD = 0.1
"""Shortest period of reading a topic [s, real time]."""


@dataclass(frozen=True)
class StreamTopic:
    """A value of the type `gives`: `view` reads it from the service in the stack's loop.

    While it has readers, it is read after an event of the types in `after`, after a state with which `source` returns
    another object, and at least once in `look` [s, real time]. `shown` makes the message in the server's loop.
    """

    name: str
    gives: Any
    view: Callable[[Service], Any]
    look: float
    after: tuple[type[Event], ...] = ()
    source: Callable[[Service], object] = lambda service: None
    shown: Callable[[Any], object] = lambda value: value


QUEUE = StreamTopic(
    "queue",
    QueueView,
    lambda service: service.queue.view(),
    look=2.0,  # for updated predictions
    after=(JobAdvanced, StepAdvanced, QueueChanged, LeaseChanged),
)


def _motion(snapshot: MotionSnapshot | None) -> MotionView:
    return MotionView() if snapshot is None else snapshot.view()


MOTION = StreamTopic(
    "motion",
    MotionView,
    lambda service: service.motion(),
    look=10.0,
    source=lambda service: service.move,
    shown=_motion,
)

LINK = StreamTopic("link", LinkView, lambda service: service.link(), look=1.0)

SIGNALS = StreamTopic("signals", Signals | None, lambda service: service.signals(), look=0.1)

TABLE = StreamTopic(
    "table",
    TableView,
    lambda service: service.table(),
    look=2.0,  # for parts that are not moved by the gripper
    after=(StepAdvanced, GripperClosed, GripperOpened),
    source=lambda service: service.state.gripper_closed,
)

TOPICS = {topic.name: topic for topic in (QUEUE, MOTION, LINK, SIGNALS, TABLE)}
"""All topics by name."""


class TopicSource:
    """Reads a topic of `service` in the stack's loop while it has readers, and passes it to `found`.

    `speed` is the speed of the loop's clock relative to real time. Any thread may set `wanted` and call `look`.
    """

    def __init__(self, topic: StreamTopic, service: Service, found: Callable[[object], None], speed: float) -> None:
        self._topic = topic
        self._service = service
        self._found = found
        self._speed = speed
        self._stirred = asyncio.Event()
        self._stirred.set()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._origin: object = None
        self.wanted = False

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
        """Read the topic soon if its source is another object than after the state before."""
        if not self.wanted:
            return
        origin = self._topic.source(self._service)
        if origin is not self._origin:
            self._origin = origin
            self._stirred.set()

    async def run(self) -> None:
        """Read the topic until cancelled."""
        self._loop = asyncio.get_running_loop()
        while True:
            with suppress(TimeoutError):
                async with asyncio.timeout((self._topic.look - PERIOD) * self._speed if self.wanted else None):
                    await self._stirred.wait()
            self._stirred.clear()
            if self.wanted:
                self._found(self._topic.view(self._service))
                await asyncio.sleep(PERIOD * self._speed)
