"""Access of one client: its sign-in and its present rights, and a graph that checks them for each request."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Protocol

from maya_ros.graph.protocol import (
    Act,
    Answer,
    Directory,
    Feedback,
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
from maya_ros.graph.table import CALL_OPERATION, MAYA_COMMAND, Kind, asked_by_call, asked_by_topic
from maya_un.client.operations import operation_named
from maya_un.errors import InvalidRequest, MayaError, NotSignedIn
from maya_un.http.connections import RightsSource
from maya_un.process.spec.json_object import decode_object
from maya_un.robot.primitives.can_teleop import CanTeleop
from maya_un.service.access.operations import BYSTANDER, ROS, RULES, STOPPING, Caller, Operation, allowed, require


class TokenChecker(RightsSource, Protocol):
    """Authenticates tokens; implemented by `http.bridge.Bridge`."""

    async def caller(
        self, authorization: str | None, lease: str, source: str, *, loopback: bool, stopping: bool, alone: Caller = ROS
    ) -> Caller:
        """Return the caller of a token; `alone` for a local client while no users exist.

        Raises `NotSignedIn`, `TooManyRequests`.
        """
        ...


Asks = Callable[[str], Operation]
"""Returns the operation that using a name of the graph needs."""


class Guest:
    """A client and its source; a client on the robot's machine (`local`) may always stop.

    `lease` is the control lease that it sent, "" without one.
    """

    def __init__(self, source: str = "", *, local: bool = True, lease: str = "") -> None:
        self.source = source
        self.local = local
        self.left = False
        self._lease = lease
        self._caller: Caller | None = None
        self._why: MayaError = NotSignedIn(reason="it has no token")

    @property
    def known(self) -> Caller | None:
        """The caller, None while unknown."""
        return self._caller

    @property
    def caller(self) -> Caller:
        """The caller of its requests; an unknown one may only stop."""
        return self._caller or replace(BYSTANDER, source=self.source)

    def require(self, operation: Operation) -> None:
        """Raise `NotSignedIn` or `NotAllowed` if the client may not request `operation`."""
        if self._caller is not None:
            require(self._caller, operation)
        elif not (self.local and operation in STOPPING):
            raise self._why

    async def asked_by(self, service: str, request: Request) -> Operation:
        """Return the operation that a call needs; `can_teleop` only reads."""
        task = _field(request, "task")
        question = isinstance(task, dict) and task.get("command") == CanTeleop.command
        return Operation.READ if question and service == MAYA_COMMAND.name else asked_by_call(service, Kind.SERVICE)

    def name_of(self, name: str, asks: Asks) -> str:
        """Return the name whose right a name of the graph needs: the name itself."""
        del asks
        return name

    async def introduce(self, admission: TokenChecker, token: str | None) -> None:
        """Sign in with a token; raises `NotSignedIn`, `TooManyRequests`, and then the client is unknown."""
        self._caller = None
        shown = None if token is None else f"Bearer {token}"
        try:
            found = await admission.caller(
                shown, self._lease, self.source, loopback=self.local, stopping=False, alone=ROS
            )
        except MayaError as refusal:
            self._why = refusal
            raise
        self._caller = _at_rights(found)

    def outlasts(self, now: Caller | MayaError) -> bool:
        """Apply the present rights; return whether none are lost."""
        before, self._caller = self._caller, None if isinstance(now, MayaError) else _at_rights(now)
        if isinstance(now, MayaError):
            self._why = now
        return before is None or (self._caller is not None and self._caller.role >= before.role)


class SharedGuest(Guest):
    """A client for whom the graph acts as its own user, because no message of the graph names its sender.

    So it needs the rights to what is done in the name of that user. Its lease does not go along: to drive, it needs a
    role that may take the lease. `asked` returns the operations of /call_operation by name; it may take seconds.
    """

    def __init__(
        self,
        asked: Callable[[], Awaitable[Mapping[str, Operation]]],
        source: str = "",
        *,
        local: bool = True,
        lease: str = "",
    ) -> None:
        super().__init__(source, local=local, lease=lease)
        self._asked = asked

    def require(self, operation: Operation) -> None:
        """Raise `NotSignedIn` or `NotAllowed` if the client may not request `operation` for the graph's user."""
        super().require(_FOR_ANOTHER.get(operation, operation))
        if RULES[operation].drives:
            super().require(Operation.LEND)

    async def asked_by(self, service: str, request: Request) -> Operation:
        """Return the operation that a call needs; raises `InvalidRequest` for an unknown one of /call_operation."""
        if service != CALL_OPERATION.name:
            return await super().asked_by(service, request)
        name = _field(request, "operation")
        if not isinstance(name, str):
            raise InvalidRequest(key="operation", reason="it must be a text")
        if name in STOPS:  # a stop does not wait for the others to be known
            return STOPS[name]
        operation_named(name)
        if name == "take_lease" and _arguments(request).get("force"):
            return Operation.BREAK
        return (await self._asked())[name]

    def name_of(self, name: str, asks: Asks) -> str:
        """Return the end of a name that is in the table, the name itself if there is none.

        The graph can contain another Maya in a namespace, which also carries out requests of the graph's user.
        """
        ends = (name[place:] for place, sign in enumerate(name) if sign == "/")
        return next((end for end in ends if asks(end) is not Operation.GRAPH), name)


STOPS: Mapping[str, Operation] = {"stop": Operation.STOP, "abort": Operation.ABORT}
"""The operations of /call_operation that stop the robot."""

