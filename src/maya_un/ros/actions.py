"""Servers of actions in a real graph: goals are carried out in the loop, and cancelled where their client is gone."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from functools import partial

import actionlib
import rospy

from maya_un.errors import Cancelled, InternalError, MayaError
from maya_un.graph.protocol import Act, Message, Outcome, Refused
from maya_un.ros.classes import action_class
from maya_un.ros.convert import converter_of
from maya_un.ros.threads import Post

LINGER = 0.2
"""A message is on its way so long after it was published [s]; who closes a topic at once keeps it from going."""


class _Run:
    """A goal that is carried out, for `client`, the name of a node."""

    def __init__(self, goal: actionlib.ServerGoalHandle, task: asyncio.Task[Message]) -> None:
        self.goal = goal
        self.task = task
        self.client: str = (goal.goal._connection_header or {}).get("callerid", "")
        self.cancelled = False

    @property
    def outcome(self) -> Outcome:
        """How the goal stands."""
        return Outcome(self.goal.get_goal_status().status)

    def cancel(self) -> None:
        """Have it end as soon as the robot is at rest; once, as a second word would tear the braking short."""
        if not self.cancelled:
            self.cancelled = True
            self.task.cancel()

    def refused(self) -> bool:
        """Tell whether it ended before it began."""
        return self.task.done() and not self.task.cancelled() and isinstance(self.task.exception(), Refused)


class RosAction:
    """The server of an action, until it is closed (`graph.protocol.Held`).

    rospy's thread only tells the loop what came, in order. A client that had subscribed to the result and whose
    connection is gone has its goals cancelled; rospy looks for broken connections twice a second. The server goes
    `linger` [s, the loop's] after its last word.
    """

    def __init__(
        self, loop: asyncio.AbstractEventLoop, action: str, kind: str, act: Act, *, linger: float = LINGER
    ) -> None:
        found = action_class(kind)
        self._loop = loop
        self._post = Post(loop)
        self._act = act
        self._linger = linger
        self._goal = converter_of(found.goal).plain
        self._result = converter_of(found.result)
        self._feedback = converter_of(found.feedback)
        self._fields = frozenset(found.result.__slots__)
        self._runs: dict[str, _Run] = {}
        self._seen: set[str] = set()
        self._open = True
        self._server = actionlib.ActionServer(action, found.kind, self._goal_came, self._cancel_came, auto_start=False)
        self._server.start()
        impl = self._server.result_pub.impl
        assert impl is not None
        impl.add_subscriber_listener(_Readers(lambda: self._post(self._look_for_clients)))

    def close(self) -> None:
        """Take no goal any more; what runs is cancelled, and tells its end as long as the node lives."""
        self._open = False
        for run in self._runs.values():
            run.cancel()
        self._stop_soon()

    async def ended(self) -> None:
        """Wait until nothing runs any more."""
        while self._runs:
            await asyncio.wait([run.task for run in self._runs.values()])
            await asyncio.sleep(0)

    def _stop_soon(self) -> None:
        """Stop the server where nothing runs any more, and what was told last has gone out."""
        if not self._open and not self._runs:
            self._loop.call_later(self._linger, self._stop)

    def _stop(self) -> None:
        if self._server.started and not rospy.is_shutdown():
            self._server.stop()

    def _goal_came(self, goal: actionlib.ServerGoalHandle) -> None:
        self._post(self._begin, goal)

    def _cancel_came(self, goal: actionlib.ServerGoalHandle) -> None:
        self._post(self._cancel, goal.get_goal_id().id)

    def _begin(self, goal: actionlib.ServerGoalHandle) -> None:
        if not self._open or goal.get_goal_status().status == Outcome.RECALLING:
            goal.set_canceled(self._result.made(self._failure(Cancelled())))
            return
        name: str = goal.get_goal_id().id
        task = self._loop.create_task(self._acted(goal), name=f"goal {name}")
        run = self._runs[name] = _Run(goal, task)
        task.add_done_callback(partial(self._end, name, run))
        self._loop.call_soon(self._accept, run)  # after the first step of the task, in which it may refuse
        self._look_for_clients()

    async def _acted(self, goal: actionlib.ServerGoalHandle) -> Message:
        def feedback(message: Message) -> None:
            goal.publish_feedback(self._feedback.made(message))

        return await self._act(self._goal(goal.get_goal()), feedback)

    def _accept(self, run: _Run) -> None:
        if run.outcome in {Outcome.PENDING, Outcome.RECALLING} and not run.refused():
            run.goal.set_accepted()

    def _cancel(self, name: str) -> None:
        if name in self._runs:
            self._runs[name].cancel()

    def _end(self, name: str, run: _Run, task: asyncio.Task[Message]) -> None:
        """Set the terminal state; whatever happened, there is one."""
        self._runs.pop(name, None)
        goal = run.goal
        if run.refused() and run.outcome in {Outcome.PENDING, Outcome.RECALLING}:
            refusal = task.exception()
            assert isinstance(refusal, Refused)
            goal.set_rejected(self._result.made(refusal.result), str(refusal))
        else:
            self._accept(run)
            outcome, result = self._outcome(run)
            words = str(result.get("message", ""))
            end = {Outcome.SUCCEEDED: goal.set_succeeded, Outcome.PREEMPTED: goal.set_canceled}
            end.get(outcome, goal.set_aborted)(self._result.made(result), words)
        self._stop_soon()

    def _outcome(self, run: _Run) -> tuple[Outcome, Message]:
        """Return how a goal ended that had begun, and with what."""
        if run.task.cancelled():
            return Outcome.PREEMPTED, self._failure(Cancelled())
        error = run.task.exception()
        if error is None:
            result = run.task.result()
            if result.get("success", True):
                return Outcome.SUCCEEDED, result
            return (Outcome.PREEMPTED if run.cancelled else Outcome.ABORTED), result
        if isinstance(error, Refused):
            return Outcome.ABORTED, error.result
        if not isinstance(error, MayaError):
            logging.getLogger("rosout").error("A goal ended by a defect of ours.", exc_info=error)
            error = InternalError(reason=repr(error))
        return (Outcome.PREEMPTED if run.cancelled else Outcome.ABORTED), self._failure(error)

    def _failure(self, error: MayaError) -> Message:
        result = {"success": False, "code": str(error.code), "message": str(error)}
        return {key: value for key, value in result.items() if key in self._fields}

    def _look_for_clients(self) -> None:
        """Cancel the goals of clients that were there and are gone."""
        impl = self._server.result_pub.impl
        here = set[str]() if impl is None else {link.endpoint_id for link in impl.connections}
        self._seen |= here
        for run in self._runs.values():
            if run.client in self._seen and run.client not in here:
                rospy.logwarn("%s is gone, so what it wanted is stopped.", run.client)
                run.cancel()
        self._seen &= here | {run.client for run in self._runs.values()}


class _Readers(rospy.SubscribeListener):
    """Tells that somebody came or went."""

    def __init__(self, changed: Callable[[], object]) -> None:
        self._changed = changed

    def peer_subscribe(self, topic_name: str, topic_publish: object, peer_publish: object) -> None:
        """Take note that somebody came."""
        self._changed()

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        """Take note that somebody went."""
        self._changed()
