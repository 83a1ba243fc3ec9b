"""Node process_controller: the durable queue, for /send_task, /start_queue and /stop_queue, and for the HTTP server.

Its runtime file is that of `maya up`, so `maya status`, `maya queue`, `maya stop` and the others call this node.
Parameters, private or under /maya: http_port (the usual one, or any free one if that is taken). If users exist, the
graph acts with the token in the file that $MAYA_GRAPH_TOKEN_FILE names.
"""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager, suppress

from dmc41x3.address import REAL, SIM, meant
from maya_ros.graph.clients.controller import GraphController
from maya_ros.graph.clients.robot import GraphRobot
from maya_ros.graph.distributed import robot_layer_seen
from maya_ros.graph.servers.operations import InternalApp, OperationServer
from maya_ros.graph.servers.process import GraphQueue, ProcessServer
from maya_ros.ros1.configuration import awaited
from maya_ros.ros1.controlling import log_own_event, ros_time
from maya_ros.ros1.node import RosNode, run
from maya_ros.ros1.rights import graph_rights
from maya_un import runtime
from maya_un.assembly.stack import ProcessAssembly, keep_events, process_layer, storage
from maya_un.assembly.staff import staffed
from maya_un.config import Config, default_path
from maya_un.config.state_folder import queue_file
from maya_un.errors import AddressInUse, MayaError
from maya_un.events import EventLog
from maya_un.http import dates, log
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.metrics import Metrics
from maya_un.http.sockets import PORT, bound_socket
from maya_un.http.thread import served


def main() -> int:
    """Run the node; return the exit code."""
    return run("process_controller", serve)


async def serve(node: RosNode) -> None:
    """Work the queue until cancelled; raises `AlreadyRunning`, `AddressInUse`, `StorageInUse` and related errors."""
    waiting = "Waiting for the controller layer (hw_simulator or hardware_interface)."
    with (
        runtime.claimed(),
        log.kept(people=False),
        await _server(node) as near,
        robot_layer_seen(node.graph) as missing,
    ):
        config = await awaited(node.graph.parameters, speed=node.speed, waiting=lambda: node.say(waiting))
        metrics = Metrics()
        async with _layer(node, config, metrics) as (layer, controller), graph_rights(layer.access.callers) as rights:
            bridge = _bridge(layer, missing)
            app = create_app(bridge, None, metrics)
            queue = GraphQueue(layer.gate.call, layer.service.queue.view, controller, rights.who)
            server = ProcessServer(queue, clock=ros_time, speed=node.speed)
            operations = OperationServer(InternalApp(bridge), lambda: controller.stops, rights.who)
            async with (
                served(app, near) as url,
                _timed(metrics, node.speed),
                server.open(node.graph),
                operations.open(node.graph),
            ):
                runtime.publish(runtime.Running(url, os.getpid(), None))
                try:
                    await node.say_ready(f"The queue is worked; {url} and the `maya` commands find it.")
                    await asyncio.Event().wait()
                finally:
                    await layer.process.close()


async def _server(node: RosNode) -> socket.socket:
    """Return the socket for HTTP: at the named port, else at the usual one, else at any free one."""
    if await node.parameter("http_port", None) is not None:
        return bound_socket(await node.number("http_port", PORT))
    with suppress(AddressInUse):
        return bound_socket(PORT)
    node.warn(f"Port {PORT} is taken; HTTP is served at another one.")
    return bound_socket(0)


@asynccontextmanager
async def _layer(
    node: RosNode, config: Config, metrics: Metrics
) -> AsyncIterator[tuple[ProcessAssembly, GraphController]]:
    """Yield the process layer on the layers of the graph, with its storage."""
    simulated = await node.flag("sim_mode", default=True)
    address = SIM if simulated else meant(str(await node.parameter("address", REAL)), config.controller.address)
    async with (
        storage(queue_file(), config.storage) as kept,
        GraphController.on(node.graph, config, speed=node.speed) as controller,
    ):
        assert kept.journal is not None
        keep_events(controller.events, kept.journal, dates)
        _listened(controller.events, metrics)
        await controller.connected()
        with staffed(config) as staff:
            staff.own.warm()
            async with process_layer(
                GraphRobot(node.graph, controller, config, speed=node.speed),
                controller,
                config,
                address=address,
                speed=node.speed,
                places=default_path().with_name("poses.toml"),
                journal=kept.journal,
                calendar=dates,
                users=kept.users,
                staff=staff,
            ) as layer:
                yield layer, controller


def _listened(events: EventLog, metrics: Metrics) -> None:
    for listener in (metrics.happened, log.note_event, log_own_event):
        events.heard_by(listener)


def _bridge(layer: ProcessAssembly, missing: Callable[[], Sequence[MayaError]]) -> Bridge:
    return Bridge(
        asyncio.get_running_loop(),
        layer.service,
        gate=layer.gate,
        callers=layer.access.callers,
        journal=layer.journal,
        missing=missing,
    )


@asynccontextmanager
async def _timed(metrics: Metrics, speed: float) -> AsyncGenerator[None]:
    """Measure the delay of the loop while the block runs."""
    watching = asyncio.create_task(metrics.watch_loop(speed))
    try:
        yield
    finally:
        watching.cancel()
        await asyncio.gather(watching, return_exceptions=True)
