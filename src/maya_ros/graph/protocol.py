"""The interface of a ROS graph, either a real one or one within this process.

Messages are plain data: a dict of field names; arrays are lists, times and durations {"secs", "nsecs"} (as rosbridge
writes them). All calls, and all callbacks except `Quick`, run in the running loop.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Protocol

from dmc41x3.i18n import phrase
from maya_un.errors import InvalidMessage

Message = dict[str, Any]
"""A message, request, response, goal, result or feedback as plain data."""

Request = Message | list[Any]
"""A request of a service; a list holds the values of its first fields, in their order."""

Heard = Callable[[Message], None]
"""Called with every message on a topic, in order."""

Answer = Callable[[Message], Awaitable[Message]]
"""Answers a service request. It raises a `MayaError` to fail; a cancelled request gets no answer."""

Quick = Callable[[Message], Message | None]
"""Answers a request at once from known data, in any thread; None leaves the request to the loop."""

Feedback = Callable[[Message], None]
"""Called with the progress of a goal."""

Act = Callable[[Message, Feedback], Awaitable[Message]]
"""Carries out the goal of an action and returns its result; if cancelled, it ends when the robot is at rest.

The first feedback marks the start. Until then the goal is PENDING, and the function may refuse it by raising
`GoalRefused`. It fails by raising another `MayaError`: the goal is ABORTED, or PREEMPTED after a stop
(`graph.outcome.run_goal`).
"""


class GoalStatus(IntEnum):
    """State or outcome of a goal (actionlib_msgs/GoalStatus)."""

    PENDING = 0
    ACTIVE = 1
    PREEMPTED = 2
    SUCCEEDED = 3
    ABORTED = 4
    REJECTED = 5
    PREEMPTING = 6
    RECALLING = 7
    RECALLED = 8
    LOST = 9


class GoalRefused(Exception):
    """Refusal of a goal before it starts; `result` holds the code and the reason."""

    def __init__(self, result: Message) -> None:
        super().__init__(str(result.get("message", "")))
        self.result = result


@dataclass(frozen=True, slots=True)
class GoalResult:
    """Outcome and result of a goal; the result is empty if the server vanished (`LOST`)."""

    outcome: GoalStatus
    result: Message


class GraphHandle(Protocol):
    """A resource of a graph, held until it is closed."""

    def close(self) -> None:
        """Release the resource; a second call has no effect."""
        ...


class Publisher(GraphHandle, Protocol):
    """A publisher of a topic."""

    def publish(self, message: Message) -> None:
        """Publish a message without blocking; raises `InvalidMessage`."""
        ...

    @property
    def readers(self) -> int:
        """Number of current subscribers."""
        ...


class Subscription(GraphHandle, Protocol):
    """A subscription to a topic."""

    @property
    def writers(self) -> frozenset[str]:
        """Nodes that publish on the topic now, without nodes that died."""
        ...


class Directory(Protocol):
    """Content of a graph, as rosapi reads it."""

    async def topics(self) -> Mapping[str, str]:
        """Return the type of every topic that has a publisher or a subscriber."""
        ...

    def topic_type(self, topic: str) -> str | None:
        """Return the type of a topic, "" for an unused topic, None if that needs a request to the graph (`topics`)."""
        ...

    async def services(self) -> Mapping[str, str]:
        """Return the type of every service, "" if unknown. A real graph requests the type from every server."""
        ...

    async def service_names(self) -> Sequence[str]:
        """Return the names of all services, without requests to their servers."""
        ...

    async def service_type(self, service: str) -> str:
        """Return the type of one service, "" if no node serves it."""
        ...

    async def service_host(self, service: str) -> str:
        """Return the machine that serves a service, "" if no node serves it."""
        ...

    async def nodes(self) -> Mapping[str, NodeInfo]:
        """Return what every node publishes, subscribes and serves."""
        ...


@dataclass(frozen=True, slots=True)
class NodeInfo:
    """Connections of a node: topics it publishes and subscribes, services it answers."""

    publishes: tuple[str, ...] = ()
    subscribes: tuple[str, ...] = ()
    serves: tuple[str, ...] = ()


class ParameterServer(Protocol):
    """The parameters of a graph, by name ("/maya/speed"); values are plain data."""

    async def get(self, name: str, default: Any = None) -> Any:
        """Return the value at `name` or a dict of the values below it; `default` if none exists."""
        ...

    async def set(self, name: str, value: Any) -> None:
        """Set the value at `name`."""
        ...

    async def delete(self, name: str) -> None:
        """Delete `name`."""
        ...

    async def names(self) -> Sequence[str]:
        """Return the names of all values."""
        ...


class Graph(Protocol):
    """A ROS graph. Types are named as in ROS ("std_msgs/String"); raises `InvalidMessage` and `UnknownInterface`."""

    @property
    def directory(self) -> Directory:
        """Content of the graph."""
        ...

    @property
    def parameters(self) -> ParameterServer:
        """Parameters of the graph."""
        ...

    def advertise(self, topic: str, kind: str, *, latch: bool = False, queue_size: int = 100) -> Publisher:
        """Return a publisher of a topic; a latched topic sends its last message to every later subscriber."""
        ...

    def subscribe(self, topic: str, kind: str, heard: Heard, *, queue_size: int = 100) -> Subscription:
        """Subscribe to a topic; `kind` "" takes the type it has. The oldest messages above `queue_size` are dropped."""
        ...

    def serve(self, service: str, kind: str, answer: Answer, quick: Quick | None = None) -> GraphHandle:
        """Serve a service: `quick` answers at once if it can, otherwise `answer` does."""
        ...

    async def call(self, service: str, request: Request, kind: str = "") -> Message:
        """Return the answer of a service; raises `ServiceFailed` if it fails, or its server is gone."""
        ...

    def expect(self, *services: str) -> None:
        """Look up services before they are called, so that later calls work without a master; return at once."""
        ...

    def act(self, action: str, kind: str, act: Act) -> GraphHandle:
        """Serve an action. Goals may arrive at any time; `act` refuses goals while it is busy."""
        ...

    async def do(self, action: str, kind: str, goal: Message, feedback: Feedback | None = None) -> GoalResult:
        """Send a goal to the server of an action and return its outcome and result.

        Cancelling this call cancels the goal, and ends when the server reports the goal's end. Raises `NodeGone` if no
        node serves the action.
        """
        ...


def by_name(kind: str, fields: Sequence[str], request: Request) -> Message:
    """Return a request of the type `kind` by the names of its `fields`; raises `InvalidMessage` for too many values.

    A list of one object whose keys are fields of the request counts as that request: some clients wrap it so.
    """
    if not isinstance(request, list):
        return request
    if len(request) == 1 and isinstance(request[0], dict) and set(fields).issuperset(request[0]):
        return request[0]
    if len(request) > len(fields):
        raise InvalidMessage(
            name=kind, reason=phrase("it has {count} fields, not {given}", count=len(fields), given=len(request))
        )
    return dict(zip(fields, request, strict=False))


Stamp = dict[str, int]
"""A time or a duration in the form of ROS 1."""

_BILLION = 1_000_000_000


def stamp(seconds: float) -> Stamp:
    """Return `seconds` since the epoch, or a duration, as ROS writes it: whole seconds, and nanoseconds above them."""
    whole, rest = divmod(round(seconds * _BILLION), _BILLION)
    return {"secs": whole, "nsecs": rest}


def header(seconds: float = 0.0, frame: str = "") -> Message:
    """Return the header of a message; for a lookup of frames, a time of 0 means the newest."""
    return {"seq": 0, "stamp": stamp(seconds), "frame_id": frame}


def in_seconds(when: Mapping[str, int]) -> float:
    """Return a time or a duration in seconds."""
    return when["secs"] + when["nsecs"] / _BILLION


def order(when: Mapping[str, int]) -> tuple[int, int]:
    """Return the sort key of a time; (0, 0) means no time."""
    return when["secs"], when["nsecs"]
