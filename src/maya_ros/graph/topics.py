"""Topics within one loop: the loop delivers a message in its next turn, in order across all topics."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Mapping
from typing import Protocol

from dmc41x3.i18n import phrase
from maya_ros.graph import types
from maya_ros.graph.permissions import Who, acting_for, caller
from maya_ros.graph.protocol import Message, Stamp
from maya_un.errors import InvalidMessage, UnknownInterface
from maya_un.service.access.operations import Caller


class TopicNode(Protocol):
    """A node, as far as topics use it."""

    @property
    def name(self) -> str:
        """Name of the node; several nodes may share a name."""
        ...

    @property
    def who(self) -> Who | None:
        """Returns the principal for whom the node acts, None for the principal that triggered it."""
        ...

    def keep(self, held: TopicOutlet | TopicInlet) -> None:
        """Register a resource that is closed when the node ends."""
        ...

    def drop(self, held: TopicOutlet | TopicInlet) -> None:
        """Unregister a closed resource."""
        ...


Heard = Callable[[Message, TopicNode], None]
"""Called with a message and its publisher."""


class Topic:
    """One topic: its type, publishers and subscribers."""

    def __init__(self, name: str, kind: str) -> None:
        self.name = name
        self.kind = kind
        self.outlets: list[TopicOutlet] = []
        self.inlets: list[TopicInlet] = []


class Topics:
    """All topics. `now` stamps message headers without a time."""

    def __init__(self, now: Callable[[], Stamp]) -> None:
        self._now = now
        self._topics: dict[str, Topic] = {}

    @property
    def kinds(self) -> Mapping[str, str]:
        """Type of every topic that has a publisher or a subscriber."""
        return {name: topic.kind for name, topic in self._topics.items()}

    def find(self, name: str) -> Topic | None:
        """Return a topic that has a publisher or a subscriber, None for other names."""
        return self._topics.get(name)

    def advertise(self, name: str, kind: str, member: TopicNode, *, latch: bool) -> TopicOutlet:
        """Return a publisher of a topic; raises `InvalidMessage` if the topic has another type; `UnknownInterface`."""
        outlet = TopicOutlet(self._topic(name, kind), member, self, latch=latch)
        outlet.topic.outlets.append(outlet)
        member.keep(outlet)
        return outlet

    def listen(self, name: str, kind: str, heard: Heard, member: TopicNode, queue_size: int) -> TopicInlet:
        """Subscribe to a topic; its latched message is delivered first. Raises as `advertise` does."""
        inlet = TopicInlet(self._topic(name, kind), member, self, heard, queue_size)
        inlet.topic.inlets.append(inlet)
        member.keep(inlet)
        for outlet in inlet.topic.outlets:
            if outlet.latched is not None:
                inlet.put(outlet.latched, outlet.member)
        return inlet

    def stamp(self) -> Stamp:
        """Return the present time."""
        return self._now()

    def tidy(self, topic: Topic) -> None:
        """Forget a topic that has no publisher and no subscriber."""
        if not topic.outlets and not topic.inlets and self._topics.get(topic.name) is topic:
            del self._topics[topic.name]

    def _topic(self, name: str, kind: str) -> Topic:
        known = self._topics.get(name)
        kind = kind.replace("/msg/", "/")
        if known is not None:
            if kind not in ("", known.kind):
                raise InvalidMessage(
                    name=kind, reason=phrase("the topic {name} carries {kind}", name=name, kind=known.kind)
                )
            return known
        if not kind:
            raise UnknownInterface(form="topic", name=name)
        types.default(kind)
        self._topics[name] = topic = Topic(name, kind)
        return topic


def caller_of(member: TopicNode) -> Caller:
    """Return the principal for whom a node acts now."""
    return caller() if member.who is None else member.who()


class TopicOutlet:
    """A publisher of a topic; see `protocol.Publisher`."""

    def __init__(self, topic: Topic, member: TopicNode, topics: Topics, *, latch: bool) -> None:
        self.topic = topic
        self.member = member
        self.latched: Message | None = None
        self._topics = topics
        self._latch = latch
        self._closed = False

    @property
    def readers(self) -> int:
        """Number of current subscribers."""
        return len(self.topic.inlets)

    def publish(self, message: Message) -> None:
        """Complete and deliver a message, which all subscribers share and must not change. Raises `InvalidMessage`."""
        if self._closed:
            return
        whole = types.conform(self.topic.kind, message, stamp=self._topics.stamp())
        if self._latch:
            self.latched = whole
        for inlet in self.topic.inlets:
            inlet.put(whole, self.member)

    def close(self) -> None:
        """Stop publishing."""
        if not self._closed:
            self._closed = True
            self.topic.outlets.remove(self)
            self.member.drop(self)
            self._topics.tidy(self.topic)


class TopicInlet:
    """A subscription to a topic; see `protocol.Subscription`."""

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
        """Nodes that publish on the topic now."""
        return frozenset(outlet.member.name for outlet in self.topic.outlets)

    def put(self, message: Message, member: TopicNode) -> None:
        """Queue a message for delivery in order across all topics; drop the oldest beyond the queue size."""
        self._queue.append((message, member, caller_of(member)))
        self._loop.call_soon(self._deliver)

    def close(self) -> None:
        """Unsubscribe; waiting messages are dropped."""
        if not self._closed:
            self._closed = True
            self._queue.clear()
            self.topic.inlets.remove(self)
            self.member.drop(self)
            self._topics.tidy(self.topic)

    def _deliver(self) -> None:
        """Deliver the next message, if it was not dropped."""
        if self._closed or not self._queue:
            return
        message, member, who = self._queue.popleft()
        try:
            with acting_for(who):
                self._heard(message, member)
        except Exception as defect:  # noqa: BLE001 - a failing subscriber must not block the messages of others
            context = {"message": f"a reader of {self.topic.name} failed", "exception": defect}
            self._loop.call_exception_handler(context)
