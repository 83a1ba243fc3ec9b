"""The manual's graph without ROS: a bus in the server's loop, the doors of all floors on it, and the endpoint."""

from __future__ import annotations

import socket
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager
from pathlib import Path
from typing import NamedTuple

from maya_un.address import SIM
from maya_un.assembly import Stack
from maya_un.config import Config
from maya_un.graph.bus import Bus, BusNode
from maya_un.graph.doors.bridge import BridgeDoor
from maya_un.graph.doors.controller import ControllerDoor
from maya_un.graph.doors.process import ProcessDoor
from maya_un.graph.doors.robot import RobotDoor
from maya_un.graph.doors.sensors import SensorsDoor
from maya_un.graph.protocol import Graph
from maya_un.graph.queue import Queue, status_of
from maya_un.graph.step_store import StepStore
from maya_un.graph.table import POSITION
from maya_un.rosbridge.endpoint import NODE, Endpoint
from maya_un.rosbridge.near import NearController, NearRobot, Scenery, echoed
from maya_un.server import dates
from maya_un.server.bridge import Bridge
from maya_un.server.edge import Edge


class Place(NamedTuple):
    """Where the endpoint is served, to whom, and the file that keeps which steps were carried out."""

    door: socket.socket
    edge: Edge
    steps: Path


@asynccontextmanager
async def endpoint(
    stack: Stack, bridge: Bridge, place: Place, *, speed: float = 1.0, now: Callable[[], float] = dates.epoch
) -> AsyncIterator[Endpoint]:
    """Serve rosbridge for `stack`, which lives in the bridge's loop with a clock of `speed`, while the block runs.

    `now` is the date [s since the epoch], which messages are stamped with. Raises `StorageInUse` and its kin.
    """
    bus = Bus(now)
    async with AsyncExitStack() as held:
        store = await StepStore.open(place.steps)
        held.push_async_callback(store.close)
        await _describe(bus, stack, speed)
        await _open_doors(held, bus, stack, bridge, store, speed, now)
        serving = Endpoint(lambda: _seat(bus), now, place.edge)
        await held.enter_async_context(serving.serving(place.door))
        yield serving


async def _open_doors(
    held: AsyncExitStack,
    bus: Bus,
    stack: Stack,
    bridge: Bridge,
    store: StepStore,
    speed: float,
    now: Callable[[], float],
) -> None:
    echo = await held.enter_async_context(echoed(bridge, speed))
    floor = NearController(stack, bridge, echo)
    hardware = "hw_simulator" if stack.address == SIM else "hardware_interface"
    scene = None if stack.twin is None else Scenery(stack.twin)
    queue = Queue(bridge.carry, lambda: status_of(echo.view, stack.controller))
    sensors = SensorsDoor(floor, stack.config, raw=lambda: stack.controller.record, scene=scene, clock=now)
    doors = (
        (hardware, ControllerDoor(floor, address=stack.address, clock=now)),
        ("sensor_converter" if scene is None else hardware, sensors),
        ("robot_controller", RobotDoor(NearRobot(stack, bridge, echo), clock=now)),
        ("process_controller", ProcessDoor(queue, clock=now)),
        ("firebase_bridge", BridgeDoor(store, dates.now, clock=now)),
    )
    for name, door in doors:
        node = bus.node(name)
        held.callback(node.close)
        await held.enter_async_context(door.open(node))


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
def _seat(bus: Bus) -> Iterator[Graph]:
    node: BusNode = bus.node(NODE)
    try:
        yield node
    finally:
        node.close()


def told_often(config: Config, speed: float) -> Config:
    """Return the configuration with as many records as /maya_position needs while the clock runs at `speed`."""
    rate = max(config.controller.stream_rate, POSITION.rate / max(1.0, speed))
    return config.model_copy(update={"controller": config.controller.model_copy(update={"stream_rate": rate})})
