"""Topics of a client: those that it publishes on, goals sent as plain topics, and those that it subscribes to."""

from __future__ import annotations

import asyncio
import itertools
from collections import deque
from collections.abc import Awaitable, Callable
from contextlib import ExitStack
from typing import Any, NamedTuple

from dmc41x3.i18n import phrase
from maya_ros.graph import types
from maya_ros.graph.protocol import Message, Publisher, Subscription, stamp
from maya_ros.rosbridge.client import ROWS, Backlog, Id, RosbridgeClient, StatusLevel, other_type
from maya_ros.rosbridge.incoming import Fields
from maya_ros.rosbridge.limits import (
    LONGEST_MESSAGE,
    LONGEST_QUEUE,
    REQUESTS,
    SMALLEST_FRAGMENT,
    TOPICS,
    UNDER_WAY,
    WAITING,
)
from maya_ros.rosbridge.outgoing import COMPRESSIONS, MessageFormat, Outgoing
from maya_un.errors import InvalidRequest, MayaError

PATIENCE = 1.0
"""Time after the advertising of a topic during which messages wait for a first subscriber [s]."""

_LOOK = 0.02
_GOAL, _RESULT, _ACTION_RESULT = "/goal", "/result", "ActionResult"
_goals = itertools.count(1)

GoalEnded = Callable[[str, str], None]
"""Receives action and id of a goal whose result has come."""


class _Writing:
    """One topic on which a client publishes, for all its `advertise` messages.

    In a real graph, subscribers connect to a new topic a moment later. Messages until then would be lost, so they wait
    for the first subscriber, as in rosbridge.
    """

    def __init__(self, client: RosbridgeClient, kind: str, publisher: Publisher, *, latch: bool) -> None:
        self.kind = kind
        self.names: set[Id] = set()
        self.action = types.action_of(kind)
        self._client = client
        self._publisher = publisher
        self._loop = asyncio.get_running_loop()
        self._until = 0.0 if latch else self._loop.time() + PATIENCE
        self._waiting: deque[Message] = deque(maxlen=WAITING)
        self._timer: asyncio.TimerHandle | None = None

    def publish(self, message: Message) -> None:
        """Publish a message, now or when a subscriber connects; raises `InvalidMessage`."""
        if not self._waiting and (self._publisher.readers or self._loop.time() >= self._until):
            self._publisher.publish(message)
            return
        now = stamp(self._client.press.now())
        self._waiting.append(types.conform(self.kind, message, stamp=now) if types.known(self.kind) else message)
        if self._timer is None:
            self._timer = self._loop.call_later(_LOOK, self._look)

    def close(self) -> None:
        """Publish the waiting messages, and stop publishing."""
        if self._timer is not None:
            self._timer.cancel()
        self._let_go()
        self._publisher.close()

    def _look(self) -> None:
        self._timer = None
        if self._publisher.readers or self._loop.time() >= self._until:
            self._let_go()
        else:
            self._timer = self._loop.call_later(_LOOK, self._look)

    def _let_go(self) -> None:
        while self._waiting:
            try:
                self._publisher.publish(self._waiting.popleft())
            except MayaError as error:
                self._client.refuse(error)


