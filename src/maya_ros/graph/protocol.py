"""The interface of a ROS graph, whether a real one or one within this process.

Messages are plain data: a dict of field names; arrays are lists, times and durations {"secs", "nsecs"} (as rosbridge
writes them). Everything is called in the running loop, and calls back there.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Protocol

from maya_un.errors import InvalidMessage

Message = dict[str, Any]
"""A message, request, response, goal, result or feedback as plain data."""

Request = Message | list[Any]
"""A request of a service; a list holds the values of its first fields, in their order."""

Heard = Callable[[Message], None]
"""Told of every message on a topic, in order."""

Answer = Callable[[Message], Awaitable[Message]]
"""Answers the request of a service. Raising a `MayaError` is the way to fail; a cancelled one answers nobody."""

Quick = Callable[[Message], Message | None]
"""Answers at once from what is known, in whatever thread, or None: then it is for the loop."""

Feedback = Callable[[Message], None]
"""Told how far a goal has come."""

Act = Callable[[Message, Feedback], Awaitable[Message]]
"""Carries out the goal of an action and returns its result; being cancelled, it ends when the robot is at rest.

Its first feedback says that something begins: until then its goal is PENDING, and it may refuse it by raising
`GoalRefused`. It fails by raising another `MayaError` (ABORTED; what was stopped is PREEMPTED):
`graph.outcome.carried`.
"""


class GoalStatus(IntEnum):
    """How a goal stands or ended (actionlib_msgs/GoalStatus)."""

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
    """A goal is refused before it began; `result` says with which code and why."""

    def __init__(self, result: Message) -> None:
        super().__init__(str(result.get("message", "")))
        self.result = result


@dataclass(frozen=True, slots=True)
class GoalResult:
    """How a goal ended, and its result; of one whose server vanished there is none (`LOST`)."""

    outcome: GoalStatus
    result: Message


class GraphHandle(Protocol):
    """Something taken in a graph until it is given back."""

    def close(self) -> None:
        """Give it back; what is given back twice is given back."""
        ...


class Publisher(GraphHandle, Protocol):
    """A topic that messages can be put on."""

    def publish(self, message: Message) -> None:
        """Put a message on the topic; never blocks. Raises `InvalidMessage`."""
        ...

    @property
    def readers(self) -> int:
        """How many subscribe now."""
        ...


class Subscription(GraphHandle, Protocol):
    """A topic that is listened to."""

    @property
    def writers(self) -> frozenset[str]:
        """The nodes that publish on it now; one that died is not among them."""
        ...


class Directory(Protocol):
    """Content of a graph, as rosapi reads it."""

    async def topics(self) -> Mapping[str, str]:
        """Return the type of every topic that somebody publishes or subscribes."""
        ...

    def topic_type(self, topic: str) -> str | None:
        """Return the type of a topic, "" of one that nobody uses, None where the graph has to be asked (`topics`)."""
        ...

    async def services(self) -> Mapping[str, str]:
        """Return the type of every service, "" where nobody knows. In a real graph this asks every server."""
        ...

    async def service_names(self) -> Sequence[str]:
        """Return the names of all services, without asking their servers."""
        ...

    async def service_type(self, service: str) -> str:
        """Return the type of one service, "" where nobody serves it."""
        ...

    async def service_host(self, service: str) -> str:
        """Return the machine that serves a service, "" where nobody serves it."""
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
        """Return the value at `name`, a dict for a name that others begin with."""
        ...

    async def set(self, name: str, value: Any) -> None:
        """Set the value at `name`."""
        ...

    async def delete(self, name: str) -> None:
        """Forget `name`."""
        ...

    async def names(self) -> Sequence[str]:
        """Return the names of all values."""
        ...


class Graph(Protocol):
    """A ROS graph. Types are named as in ROS ("std_msgs/String"); raises `InvalidMessage` and `UnknownInterface`."""

    @property
    def directory(self) -> Directory:
        """Its content."""
        ...

    @property
    def parameters(self) -> ParameterServer:
        """Its parameters."""
        ...

    def advertise(self, topic: str, kind: str, *, latch: bool = False, queue_size: int = 100) -> Publisher:
        """Take a topic to publish on; a latched one hands its last message to whoever subscribes later."""
        ...

    def subscribe(self, topic: str, kind: str, heard: Heard, *, queue_size: int = 100) -> Subscription:
        """Listen to a topic; `kind` "" takes the type it has. The oldest beyond `queue_size` are dropped."""
        ...

    def serve(self, service: str, kind: str, answer: Answer, quick: Quick | None = None) -> GraphHandle:
        """Answer a service."""
        ...

    async def call(self, service: str, request: Request, kind: str = "") -> Message:
        """Return the answer of a service; raises `ServiceFailed` where it fails, or nobody answers any more."""
        ...

    def expect(self, *services: str) -> None:
        """Look up services before they are called, so that later calls work without a master."""
        ...

    def act(self, action: str, kind: str, act: Act) -> GraphHandle:
        """Be the server of an action. Goals come as they come: whoever acts refuses what comes while it is busy."""
        ...

    async def do(self, action: str, kind: str, goal: Message, feedback: Feedback | None = None) -> GoalResult:
        """Have a goal carried out and return how it ended.

        Being cancelled cancels the goal, and ends when its server says that it has ended. Raises `NodeGone` where
        nobody serves the action.
        """
        ...


def by_name(kind: str, fields: Sequence[str], request: Request) -> Message:
    """Return a request of the type `kind` by the names of its `fields`; raises `InvalidMessage` for too many values.

    A list of one object that names fields of the request is that request: some clients wrap it so.
    """
    if not isinstance(request, list):
        return request
    if len(request) == 1 and isinstance(request[0], dict) and set(fields).issuperset(request[0]):
        return request[0]
    if len(request) > len(fields):
        raise InvalidMessage(name=kind, reason=f"it has {len(fields)} fields, not {len(request)}")
    return dict(zip(fields, request, strict=False))


Stamp = dict[str, int]
"""A time or a duration as ROS 1 has them."""

_BILLION = 1_000_000_000


def stamp(seconds: float) -> Stamp:
    """Return `seconds` since the epoch, or a duration, as ROS writes it: whole seconds, and nanoseconds above them."""
    whole, rest = divmod(round(seconds * _BILLION), _BILLION)
    return {"secs": whole, "nsecs": rest}


def header(seconds: float = 0.0, frame: str = "") -> Message:
    """Return the header of a message; a time of 0 means "whatever is newest" to whoever looks up frames."""
    return {"seq": 0, "stamp": stamp(seconds), "frame_id": frame}


def in_seconds(when: Mapping[str, int]) -> float:
    """Return a time or a duration in seconds."""
    return when["secs"] + when["nsecs"] / _BILLION


def order(when: Mapping[str, int]) -> tuple[int, int]:
    """Return what times are compared by; (0, 0) says no time."""
    return when["secs"], when["nsecs"]
