"""Topics that a client publishes on, and the goals that it sends as plain topics of ROS 1."""

from __future__ import annotations

import asyncio
import itertools
from collections import deque
from collections.abc import Awaitable, Callable
from typing import Any

from maya_ros.graph import types
from maya_ros.graph.protocol import Message, Publisher, stamp
from maya_ros.rosbridge.client import Id, RosbridgeClient, StatusLevel, other_type
from maya_ros.rosbridge.incoming import Fields
from maya_ros.rosbridge.limits import TOPICS, UNDER_WAY, WAITING
from maya_un.errors import InvalidRequest, MayaError

PATIENCE = 1.0
"""So long after it was advertised a topic without anybody who listens is waited with [s]."""

_LOOK = 0.02
_GOAL = "/goal"
_goals = itertools.count(1)


class _Writing:
    """One topic that a client publishes on, as often as it said so.

    In a real graph those who listen to a new topic are connected a moment later; what is published until then would be
    lost, so it waits for the first of them, as in rosbridge.
    """

    def __init__(self, client: RosbridgeClient, kind: str, publisher: Publisher, *, latch: bool) -> None:
        self.kind = kind
        self.names: set[Id] = set()
        self.action = types.action_of(kind)
        self.goals: deque[str] = deque(maxlen=UNDER_WAY)
        self._client = client
        self._publisher = publisher
        self._loop = asyncio.get_running_loop()
        self._until = 0.0 if latch else self._loop.time() + PATIENCE
        self._waiting: deque[Message] = deque(maxlen=WAITING)
        self._timer: asyncio.TimerHandle | None = None

    def publish(self, message: Message) -> None:
        """Publish a message, now or when somebody listens; raises `InvalidMessage`."""
        if not self._waiting and (self._publisher.readers or self._loop.time() >= self._until):
            self._publisher.publish(message)
            return
        now = stamp(self._client.press.now())
        self._waiting.append(types.conform(self.kind, message, stamp=now) if types.known(self.kind) else message)
        if self._timer is None:
            self._timer = self._loop.call_later(_LOOK, self._look)

    def close(self) -> None:
        """Publish what waits, and no more."""
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
    """What one client publishes. `hears` tells whether it subscribes to a topic."""

    def __init__(self, client: RosbridgeClient, hears: Callable[[str], bool]) -> None:
        self._client = client
        self._hears = hears
        self._writings: dict[str, _Writing] = {}
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
        """Carry out `publish`; on a topic that the client did not advertise too, where its type is known."""
        _, topic = fields.name("topic")
        writing = self._writings.get(topic)
        if writing is None:
            return self._publish_on_new(topic, fields)
        self._publish(writing, fields)
        return None

    async def _publish_on_new(self, topic: str, fields: Fields) -> None:
        kind = await self._client.type_of(topic)
        writing = self._begin(topic, kind, latch=fields.flag("latch", default=False))
        writing.names.add(None)
        self._publish(writing, fields)

    def _begin(self, topic: str, kind: str, *, latch: bool = False, queue_size: int = 100) -> _Writing:
        if len(self._writings) >= TOPICS:
            raise InvalidRequest(key="topic", reason=f"a client publishes on at most {TOPICS}")
        publisher = self._client.graph.advertise(topic, kind, latch=latch, queue_size=queue_size)
        writing = self._writings[topic] = _Writing(self._client, kind, publisher, latch=latch)
        return writing

    def _publish(self, writing: _Writing, fields: Fields) -> None:
        message = _timed(fields.record("msg"))
        if writing.action:
            message = _named(message)
        writing.publish(message)
        if writing.action:
            writing.goals.append(_id_of(message))

    def close(self) -> None:
        """Publish nothing any more, and cancel goals whose ends this client would have heard of.

        A goal whose client is gone is not to be carried on; cancelling one that has ended changes nothing.
        """
        for topic, writing in self._writings.items():
            if writing.goals and self._hears(topic.removesuffix(_GOAL) + "/result"):
                self._cancel(topic.removesuffix(_GOAL), writing.goals)
            writing.close()
        self._writings.clear()

    def _cancel(self, action: str, goals: deque[str]) -> None:
        canceller = self._client.graph.advertise(f"{action}/cancel", "actionlib_msgs/GoalID")
        for goal in goals:
            canceller.publish({"stamp": {"secs": 0, "nsecs": 0}, "id": goal})
        canceller.close()


async def _after(asked: Awaitable[None], begin: Callable[[], None]) -> None:
    await asked
    begin()


def _timed(message: Message) -> Message:
    """Return a message without the time of its header where that is null or empty, which counts as left out."""
    header = message.get("header")
    if not isinstance(header, dict) or header.get("stamp", 0) not in (None, {}):
        return message
    return {**message, "header": {name: value for name, value in header.items() if name != "stamp"}}


def _named(goal: Message) -> Message:
    """Return a goal with an id, so that it can be cancelled; one that is not to be understood is left as it is."""
    name = goal.get("goal_id") or {}
    if not isinstance(name, dict) or name.get("id"):
        return goal
    return {**goal, "goal_id": {**name, "id": f"/rosbridge/goal-{next(_goals)}"}}


def _id_of(goal: Message) -> str:
    return str(goal["goal_id"]["id"])