class ClientPublications:
    """The topics on which one client publishes. `hears` returns whether the client subscribes to a topic."""

    def __init__(self, client: RosbridgeClient, hears: Callable[[str], bool]) -> None:
        self._client = client
        self._hears = hears
        self._writings: dict[str, _Writing] = {}
        self._goals: dict[tuple[str, str], None] = {}  # action and id of goals whose results have not come
        self._cancellers: dict[str, Publisher] = {}
        self.ops = {"advertise": self.advertise, "unadvertise": self.unadvertise, "publish": self.publish}

    def advertise(self, fields: Fields) -> Awaitable[None] | None:
        """Carry out `advertise`, at once unless the type of the topic must be requested from the graph."""
        _, topic = fields.name("topic")
        kind, latch = fields.kind(), fields.flag("latch", default=False)
        queue_size = fields.whole("queue_size", 100, 0, 1000) or 1
        writing = self._writings.get(topic)
        if writing is not None:
            self._join(writing, kind, fields)
            return None

        def begin() -> None:
            self._join(self._begin(topic, kind, latch=latch, queue_size=queue_size), kind, fields)

        asked = self._client.require(topic, kind)
        return begin() if asked is None else _after(asked, begin)

    def _join(self, writing: _Writing, kind: str, fields: Fields) -> None:
        said, _ = fields.name("topic")
        if writing.kind != kind:
            raise other_type(said, writing.kind)
        writing.names.add(fields.id)
        self._client.tell(StatusLevel.info, f"advertised {said}", fields.id)

    def unadvertise(self, fields: Fields) -> None:
        """Carry out `unadvertise`."""
        said, topic = fields.name("topic")
        writing = self._writings.get(topic)
        if writing is None:
            self._client.tell(StatusLevel.warning, f"{said} is not advertised", fields.id)
            return
        writing.names.discard(fields.id)
        if fields.id is None or not writing.names:
            del self._writings[topic]
            writing.close()
        self._client.tell(StatusLevel.info, f"unadvertised {said}", fields.id)

    def publish(self, fields: Fields) -> Any:
        """Carry out `publish`; a topic that the client did not advertise must have a known type."""
        _, topic = fields.name("topic")
        writing = self._writings.get(topic)
        if writing is None:
            return self._publish_on_new(topic, fields)
        self._publish(topic, writing, fields)
        return None

    async def _publish_on_new(self, topic: str, fields: Fields) -> None:
        kind = await self._client.type_of(topic)
        writing = self._begin(topic, kind, latch=fields.flag("latch", default=False))
        writing.names.add(None)
        self._publish(topic, writing, fields)

    def _begin(self, topic: str, kind: str, *, latch: bool = False, queue_size: int = 100) -> _Writing:
        if len(self._writings) >= TOPICS:
            raise InvalidRequest(key="topic", reason=phrase("a client publishes on at most {most}", most=TOPICS))
        publisher = self._client.graph.advertise(topic, kind, latch=latch, queue_size=queue_size)
        writing = self._writings[topic] = _Writing(self._client, kind, publisher, latch=latch)
        return writing

    def _publish(self, topic: str, writing: _Writing, fields: Fields) -> None:
        message = _timed(fields.record("msg"))
        if writing.action:
            self._publish_goal(topic.removesuffix(_GOAL), writing, _named(message))
        else:
            writing.publish(message)

    def _publish_goal(self, action: str, writing: _Writing, goal: Message) -> None:
        """Publish a goal, and keep its id until its result comes, also when the topic is unadvertised before."""
        id_ = _id_of(goal)
        if id_ is None or (action, id_) in self._goals:
            writing.publish(goal)
            return
        self._canceller(action)
        self._goals[action, id_] = None  # before the publishing, because its result can come during it
        try:
            writing.publish(goal)
        except MayaError:
            self._goals.pop((action, id_), None)
            raise
        if len(self._goals) > UNDER_WAY:
            action, id_ = next(iter(self._goals))
            self._cancel(action, [id_])  # one that is under way must not be forgotten

    def ended(self, action: str, goal: str) -> None:
        """Forget a goal whose result has come."""
        self._goals.pop((action, goal), None)

    def close(self) -> None:
        """Stop publishing, and cancel goals whose results this client would have received.

        A goal must not continue without its client.
        """
        with ExitStack() as ends:
            for canceller in self._cancellers.values():
                ends.callback(canceller.close)
            for action in {action for action, _ in self._goals}:
                ends.callback(self._cancel, action, [id_ for other, id_ in self._goals if other == action])
            for writing in self._writings.values():
                ends.callback(writing.close)  # called before the others: a goal can still wait there
        self._writings.clear()

    def _cancel(self, action: str, goals: list[str]) -> None:
        """Forget goals, and cancel them if the client waits for their results; this changes none that has ended."""
        for goal in goals:
            self.ended(action, goal)
        if self._hears(action + _RESULT):
            canceller = self._canceller(action)
            for goal in goals:
                canceller.publish({"stamp": {"secs": 0, "nsecs": 0}, "id": goal})

    def _canceller(self, action: str) -> Publisher:
        """Return the publisher that cancels goals of an action; it is advertised with the first goal.

        A server of ROS 1 connects to it in some milliseconds, and a message that is published earlier is lost.
        """
        if action not in self._cancellers:
            self._cancellers[action] = self._client.graph.advertise(f"{action}/cancel", "actionlib_msgs/GoalID")
        return self._cancellers[action]


async def _after(asked: Awaitable[None], begin: Callable[[], None]) -> None:
    await asked
    begin()


