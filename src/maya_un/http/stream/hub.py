"""The hub of the stream: states, events and topics from the service to each reader.

It has a source in the stack's loop, and encodes each frame once for all readers. A reader gets every event in order
from a shared ring, and only the latest value of everything else.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from types import MappingProxyType
from typing import NamedTuple, Protocol

from maya_un.events import Event
from maya_un.http.stream.messages import content, event_frame, state_frame, topic_frame
from maya_un.http.stream.topics import EVERYBODY, TOPICS, Audience, StreamTopic, TopicSource
from maya_un.schema.robot import EventMessage
from maya_un.service.access.operations import Caller
from maya_un.service.service import Service
from maya_un.values import State

MOST_EVENTS = 20_000
"""Maximum number of events by which a reader may lag."""

MOST_BYTES = 16_000_000
"""Maximum total size of the events stored for readers [bytes]."""


class EventRing:
    """Frames of events `first` to `last` without a gap; beyond `most` events or `most_bytes`, the oldest are dropped.

    The ring starts empty; its first event will be number `last` + 1.
    """

    def __init__(self, last: int, most: int = MOST_EVENTS, most_bytes: int = MOST_BYTES) -> None:
        self._frames: deque[bytes] = deque()
        self._most = most
        self._most_bytes = most_bytes
        self._bytes = 0
        self._shared: tuple[int, int, bytes] = (last, last, b"")
        self.first = last + 1
        self.last = last

    def add(self, frame: bytes) -> None:
        """Store the frame of the next event."""
        self._frames.append(frame)
        self._bytes += len(frame)
        self.last += 1
        while len(self._frames) > self._most or self._bytes > self._most_bytes:
            self._bytes -= len(self._frames.popleft())
            self.first += 1

    def reaches(self, seq: int) -> bool:
        """Return whether the ring contains every event numbered above `seq`."""
        return seq >= self.first - 1

    def after(self, seq: int, most: int) -> tuple[int, bytes]:
        """Return frames of the events above `seq`, about `most` bytes of them, and the number of the last one.

        Readers at the same event share the same bytes. The ring must reach `seq`.
        """
        began, upto, frames = self._shared
        if began != seq or (upto < self.last and len(frames) < most):
            upto, frames = self._joined(seq, most)
            self._shared = (seq, upto, frames)
        return upto, frames

    def _joined(self, seq: int, most: int) -> tuple[int, bytes]:
        taken: list[bytes] = []
        size = 0
        while seq < self.last and size < most:
            taken.append(self._frames[seq + 1 - self.first])
            size += len(taken[-1])
            seq += 1
        return seq, b"".join(taken)


CHUNK = 65_536
"""Approximate size of one write of events [bytes]."""


class ReaderWire(Protocol):
    """The connection of a reader: `full` while its buffer is full; `on_room` is called when it has space again."""

    on_room: Callable[[], None] | None

    @property
    def full(self) -> bool:
        """Whether nothing more should be written now."""
        ...

    def write(self, frames: bytes) -> None:
        """Send whole frames without waiting."""
        ...


class StreamReader:
    """One reader of the stream.

    Values (a state, a topic) replace an older one that was not sent yet. Events are sent from the shared `ring`, so a
    slow reader needs no memory of its own; if the ring no longer contains the reader's next event, the reader is lost,
    and `on_lost` is called. `seen` is the number of the last event sent, None without a subscription; while `catching`,
    another task sends it the missing events. The hub sets `audience`.
    """

    def __init__(self, outlet: ReaderWire, ring: EventRing, on_lost: Callable[[], None]) -> None:
        self._outlet = outlet
        self._ring = ring
        self.on_lost = on_lost
        self._latest: dict[str, bytes] = {}
        self.seen: int | None = None
        self.catching = False
        self.audience = EVERYBODY
        outlet.on_room = self.go_on

    @property
    def lost(self) -> bool:
        """Whether the ring no longer contains the next event of this reader."""
        return self.seen is not None and not self.catching and not self._ring.reaches(self.seen)

    def show(self, kind: str, frame: bytes) -> None:
        """Send the latest value of a kind now, or when the reader accepts data, unless a newer value replaces it."""
        if self._outlet.full:
            self._latest[kind] = frame
        else:
            self._outlet.write(frame)

    def forget(self, kind: str) -> None:
        """Discard the waiting value of a kind."""
        self._latest.pop(kind, None)

    def go_on(self) -> None:
        """Send waiting values and events, as far as the reader accepts them."""
        while self._latest and not self._outlet.full:
            self._outlet.write(self._latest.pop(next(iter(self._latest))))
        self.pump()

    def pump(self) -> None:
        """Send missing events, as far as the reader accepts them and the ring contains them."""
        while self.seen is not None and not self.catching and self.seen < self._ring.last:
            if self._outlet.full or not self._ring.reaches(self.seen):
                return
            self.seen, frames = self._ring.after(self.seen, CHUNK)
            self._outlet.write(frames)

    def send_past(self, upto: int, frames: bytes) -> None:
        """Send frames of the missing events up to number `upto`, from any source."""
        self._outlet.write(frames)
        self.seen = upto


class Batch(NamedTuple):
    """New data: events in order, the latest state (None for an unchanged one), and the newest values of topics."""

    events: list[Event]
    state: State | None
    values: Mapping[StreamTopic, Mapping[Caller, object]]


class StreamSource:
    """Follows `service` in the stack's loop; `hand_over` is called there with every batch.

    `speed` is the speed of the loop's clock relative to real time. Any thread may read `latest`, the newest state, and
    use the sources of `topics`.
    """

    def __init__(self, service: Service, hand_over: Callable[[Batch], None], speed: float = 1.0) -> None:
        self._service = service
        self._hand_over = hand_over
        self._events: list[Event] = []
        self._state: State | None = None
        self._told: object = None
        self._wanted = True
        self._values: dict[StreamTopic, Mapping[Caller, object]] = {}
        self._flushing = False
        self.latest: State | None = None
        self.topics = {
            topic: TopicSource(topic, service, partial(self._found, topic), max(1.0, speed))
            for topic in TOPICS.values()
        }

    async def run(self, since: int) -> None:
        """Follow the service until cancelled; events are those numbered above `since`."""
        async with asyncio.TaskGroup() as group:
            group.create_task(self._follow_states())
            group.create_task(self._follow_events(since))
            for source in self.topics.values():
                group.create_task(source.run())

    def want(self) -> None:
        """Request the next state whose content differs from the current one; from any thread.

        Read `latest` after this call, because states in between are not passed on.
        """
        state = self.latest
        self._told = None if state is None else content(state)
        self._wanted = True

    async def _follow_states(self) -> None:
        async for state in self._service.watch():
            self.latest = state
            for source in self.topics.values():
                source.saw_state()
            if self._wanted and content(state) != self._told:
                self._wanted = False
                self._told = content(state)
                self._state = state
                self._flush_soon()

    async def _follow_events(self, since: int) -> None:
        async for event in self._service.follow_events(since):
            self._events.append(event)
            self._flush_soon()
            for source in self.topics.values():
                source.saw(event)

    def _found(self, topic: StreamTopic, values: Mapping[Caller, object]) -> None:
        self._values[topic] = values
        self._flush_soon()

    def _flush_soon(self) -> None:
        """Pass data on at the end of this turn of the loop, together with further data of the same turn."""
        if not self._flushing:
            self._flushing = True
            asyncio.get_running_loop().call_soon(self._flush)

    def _flush(self) -> None:
        self._flushing = False
        batch = Batch(self._events, self._state, self._values)
        self._events, self._state, self._values = [], None, {}
        with suppress(RuntimeError):  # the server's loop has ended
            self._hand_over(batch)


HEARTBEAT = 10.0
"""Period after which an unchanged state is sent again [s]."""

TOLERANCE = 0.1
"""Fraction of its period by which a state may be early, so that states at exactly the requested rate are all sent."""


class StateFrame(NamedTuple):
    """A state for sending: its content, and its frame."""

    content: object
    frame: bytes


class RateGroup:
    """Readers with the same rate of states: they receive the same states at the same time.

    `latest` returns the newest state, `want` requests a call of `offer` for the next changed one.
    """

    def __init__(self, rate: float, latest: Callable[[], StateFrame | None], want: Callable[[], None]) -> None:
        self._period = (1.0 - TOLERANCE) / rate
        self._latest = latest
        self._want = want
        self._shown: object = None
        self._idle = True
        self._timer: asyncio.TimerHandle | None = None
        self.readers: set[StreamReader] = set()

    def join(self, reader: StreamReader) -> None:
        """Send a reader the current state, and every new one from now on."""
        self.readers.add(reader)
        if self._idle and self._look():
            return
        latest = self._latest()
        if latest is not None:
            reader.show("state", latest.frame)

    def offer(self) -> None:
        """Send a changed state, unless the period since the last one has not passed yet."""
        if self._idle:
            self._look()

    def close(self) -> None:
        """Stop sending."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _look(self) -> bool:
        """Send a changed state, or wait for the next; requesting it before reading leaves no gap between the two."""
        self._want()
        latest = self._latest()
        if latest is None or latest.content == self._shown:
            return False
        self._show(latest)
        return True

    def _show(self, snapshot: StateFrame) -> None:
        self._shown = snapshot.content
        for reader in self.readers:
            reader.show("state", snapshot.frame)
        self._idle = False
        self._again(self._period, self._due)

    def _due(self) -> None:
        self._idle = True
        if not self._look():
            self._again(HEARTBEAT, self._beat)

    def _beat(self) -> None:
        latest = self._latest()
        assert latest is not None
        self._show(latest)

    def _again(self, after: float, what: Callable[[], None]) -> None:
        self.close()
        self._timer = asyncio.get_running_loop().call_later(after, what)


