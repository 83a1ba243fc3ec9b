"""Topics within one loop: what is published is heard in the loop's next turn, in order across all topics."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Mapping
from typing import Protocol

from maya_ros.graph import types
from maya_ros.graph.permissions import Who, acting_for, caller
from maya_ros.graph.protocol import Message, Stamp
from maya_un.errors import InvalidMessage, UnknownInterface
from maya_un.service.access.operations import Caller


class TopicNode(Protocol):
    """A node, as far as topics know it."""

    @property
    def name(self) -> str:
        """Its name; several may have the same."""
        ...

    @property
    def who(self) -> Who | None:
        """Returns the principal for whom it acts, None for the one that triggered it."""
        ...

    def keep(self, held: TopicOutlet | TopicInlet) -> None:
        """Have something that is given back when the node ends."""
        ...

    def drop(self, held: TopicOutlet | TopicInlet) -> None:
        """Take notice that something was given back."""
        ...


Heard = Callable[[Message, TopicNode], None]
"""Told of a message and of who published it."""


class Topic:
    """One topic: its type, who publishes on it, who listens."""

    def __init__(self, name: str, kind: str) -> None:
        self.name = name
        self.kind = kind
        self.outlets: list[TopicOutlet] = []
        self.inlets: list[TopicInlet] = []


class Topics:
    """All topics. `now` stamps the headers of messages that say no time."""

    def __init__(self, now: Callable[[], Stamp]) -> None:
        self._now = now
        self._topics: dict[str, Topic] = {}

    @property
    def kinds(self) -> Mapping[str, str]:
        """The type of every topic that somebody publishes or listens to."""
        return {name: topic.kind for name, topic in self._topics.items()}

    def find(self, name: str) -> Topic | None:
        """Return a topic that somebody publishes or listens to."""
        return self._topics.get(name)

    def advertise(self, name: str, kind: str, member: TopicNode, *, latch: bool) -> TopicOutlet:
        """Take a topic to publish on; raises `InvalidMessage` where it carries another type, `UnknownInterface`."""
        outlet = TopicOutlet(self._topic(name, kind), member, self, latch=latch)
        outlet.topic.outlets.append(outlet)
        member.keep(outlet)
        return outlet

    def listen(self, name: str, kind: str, heard: Heard, member: TopicNode, queue_size: int) -> TopicInlet:
        """Listen to a topic; what it has latched is heard first. Raises as `advertise` does."""
        inlet = TopicInlet(self._topic(name, kind), member, self, heard, queue_size)
        inlet.topic.inlets.append(inlet)
        member.keep(inlet)
        for outlet in inlet.topic.outlets:
            if outlet.latched is not None:
                inlet.put(outlet.latched, outlet.member)
        return inlet

    def stamp(self) -> Stamp:
        """Return the time now."""
        return self._now()

    def tidy(self, topic: Topic) -> None:
        """Forget a topic that nobody uses any more."""
        if not topic.outlets and not topic.inlets and self._topics.get(topic.name) is topic:
            del self._topics[topic.name]

    def _topic(self, name: str, kind: str) -> Topic:
        known = self._topics.get(name)
        kind = kind.replace("/msg/", "/")
        if known is not None:
            if kind not in ("", known.kind):
                raise InvalidMessage(name=kind, reason=f"the topic {name} carries {known.kind}")
            return known
        if not kind:
            raise UnknownInterface(form="topic", name=name)
        types.default(kind)
        self._topics[name] = topic = Topic(name, kind)
        return topic


def caller_of(member: TopicNode) -> Caller:
    """Return for whom a node acts now."""
    return caller() if member.who is None else member.who()


class TopicOutlet:
    """A topic that somebody publishes on; see `protocol.Publisher`."""

    def __init__(self, topic: Topic, member: TopicNode, topics: Topics, *, latch: bool) -> None:
        self.topic = topic
        self.member = member
        self.latched: Message | None = None
        self._topics = topics
        self._latch = latch
        self._closed = False

    @property
    def readers(self) -> int:
        """How many listen now."""
        return len(self.topic.inlets)

    def publish(self, message: Message) -> None:
        """Hand a message on, completed; all hear the same one, which nobody may change. Raises `InvalidMessage`."""
        if self._closed:
            return
        whole = types.conform(self.topic.kind, message, stamp=self._topics.stamp())
        if self._latch:
            self.latched = whole
        for inlet in self.topic.inlets:
            inlet.put(whole, self.member)

    def close(self) -> None:
        """Give it back."""
        if not self._closed:
            self._closed = True
            self.topic.outlets.remove(self)
            self.member.drop(self)
            self._topics.tidy(self.topic)


class TopicInlet:
    """A topic that somebody listens to; see `protocol.Subscription`."""

    def __init__(self, topic: Topic, member: TopicNode, topics: Topics, heard: Heard, queue_size: int) -> None:
        self.topic = topic
        self.member = member
        self._topics = topics
        self._heard = heard
        self._loop = asyncio.get_running_loop()
        self._queue: deque[tuple[Message, TopicNode, Caller]] = deque(maxlen=queue_size or None)
        self._closed = False

    @property
    def writers(self) -> frozenset[str]:
        """The nodes that publish on it now."""
        return frozenset(outlet.member.name for outlet in self.topic.outlets)

    def put(self, message: Message, member: TopicNode) -> None:
        """Have a message heard soon, in its turn among those of all topics; the oldest of too many are dropped."""
        self._queue.append((message, member, caller_of(member)))
        self._loop.call_soon(self._deliver)

    def close(self) -> None:
        """Give it back; nothing is heard any more."""
        if not self._closed:
            self._closed = True
            self._queue.clear()
            self.topic.inlets.remove(self)
            self.member.drop(self)
            self._topics.tidy(self.topic)

    def _deliver(self) -> None:
        """Have the next one heard, if it was not dropped."""
        if self._closed or not self._queue:
            return
        message, member, who = self._queue.popleft()
        try:
            with acting_for(who):
                self._heard(message, member)
        except Exception as defect:  # noqa: BLE001 - one that cannot cope must not take the messages of others
            context = {"message": f"a reader of {self.topic.name} failed", "exception": defect}
            self._loop.call_exception_handler(context)
