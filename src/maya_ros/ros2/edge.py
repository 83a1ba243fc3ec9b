"""One robot in a ROS 2 graph: the topics, services and actions of the bus under the same names, on DDS.

`graph.table` lists what there is. A row belongs to the node that offers it on the bus, so ROS 2 shows the nodes of the
manual. ROS 2 has no sign-in: all its programs are one guest, with the rights of the token that the edge was given.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager

from cyclonedds.core import DDSException

from maya_ros.graph import types as graph_types
from maya_ros.graph.access import Guest, RestrictedGraph
from maya_ros.graph.bus import Bus
from maya_ros.graph.outcome import goal_to_its_end
from maya_ros.graph.protocol import Feedback, GoalResult, Graph, Message, Publisher
from maya_ros.graph.table import TABLE, Kind, Row
from maya_ros.ros2 import types
from maya_ros.ros2.dds import Counts, DdsGraph
from maya_ros.ros2.names import quality
from maya_ros.ros2.server import ActionServer, DdsInbox, ServiceServer
from maya_ros.ros2.standard import RobotInterface, StandardInterfaces
from maya_un.edges import Ros2Options
from maya_un.errors import MayaError, Ros2NotJoined

NODE = "ros2"
"""The node on the bus that acts for the programs of ROS 2."""

_log = logging.getLogger("maya_ros.ros2")


class Ros2Edge:
    """The endpoints of one bus on DDS; without `robot`, those of the bus alone.

    Everything but the conversions runs in the loop of the bus.
    """

    def __init__(self, bus: Bus, guest: Guest, dds: DdsGraph, robot: RobotInterface | None = None) -> None:
        self._bus = bus
        self._dds = dds
        self._node = bus.node(NODE, lambda: guest.caller)
        self.graph: Graph = RestrictedGraph(self._node, guest)
        self._server = ServiceServer(dds, bus.now)
        for row in TABLE:
            self._offer(row)
        self._standard = None if robot is None else StandardInterfaces(bus, self.graph, dds, self._server, robot)

    @property
    def counts(self) -> Counts:
        """Messages that were not delivered."""
        return self._dds.counts

    async def close(self) -> None:
        """Cancel what programs of ROS 2 have begun, and wait until the robot is at rest."""
        await self._server.close()
        if self._standard is not None:
            self._standard.close()
        self._node.close()

    def _offer(self, row: Row) -> None:
        if row.form is Kind.SERVICE and row.name in self._bus.services:
            self._serve(row, self._bus.services[row.name].node.name.strip("/"))
        elif row.form is Kind.ACTION and row.name in self._bus.actions:
            self._act(row, self._bus.actions[row.name].node.name.strip("/"))
        elif row.form is Kind.TOPIC and (topic := self._bus.topics.find(row.name)) is not None:
            members = [one.member for one in (topic.inlets if row.heard else topic.outlets)]
            if members:
                offer = self._hear if row.heard else self._publish
                offer(row, members[0].name.strip("/"))

    def _publish(self, row: Row, node: str) -> None:
        """Send what Maya publishes."""
        kind = types.message_type(row.type)
        writer = self._dds.publisher(node, row.name, kind, quality(row))
        self._bus.topics.listen(row.name, row.type, lambda message, _: writer.send(message), self._node, row.queue_size)

    def _hear(self, row: Row, node: str) -> None:
        """Take what programs of ROS 2 send."""
        kind = types.message_type(row.type)
        inbox = DdsInbox(asyncio.get_running_loop(), max(1, row.queue_size), self.counts)

        outlet: Publisher | None = None

        def take(message: Message) -> None:
            nonlocal outlet
            try:
                outlet = outlet or self.graph.advertise(row.name, row.type)
                outlet.publish(message)
            except MayaError as refusal:
                _log.warning("%s: %s %s", row.name, refusal.code, refusal)

        self._dds.subscription(node, row.name, kind, quality(row), lambda sample: inbox.put(take, kind.message(sample)))

    def _serve(self, row: Row, node: str) -> None:
        kinds = types.service_types(row.type)

        async def answer(message: Message) -> Message:
            return await self.graph.call(row.name, message, row.type)

        self._server.serve(node, row.name, kinds, graph_types.halves(row.type)[1], answer)

    def _act(self, row: Row, node: str) -> None:
        async def carry_out(goal: Message, feedback: Feedback) -> GoalResult:
            return await goal_to_its_end(self.graph, row.name, row.type, goal, feedback)

        ActionServer(self._server, row, node, self._dds, carry_out)


@asynccontextmanager
async def dds_serving(
    bus: Bus, guest: Guest, options: Ros2Options, robot: RobotInterface | None = None
) -> AsyncGenerator[Ros2Edge]:
    """Offer the bus to a domain of ROS 2 while the block runs. Raises `Ros2NotJoined`."""
    try:
        dds = DdsGraph(options.domain, options.namespace, options.remappings)
    except DDSException as error:
        raise Ros2NotJoined(domain=options.domain) from error
    edge = Ros2Edge(bus, guest, dds, robot)
    dds.start()
    try:
        yield edge
    finally:
        await edge.close()
        await asyncio.to_thread(dds.close)
