"""One robot in a ROS 2 graph: the topics, services and actions of a graph under the same names, on DDS.

`graph.table` lists what there is. A row belongs to the node that offers it, so ROS 2 shows the nodes of the manual. The
graph is a bus, or a real one of ROS 1. ROS 2 has no sign-in: all its programs are one guest, with the rights of the
token that the edge was given.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncGenerator, Callable, Mapping
from contextlib import asynccontextmanager

from cyclonedds.core import DDSException

from maya_ros.graph import types as graph_types
from maya_ros.graph.access import Guest, RestrictedGraph
from maya_ros.graph.outcome import goal_to_its_end
from maya_ros.graph.protocol import Feedback, GoalResult, Graph, GraphHandle, Heard, Message, NodeInfo, Stamp
from maya_ros.graph.table import FOLLOW, NODES, STEP_RESULT, TABLE, Kind, Row, asked_by_topic
from maya_ros.ros2 import types
from maya_ros.ros2.dds import Counts, DdsGraph, SampleWriter
from maya_ros.ros2.demand import ReaderDemand
from maya_ros.ros2.names import quality
from maya_ros.ros2.robot import RobotInterface
from maya_ros.ros2.server import ActionServer, ServiceServer, TopicInbox
from maya_ros.ros2.standard import StandardInterfaces
from maya_un.edges import Ros2Options
from maya_un.errors import MayaError, Ros2NotJoined

NODE = "ros2"
"""The node of the graph that acts for the programs of ROS 2."""

_log = logging.getLogger("maya_ros.ros2")


class Ros2Edge:
    """The endpoints of one graph on DDS; without `robot`, those of the table alone.

    `graph` is that of the node `NODE`, and `now` returns the time of its stamps. Everything but the conversions runs in
    the running loop.
    """

    def __init__(
        self, graph: Graph, guest: Guest, dds: DdsGraph, now: Callable[[], Stamp], robot: RobotInterface | None = None
    ) -> None:
        self._graph = graph
        self._guest = guest
        self._dds = dds
        self._robot = robot
        self._restricted = RestrictedGraph(graph, guest)
        self._server = ServiceServer(dds, now)
        self._standard: StandardInterfaces | None = None
        self._offered: set[str] = set()
        self._held: list[GraphHandle] = []
        self._demand = ReaderDemand()
        self._server.spawn(self._demand.follow())

    @property
    def counts(self) -> Counts:
        """Messages that were not delivered."""
        return self._dds.counts

    async def look(self) -> None:
        """Offer what the graph has and ROS 2 has not yet; raises what the directory of the graph raises."""
        there = await self._graph.directory.nodes()
        found = {row: _offering(row, there) for row in TABLE if row.name not in self._offered}
        for row, node in found.items():
            if node is not None:
                self._offer(row, node)
        if any(found.values()):
            self._dds.announce()

    async def close(self) -> None:
        """Cancel what programs of ROS 2 have begun, and wait until the robot is at rest."""
        await self._server.close()
        if self._standard is not None:
            self._standard.close()
        for held in (self._demand, *self._held):
            held.close()

    def _offer(self, row: Row, node: str) -> None:
        self._offered.add(row.name)
        match row.form:
            case Kind.SERVICE:
                self._serve(row, node)
            case Kind.ACTION:
                self._act(row, node)
            case Kind.TOPIC if row.heard:
                self._hear(row, node)
            case Kind.TOPIC:
                self._publish(row, node)
        if row is FOLLOW and self._robot is not None:
            self._standard = StandardInterfaces(
                self._graph, self._restricted, self._dds, self._server, self._demand, self._robot, node
            )

    def _publish(self, row: Row, node: str) -> None:
        """Send what Maya publishes."""
        writer = self._dds.publisher(node, row.name, types.message_type(row.type), quality(row))
        send = _news(writer) if row.rate and row.latch else writer.send

        def subscribe() -> GraphHandle:
            return self._graph.subscribe(row.name, row.type, send, queue_size=row.queue_size)

        if row is STEP_RESULT or (row.rate and not row.latch):  # a result waits for somebody who reads it
            self._demand.add(writer, subscribe)
        else:
            self._held.append(subscribe())

    def _hear(self, row: Row, node: str) -> None:
        """Take what programs of ROS 2 send. The graph has the publisher from the beginning, for it knows it late."""
        kind = types.message_type(row.type)
        outlet = self._graph.advertise(row.name, row.type, queue_size=row.queue_size)
        self._held.append(outlet)

        def take(message: Message) -> None:
            try:
                self._guest.require(asked_by_topic(row.name))
                outlet.publish(message)
            except MayaError as refusal:
                _log.warning("%s: %s %s", row.name, refusal.code, refusal)

        inbox = TopicInbox(asyncio.get_running_loop(), max(1, row.queue_size), self.counts, take)
        self._dds.subscription(node, row.name, kind, quality(row), lambda sample: inbox.put(kind.message(sample)))

    def _serve(self, row: Row, node: str) -> None:
        kinds = types.service_types(row.type)
        self._graph.expect(row.name)

        async def answer(message: Message) -> Message:
            return await self._restricted.call(row.name, message, row.type)

        self._server.serve(node, row.name, kinds, graph_types.halves(row.type)[1], answer)

    def _act(self, row: Row, node: str) -> None:
        async def carry_out(goal: Message, feedback: Feedback) -> GoalResult:
            return await goal_to_its_end(self._restricted, row.name, row.type, goal, feedback)

        ActionServer(self._server, row, node, self._dds, carry_out)


def _news(writer: SampleWriter) -> Heard:
    """Return what sends the messages on a topic, and leaves out repeated ones while nobody reads."""
    last: Message = {}

    def send(message: Message) -> None:
        nonlocal last
        if message != last or writer.read:
            writer.send(message)
        last = message

    return send


def _offering(row: Row, there: Mapping[str, NodeInfo]) -> str | None:
    """Return the node of the manual that offers a row, None if none does."""
    for name in (*row.nodes, *NODES):
        does = there.get(f"/{name}")
        if does is not None and row.name in _offers(row, does):
            return name
    return None


def _offers(row: Row, does: NodeInfo) -> tuple[str, ...]:
    """Return the names that a node offers in the form of a row."""
    match row.form:
        case Kind.SERVICE:
            return does.serves
        case Kind.ACTION:
            return tuple(name.removesuffix("/status") for name in does.publishes if name.endswith("/status"))
        case Kind.TOPIC:
            return does.subscribes if row.heard else does.publishes


@asynccontextmanager
async def dds_serving(
    graph: Graph, guest: Guest, options: Ros2Options, now: Callable[[], Stamp], robot: RobotInterface | None = None
) -> AsyncGenerator[Ros2Edge]:
    """Offer a graph to a domain of ROS 2 while the block runs.

    Raises `Ros2NotJoined`, and what the directory of the graph raises.
    """
    try:
        dds = DdsGraph(options.domain, options.namespace, options.remappings)
    except DDSException as error:
        raise Ros2NotJoined(domain=options.domain) from error
    edge = Ros2Edge(graph, guest, dds, now, robot)
    try:
        await edge.look()
        dds.start()
        yield edge
    finally:
        await edge.close()
        await asyncio.to_thread(dds.close)
