"""A node made of the graph of this project alone: it obeys requests and reports events.

The `a` of a move goal decides its end (`peer_outcomes.GoalOutcome`). On /peer/do it gets goals to send and services to
call, as JSON. It reports events on /peer/said, as JSON too.
"""

from __future__ import annotations

import asyncio
import json
import threading

from maya_ros.graph.outcome import failure, success
from maya_ros.graph.protocol import Feedback, GoalRefused, Message
from maya_ros.ros1.node import RosNode, run
from maya_un.errors import Busy, LimitReached, MayaError
from tests.ros.peer_outcomes import MOVE, GoalOutcome


class Peer:
    """Its servers, and its requests."""

    def __init__(self, node: RosNode) -> None:
        self._node = node
        self._graph = graph = node.graph
        self._tasks: set[asyncio.Task[None]] = set()
        self._said = graph.advertise("/peer/said", "std_msgs/String", queue_size=1000)
        self._out = graph.advertise("/peer/out", "std_msgs/String", latch=True, queue_size=1000)
        self._out.publish({"data": "latched"})
        self._echoed = graph.subscribe("/peer/in", "std_msgs/String", self._out.publish, queue_size=1000)
        graph.subscribe("/peer/do", "std_msgs/String", self._heard)
        graph.serve("/peer/lasting", "std_srvs/Trigger", self._lasting)
        graph.serve("/peer/failing", "std_srvs/Trigger", self._failing)
        graph.serve("/peer/late", "std_srvs/Trigger", self._late)
        graph.serve("/peer/quick", "std_srvs/Trigger", self._late, lambda _: {"success": True, "message": "at once"})
        graph.act("/peer/move", MOVE, self._act)

    def _say(self, what: str, **details: object) -> None:
        self._said.publish({"data": json.dumps({"what": what, **details})})

    async def _until_cancelled(self, what: str) -> None:
        try:
            await asyncio.Event().wait()
        except asyncio.CancelledError:
            await work(0.1 * self._node.speed)
            self._say("cancelled", of=what)
            raise

    async def _act(self, goal: Message, feedback: Feedback) -> Message:
        request = GoalOutcome(round(goal["a"]))
        if request is GoalOutcome.IS_REFUSED:
            raise GoalRefused(failure(Busy(doing="something else")))
        if request is GoalOutcome.FAILS:
            raise LimitReached(axis="b", side="forward")
        if request is GoalOutcome.BREAKS:
            raise ZeroDivisionError("by design")
        feedback({"a": 1.0, "progress": 0.5})
        if request is GoalOutcome.LASTS:
            going_on = asyncio.ensure_future(self._go_on(feedback))
            try:
                await self._until_cancelled("goal")
            finally:
                going_on.cancel()
        if request is GoalOutcome.TAKES_A_WHILE:
            await work(0.2 * self._node.speed)
        return success()

    async def _go_on(self, feedback: Feedback) -> None:
        """Tell the progress again and again: rospy drops what comes just after it answered a reader's handshake."""
        while True:
            await work(0.2 * self._node.speed)
            feedback({"a": 1.0, "progress": 0.5})

    async def _lasting(self, _: Message) -> Message:
        self._say("asked")
        await self._until_cancelled("service")
        return {}

    async def _failing(self, _: Message) -> Message:
        raise Busy(doing="something else")

    async def _late(self, _: Message) -> Message:
        await work(0.01)
        return {"success": True, "message": "in the loop"}

    def _heard(self, message: Message) -> None:
        request = json.loads(message["data"])
        match request["op"]:
            case "cancel":
                for task in self._tasks:
                    task.cancel()
            case "threads":
                self._say("threads", names=[thread.name for thread in threading.enumerate()])
            case "serve":
                self._graph.serve(request["service"], "std_srvs/Trigger", self._late)
            case "expect":
                self._graph.expect(request["service"])
            case "writers":
                self._say("writers", names=sorted(self._echoed.writers), readers=self._out.readers)
            case _:
                task = asyncio.ensure_future(self._done(request))
                self._tasks.add(task)
                task.add_done_callback(self._tasks.discard)

    async def _done(self, request: Message) -> None:
        try:
            if request["op"] == "call":
                self._say("calling")
                answer = await self._graph.call(request["service"], {}, request.get("kind", ""))
                self._say("answered", answer=answer)
            else:
                ended = await self._graph.do(request["action"], MOVE, request["goal"], self._feedback)
                self._say("ended", outcome=ended.outcome, result=ended.result)
        except asyncio.CancelledError:
            self._say("did cancel")
        except MayaError as error:
            self._say("failed", code=error.code, sentence=str(error))

    def _feedback(self, message: Message) -> None:
        self._say("feedback", message=message)


async def work(seconds: float) -> None:
    """Wait `seconds` by the loop's clock."""
    loop = asyncio.get_running_loop()
    done: asyncio.Future[None] = loop.create_future()
    loop.call_later(seconds, lambda: done.done() or done.set_result(None))  # it may have been cancelled meanwhile
    await done


async def serve(node: RosNode) -> None:
    """Serve until cancelled, and take a while to come to rest."""
    Peer(node)
    await node.say_ready("ready")
    try:
        await asyncio.Event().wait()
    finally:
        node.say("resting")
        await work(0.1 * node.speed)
        node.say("rested")


if __name__ == "__main__":
    raise SystemExit(run("peer", serve))
