"""The interfaces that ROS 2 expects of any robot: model, frames, clock, log, parameters, and trajectories."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from functools import partial

from maya_ros.graph.access import RestrictedGraph
from maya_ros.graph.protocol import Graph, Message, Stamp, in_seconds
from maya_ros.graph.table import (
    CLOCK,
    DESCRIPTION,
    FOLLOW,
    FOLLOW_JOINTS,
    JOINTS,
    PROGRAM,
    ROSOUT,
    TF,
    TF_STATIC,
    Row,
)
from maya_ros.ros2 import types
from maya_ros.ros2.dds import DdsGraph, SampleWriter
from maya_ros.ros2.demand import ReaderDemand
from maya_ros.ros2.model import FrameTree
from maya_ros.ros2.names import PARAMETER_SERVICES, quality
from maya_ros.ros2.parameters import Parameters
from maya_ros.ros2.robot import RobotInterface
from maya_ros.ros2.server import ActionServer, ServiceServer
from maya_ros.ros2.trajectory import JointTrajectories
from maya_un.http import log

_LOGGERS = ("", log.ROOT)
"""The loggers whose messages are published: that of all libraries, and that of the program, which hands nothing up."""

_own = logging.getLogger("maya_ros")

LONGEST = 4096
"""Longest text of a message in the log [characters]."""


class StandardInterfaces:
    """The interfaces of one robot.

    `restricted` is `graph` with the rights of the programs of ROS 2; `hardware` is the node of the controller layer.
    """

    def __init__(
        self,
        graph: Graph,
        restricted: RestrictedGraph,
        dds: DdsGraph,
        server: ServiceServer,
        demand: ReaderDemand,
        robot: RobotInterface,
        hardware: str,
    ) -> None:
        self._dds = dds
        self._now = server.now
        self._show(graph, demand, FrameTree(robot.description), robot.description)
        parameters = Parameters(restricted, sim_time=robot.scaled)
        for name, kind in PARAMETER_SERVICES.items():
            kinds = types.service_types(f"rcl_interfaces/{kind}")
            server.serve(PROGRAM, f"/{PROGRAM}/{name}", kinds, "", partial(parameters.answer, name))
        if robot.scaled:
            server.spawn(self._tick(self._publisher(CLOCK)))
        trajectories = JointTrajectories(
            restricted,
            graph,
            robot,
            lambda: in_seconds(server.now()),
            partial(restricted.require_action, FOLLOW.name),
        )
        ActionServer(server, FOLLOW_JOINTS, hardware, dds, trajectories.carry_out)
        self._log = RosoutHandler(self._publisher(ROSOUT), server.now)
        for name in _LOGGERS:
            logging.getLogger(name).addHandler(self._log)
        _own.setLevel(logging.INFO)  # for good: another robot in this process may need it after this one

    def close(self) -> None:
        """Publish nothing more."""
        for name in _LOGGERS:
            logging.getLogger(name).removeHandler(self._log)

    def _show(self, graph: Graph, demand: ReaderDemand, frames: FrameTree, description: str) -> None:
        self._publisher(DESCRIPTION).send({"data": description})
        self._publisher(TF_STATIC).send(frames.fixed(self._now()))
        moving = self._publisher(TF)

        def hear(message: Message) -> None:
            moving.send_made(lambda: frames.moving(message))

        demand.add(moving, lambda: graph.subscribe(JOINTS.name, JOINTS.type, hear, queue_size=JOINTS.queue_size))

    async def _tick(self, clock: SampleWriter) -> None:
        while True:
            clock.send({"clock": self._now()})
            await asyncio.sleep(1.0 / CLOCK.rate)

    def _publisher(self, row: Row) -> SampleWriter:
        return self._dds.publisher(row.sources[0], row.name, types.message_type(row.type), quality(row))


class RosoutHandler(logging.Handler):
    """Publishes the log of this program (rcl_interfaces/Log); the levels of Python are those of ROS 2."""

    def __init__(self, writer: SampleWriter, now: Callable[[], Stamp]) -> None:
        super().__init__(logging.INFO)
        self._writer = writer
        self._now = now
        self._last: logging.LogRecord | None = None

    def emit(self, record: logging.LogRecord) -> None:
        """Publish a record, unless the writing thread itself logged it: it would come back to that thread."""
        if self._writer.writes_in(record.thread) or record is self._last:
            return
        self._last = record  # it comes again from a logger further up
        try:
            text = record.getMessage()[:LONGEST]
        except Exception:  # noqa: BLE001 - as every handler, this one reports a record that has no text
            self.handleError(record)
            return
        self._writer.send(
            {
                "stamp": self._now(),
                "level": record.levelno,
                "name": record.name,
                "msg": text,
                "file": record.filename,
                "function": record.funcName or "",
                "line": record.lineno,
            }
        )
