"""The manual's graph without ROS: a bus in the server's loop, the servers of all layers on it, and the endpoint."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager, contextmanager
from functools import partial
from pathlib import Path
from socket import socket
from typing import Protocol

from dmc41x3.address import SIM
from maya_ros.graph.access import Guest
from maya_ros.graph.bus import Bus, BusNode
from maya_ros.graph.protocol import Graph
from maya_ros.graph.servers.controller import ControllerServer
from maya_ros.graph.servers.operations import InternalApp, OperationServer
from maya_ros.graph.servers.process import GraphQueue, ProcessServer
from maya_ros.graph.servers.robot import RobotServer
from maya_ros.graph.servers.sensors import SensorServer
from maya_ros.graph.servers.steps import TaskServer
from maya_ros.graph.servers.tasks import Clock
from maya_ros.graph.table import POSITION
from maya_ros.graph.timing import MotionTimer
from maya_ros.rosbridge.endpoint import NODE, Endpoint
from maya_ros.rosbridge.thread_proxy import ControllerProxy, RobotProxy, StackEvents, echoed
from maya_un.assembly.stack import Stack
from maya_un.config import Config
from maya_un.http import dates
from maya_un.http.bridge import Bridge
from maya_un.http.origins import OriginPolicy
from maya_un.steps.store import StepStore


@asynccontextmanager
async def served(bus: Bus, bridge: Bridge, listener: socket, edge: OriginPolicy, now: Clock) -> AsyncIterator[Endpoint]:
    """Serve rosbridge for a graph at `listener` while the block runs."""
    serving = Endpoint(partial(_seat, bus), now, edge, admission=bridge)
    async with serving.serving(listener):
        yield serving


@asynccontextmanager
async def graph_of(
    stack: Stack, bridge: Bridge, steps: Path, *, speed: float = 1.0, now: Clock = dates.epoch
) -> AsyncIterator[Bus]:
    """Yield a graph that offers all layers of `stack`, which runs in the bridge's loop at `speed`.

    The file `steps` records which steps were carried out; `now` returns the date [s since the epoch] for message
    stamps. At the end, all motion that the graph started is at rest. Raises `StorageInUse` and related errors.
    """
    bus = Bus(now)
    await _describe(bus, stack, speed)
    async with AsyncExitStack() as held:
        store = await StepStore.open(steps)
        held.push_async_callback(store.close)
        echo = await held.enter_async_context(echoed(bridge, speed))
        for name, server in _servers(stack, bridge, echo, now):
            await _open(held, bus, name, server)
        name = stack.config.coms.name
        await _open(held, bus, "firebase_bridge", TaskServer(store, dates.now, clock=now, name=name))
        yield bus


class _LayerServer(Protocol):
    def open(self, graph: Graph, /) -> AbstractAsyncContextManager[object]: ...


def _servers(stack: Stack, bridge: Bridge, echo: StackEvents, now: Clock) -> tuple[tuple[str, _LayerServer], ...]:
    """Return the servers, by the names of their nodes in a graph of ROS."""
    layer = ControllerProxy(stack, bridge, echo)
    hardware, sensor = ("hw_simulator",) * 2 if stack.address == SIM else ("hardware_interface", "sensor_converter")
    queue = GraphQueue(bridge.carry, lambda: echo.view, stack.controller)
    return (
        (hardware, ControllerServer(layer, timer_of(stack), address=stack.address, clock=now)),
        (sensor, SensorServer(layer, stack.config, raw=lambda: stack.controller.record, scene=stack.twin, clock=now)),
        ("robot_controller", RobotServer(RobotProxy(stack, bridge, echo), clock=now)),
        ("process_controller", ProcessServer(queue, clock=now)),
        ("process_controller", OperationServer(InternalApp(bridge), lambda: layer.stops)),
    )


def timer_of(stack: Stack) -> MotionTimer:
    """Return the timer of a stack's motions; it takes requests from any loop."""
    return MotionTimer(stack.controller, stack.service.previews.computing)


async def _open(held: AsyncExitStack, bus: Bus, name: str, server: _LayerServer) -> None:
    node = bus.node(name)
    held.callback(node.close)
    await held.enter_async_context(server.open(node))


async def _describe(bus: Bus, stack: Stack, speed: float) -> None:
    """Set the parameters that the nodes of a real graph have."""
    values = {
        "config": stack.config.model_dump(mode="json"),
        "speed": speed,
        "sim_mode": stack.address == SIM,
        "address": stack.address,
    }
    await bus.parameters.set("/maya", values)


@contextmanager
def _seat(bus: Bus, guest: Guest) -> Iterator[Graph]:
    node: BusNode = bus.node(NODE, lambda: guest.caller)
    try:
        yield node
    finally:
        node.close()


def configured(config: Config, speed: float) -> Config:
    """Return the configuration with as many records as /maya_position needs while the clock runs at `speed`."""
    rate = max(config.controller.stream_rate, POSITION.rate / max(1.0, speed))
    return config.model_copy(update={"controller": config.controller.model_copy(update={"stream_rate": rate})})
