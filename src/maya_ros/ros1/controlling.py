"""Common part of the two nodes of the controller layer: its server, its log, and taking over a homing."""

from __future__ import annotations

import asyncio
import logging

import rospy

from maya_ros.graph.permissions import PermittedGraph
from maya_ros.graph.servers.controller import ControllerServer
from maya_ros.graph.table import POSITION
from maya_ros.graph.timing import MotionTimer
from maya_ros.ros1.node import RosNode
from maya_ros.ros1.rights import rights_of_node
from maya_un.assembly.controller import ControllerAssembly
from maya_un.config import Config
from maya_un.errors import MayaError
from maya_un.events import Connected, ControllerEvent, Disconnected, Event
from maya_un.service.computing import Computing
from maya_un.workers import Workers

_WRITE = {
    logging.DEBUG: rospy.logdebug,
    logging.INFO: rospy.loginfo,
    logging.WARNING: rospy.logwarn,
    logging.ERROR: rospy.logerr,
}


def ros_time() -> float:
    """Return the time for message stamps [s]."""
    return rospy.Time.now().to_sec()


def log_event(event: Event) -> None:
    """Write an event to the log of this node."""
    _WRITE[event.level]("%s", f"{event} [{event.code}]" if event.code else event)


def log_own_event(event: Event) -> None:
    """Write an event of a layer above the controller's; the controller's node logs its events itself."""
    news = isinstance(event, Connected | Disconnected)  # only other nodes notice whether that node is alive
    if news or not isinstance(event, ControllerEvent):
        log_event(event)


def fast_enough(config: Config, speed: float) -> Config:
    """Return the configuration with as many records as /maya_position needs while the clock runs at `speed`."""
    rate = max(config.controller.stream_rate, POSITION.rate / max(1.0, speed))
    return config.model_copy(update={"controller": config.controller.model_copy(update={"stream_rate": rate})})


async def offered(node: RosNode, layer: ControllerAssembly, workers: Workers, *, skip_home: bool) -> None:
    """Serve a controller layer on the graph until cancelled; with `skip_home`, take over its stored homing.

    If that is refused, the graph stays up, and motion is refused until a homing. `workers` time motions of clients.
    """
    timer = MotionTimer(layer.controller, Computing(workers))
    server = ControllerServer(layer.controller, timer, address=layer.address, clock=ros_time, speed=node.speed)
    async with rights_of_node(node.speed) as rights, server.open(PermittedGraph(node.graph, rights.permit)):
        await node.say_ready(f"The controller at {layer.address} is offered to the graph.")
        if skip_home:
            try:
                await layer.controller.skip_home()
            except MayaError as refusal:
                node.warn(f"skip_home: error {refusal.code}: {refusal}")
        await asyncio.Event().wait()
