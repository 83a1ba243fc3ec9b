"""Servers and clients of actions in a real graph, over the five topics of an action.

actionlib's client runs in threads, and treats a goal that is cancelled at once as lost. This client runs in the loop,
and relies on the server's reports only.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from itertools import count
from typing import Any

import rospy

from maya_ros.graph.goals import GoalServer, GoalTopics
from maya_ros.graph.protocol import Act, Feedback, GoalResult, GoalStatus, Message, Stamp
from maya_ros.ros1.master import REACH, LoopCalls, Registrar, in_thread, published
from maya_ros.ros1.topics import RosPublisher, RosSubscription
from maya_un.cancellation import run_to_rest
from maya_un.errors import NodeGone

_QUEUE = 50


class RosAction:
    """The server of an action, until it is closed (`graph.protocol.GraphHandle`).

    `speed` is how fast the loop's clock runs.

    It replaces actionlib's server, which runs in threads of rospy, where a cancel may overtake its goal. If a client
    that has subscribed to the result disconnects, its goals are cancelled; rospy looks for broken connections twice a
    second. `ended` completes once this is closed and all is at rest.
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
        """Take no more goals and cancel those under way; their results are still published."""
        self.open = False
        for ear in self._ears:
            ear.close()
        self._server.close()

    def _take(self, goal: Message, source: str) -> None:
        self._server.take(goal, source)
        self._look_for_clients()

    def _look_for_clients(self) -> None:
        """Cancel the goals of clients that have disconnected."""
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


_LOOK = 0.1
"""Period of the check for a server [s]."""

_FIND = 5.0
"""A server that is not found within this time is missing [s]."""

_NOTICE = 5.0
"""A goal that its server has not listed for this time is lost [s]."""

_GOAL_QUEUE = 50
_numbers = count(1)


class _Goal:
    """A goal under way at `server`; `silent` is the time since the server listed it [s, real time]."""

    def __init__(self, name: str, server: frozenset[str], feedback: Feedback | None) -> None:
        self.name = name
        self.server = server
        self.feedback = feedback
        self.silent = 0.0
        self.ended: asyncio.Future[GoalResult] = asyncio.get_running_loop().create_future()

    def end(self, outcome: GoalStatus, result: Message) -> None:
        """Set the outcome; only the first one counts."""
        if not self.ended.done():
            self.ended.set_result(GoalResult(outcome, result))


class ActionClient:
    """All goals of this node for one action. `speed` is how fast the loop's clock runs."""

    def __init__(self, registrar: Registrar, post: LoopCalls, action: str, kind: str, speed: float) -> None:
        self._action = action
        self._speed = speed
        self._goals: dict[str, _Goal] = {}
        self._goal = RosPublisher(registrar, f"{action}/goal", f"{kind}ActionGoal", queue_size=_GOAL_QUEUE)
        self._cancel = RosPublisher(registrar, f"{action}/cancel", "actionlib_msgs/GoalID", queue_size=_GOAL_QUEUE)
        self._registrar = registrar
        self._status = self._heard(post, "status", "actionlib_msgs/GoalStatusArray", self._status_came)
        self._feedback = self._heard(post, "feedback", f"{kind}ActionFeedback", self._feedback_came)
        self._result = self._heard(post, "result", f"{kind}ActionResult", self._result_came)

    @property
    def busy(self) -> bool:
        """Whether a goal is under way."""
        return bool(self._goals)

    async def do(self, goal: Message, feedback: Feedback | None) -> GoalResult:
        """Send a goal to its server and return its outcome (`graph.protocol.Graph.do`); raises `NodeGone`."""
        server = await self._server()
        run = _Goal(f"{rospy.get_name()}-{next(_numbers)}-{rospy.Time.now().to_sec():.9f}", server, feedback)
        self._goals[run.name] = run
        watch = asyncio.create_task(self._watch(run), name=f"watch {self._action}")
        try:
            self._goal.publish({"goal_id": {"id": run.name}, "goal": goal})
            return await self._outcome(run)
        finally:
            watch.cancel()
            del self._goals[run.name]

    def close(self) -> None:
        """Close the topics."""
        for held in (self._goal, self._cancel, self._status, self._feedback, self._result):
            held.close()

    async def _outcome(self, run: _Goal) -> GoalResult:
        """Wait for the end; if cancelled, cancel the goal and still wait for its end."""
        return await run_to_rest(run.ended, lambda: self._cancel.publish({"id": run.name}))

    async def _server(self) -> frozenset[str]:
        """Return the server's name once all five topics are connected to it; raises `NodeGone`."""
        for _ in range(round(_FIND / _LOOK)):
            heard = self._status.writers & self._feedback.writers & self._result.writers
            found = heard & self._goal.reading & self._cancel.reading
            if found:
                return found
            if not heard and not await self._known():
                break
            await asyncio.sleep(_LOOK * self._speed)
        raise NodeGone(node=self._action)

    async def _known(self) -> bool:
        """Return whether the master knows a server; for a while it also knows a killed one.

        The server may belong to this node, so wait first for this node's registrations.
        """
        await self._registrar.settled(REACH)
        return f"{self._action}/result" in await in_thread(published)

    async def _watch(self, run: _Goal) -> None:
        """End a goal as lost if its server is gone or no longer lists it."""
        while not run.ended.done():
            await asyncio.sleep(_LOOK * self._speed)
            run.silent += _LOOK
            if not run.server & self._result.writers or run.silent > _NOTICE:
                self._cancel.publish({"id": run.name})  # in case the server still runs
                run.end(GoalStatus.LOST, {})

    def _heard(self, post: LoopCalls, part: str, kind: str, heard: Callable[[Message], None]) -> RosSubscription:
        return RosSubscription(self._registrar, post, f"{self._action}/{part}", kind, lambda message, _: heard(message))

    def _status_came(self, message: Message) -> None:
        for status in message["status_list"]:
            run = self._of(status)
            if run is not None:
                run.silent = 0.0

    def _feedback_came(self, message: Message) -> None:
        run = self._of(message["status"])
        if run is not None and run.feedback is not None:
            run.feedback(message["feedback"])

    def _result_came(self, message: Message) -> None:
        run = self._of(message["status"])
        if run is not None:
            run.end(GoalStatus(message["status"]["status"]), message["result"])

    def _of(self, status: dict[str, Any]) -> _Goal | None:
        return self._goals.get(status["goal_id"]["id"])
