"""A real ROS graph, by rospy, with the same interface as the graph within a process (`graph.bus`)."""

from __future__ import annotations

import asyncio

from dmc41x3.i18n import phrase
from maya_ros.graph.protocol import (
    Act,
    Answer,
    Feedback,
    GoalResult,
    GraphHandle,
    Heard,
    Message,
    Publisher,
    Quick,
    Request,
    Subscription,
)
from maya_ros.ros1.actions import ActionClient, RosAction
from maya_ros.ros1.master import REACH, LoopCalls, Registrar, RosDirectory, RosParameters, whole
from maya_ros.ros1.services import Calls, RosService
from maya_ros.ros1.topics import LINGER, RosPublisher, RosSubscription
from maya_un.errors import InvalidRequest, NodeGone, UnknownInterface


class RosGraph:
    """The graph that this process's node takes part in (`graph.protocol.Graph`), in the running loop.

    The node must have been made (`rospy.init_node`). Names are the manual's (`master.whole`). `speed` is how fast the
    loop's clock runs. No call waits in the loop for the master: topics, services and actions are registered a moment
    later, in order (`registered`).
    """

    def __init__(self, *, speed: float = 1.0) -> None:
        self._loop = asyncio.get_running_loop()
        self._post = LoopCalls(self._loop)
        self._speed = speed
        self._registrar = Registrar(speed)
        self._directory = RosDirectory(self._registrar.settled)
        self._parameters = RosParameters()
        self._calls = Calls()
        self._clients: dict[tuple[str, str], ActionClient] = {}
        self._actions: list[RosAction] = []
        self._served: dict[str, RosService] = {}

    async def registered(self) -> None:
        """Wait until the master knows all registrations; without a master, until it is back."""
        await self._registrar.settled()

    @property
    def directory(self) -> RosDirectory:
        """Content of the graph."""
        return self._directory

    @property
    def parameters(self) -> RosParameters:
        """Parameters of the graph."""
        return self._parameters

    def advertise(self, topic: str, kind: str, *, latch: bool = False, queue_size: int = 100) -> Publisher:
        """Return a publisher of a topic."""
        return RosPublisher(self._registrar, whole(topic), kind, latch=latch, queue_size=queue_size)

    def subscribe(self, topic: str, kind: str, heard: Heard, *, queue_size: int = 100) -> Subscription:
        """Subscribe to a topic, whose type must be given: this does not call the master (`directory` does)."""
        if not kind:
            raise UnknownInterface(form="topic", name=topic)
        name = whole(topic)
        return RosSubscription(self._registrar, self._post, name, kind, lambda message, _: heard(message), queue_size)

    def serve(self, service: str, kind: str, answer: Answer, quick: Quick | None = None) -> GraphHandle:
        """Serve a service; `quick` runs in a thread of rospy. If the client disconnects, the answer is cancelled.

        Raises `InvalidRequest` if this node serves one of that name already.
        """
        name = whole(service)
        if name in self._served and self._served[name].open:
            raise InvalidRequest(key="service", reason=phrase("{name} is served already", name=name))
        held = self._served[name] = RosService(self._registrar, self._loop, service, kind, answer, quick)
        return held

    async def call(self, service: str, request: Request, kind: str = "") -> Message:
        """Return the answer of a service; raises `ServiceFailed` if it fails, or its server is gone."""
        if not kind:
            await self._registrar.settled(REACH)  # the service may be a new one of this node
        return await self._calls.call(service, request, kind)

    def expect(self, *services: str) -> None:
        """Look up services before they are called, in a thread; their later calls need no master."""
        self._calls.expect(*services)

    def act(self, action: str, kind: str, act: Act) -> GraphHandle:
        """Serve an action; raises `InvalidRequest` if this node serves it already."""
        name = whole(action)
        if any(one.name == name and one.open for one in self._actions):
            raise InvalidRequest(key="action", reason=phrase("{name} is served already", name=name))
        self._actions.append(RosAction(self._registrar, self._post, name, kind, act, self._speed))
        return self._actions[-1]

    async def do(self, action: str, kind: str, goal: Message, feedback: Feedback | None = None) -> GoalResult:
        """Send a goal to its server and return its outcome and result; raises `NodeGone` if no server exists."""
        key = (whole(action), kind)
        client = self._clients.get(key)
        if client is None:
            client = self._clients[key] = ActionClient(self._registrar, self._post, *key, self._speed)
        try:
            return await client.do(goal, feedback)
        except NodeGone:
            if self._clients.get(key) is client and not client.busy:
                self._clients.pop(key).close()  # its topics would look like a served action
            raise

    async def close(self) -> None:
        """Close actions and connections, and let the last messages go out."""
        for action in self._actions:
            action.close()
        await asyncio.gather(*(action.ended for action in self._actions))
        self._calls.close()
        await asyncio.sleep(LINGER * self._speed)
