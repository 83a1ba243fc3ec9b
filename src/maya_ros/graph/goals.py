"""The server side of a ROS 1 action: goals, cancels and the status list (wiki.ros.org/actionlib).

A goal is PENDING until its act gives the first feedback, which marks the start. Until then, the goal can be refused, or
cancelled without effect (RECALLED). An ended goal stays in the list for a while, for clients that missed the result.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from maya_ros.graph import types
from maya_ros.graph.outcome import ENDED, failure, run_goal
from maya_ros.graph.protocol import Act, GoalStatus, Message, Publisher, Stamp, order
from maya_un.cancellation import cancel_once
from maya_un.errors import Cancelled

KEPT = 5.0
"""Time for which an ended goal stays in the list [s] (actionlib's status_list_timeout)."""

PERIOD = 0.2
"""Period of publishing the list while it is not empty [s] (actionlib's status frequency is 5 Hz)."""

MANY = 20
"""A longer list is only published periodically: the cost of a flood of goals must not grow with its square."""

MOST = 100
"""Largest number of ended goals in the list; beyond it, the oldest are removed sooner."""

_BEFORE = {"secs": 0, "nsecs": 0}
_TOO_LATE = "It came with a time before that of the last cancel."


@dataclass(frozen=True, slots=True)
class GoalTopics:
    """The topics on which a server publishes."""

    status: Publisher
    feedback: Publisher
    result: Publisher

    def close(self) -> None:
        """Close the publishers."""
        for voice in (self.status, self.feedback, self.result):
            voice.close()


@dataclass(slots=True, eq=False)
class Goal:
    """A goal on the server; when the client `source` ends, the goal is cancelled (None: no client)."""

    id: str
    stamp: Stamp
    outcome: GoalStatus = GoalStatus.PENDING
    text: str = ""
    source: object | None = None
    task: asyncio.Task[None] | None = None

    def status(self) -> Message:
        """Return the state of the goal as actionlib_msgs/GoalStatus."""
        return {"goal_id": {"stamp": self.stamp, "id": self.id}, "status": int(self.outcome), "text": self.text}


class GoalServer:
    """Serves one action of type `kind`: carries out each goal with `act`, in a separate task.

    `now` returns the time of the graph. `idle` is called once the server is closed and the last goal has ended. `speed`
    is how fast the loop's clock runs: clients wait for the list in real time.
    """

    def __init__(
        self,
        name: str,
        kind: str,
        act: Act,
        voices: GoalTopics,
        now: Callable[[], Stamp],
        idle: Callable[[], None],
        *,
        speed: float = 1.0,
    ) -> None:
        self.name = name
        self.kind = kind
        self._act = act
        self._voices = voices
        self._now = now
        self._idle = idle
        self._speed = speed
        self._goals: list[Goal] = []
        self._numbers = 0
        self._last_cancel: Stamp = _BEFORE
        self._ticker: asyncio.TimerHandle | None = None
        self._closed = False
        self._tell_status()

    @property
    def goals(self) -> tuple[Goal, ...]:
        """The goals in the list, in the order of arrival."""
        return tuple(self._goals)

    @property
    def busy(self) -> bool:
        """Whether a goal is under way."""
        return any(goal.task is not None and not goal.task.done() for goal in self._goals)

    def take(self, message: Message, source: object | None = None) -> None:
        """Take a goal (XActionGoal); a goal with a known id does not start again."""
        if self._closed:
            return
        goal_id = message["goal_id"]
        known = next((goal for goal in self._goals if goal_id["id"] and goal.id == goal_id["id"]), None)
        if known is not None:
            if known.outcome is GoalStatus.RECALLING and known.task is None:
                self._end(known, GoalStatus.RECALLED, failure(Cancelled()))
            return
        stamp = goal_id["stamp"]
        goal = Goal(goal_id["id"] or self._new_id(), stamp if order(stamp) != (0, 0) else self._now(), source=source)
        self._goals.append(goal)
        if (0, 0) < order(stamp) <= order(self._last_cancel):
            self._end(goal, GoalStatus.RECALLED, failure(Cancelled()), _TOO_LATE)
            return
        goal.task = asyncio.get_running_loop().create_task(self._carry_out(goal, message["goal"]), name=self.name)
        goal.task.add_done_callback(lambda _: self._see_to_its_end(goal))
        self._tell_status()

    def cancel(self, request: Message) -> None:
        """Cancel goals as an actionlib_msgs/GoalID requests: by id, by time (all goals up to then), or all goals."""
        if self._closed:
            return
        wanted, until = request["id"], order(request["stamp"])
        everything = not wanted and until == (0, 0)
        for goal in self.goals:
            if everything or goal.id == wanted or (until != (0, 0) and order(goal.stamp) <= until):
                self.recall(goal)
        if wanted and all(goal.id != wanted for goal in self._goals):
            early = Goal(wanted, request["stamp"], GoalStatus.RECALLING)
            self._goals.append(early)
            self._forget_later(early)
            self._forget_oldest()
            self._tell_status()
        if until > order(self._last_cancel):  # a time in the future does not cover later goals: they are new commands
            self._last_cancel = min(request["stamp"], self._now(), key=order)

    def recall(self, goal: Goal) -> None:
        """Request the end of a goal, unless that was done before."""
        match goal.outcome:
            case GoalStatus.PENDING:
                goal.outcome = GoalStatus.RECALLING
            case GoalStatus.ACTIVE:
                goal.outcome = GoalStatus.PREEMPTING
            case _:
                return
        if goal.task is not None:
            goal.task.cancel()
        self._tell_status()

    def forsake(self, source: object) -> None:
        """Cancel the goals of a client that has vanished."""
        for goal in self.goals:
            if goal.source == source:
                self.recall(goal)

    def close(self) -> None:
        """Take no more goals and cancel those under way; their results are still published."""
        if self._closed:
            return
        for goal in self.goals:
            self.recall(goal)
        self._closed = True
        self._end_of_all()

    def kill(self) -> None:
        """End as a node that dies: publish nothing more, and cancel all goals."""
        self._closed = True
        self._silence()
        for goal in self._goals:
            cancel_once(goal.task)
        self._voices.close()

    async def _carry_out(self, goal: Goal, message: Message) -> None:
        ended = await run_goal(self._act, message, lambda feedback: self._tell_feedback(goal, feedback))
        begun = goal.outcome in (GoalStatus.ACTIVE, GoalStatus.PREEMPTING)
        outcome = ended.outcome
        if outcome is GoalStatus.PREEMPTED and not begun:
            outcome = GoalStatus.RECALLED
        elif outcome is GoalStatus.REJECTED and begun:
            outcome = GoalStatus.ABORTED
        elif outcome in (GoalStatus.ABORTED, GoalStatus.SUCCEEDED):
            self._begin(goal)
        self._end(goal, outcome, ended.result)

    def _see_to_its_end(self, goal: Goal) -> None:
        """End a goal that was cancelled before its task had its first turn."""
        if goal.outcome not in ENDED:
            self._end(goal, GoalStatus.RECALLED, failure(Cancelled()))

    def _begin(self, goal: Goal) -> None:
        if goal.outcome in (GoalStatus.PENDING, GoalStatus.RECALLING):
            goal.outcome = GoalStatus.ACTIVE if goal.outcome is GoalStatus.PENDING else GoalStatus.PREEMPTING
            self._tell_status()

    def _tell_feedback(self, goal: Goal, feedback: Message) -> None:
        if goal.outcome in ENDED or self._voices_closed:
            return
        self._begin(goal)
        self._voices.feedback.publish({"header": self._header(), "status": goal.status(), "feedback": feedback})

    def _end(self, goal: Goal, outcome: GoalStatus, result: Message, text: str = "") -> None:
        goal.outcome, goal.text = outcome, text or str(result.get("message", ""))
        goal.source = None
        if not self._voices_closed:
            known = types.fields(self.kind + "Result")
            fitting = {name: value for name, value in result.items() if name in known}
            self._voices.result.publish({"header": self._header(), "status": goal.status(), "result": fitting})
            self._forget_later(goal)
            self._forget_oldest()
            self._tell_status()
        asyncio.get_running_loop().call_soon(self._end_of_all)

    def _forget_later(self, goal: Goal) -> None:
        asyncio.get_running_loop().call_later(KEPT * self._speed, self._forget, goal)

    def _forget(self, goal: Goal) -> None:
        if goal in self._goals:
            self._goals.remove(goal)
            if not self._voices_closed:
                self._tell_status()

    def _forget_oldest(self) -> None:
        over = [goal for goal in self._goals if goal.task is None or goal.outcome in ENDED]
        for goal in over[:-MOST]:
            self._goals.remove(goal)

    def _tell_status(self) -> None:
        """Publish the state of all goals; a long list waits for the next period."""
        if len(self._goals) <= MANY:
            self._tell_list()
        if self._goals and self._ticker is None:
            self._ticker = asyncio.get_running_loop().call_later(PERIOD * self._speed, self._tick)

    def _tell_list(self) -> None:
        self._voices.status.publish({"header": self._header(), "status_list": [goal.status() for goal in self._goals]})

    def _tick(self) -> None:
        self._ticker = None
        if not self._voices_closed:
            if len(self._goals) > MANY:
                self._tell_list()
            self._tell_status()

    def _end_of_all(self) -> None:
        if self._closed and not self._voices_closed and not self.busy:
            self._silence()
            self._voices.close()

    _voices_closed = False

    def _silence(self) -> None:
        self._voices_closed = True
        if self._ticker is not None:
            self._ticker.cancel()
            self._ticker = None
        self._idle()

    def _header(self) -> dict[str, Any]:
        return {"stamp": self._now()}

    def _new_id(self) -> str:
        self._numbers += 1
        now = self._now()
        return f"{self.name}-{self._numbers}-{now['secs']}.{now['nsecs']:09d}"