def _timed(message: Message) -> Message:
    """Return a message without a null or empty time in its header, which counts as missing."""
    header = message.get("header")
    if not isinstance(header, dict) or header.get("stamp", 0) not in (None, {}):
        return message
    return {**message, "header": {name: value for name, value in header.items() if name != "stamp"}}


def _named(goal: Message) -> Message:
    """Return a goal with an id, so that it can be cancelled; an invalid goal is returned unchanged."""
    name = goal.get("goal_id") or {}
    if not isinstance(name, dict) or name.get("id"):
        return goal
    return {**goal, "goal_id": {**name, "id": f"/rosbridge/goal-{next(_goals)}"}}


def _id_of(goal: Message) -> str | None:
    """Return the id of a goal from `_named`, None for an invalid goal."""
    name = goal.get("goal_id")
    id_ = name.get("id") if isinstance(name, dict) else None
    return id_ if isinstance(id_, str) else None


_LONGEST_THROTTLE = 86_400_000


class SubscribeRequest(NamedTuple):
    """Options of one subscription: least interval `throttle` [s], queue length, fragment size and compression."""

    throttle: float
    queue: int
    fragment: int
    compression: str

    @classmethod
    def of(cls, fields: Fields) -> SubscribeRequest:
        """Return the options in a message; raises `InvalidRequest`."""
        return cls(
            fields.whole("throttle_rate", 0, 0, _LONGEST_THROTTLE) / 1000.0,
            fields.whole("queue_length", 0, 0, LONGEST_QUEUE),
            fields.whole("fragment_size", 0, SMALLEST_FRAGMENT, LONGEST_MESSAGE),
            fields.one_of("compression", COMPRESSIONS, "none"),
        )


class TopicReading:
    """One topic to which a client subscribes, under the name that the client used.

    Of several requests, the smallest throttle, queue and fragment, and the strongest compression apply, as in
    rosbridge.
    `ended` receives action and id of goals, if the topic has the results of an action.
    """

    def __init__(self, client: RosbridgeClient, said: str, topic: str, kind: str, ended: GoalEnded) -> None:
        self._client = client
        self._said = said
        self._topic = topic
        self.kind = kind
        self.requests: dict[Id, SubscribeRequest] = {}
        self._throttle, self._queue, self._form = 0.0, 0, MessageFormat(said)
        self._backlog = Backlog(WAITING)
        self._pending: deque[Outgoing] = deque()
        self._due = 0.0
        self._timer: asyncio.TimerHandle | None = None
        self._latest: Outgoing | None = None
        self._loop = asyncio.get_running_loop()
        self._taken: Subscription | None = None
        self._ended = ended
        self._action = topic.removesuffix(_RESULT) if _is_of_results(kind) else None

    def open(self) -> None:
        """Subscribe; raises the errors of the graph."""
        self._client.press.join(self._topic, self.kind)
        try:
            self._taken = self._client.graph.subscribe(self._topic, self.kind, self._heard)
        except BaseException:
            self._client.press.leave(self._topic, self.kind)
            raise

    def add(self, name: Id, request: SubscribeRequest) -> None:
        """Add a request, or replace an older one of the same name.

        A later subscriber of a latched topic gets its latest message, as with a separate subscription.
        """
        later = bool(self.requests) and name not in self.requests
        self.requests[name] = request
        self._settle()
        row = ROWS.get(self._topic)
        if later and row is not None and row.latch and self._latest is not None:
            self._client.sender.send(self._backlog, self._latest.frames(self._form))

    def remove(self, name: Id) -> None:
        """Remove a request, or all requests for None."""
        if name is None:
            self.requests.clear()
        else:
            self.requests.pop(name, None)
        if self.requests:
            self._settle()

    def close(self) -> None:
        """Unsubscribe."""
        if self._timer is not None:
            self._timer.cancel()
        if self._taken is not None:
            self._taken.close()
            self._client.press.leave(self._topic, self.kind)
            self._taken = None
        self._client.sender.forget(self._backlog)

    def _settle(self) -> None:
        requests = self.requests.values()
        pieces = [one.fragment for one in requests if one.fragment]
        strongest = max(COMPRESSIONS.index(one.compression) for one in requests)
        self._throttle = min(one.throttle for one in requests)
        self._queue = min(one.queue for one in requests)
        self._form = MessageFormat(self._said, COMPRESSIONS[strongest], min(pieces, default=0))
        self._backlog.most = self._queue or WAITING
        self._pending = deque(self._pending, maxlen=self._queue)

    def _heard(self, message: Message) -> None:
        if self._action is not None:
            self._ended(self._action, message["status"]["goal_id"]["id"])
        outgoing = self._latest = self._client.press.outgoing(self._topic, self.kind, message)
        if not self._throttle:
            self._client.sender.send(self._backlog, outgoing.frames(self._form))
            return
        now = self._loop.time()
        if not self._pending and now >= self._due:
            self._send(outgoing, now)
        elif self._queue:
            self._pending.append(outgoing)
            self._wait()

    def _send(self, outgoing: Outgoing, now: float) -> None:
        self._due = now + self._throttle
        self._client.sender.send(self._backlog, outgoing.frames(self._form))

    def _wait(self) -> None:
        if self._timer is None:
            self._timer = self._loop.call_at(self._due, self._next)

    def _next(self) -> None:
        self._timer = None
        if self._pending:
            self._send(self._pending.popleft(), self._loop.time())
        if self._pending:
            self._wait()


