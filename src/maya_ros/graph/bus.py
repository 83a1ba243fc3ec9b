"""A graph within one process and one loop, without ROS: topics, services, actions, parameters.

    bus = Bus()
    node = bus.node("hw_simulator")             # a node, under its name in the manual
    position = node.advertise("/maya_position", "geometry_msgs/Point", latch=True)

Actions are the topics X/goal, X/cancel, X/status, X/feedback and X/result, as in ROS 1. A client may use these topics
directly or call `do`. All subscribers share a received message and must not change it.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from dmc41x3.i18n import phrase
from maya_ros.graph import types
from maya_ros.graph.goals import GoalServer, GoalTopics
from maya_ros.graph.permissions import Who, acting_for
from maya_ros.graph.protocol import (
    Act,
    Answer,
    Directory,
    Feedback,
    GoalResult,
    GoalStatus,
    GraphHandle,
    Heard,
    Message,
    NodeInfo,
    Publisher,
    Quick,
    Request,
    Stamp,
    Subscription,
    by_name,
    stamp,
)
from maya_ros.graph.topics import TopicInlet, TopicNode, TopicOutlet, Topics, caller_of
from maya_un.cancellation import cancel_once, is_caller_cancelled, run_to_rest
from maya_un.errors import InvalidMessage, MayaError, NodeGone, ServiceFailed, UnknownInterface


class BusParameters:
    """Values by name; a name with values below it is a dict of them, as on ROS' parameter server."""

    def __init__(self) -> None:
        self._tree: dict[str, Any] = {}

    async def get(self, name: str, default: Any = None) -> Any:
        """Return the value at `name` or a dict of the values below it; `default` if none exists."""
        here: Any = self._tree
        for part in _parts(name):
            if not isinstance(here, Mapping) or part not in here:
                return default
            here = here[part]
        return _copied(here)

    async def set(self, name: str, value: Any) -> None:
        """Set the value at `name`; a dict replaces all values below `name`."""
        parts = _parts(name)
        if not parts:
            self._tree = _copied(value)
            return
        here = self._tree
        for part in parts[:-1]:
            below = here.get(part)
            if not isinstance(below, dict):
                here[part] = below = {}
            here = below
        here[parts[-1]] = _copied(value)

    async def delete(self, name: str) -> None:
        """Delete `name` and all values below it, if they exist."""
        parts = _parts(name)
        above = await self._at(parts[:-1])
        if parts and above is not None:
            above.pop(parts[-1], None)
        elif not parts:
            self._tree = {}

    async def names(self) -> Sequence[str]:
        """Return the names of all values; an empty group has none, as on ROS' parameter server."""
        return list(_names("", self._tree))

    async def _at(self, parts: Sequence[str]) -> dict[str, Any] | None:
        here: Any = self._tree
        for part in parts:
            here = here.get(part) if isinstance(here, dict) else None
        return here if isinstance(here, dict) else None


def _parts(name: str) -> list[str]:
    return [part for part in name.split("/") if part]


def _names(above: str, tree: Mapping[str, Any]) -> Sequence[str]:
    found: list[str] = []
    for key, value in tree.items():
        name = f"{above}/{key}"
        found += _names(name, value) if isinstance(value, Mapping) else [name]
    return found


