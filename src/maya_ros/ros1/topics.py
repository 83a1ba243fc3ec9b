"""Topics of a real graph: publishers that never block, and subscriptions whose messages are handled in the loop.

Both are created at once, and registered with the master as soon as it answers (`master.Registrar`).
"""

from __future__ import annotations

import socket
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import rospy
from rospy.impl.transport import Transport
from rospy.topics import _SubscriberImpl as SubscriberImpl  # pyright: ignore[reportPrivateUsage]
from rospy.topics import _TopicImpl as TopicImpl  # pyright: ignore[reportPrivateUsage]

from maya_ros.graph.protocol import Message
from maya_ros.graph.types import says_when
from maya_ros.ros1.convert import MessageClass, converter_of, message_class
from maya_ros.ros1.master import LoopCalls, Registrar, connect_to, publishers_of

CHECKS = 3
"""Number of checks whether rospy has connected a new subscription to all publishers."""

LINGER = 0.2
"""Time to send the last message [s, real time]: rospy drops messages that still wait on a topic that it closes."""


class RosPublisher:
    """A publisher of a topic (`graph.protocol.Publisher`).

    There always is a queue: without one, rospy writes to every subscriber itself, and a stopped subscriber would block
    this node. Messages from before the registration of the topic wait in a queue of the same length. TCP does not delay
    small packets (TCP_NODELAY): otherwise the second of two messages comes up to 40 ms late, after a later message on
    another topic. `changed` is called when a subscriber connects or disconnects, in a thread of rospy.
    """

    def __init__(
        self,
        registrar: Registrar,
        topic: str,
        kind: str,
        *,
        latch: bool = False,
        queue_size: int,
        changed: Callable[[], object] | None = None,
    ) -> None:
        found = message_class(kind)
        size = max(1, queue_size)
        self._registrar = registrar
        self._converter = converter_of(found)
        self._stamped = ("header", "std_msgs/Header") in zip(found.__slots__, found._slot_types, strict=True)
        self._changed = changed
        self._open = True
        self._held: rospy.Publisher | None = None
        self._early: deque[MessageClass] = deque(maxlen=size)
        self._turn = threading.Lock()
        registrar(
            lambda: self._taken(rospy.Publisher(topic, found, _Readers(self._look), latch=latch, queue_size=size))
        )

    def publish(self, message: Message) -> None:
        """Publish a message; raises `InvalidMessage`. After `close`, this does nothing.

        A header without a time gets the present time, as on the bus (`graph.topics`).
        """
        made: Any = self._converter.made(message)
        if self._stamped and not says_when(message):
            made.header.stamp = rospy.Time.now()
        if not self._open or rospy.is_shutdown():
            return
        with self._turn:
            if self._held is None:
                self._early.append(made)
            else:
                self._held.publish(made)

    @property
    def readers(self) -> int:
        """Number of current subscribers; one that died counts for up to half a second more."""
        held = self._held
        return held.get_num_connections() if held is not None and self._open else 0

    @property
    def reading(self) -> frozenset[str]:
        """The names of the nodes that subscribe now."""
        impl = None if self._held is None else self._held.impl
        return frozenset() if impl is None else frozenset(link.endpoint_id for link in impl.connections)

    def close(self) -> None:
        """Stop publishing, once the last message has been sent."""
        if self._open:
            self._open = False
            timer = threading.Timer(LINGER, self._registrar, (self._given_back,))
            timer.daemon = True
            timer.start()

    def _taken(self, held: rospy.Publisher) -> None:
        """Publish the messages that waited for the registration of the topic."""
        with self._turn:
            for made in self._early:
                held.publish(made)
            self._early.clear()
            self._held = held
        self._look()

    def _look(self) -> None:
        """Set TCP_NODELAY on all connections, and call `changed`."""
        impl = self._held.impl if self._held is not None and self._open else None
        for link in () if impl is None else impl.connections:
            with suppress(OSError, AttributeError):  # the subscriber has just disconnected
                link.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if self._changed is not None:
            self._changed()

    def _given_back(self) -> None:
        if self._held is not None:
            self._held.unregister()


