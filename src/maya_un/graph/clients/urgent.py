"""Stops over a graph: said also where the master is gone, and where the floor's node hangs, which is told in time."""

from __future__ import annotations

import asyncio
import json

from maya_un.errors import NodeGone, NotConnected
from maya_un.graph.clients.asking import called
from maya_un.graph.clients.watch import SETTLES, ControllerWatch
from maya_un.graph.protocol import Graph, Message
from maya_un.graph.table import FOLLOW, HOME, MOVE, Row

HEARD = 1.0
"""A node that does not answer a stop within this time hangs [s, real time]; `maya stop` waits for twice as long."""


class StopSender:
    """Says stops to the controller floor that `watch` watches; `speed` is how fast the loop's clock runs."""

    def __init__(self, graph: Graph, watch: ControllerWatch, speed: float) -> None:
        self._graph = graph
        self._watch = watch
        self._patience = HEARD * max(1.0, speed)
        self._cancels = [graph.advertise(f"{row.name}/cancel", "actionlib_msgs/GoalID") for row in (HOME, MOVE, FOLLOW)]
        self._saying: set[asyncio.Task[Message]] = set()

    async def say(self, row: Row) -> Message:
        """Return what the service of a stop answers; it goes on being called also where nobody waits for that.

        Where it is not answered all goals are cancelled, which needs no master. Raises `NotConnected` where nobody
        hears that either, and `NodeGone` where the node hangs: it stops when it goes on.
        """
        saying = asyncio.create_task(called(self._graph, row, {}), name=row.name)
        self._saying.add(saying)
        saying.add_done_callback(self._said)
        answered, _ = await asyncio.wait({saying}, timeout=self._patience)
        try:
            if answered:
                return saying.result()
        except NodeGone:
            if not any(cancel.readers for cancel in self._cancels):
                raise NotConnected from None
        moving = self._watch.state.moving
        for cancel in self._cancels:
            cancel.publish({})
        rests = await self._watch.until(lambda: not self._watch.state.moving, SETTLES)
        if not answered and not (moving and rests):
            raise NodeGone(node=self._watch.node)
        return {"message": json.dumps({"was_moving": moving, "duration": 0.0, "distance": (0.0, 0.0, 0.0)})}

    async def close(self) -> None:
        """Say no more."""
        for saying in self._saying:
            saying.cancel()
        if self._saying:
            await asyncio.wait(self._saying)
        for cancel in self._cancels:
            cancel.close()

    def _said(self, saying: asyncio.Task[Message]) -> None:
        self._saying.discard(saying)
        if not saying.cancelled():
            saying.exception()
