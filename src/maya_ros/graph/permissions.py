"""Permissions in a graph: the principal of each command, and a graph that checks commands before it runs them.

It follows the work that a message starts, tasks included, so handlers need not pass it on.
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

    Requests of this process itself are not checked. Questions that are answered at once, and cancels, are
    open to everybody. See `graph.protocol.Graph`.
    """

    def __init__(self, graph: Graph, permit: Permit) -> None:
        self._graph = graph
        self._permit = permit

    @property
    def directory(self) -> Directory:
        """Its topics, services, actions and nodes."""
        return self._graph.directory

    @property
    def parameters(self) -> ParameterServer:
        """Its parameters."""
        return self._graph.parameters

    def advertise(self, topic: str, kind: str, *, latch: bool = False, queue_size: int = 100) -> Publisher:
        """Take a topic to publish on."""
        return self._graph.advertise(topic, kind, latch=latch, queue_size=queue_size)

    def subscribe(self, topic: str, kind: str, heard: Heard, *, queue_size: int = 100) -> Subscription:
        """Subscribe to a topic; a refused command is logged, because no caller waits for an answer."""
        operation = asked_by_topic(topic)
        if operation is Operation.GRAPH:  # it is no command, but information
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
        """Answer a service; a call that is refused fails."""
        operation = asked_by_call(service, Kind.SERVICE)

        async def looked_at(request: Message) -> Message:
            self._permit(operation)
            return await answer(request)

        return self._graph.serve(service, kind, looked_at, quick)

    async def call(self, service: str, request: Request, kind: str = "") -> Message:
        """Return the answer of a service."""
        return await self._graph.call(service, request, kind)

    def expect(self, *services: str) -> None:
        """Find services that will be called, soon."""
        self._graph.expect(*services)

    def act(self, action: str, kind: str, act: Act) -> GraphHandle:
        """Be the server of an action; a goal that is refused is rejected."""
        operation = asked_by_call(action, Kind.ACTION)

        async def looked_at(goal: Message, feedback: Feedback) -> Message:
            try:
                self._permit(operation)
            except MayaError as refusal:
                raise GoalRefused(failure(refusal)) from refusal
            return await act(goal, feedback)

        return self._graph.act(action, kind, looked_at)

    async def do(self, action: str, kind: str, goal: Message, feedback: Feedback | None = None) -> GoalResult:
        """Have a goal carried out and return how it ended."""
        return await self._graph.do(action, kind, goal, feedback)
