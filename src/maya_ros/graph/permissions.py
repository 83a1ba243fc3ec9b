"""Permissions in a graph: the principal of each command, and a graph that checks commands before it runs them.

The principal follows the work that a message starts, tasks included, so handlers need not pass it on.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from maya_ros.graph.outcome import failure
from maya_ros.graph.protocol import (
    Act,
    Answer,
    Directory,
    Feedback,
    GoalRefused,
    GoalResult,
    Graph,
    GraphHandle,
    Heard,
    Message,
    ParameterServer,
    Publisher,
    Quick,
    Request,
    Subscription,
)
from maya_ros.graph.table import Kind, asked_by_call, asked_by_topic
from maya_un.errors import MayaError
from maya_un.service.access.operations import ROS, Caller, Operation

Who = Callable[[], Caller]
"""Returns the present principal."""

_CALLER: ContextVar[Caller] = ContextVar("caller", default=ROS)


def caller() -> Caller:
    """Return the principal of this command: the graph itself (`ROS`) unless another one is set."""
    return _CALLER.get()


@contextmanager
def acting_for(who: Caller) -> Iterator[None]:
    """Make `who` the principal of all work that begins in the block."""
    token = _CALLER.set(who)
    try:
        yield
    finally:
        _CALLER.reset(token)


Permit = Callable[[Operation], None]
"""Raises a `MayaError` if an operation may not be requested."""

_log = logging.getLogger("maya_ros.graph")


def anything(_: Operation) -> None:
    """Permit everything, for a graph without users."""


class PermittedGraph:
    """A `graph` whose services, actions and topics accept only requests that `permit` allows.

    Requests of this process itself are not checked. Any client may cancel, and may call what a service answers at once.
    See `graph.protocol.Graph`.
    """

    def __init__(self, graph: Graph, permit: Permit) -> None:
        self._graph = graph
        self._permit = permit

    @property
    def directory(self) -> Directory:
        """Topics, services, actions and nodes of the graph."""
        return self._graph.directory

    @property
    def parameters(self) -> ParameterServer:
        """Parameters of the graph."""
        return self._graph.parameters

    def advertise(self, topic: str, kind: str, *, latch: bool = False, queue_size: int = 100) -> Publisher:
        """Return a publisher of a topic."""
        return self._graph.advertise(topic, kind, latch=latch, queue_size=queue_size)

    def subscribe(self, topic: str, kind: str, heard: Heard, *, queue_size: int = 100) -> Subscription:
        """Subscribe to a topic; a refused command is logged, because no caller waits for an answer."""
        operation = asked_by_topic(topic)
        if operation is Operation.GRAPH:  # information, not a command
            return self._graph.subscribe(topic, kind, heard, queue_size=queue_size)

        def looked_at(message: Message) -> None:
            try:
                self._permit(operation)
            except MayaError as refusal:
                _log.warning("%s: %s %s", topic, refusal.code, refusal)
            else:
                heard(message)

        return self._graph.subscribe(topic, kind, looked_at, queue_size=queue_size)

    def serve(self, service: str, kind: str, answer: Answer, quick: Quick | None = None) -> GraphHandle:
        """Serve a service; a refused call fails."""
        operation = asked_by_call(service, Kind.SERVICE)

        async def looked_at(request: Message) -> Message:
            self._permit(operation)
            return await answer(request)

        return self._graph.serve(service, kind, looked_at, quick)

    async def call(self, service: str, request: Request, kind: str = "") -> Message:
        """Return the answer of a service."""
        return await self._graph.call(service, request, kind)

    def expect(self, *services: str) -> None:
        """Look up services before they are called."""
        self._graph.expect(*services)

    def act(self, action: str, kind: str, act: Act) -> GraphHandle:
        """Serve an action; a refused goal is rejected."""
        operation = asked_by_call(action, Kind.ACTION)

        async def looked_at(goal: Message, feedback: Feedback) -> Message:
            try:
                self._permit(operation)
            except MayaError as refusal:
                raise GoalRefused(failure(refusal)) from refusal
            return await act(goal, feedback)

        return self._graph.act(action, kind, looked_at)

    async def do(self, action: str, kind: str, goal: Message, feedback: Feedback | None = None) -> GoalResult:
        """Send a goal to its server and return its outcome and result."""
        return await self._graph.do(action, kind, goal, feedback)
