"""Services and actions on DDS: requests come from the reading thread, and are answered in the loop of the bus."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections import OrderedDict, deque
from collections.abc import Callable, Coroutine, Mapping
from dataclasses import dataclass
from typing import Any

from maya_ros.graph import types as graph_types
from maya_ros.graph.outcome import error_of
from maya_ros.graph.protocol import Feedback, GoalResult, GoalStatus, Message, Stamp
from maya_ros.graph.table import Row
from maya_ros.ros2 import types
from maya_ros.ros2.dds import Counts, DdsGraph, SampleWriter
from maya_ros.ros2.names import Quality
from maya_un.errors import Busy, MayaError

UNDER_WAY = 32
"""Most requests of one service that are carried out at once; more are refused."""

MOST = 1000
"""Most requests of one service that wait, those for the result of a goal included; a further one is dropped."""

KEPT = 100
"""Number of ended goals of an action that are kept, for clients that ask for their results later."""

_log = logging.getLogger("maya_ros.ros2")

CarryOut = Callable[[Message, Feedback], Coroutine[Any, Any, GoalResult]]
"""Carries out a goal to its end, also after a cancellation; the first feedback marks the beginning."""


class ServiceServer:
    """Serves services on DDS, and keeps the tasks of their work; `now` returns the time of the graph."""

    def __init__(self, dds: DdsGraph, now: Callable[[], Stamp]) -> None:
        self.now = now
        self._dds = dds
        self._loop = asyncio.get_running_loop()
        self._tasks: set[asyncio.Task[None]] = set()

    async def close(self) -> None:
        """Cancel what programs of ROS 2 have begun, and wait until the robot is at rest."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def serve(
        self,
        node: str,
        name: str,
        kinds: tuple[types.SampleType, types.SampleType],
        response: str,
        answer: Callable[[Message], Coroutine[Any, Any, Message]],
    ) -> None:
        """Serve a service on DDS; an error of `answer` becomes a response of the type `response`, "" for no answer."""
        inbox = DdsInbox(self._loop, MOST, self._dds.counts)
        under_way: set[asyncio.Task[None]] = set()

        async def answered(message: Message, client: int, number: int) -> None:
            try:
                said = await answer(message)
            except MayaError as error:
                if not response:
                    _log.warning("%s: %s %s", name, error.code, error)
                    return
                said = refusal(response, error)
            writer.send(said, guid=client, seq=number)

        def begin(asked: tuple[Message, int, int]) -> None:
            if len(under_way) >= MOST:
                self._dds.counts.displaced += 1
                return
            if len(under_way) >= UNDER_WAY and response:
                busy = refusal(response, Busy(doing=name))
                writer.send(busy, guid=asked[1], seq=asked[2])
                return
            task = self.spawn(answered(*asked))
            under_way.add(task)
            task.add_done_callback(under_way.discard)

        def heard(sample: Any) -> None:
            inbox.put(begin, (kinds[0].message(sample), sample.guid, sample.seq))

        writer = self._dds.service(node, name, kinds, heard)

    def spawn(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        """Run work that `close` cancels."""
        task = self._loop.create_task(work, name="ROS 2")
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task


class DdsInbox:
    """The way of requests from the reading thread to the loop: at most `most` wait there; a further one is dropped."""

    def __init__(self, loop: asyncio.AbstractEventLoop, most: int, counts: Counts) -> None:
        self._loop = loop
        self._most = most
        self._counts = counts
        self._waiting = 0

    def put(self, take: Callable[[Any], None], message: Any) -> None:
        """Have the loop call `take`; called in the reading thread."""
        if self._waiting >= self._most:
            self._counts.displaced += 1
            return
        self._waiting += 1
        self._loop.call_soon_threadsafe(self._take, take, message)

    def _take(self, take: Callable[[Any], None], message: Any) -> None:
        self._waiting -= 1
        take(message)


class TopicInbox:
    """The way of a topic from the reading thread to `take` in the loop; if `most` wait, a new one displaces the oldest.

    So the newest command counts, as in ROS 1.
    """

    def __init__(
        self, loop: asyncio.AbstractEventLoop, most: int, counts: Counts, take: Callable[[Message], None]
    ) -> None:
        self._loop = loop
        self._counts = counts
        self._hand_on = take
        self._waiting: deque[Message] = deque(maxlen=most)
        self._changing = threading.Lock()

    def put(self, message: Message) -> None:
        """Have the loop take a message; called in the reading thread."""
        with self._changing:
            full = len(self._waiting) == self._waiting.maxlen
            self._waiting.append(message)
        if full:
            self._counts.displaced += 1  # the loop takes this one when it would have taken the oldest
        else:
            self._loop.call_soon_threadsafe(self._take)

    def _take(self) -> None:
        with self._changing:
            message = self._waiting.popleft()
        self._hand_on(message)


def refusal(kind: str, error: MayaError) -> Message:
    """Return the response of a service that failed."""
    said = {"success": False, "code": str(error.code), "message": str(error)}
    known = graph_types.fields(kind)
    if "code" not in known:
        said["message"] = f"{error.code}: {error}"
    return graph_types.conform(kind, {name: value for name, value in said.items() if name in known})


ACCEPTED, EXECUTING, CANCELING, SUCCEEDED, CANCELED, ABORTED = range(1, 7)
"""States of a goal (action_msgs/GoalStatus); 0 is unknown."""

_ENDS: Mapping[GoalStatus, int] = {
    GoalStatus.SUCCEEDED: SUCCEEDED,
    GoalStatus.PREEMPTED: CANCELED,
    GoalStatus.RECALLED: CANCELED,
}


@dataclass(slots=True, eq=False)
class _DdsGoal:
    id: tuple[int, ...]
    stamp: Stamp
    begun: asyncio.Future[bool]
    ended: asyncio.Future[GoalResult]
    status: int = ACCEPTED
    task: asyncio.Task[None] | None = None

    def info(self) -> Message:
        """Return it as action_msgs/GoalInfo."""
        return {"goal_id": {"uuid": list(self.id)}, "stamp": self.stamp}


class ActionServer:
    """One action on DDS: three services and two topics. A goal is accepted when the robot begins it."""

    def __init__(self, server: ServiceServer, row: Row, node: str, dds: DdsGraph, carry_out: CarryOut) -> None:
        self._server = server
        self._row = row
        self._act = carry_out
        self._goals: OrderedDict[tuple[int, ...], _DdsGoal] = OrderedDict()
        kinds = types.action_types(row.type)
        inner = f"{row.name}/_action"
        server.serve(node, f"{inner}/send_goal", kinds.send_goal, "", self._send_goal)
        server.serve(node, f"{inner}/get_result", kinds.get_result, "", self._get_result)
        server.serve(node, f"{inner}/cancel_goal", kinds.cancel_goal, "", self._cancel_goal)
        self._feedback = dds.publisher(node, f"{inner}/feedback", kinds.feedback, Quality(100))
        self._status: SampleWriter = dds.publisher(node, f"{inner}/status", kinds.status, Quality(1, late=True))

    async def _send_goal(self, request: Message) -> Message:
        id_ = tuple(request["goal_id"]["uuid"])
        if id_ in self._goals:
            return {"accepted": False, "stamp": self._server.now()}
        loop = asyncio.get_running_loop()
        goal = _DdsGoal(id_, self._server.now(), loop.create_future(), loop.create_future())
        self._goals[id_] = goal
        goal.task = self._server.spawn(self._carry_out(goal, request["goal"]))
        goal.task.add_done_callback(lambda task: self._see_to_its_end(goal, task))
        accepted = await asyncio.shield(goal.begun)
        return {"accepted": accepted, "stamp": goal.stamp}

    async def _carry_out(self, goal: _DdsGoal, message: Message) -> None:
        def feedback(values: Message) -> None:
            self._begin(goal)
            self._feedback.send({"goal_id": {"uuid": list(goal.id)}, "feedback": values})

        try:
            ended = await self._act(message, feedback)
        except MayaError as error:
            ended = GoalResult(GoalStatus.REJECTED, {"message": f"{error.code}: {error}"})
        self._end(goal, ended)

    def _see_to_its_end(self, goal: _DdsGoal, task: asyncio.Task[None]) -> None:
        """End a goal whose task has ended without a result: a cancel came before its first turn, or it failed."""
        if not goal.ended.done():
            self._end(goal, GoalResult(GoalStatus.PREEMPTED if task.cancelled() else GoalStatus.ABORTED, {}))

    def _end(self, goal: _DdsGoal, ended: GoalResult) -> None:
        if not goal.begun.done():
            goal.begun.set_result(ended.outcome is not GoalStatus.REJECTED)
            if ended.outcome is GoalStatus.REJECTED:
                error = error_of(ended.result, self._row.name)
                reason = ended.result.get("message", "") if error is None else f"{error.code}: {error}"
                _log.info("%s refused a goal: %s", self._row.name, reason)
                del self._goals[goal.id]
        goal.status = _ENDS.get(ended.outcome, ABORTED)
        goal.ended.set_result(ended)
        self._tell()

    def _begin(self, goal: _DdsGoal) -> None:
        if not goal.begun.done():
            goal.begun.set_result(True)
            if goal.status == ACCEPTED:
                goal.status = EXECUTING
            self._tell()

    async def _get_result(self, request: Message) -> Message:
        goal = self._goals.get(tuple(request["goal_id"]["uuid"]))
        if goal is None:
            return {"status": 0, "result": {}}
        ended = await asyncio.shield(goal.ended)
        return {"status": goal.status, "result": ended.result}

    async def _cancel_goal(self, request: Message) -> Message:
        """Cancel one goal, all of them, or those up to a time (action_msgs/CancelGoal)."""
        info = request["goal_info"]
        wanted, until = tuple(info["goal_id"]["uuid"]), (info["stamp"]["secs"], info["stamp"]["nsecs"])
        found = [goal for goal in self._goals.values() if not goal.ended.done() and self._asked(goal, wanted, until)]
        for goal in found:
            if goal.task is not None and goal.status != CANCELING:
                goal.status = CANCELING
                goal.task.cancel()
        self._tell()
        code = 0 if found else 3 if wanted in self._goals else 2
        return {"return_code": code, "goals_canceling": [goal.info() for goal in found]}

    def _asked(self, goal: _DdsGoal, wanted: tuple[int, ...], until: tuple[int, int]) -> bool:
        if any(wanted) and goal.id == wanted:
            return True
        before = (goal.stamp["secs"], goal.stamp["nsecs"]) <= until
        return before if any(until) else not any(wanted)

    def _tell(self) -> None:
        """Publish the states of all goals that are kept."""
        over = [goal for goal in self._goals.values() if goal.ended.done()]
        for goal in over[:-KEPT]:
            del self._goals[goal.id]
        states = [{"goal_info": goal.info(), "status": goal.status} for goal in self._goals.values()]
        self._status.send({"status_list": states})