class StreamHub:
    """Sends the batches of a source to all readers of one `run`; runs in the server's loop.

    `about` is what the greeting tells of the robot.
    """

    def __init__(self, run: int, ring: EventRing, about: Mapping[str, object] = MappingProxyType({})) -> None:
        self.run = run
        self.about = about
        self.ring = ring
        self._tap: StreamSource | None = None
        self._paces: dict[float, RateGroup] = {}
        self._followers: set[StreamReader] = set()
        self._watchers: dict[StreamTopic, set[StreamReader]] = {topic: set() for topic in TOPICS.values()}
        self._shown: dict[tuple[StreamTopic, Audience], bytes] = {}
        self._snapshot: tuple[State | None, StateFrame | None] = (None, None)

    def open(self, tap: StreamSource) -> None:
        """Send the data of `tap` from now on."""
        self._tap = tap

    def close(self) -> None:
        """Stop sending."""
        for pace in self._paces.values():
            pace.close()
        self._paces.clear()

    def take(self, batch: Batch) -> None:
        """Encode new data, and send them."""
        if batch.events:
            for event in batch.events:
                self.ring.add(event_frame(self.run, EventMessage.of(event)))
            for reader in tuple(self._followers):
                self._further(reader)
        if batch.state is not None:
            for pace in tuple(self._paces.values()):
                pace.offer()
        for topic, values in batch.values.items():
            for audience in self._audiences(topic):
                if audience.caller in values:
                    shown = topic.shown(values[audience.caller], audience.language)
                    self._show(topic, audience, topic_frame(topic.name, shown))

    def _further(self, reader: StreamReader) -> None:
        if reader.lost:
            self._followers.discard(reader)
            reader.on_lost()
        else:
            reader.pump()

    def _audiences(self, topic: StreamTopic) -> set[Audience]:
        return {_audience(topic, reader) for reader in self._watchers[topic]}

    def _show(self, topic: StreamTopic, audience: Audience, frame: bytes) -> None:
        if frame != self._shown.get((topic, audience)):
            self._shown[topic, audience] = frame
            for reader in self._watchers[topic]:
                if _audience(topic, reader) == audience:
                    reader.show(topic.name, frame)

    def show_states(self, reader: StreamReader, rate: float | None) -> None:
        """Send states at `rate` [Hz]; with None, stop sending them."""
        for wanted, pace in tuple(self._paces.items()):
            pace.readers.discard(reader)
            if not pace.readers:
                pace.close()
                del self._paces[wanted]
        reader.forget("state")
        if rate is not None:
            if rate not in self._paces:
                self._paces[rate] = RateGroup(rate, self._latest, self._want)
            self._paces[rate].join(reader)

    def show(self, reader: StreamReader, topic: StreamTopic, *, wanted: bool) -> None:
        """Send a topic now and after each change, or stop sending it."""
        if wanted:
            self._watchers[topic].add(reader)
            frame = self._shown.get((topic, _audience(topic, reader)))
            if frame is not None:
                reader.show(topic.name, frame)
        else:
            self._watchers[topic].discard(reader)
            reader.forget(topic.name)
        self._want_topic(topic)

    def address(self, reader: StreamReader, audience: Audience) -> None:
        """Send personal topics to a reader as to `audience` from now on: its rights or its language have changed."""
        if audience == reader.audience:
            return
        reader.audience = audience
        for topic, watchers in self._watchers.items():
            if topic.personal and reader in watchers:
                reader.forget(topic.name)
                self.show(reader, topic, wanted=True)

    def _want_topic(self, topic: StreamTopic) -> None:
        """Have a topic read for its present audiences, at once for a new one, and forget those that have left."""
        assert self._tap is not None
        audiences = self._audiences(topic)
        source = self._tap.topics[topic]
        source.wanted = frozenset(audience.caller for audience in audiences)
        for key in [key for key in self._shown if key[0] is topic and key[1] not in audiences]:
            del self._shown[key]
        if any((topic, audience) not in self._shown for audience in audiences):
            source.look()

    def send_events(self, reader: StreamReader) -> None:
        """Send a reader the missing events that the ring contains, then new events as they occur."""
        self._followers.add(reader)
        reader.pump()

    def stop_events(self, reader: StreamReader) -> None:
        """Stop sending events to a reader."""
        self._followers.discard(reader)

    def leave(self, reader: StreamReader) -> None:
        """Stop sending anything to a reader."""
        self.stop_events(reader)
        self.show_states(reader, None)
        for topic, watchers in self._watchers.items():
            if reader in watchers:
                self.show(reader, topic, wanted=False)

    def _latest(self) -> StateFrame | None:
        """Return the newest state, encoded once for all rates."""
        state = None if self._tap is None else self._tap.latest
        if state is not None and self._snapshot[0] is not state:
            self._snapshot = (state, StateFrame(content(state), state_frame(self.run, state)))
        return self._snapshot[1]

    def _want(self) -> None:
        if self._tap is not None:
            self._tap.want()


def _audience(topic: StreamTopic, reader: StreamReader) -> Audience:
    return reader.audience if topic.personal else EVERYBODY