class _Readers(rospy.SubscribeListener):
    """Calls `changed` when a subscriber connects or disconnects."""

    def __init__(self, changed: Callable[[], object]) -> None:
        self._changed = changed

    def peer_subscribe(self, topic_name: str, topic_publish: object, peer_publish: object) -> None:
        """Report that a subscriber has connected."""
        self._changed()

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        """Report that a subscriber has disconnected."""
        self._changed()


class RosSubscription:
    """A subscription to a topic (`graph.protocol.Subscription`).

    `heard` is called with every message and the name of its publisher, in the loop that `post` posts to. If more than
    `queue_size` messages wait, the oldest are dropped; 0 drops none.

    rospy can miss a publisher that registers at the same time: it handles the older answer to its own registration
    after the newer list from the master, and never connects. So the list is compared with the connections later on.
    """

    def __init__(
        self,
        registrar: Registrar,
        post: LoopCalls,
        topic: str,
        kind: str,
        heard: Callable[[Message, str], None],
        queue_size: int = 0,
    ) -> None:
        found = message_class(kind)
        self._registrar = registrar
        self._plain = converter_of(found).plain
        self._post = post
        self._heard = heard
        self._waiting: deque[tuple[Message, str]] = deque(maxlen=queue_size or None)
        self._open = True
        self._held: rospy.Subscriber | None = None
        registrar(lambda: self._register(topic, found))

    @property
    def writers(self) -> frozenset[str]:
        """The names of the nodes that publish on the topic now, without nodes that died."""
        impl = None if self._held is None else self._held.impl
        links = [] if impl is None else impl.connections
        return frozenset(link.callerid_pub for link in links if _alive(link.socket, link.callerid_pub, done=link.done))

    def close(self) -> None:
        """Unsubscribe."""
        if self._open:
            self._open = False
            self._registrar(self._given_back)

    def _register(self, topic: str, found: type[MessageClass]) -> None:
        if self._open:
            self._held = rospy.Subscriber(topic, found, self._arrived, tcp_nodelay=True)
            self._registrar.once_quiet(lambda: self._connect_missed(topic, found._type, CHECKS))

    def _connect_missed(self, topic: str, kind: str, checks: int) -> None:
        """Connect to the publishers that rospy has missed, and check again, `checks` times at most."""
        impl = None if self._held is None or not self._open else self._held.impl
        if impl is None:
            return
        publishers = publishers_of(topic, kind)
        if publishers - {link.endpoint_id for link in impl.connections}:
            connect_to(topic, publishers)
            if checks > 1:
                self._registrar.once_quiet(lambda: self._connect_missed(topic, kind, checks - 1))

    def _given_back(self) -> None:
        if self._held is not None:
            self._held.unregister()

    def _arrived(self, message: MessageClass) -> None:
        """Take a message, in a thread of rospy."""
        source = (message._connection_header or {}).get("callerid", "")
        self._waiting.append((self._plain(message), source))
        self._post(self._deliver)

    def _deliver(self) -> None:
        if self._waiting and self._open:
            self._heard(*self._waiting.popleft())


def _add_connection(subscriber: SubscriberImpl, connection: Transport) -> bool:
    """Add a connection of a subscriber; return False for a second one to the same publisher, which rospy then closes.

    rospy may connect twice to one publisher: with several publishers it handles each list from the master several
    times, in parallel. Its own method lets the newer connection replace the older one, with the messages that the older
    one still holds.
    """
    with subscriber.c_lock:
        if subscriber.has_connection(connection.endpoint_id):
            return False
        return TopicImpl.add_connection(subscriber, connection)


SubscriberImpl.add_connection = _add_connection  # type: ignore[method-assign]


def _alive(link: object, name: str, *, done: bool) -> bool:
    """Return whether a connection is alive: rospy holds broken ones, to try them again."""
    return link is not None and not done and name != "unknown"