def _is_of_results(kind: str) -> bool:
    """Return whether a type is that of an action's results."""
    return kind.endswith(_ACTION_RESULT) and bool(types.action_of(kind.removesuffix(_ACTION_RESULT) + "ActionGoal"))


def _ignored(_: str, __: str) -> None:
    """Ignore the end of a goal."""


class ClientSubscriptions:
    """The subscriptions of one client, by the names that it uses. `on_end` receives the goals whose results come."""

    def __init__(self, client: RosbridgeClient) -> None:
        self._client = client
        self._readings: dict[str, TopicReading] = {}
        self.on_end: GoalEnded = _ignored
        self.ops = {"subscribe": self.subscribe, "unsubscribe": self.unsubscribe}

    def hears(self, topic: str) -> bool:
        """Return whether the client subscribes to a topic."""
        return any(name in self._readings for name in (topic, topic.removeprefix("/")))

    def subscribe(self, fields: Fields) -> Awaitable[None] | None:
        """Carry out `subscribe`, at once unless the type of the topic must be requested from the graph."""
        said, topic = fields.name("topic")
        request, kind, name = SubscribeRequest.of(fields), fields.kind(needed=False), fields.id
        reading = self._readings.get(said)
        if reading is not None:
            self._join(reading, said, kind, request, name)
            return None
        asked = self._client.require(topic, kind) if kind else self._client.type_of(topic)
        if asked is not None:
            return self._find_out(said, topic, kind, request, name, asked)
        self._begin(said, topic, kind, request, name)
        return None

    async def _find_out(
        self, said: str, topic: str, kind: str, request: SubscribeRequest, name: Id, asked: Awaitable[str | None]
    ) -> None:
        found = await asked
        self._begin(said, topic, kind or found or "", request, name)

    def _begin(self, said: str, topic: str, kind: str, request: SubscribeRequest, name: Id) -> None:
        if len(self._readings) >= TOPICS:
            raise InvalidRequest(key="topic", reason=phrase("a client subscribes to at most {most}", most=TOPICS))
        reading = TopicReading(self._client, said, topic, kind, self.on_end)
        reading.add(name, request)
        reading.open()
        self._readings[said] = reading
        self._client.tell(StatusLevel.info, f"subscribed to {said}", name)

    def _join(self, reading: TopicReading, said: str, kind: str, request: SubscribeRequest, name: Id) -> None:
        if kind and kind != reading.kind:
            raise other_type(said, reading.kind)
        if len(reading.requests) >= REQUESTS:
            raise InvalidRequest(
                key="id", reason=phrase("at most {most} subscriptions stand on a topic", most=REQUESTS)
            )
        reading.add(name, request)
        self._client.tell(StatusLevel.info, f"subscribed to {said}", name)

    def unsubscribe(self, fields: Fields) -> None:
        """Carry out `unsubscribe`."""
        said, _ = fields.name("topic")
        reading = self._readings.get(said)
        if reading is None:
            self._client.tell(StatusLevel.warning, f"{said} is not subscribed to", fields.id)
            return
        reading.remove(fields.id)
        if not reading.requests:
            del self._readings[said]
            reading.close()
        self._client.tell(StatusLevel.info, f"unsubscribed from {said}", fields.id)

    def close(self) -> None:
        """Unsubscribe from all topics."""
        for reading in self._readings.values():
            reading.close()
        self._readings.clear()
