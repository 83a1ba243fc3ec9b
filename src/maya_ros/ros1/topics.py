"""Topics of a real graph: publishers that never block, and subscriptions that are heard in the loop.

Both are created at once, and registered with the master as soon as it answers (`registering`).
"""

from __future__ import annotations

import socket
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import rospy

from maya_ros.graph.protocol import Message
from maya_ros.graph.types import says_when
from maya_ros.ros1.convert import MessageClass, converter_of, message_class
from maya_ros.ros1.master import LoopCalls, Registrar

LINGER = 0.2
"""The last message has gone out after this time [s, real]: rospy drops what still waits on a topic it closes."""


class RosPublisher:
    """A topic to publish on (`graph.protocol.Publisher`).

    There always is a queue: without one, rospy writes to every reader itself, and one that is stopped stops us.
    Messages from before the topic is registered wait in a queue of the same length. And nothing waits for company on
    the wire: else the second of two messages comes up to 40 ms late, behind what another topic told later. `changed` is
    called when somebody came or went, in a thread of rospy's.
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
        """Publish a message; raises `InvalidMessage`. After the end, this does nothing.

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
        """How many nodes subscribe now; one that died counts for up to half a second more."""
        held = self._held
        return held.get_num_connections() if held is not None and self._open else 0

    @property
    def reading(self) -> frozenset[str]:
        """The names of the nodes that subscribe now."""
        impl = None if self._held is None else self._held.impl
        return frozenset() if impl is None else frozenset(link.endpoint_id for link in impl.connections)

    def close(self) -> None:
        """Give the topic back, as soon as what was published last has gone out."""
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
        """Have messages go out at once to whoever came."""
        impl = self._held.impl if self._held is not None and self._open else None
        for link in () if impl is None else impl.connections:
            with suppress(OSError, AttributeError):  # it has just gone
                link.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if self._changed is not None:
            self._changed()

    def _given_back(self) -> None:
        if self._held is not None:
            self._held.unregister()


class _Readers(rospy.SubscribeListener):
    """Tells that somebody came or went."""

    def __init__(self, changed: Callable[[], object]) -> None:
        self._changed = changed

    def peer_subscribe(self, topic_name: str, topic_publish: object, peer_publish: object) -> None:
        """Take note that somebody came."""
        self._changed()

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        """Take note that somebody went."""
        self._changed()


class RosSubscription:
    """A topic that is listened to (`graph.protocol.Subscription`).

    `heard` is told every message and the name of the node that sent it, in the loop that `post` posts to; of more than
    `queue_size` that wait for their turn the oldest are dropped, with 0 none.
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
        """The names of the nodes that publish on it now; one that dies is gone at once."""
        impl = None if self._held is None else self._held.impl
        links = [] if impl is None else impl.connections
        return frozenset(link.callerid_pub for link in links if _alive(link.socket, link.callerid_pub, done=link.done))

    def close(self) -> None:
        """Listen no more."""
        if self._open:
            self._open = False
            self._registrar(self._given_back)

    def _register(self, topic: str, found: type[MessageClass]) -> None:
        if self._open:
            self._held = rospy.Subscriber(topic, found, self._arrived, tcp_nodelay=True)

    def _given_back(self) -> None:
        if self._held is not None:
            self._held.unregister()

    def _arrived(self, message: MessageClass) -> None:
        """Take a message, in rospy's thread."""
        source = (message._connection_header or {}).get("callerid", "")
        self._waiting.append((self._plain(message), source))
        self._post(self._deliver)

    def _deliver(self) -> None:
        if self._waiting and self._open:
            self._heard(*self._waiting.popleft())


def _alive(link: object, name: str, *, done: bool) -> bool:
    """Tell whether a connection stands: rospy keeps those that broke, to try them again."""
    return link is not None and not done and name != "unknown"
