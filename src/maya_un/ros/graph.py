"""A real ROS graph, by rospy; whatever talks to a graph talks to this one as to the one in a process (`graph.bus`)."""

from __future__ import annotations

import asyncio
from functools import cached_property

from maya_un.graph.protocol import (
    Act,
    Answer,
    Ended,
    Feedback,
    Heard,
    Held,
    Message,
    Publisher,
    Quick,
    Subscription,
)
from maya_un.ros.actions import LINGER, RosAction
from maya_un.ros.goals import ActionClient
from maya_un.ros.master import RosDirectory, RosParameters
from maya_un.ros.services import Calls, RosService
from maya_un.ros.threads import Post
from maya_un.ros.topics import RosPublisher, RosSubscription


class RosGraph:
    """The graph that this process's node takes part in (`graph.protocol.Graph`), in the running loop.

    The node must have been made (`rospy.init_node`). `speed` is how fast the loop's clock runs. Taking something asks
    the master and waits for its answer, which takes about a millisecond.
    """

    def __init__(self, *, speed: float = 1.0) -> None:
        self._loop = asyncio.get_running_loop()
        self._post = Post(self._loop)
        self._speed = speed
        self._calls = Calls()
        self._clients: dict[tuple[str, str], ActionClient] = {}
        self._actions: list[RosAction] = []

    @cached_property
    def directory(self) -> RosDirectory:
        """What there is in it."""
        return RosDirectory()

    @cached_property
    def parameters(self) -> RosParameters:
        """Its parameters."""
        return RosParameters()

    def advertise(self, topic: str, kind: str, *, latch: bool = False, queue_size: int = 100) -> Publisher:
        """Take a topic to publish on."""
        return RosPublisher(topic, kind, latch=latch, queue_size=queue_size)

    def subscribe(self, topic: str, kind: str, heard: Heard, *, queue_size: int = 100) -> Subscription:
        """Listen to a topic; `kind` "" takes the type it has."""
        return RosSubscription(self._post, topic, kind, heard, queue_size)

    def serve(self, service: str, kind: str, answer: Answer, quick: Quick | None = None) -> Held:
        """Answer a service; `quick` is asked in a thread of rospy's. Who hangs up has his answer cancelled."""
        return RosService(self._loop, service, kind, answer, quick)

    async def call(self, service: str, request: Message, kind: str = "") -> Message:
        """Return the answer of a service; raises `ServiceFailed` where it fails, or nobody answers any more."""
        return await self._calls.call(service, request, kind)

    def act(self, action: str, kind: str, act: Act) -> Held:
        """Be the server of an action."""
        self._actions.append(RosAction(self._loop, action, kind, act, linger=LINGER * self._speed))
        return self._actions[-1]

    async def do(self, action: str, kind: str, goal: Message, feedback: Feedback | None = None) -> Ended:
        """Have a goal carried out and return how it ended; raises `NodeGone` where nobody serves the action."""
        if (action, kind) not in self._clients:
            self._clients[action, kind] = ActionClient(self._loop, action, kind, self._speed)
        return await self._clients[action, kind].do(goal, feedback)

    async def close(self) -> None:
        """End what runs here, and let what was said last go out."""
        for action in self._actions:
            action.close()
        for action in self._actions:
            await action.ended()
        self._calls.close()
        await asyncio.sleep(LINGER * self._speed)