def _copied(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _copied(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_copied(one) for one in value]
    return value


UNBOUNDED = 0
"""Queue size that drops nothing."""

_STATUS = "actionlib_msgs/GoalStatusArray"
_CANCEL = "actionlib_msgs/GoalID"
_HERE = "127.0.0.1"


def named(name: str) -> str:
    """Return a name of the graph with a leading slash."""
    return "/" + name.strip("/")


class Bus:
    """The graph that its nodes share. `clock` returns the time [s] for message stamps."""

    def __init__(self, clock: Callable[[], float] | None = None) -> None:
        self._clock = asyncio.get_running_loop().time if clock is None else clock
        self.topics = Topics(self.now)
        self.services: dict[str, BusService] = {}
        self.actions: dict[str, BusAction] = {}
        self.nodes: list[BusNode] = []
        self.parameters = BusParameters()
        self.directory = BusDirectory(self)

    def node(self, name: str, who: Who | None = None) -> BusNode:
        """Return a new node; nodes may share a name, but each ends separately.

        `who` returns the principal for whom the node acts; without it, the node acts for the sender of the command.
        """
        node = BusNode(self, named(name), who)
        self.nodes.append(node)
        return node

    def now(self) -> Stamp:
        """Return the present time."""
        return stamp(self._clock())


class BusService:
    """A service that a node serves."""

    def __init__(self, node: BusNode, name: str, kind: str, answer: Answer, quick: Quick | None) -> None:
        self.node = node
        self.kind = kind
        self._name = name
        self._answer = answer
        self._quick = quick
        self._request, self._response = types.halves(kind)
        self._tasks: set[asyncio.Task[Message]] = set()

    async def call(self, request: Request) -> Message:
        """Return the answer; raises `InvalidMessage` for an invalid request, and `ServiceFailed`."""
        named_values = by_name(self._request, types.fields(self._request), request)
        asked = types.conform(self._request, named_values, stamp=self.node.bus.now())
        try:
            answer = None if self._quick is None else self._quick(asked)
            said = answer if answer is not None else await self._answered(asked)
            return types.conform(self._response, said, stamp=self.node.bus.now())
        except MayaError as error:
            raise ServiceFailed(service=self._name, reason=str(error)) from error

    async def _answered(self, asked: Message) -> Message:
        """Return the answer of a separate task; if the caller is cancelled, cancel the task and wait for its end."""
        task = asyncio.ensure_future(self._answer(asked))
        self._tasks.add(task)  # type: ignore[arg-type]
        try:
            return await run_to_rest(task)
        except asyncio.CancelledError:
            if is_caller_cancelled():
                raise
            raise ServiceFailed(service=self._name, reason="it no longer answers") from None
        finally:
            self._tasks.discard(task)  # type: ignore[arg-type]

    def close(self) -> None:
        """Stop serving, and cancel requests under way."""
        services = self.node.bus.services
        if services.get(self._name) is self:
            del services[self._name]
        self.node.drop(self)
        for task in self._tasks:
            cancel_once(task)


class BusAction:
    """The server of an action and its topics. `gone` completes when it has stopped serving."""

    def __init__(self, node: BusNode, name: str, kind: str, act: Act) -> None:
        self.node = node
        self.kind = kind
        self._name = name
        self.gone: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        voices = GoalTopics(
            node.advertise(f"{name}/status", _STATUS, latch=True),
            node.advertise(f"{name}/feedback", f"{kind}ActionFeedback"),
            node.advertise(f"{name}/result", f"{kind}ActionResult"),
        )
        self.server = GoalServer(name, kind, act, voices, node.bus.now, self._over)
        topics = node.bus.topics
        self._ears = [
            topics.listen(f"{name}/goal", f"{kind}ActionGoal", self._take, node, UNBOUNDED),
            topics.listen(f"{name}/cancel", _CANCEL, lambda request, _: self.server.cancel(request), node, UNBOUNDED),
        ]

    def close(self) -> None:
        """Take no more goals and cancel those under way; their results are still published."""
        self._deaf()
        self.server.close()

    def kill(self) -> None:
        """Stop serving as if the node had died: cancel all goals without publishing their results."""
        self._deaf()
        self.server.kill()

    def _take(self, goal: Message, source: TopicNode) -> None:
        results = self.node.bus.topics.find(f"{self._name}/result")
        waits = results is not None and any(inlet.member is source for inlet in results.inlets)
        self.server.take(goal, source if waits else None)

    def _deaf(self) -> None:
        if self.node.bus.actions.get(self._name) is self:
            del self.node.bus.actions[self._name]
        for ear in self._ears:
            ear.close()

    def _over(self) -> None:
        self.node.drop(self)
        if not self.gone.done():
            self.gone.set_result(None)


class BusNode:
    """A node of the graph; see `protocol.Graph`.

    When the node ends, its services and goals are cancelled without an answer, and goals that it waits for are
    cancelled as well.
    """

    def __init__(self, bus: Bus, name: str, who: Who | None = None) -> None:
        self.bus = bus
        self.name = name
        self.who = who
        self._held: list[Any] = []
        self._goals = 0
        self._lost: asyncio.Future[None] = asyncio.get_running_loop().create_future()

    @property
    def directory(self) -> Directory:
        """The content of the graph."""
        return self.bus.directory

    @property
    def parameters(self) -> BusParameters:
        """The parameters of the graph."""
        return self.bus.parameters

    def advertise(self, topic: str, kind: str, *, latch: bool = False, queue_size: int = 100) -> Publisher:
        """Return a publisher of a topic; see `protocol.Graph`. Messages wait at their subscribers, not here."""
        del queue_size
        return self.bus.topics.advertise(named(topic), kind, self, latch=latch)

    def subscribe(self, topic: str, kind: str, heard: Heard, *, queue_size: int = 100) -> Subscription:
        """Subscribe to a topic; see `protocol.Graph`."""
        return self.bus.topics.listen(named(topic), kind, lambda message, _: heard(message), self, queue_size)

    def serve(self, service: str, kind: str, answer: Answer, quick: Quick | None = None) -> GraphHandle:
        """Serve a service, in place of a former server."""
        name = named(service)
        held = self.bus.services[name] = BusService(self, name, kind, answer, quick)
        self.keep(held)
        return held

    async def call(self, service: str, request: Request, kind: str = "") -> Message:
        """Return the answer of a service; raises `UnknownInterface` if no node serves it; see `protocol.Graph`.

        Cancelling this call cancels the request, and ends when the work of the request has ended.
        """
        name = named(service)
        held = self.bus.services.get(name)
        if held is None:
            raise UnknownInterface(form="service", name=name)
        if kind not in ("", held.kind):
            raise InvalidMessage(name=kind, reason=phrase("the service {name} is a {kind}", name=name, kind=held.kind))
        with acting_for(caller_of(self)):
            return await held.call(request)

    def expect(self, *services: str) -> None:
        """Do nothing: this graph knows all services; see `protocol.Graph`."""

    def act(self, action: str, kind: str, act: Act) -> GraphHandle:
        """Serve an action; a former server takes no more goals."""
        name = named(action)
        before = self.bus.actions.get(name)
        if before is not None:
            before.close()
        held = self.bus.actions[name] = BusAction(self, name, kind, act)
        self.keep(held)
        return held

    async def do(self, action: str, kind: str, goal: Message, feedback: Feedback | None = None) -> GoalResult:
        """Send a goal to its server and return its outcome and result; see `protocol.Graph`."""
        name = named(action)
        server = self.bus.actions.get(name)
        if server is None or server.kind != kind:
            raise NodeGone(node=name)
        self._goals += 1
        now = self.bus.now()
        own = f"{self.name}-{self._goals}-{id(self):x}-{now['secs']}.{now['nsecs']:09d}"
        ended: asyncio.Future[GoalResult] = asyncio.get_running_loop().create_future()

        def heard_result(message: Message) -> None:
            if message["status"]["goal_id"]["id"] == own and not ended.done():
                ended.set_result(GoalResult(GoalStatus(message["status"]["status"]), message["result"]))

        def heard_feedback(message: Message) -> None:
            if message["status"]["goal_id"]["id"] == own and feedback is not None and not ended.done():
                feedback(message["feedback"])

        held: list[GraphHandle] = [
            self.subscribe(f"{name}/result", f"{kind}ActionResult", heard_result, queue_size=UNBOUNDED),
            self.subscribe(f"{name}/feedback", f"{kind}ActionFeedback", heard_feedback, queue_size=UNBOUNDED),
        ]
        goals = self.advertise(f"{name}/goal", f"{kind}ActionGoal")
        cancels = self.advertise(f"{name}/cancel", _CANCEL)
        try:
            goals.publish({"goal_id": {"stamp": now, "id": own}, "goal": goal})
            await run_to_rest(self._until(ended, server), lambda: cancels.publish({"id": own}))
            return ended.result() if ended.done() else GoalResult(GoalStatus.LOST, {})
        finally:
            for one in (*held, goals, cancels):
                one.close()

    def close(self) -> None:
        """End as a node that dies: publish nothing more, and bring all work to rest."""
        if self not in self.bus.nodes:
            return
        self.bus.nodes.remove(self)
        if not self._lost.done():
            self._lost.set_result(None)
        for held in self._held[::-1]:
            if isinstance(held, BusAction):
                held.kill()
            else:
                held.close()
        for action in self.bus.actions.values():
            action.server.forsake(self)

    def keep(self, held: TopicOutlet | TopicInlet | BusService | BusAction) -> None:
        """Register a resource that is closed when the node ends."""
        self._held.append(held)

    def drop(self, held: TopicOutlet | TopicInlet | BusService | BusAction) -> None:
        """Unregister a closed resource."""
        if held in self._held:
            self._held.remove(held)

    async def _until(self, ended: asyncio.Future[GoalResult], server: BusAction) -> None:
        """Wait until a goal has ended, its server has stopped serving, or this node has ended."""
        await asyncio.wait({ended, server.gone, self._lost}, return_when=asyncio.FIRST_COMPLETED)
        if not ended.done():  # a result published last is delivered in the loop's next turn
            await asyncio.sleep(0)
            await asyncio.sleep(0)


class BusDirectory:
    """Content of a graph within one process; see `protocol.Directory`."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus

    async def topics(self) -> Mapping[str, str]:
        """Return the type of every topic that has a publisher or a subscriber."""
        return self._bus.topics.kinds

    def topic_type(self, topic: str) -> str:
        """Return the type of a topic, "" for an unused topic."""
        return self._bus.topics.kinds.get(named(topic), "")

    async def services(self) -> Mapping[str, str]:
        """Return the type of every service."""
        return {name: service.kind for name, service in self._bus.services.items()}

    async def service_names(self) -> Sequence[str]:
        """Return the names of all services."""
        return tuple(self._bus.services)

    async def service_type(self, service: str) -> str:
        """Return the type of one service, "" if no node serves it."""
        found = self._bus.services.get(named(service))
        return "" if found is None else found.kind

    async def service_host(self, service: str) -> str:
        """Return the loopback address for every service, "" if no node serves it."""
        return _HERE if named(service) in self._bus.services else ""

    async def nodes(self) -> Mapping[str, NodeInfo]:
        """Return what every node publishes, subscribes and serves; nodes that share a name are combined."""
        found = {node.name: (set[str](), set[str](), set[str]()) for node in self._bus.nodes}
        for name in self._bus.topics.kinds:
            topic = self._bus.topics.find(name)
            assert topic is not None
            for outlet in topic.outlets:
                found[outlet.member.name][0].add(name)
            for inlet in topic.inlets:
                found[inlet.member.name][1].add(name)
        for name, service in self._bus.services.items():
            found[service.node.name][2].add(name)
        return {name: NodeInfo(*(tuple(sorted(names)) for names in does)) for name, does in found.items()}
