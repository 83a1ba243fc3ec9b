"""Servers of actions in a real graph, whose goals are cancelled where their client is gone."""

from __future__ import annotations

import asyncio

import rospy

from maya_un.graph.goals import GoalServer, GoalTopics
from maya_un.graph.protocol import Act, Message
from maya_un.graph.stamps import Stamp
from maya_un.ros.registering import Registrar
from maya_un.ros.threads import LoopCalls
from maya_un.ros.topics import RosPublisher, RosSubscription

_QUEUE = 50


class RosAction:
    """The server of an action, until it is closed (`graph.protocol.GraphHandle`).

    `speed` is how fast the loop's clock runs.

    Not actionlib's: that one lives in rospy's threads, where a cancel may overtake what it cancels. A client that had
    subscribed to the result and whose connection is gone has its goals cancelled; rospy looks for broken connections
    twice a second. `ended` completes once this is closed and all is at rest.
    """

    def __init__(self, registrar: Registrar, post: LoopCalls, action: str, kind: str, act: Act, speed: float) -> None:
        self.name = action
        self.open = True
        self.ended: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._clients: set[str] = set()
        status = RosPublisher(
            registrar, f"{action}/status", "actionlib_msgs/GoalStatusArray", latch=True, queue_size=_QUEUE
        )
        feedback = RosPublisher(registrar, f"{action}/feedback", f"{kind}ActionFeedback", queue_size=_QUEUE)
        self._result = RosPublisher(
            registrar,
            f"{action}/result",
            f"{kind}ActionResult",
            queue_size=_QUEUE,
            changed=lambda: post(self._look_for_clients),
        )
        voices = GoalTopics(status, feedback, self._result)
        self._server = GoalServer(action, kind, act, voices, _now, self._over, speed=speed)
        self._ears = (
            RosSubscription(registrar, post, f"{action}/goal", f"{kind}ActionGoal", self._take),
            RosSubscription(
                registrar,
                post,
                f"{action}/cancel",
                "actionlib_msgs/GoalID",
                lambda asked, _: self._server.cancel(asked),
            ),
        )

    def close(self) -> None:
        """Take no more goals; those under way are cancelled, and their results told once all is at rest."""
        self.open = False
        for ear in self._ears:
            ear.close()
        self._server.close()

    def _take(self, goal: Message, source: str) -> None:
        self._server.take(goal, source)
        self._look_for_clients()

    def _look_for_clients(self) -> None:
        """Cancel the goals of clients that were there and are gone."""
        here = self._result.reading
        for gone in self._clients - here:
            if any(goal.source == gone for goal in self._server.goals):
                rospy.logwarn("%s is gone, so what it wanted is stopped.", gone)
                self._server.forsake(gone)
        self._clients = set(here)

    def _over(self) -> None:
        if not self.ended.done():
            self.ended.set_result(None)


def _now() -> Stamp:
    now = rospy.Time.now()
    return {"secs": now.secs, "nsecs": now.nsecs}