_FOR_ANOTHER: Mapping[Operation, Operation] = {
    Operation.PROPOSE: Operation.SUBMIT,
    Operation.LEASE: Operation.LEND,
    Operation.RENEW: Operation.LEND,
    Operation.ME: Operation.USERS,
}
"""The operations that jobs, a lease and an account of another user need instead of those for one's own."""


def _at_rights(caller: Caller) -> Caller:
    """Return the caller for a protocol that has no message for the lease.

    While the lease is free, a role that may take it drives for each command; others need a lent lease.
    """
    if caller.name == ROS.name:
        return replace(ROS, lease=caller.lease)
    return replace(caller, implicit=allowed(caller.role, Operation.LEND) and not caller.lease)


_CANCEL = "/cancel"


class RestrictedGraph:
    """A `graph` for one `guest`; see `graph.protocol.Graph`.

    Every method raises `NotSignedIn` and `NotAllowed` as well. Every message is checked again, because rights may have
    ended.
    """

    def __init__(self, graph: Graph, guest: Guest) -> None:
        self._graph = graph
        self._guest = guest
        self._parameters = _RestrictedParameters(graph.parameters, guest)

    @property
    def directory(self) -> Directory:
        """Content of the graph."""
        self._guest.require(Operation.READ)
        return self._graph.directory

    @property
    def parameters(self) -> ParameterServer:
        """Parameters of the graph."""
        return self._parameters

    def advertise(self, topic: str, kind: str, *, latch: bool = False, queue_size: int = 100) -> Publisher:
        """Return a publisher of a topic. A client that disconnected may still cancel its goals."""

        def check() -> None:
            if not (self._guest.left and topic.endswith(_CANCEL)):
                self._guest.require(operation)

        operation = asked_by_topic(self._guest.name_of(_whole(topic), asked_by_topic))
        check()
        return _RestrictedPublisher(self._graph.advertise(topic, kind, latch=latch, queue_size=queue_size), check)

    def subscribe(self, topic: str, kind: str, heard: Heard, *, queue_size: int = 100) -> Subscription:
        """Subscribe to a topic."""
        self._guest.require(Operation.READ)
        return self._graph.subscribe(topic, kind, heard, queue_size=queue_size)

    def serve(self, service: str, kind: str, answer: Answer, quick: Quick | None = None) -> GraphHandle:
        """Serve a service."""
        self._guest.require(Operation.GRAPH)
        return self._graph.serve(service, kind, answer, quick)

    async def call(self, service: str, request: Request, kind: str = "") -> Message:
        """Return the answer of a service."""
        name = self._guest.name_of(_whole(service), partial(asked_by_call, form=Kind.SERVICE))
        self._guest.require(await self._guest.asked_by(name, request))
        return await self._graph.call(service, request, kind)

    def expect(self, *services: str) -> None:
        """Look up services before they are called."""
        self._graph.expect(*services)

    def act(self, action: str, kind: str, act: Act) -> GraphHandle:
        """Serve an action."""
        self._guest.require(Operation.GRAPH)
        return self._graph.act(action, kind, act)

    def require_action(self, action: str) -> None:
        """Raise the reason if the guest may not send goals to an action."""
        asks = partial(asked_by_call, form=Kind.ACTION)
        self._guest.require(asks(self._guest.name_of(_whole(action), asks)))

    async def do(self, action: str, kind: str, goal: Message, feedback: Feedback | None = None) -> GoalResult:
        """Send a goal to its server and return its outcome and result."""
        self.require_action(action)
        return await self._graph.do(action, kind, goal, feedback)


class _RestrictedPublisher:
    def __init__(self, publisher: Publisher, check: Callable[[], None]) -> None:
        self._publisher = publisher
        self._check = check

    @property
    def readers(self) -> int:
        """Number of current subscribers."""
        return self._publisher.readers

    def publish(self, message: Message) -> None:
        """Publish a message."""
        self._check()
        self._publisher.publish(message)

    def close(self) -> None:
        """Stop publishing."""
        self._publisher.close()


class _RestrictedParameters:
    def __init__(self, parameters: ParameterServer, guest: Guest) -> None:
        self._all = parameters
        self._guest = guest

    async def get(self, name: str, default: Any = None) -> Any:
        """Return the value at `name`."""
        self._guest.require(Operation.READ)
        return await self._all.get(name, default)

    async def set(self, name: str, value: Any) -> None:
        """Set the value at `name`."""
        self._guest.require(Operation.GRAPH)
        await self._all.set(name, value)

    async def delete(self, name: str) -> None:
        """Delete `name`."""
        self._guest.require(Operation.GRAPH)
        await self._all.delete(name)

    async def names(self) -> Sequence[str]:
        """Return the names of all values."""
        self._guest.require(Operation.READ)
        return await self._all.names()


def _field(request: Request, name: str, place: int = 0) -> Any:
    """Return a field of a request, the one at `place` if its values have no names; None if it is missing."""
    if isinstance(request, dict):
        return request.get(name)
    return request[place] if place < len(request) else None


def _arguments(request: Request) -> Mapping[str, Any]:
    """Return the arguments of /call_operation, as its server reads them; raises `InvalidRequest`."""
    text = _field(request, "arguments", 1)
    if not isinstance(text, str | None):
        raise InvalidRequest(key="arguments", reason="it must be a text")
    return decode_object(text.encode("utf-8", "surrogatepass")) if text and text.strip() else {}


def _whole(name: str) -> str:
    return "/" + name.strip("/")
