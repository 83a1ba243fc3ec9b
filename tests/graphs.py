"""Layers on one bus, in virtual time: twin and controller, robot, process, each as a separate node."""

from __future__ import annotations

from collections.abc import AsyncIterator, Mapping
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, field

from maya_ros.graph.bus import Bus, BusNode
from maya_ros.graph.clients.controller import GraphController
from maya_ros.graph.clients.robot import GraphRobot
from maya_ros.graph.distributed import robot_layer
from maya_ros.graph.servers.controller import ControllerServer
from maya_ros.graph.servers.forwarding import tasks_forwarded
from maya_ros.graph.servers.sensors import SensorServer
from maya_ros.graph.timing import MotionTimer
from maya_un.config import Config
from maya_un.controller.controller import GalilController
from maya_un.events import Event
from maya_un.machine.mechanics import MayaMechanics
from maya_un.machine.truth import StartPose
from maya_un.process.process import Process
from maya_un.service.computing import Computing
from maya_un.testing.rig import Rig, rig
from maya_un.values import Point
from tests.calm import CALM
from tests.homing_mark import take_over
from tests.unit.controller.bench import HERE
from tests.virtual_time import turn


@dataclass
class ControllerNode:
    """The controller layer behind its servers, as the node hw_simulator."""

    rig: Rig
    bus: Bus
    node: BusNode

    @property
    def mechanics(self) -> MayaMechanics:
        """The mechanics, whose record decides the result."""
        return self.rig.mechanics

    async def dies(self) -> None:
        """End the node as a kill does."""
        self.node.close()
        await turn()


def timer_of(controller: GalilController) -> MotionTimer:
    """Return the timer of a controller's motions, in the running loop."""
    return MotionTimer(controller, Computing(None))


@asynccontextmanager
async def controller_node(
    bus: Bus, *, config: Config = CALM, parts: Mapping[str, Point] | None = None, homed: bool = False
) -> AsyncIterator[ControllerNode]:
    """Open the controller layer of a twin on a bus; a `homed` one stands at `HERE`, with an open gripper."""
    node = bus.node("hw_simulator")
    async with (
        bench_of(config, parts, homed=homed) as bench,
        ControllerServer(bench.controller, timer_of(bench.controller)).open(node),
        SensorServer(bench.controller, bench.controller.config).open(node),
    ):
        yield ControllerNode(bench, bus, node)


@asynccontextmanager
async def bench_of(
    config: Config, parts: Mapping[str, Point] | None = None, *, homed: bool = False
) -> AsyncIterator[Rig]:
    """Open the controller layer of a twin alone; a `homed` one stands at `HERE`, with an open gripper."""
    start = StartPose(*HERE) if homed else None
    async with rig(config, parts=parts, start=start, live=True) as bench:
        if homed:
            await take_over(bench.controller, bench.virtual, HERE)
            await bench.controller.gripper(open_=True)
        yield bench


@asynccontextmanager
async def seen_from(bus: Bus, name: str, config: Config = CALM) -> AsyncIterator[tuple[BusNode, GraphController]]:
    """Yield a connected node and its client of the controller layer."""
    node = bus.node(name)
    async with GraphController.on(node, config) as controller:
        await controller.connected()
        yield node, controller
    node.close()


@dataclass
class LayerNodes:
    """All layers, each as a node: `controller`, `robot` and `process` are those of the process layer's node."""

    controller_node: ControllerNode
    bus: Bus
    controller: GraphController
    robot: GraphRobot
    process: Process
    nodes: dict[str, BusNode] = field(default_factory=dict[str, BusNode])

    @property
    def mechanics(self) -> MayaMechanics:
        """The mechanics, whose record decides the result."""
        return self.controller_node.mechanics

    async def dies(self, name: str) -> None:
        """End a node as a kill does."""
        self.nodes[name].close()
        await turn()

    async def at_rest(self) -> None:
        """Wait until nothing moves, according to the controller layer itself."""
        async for state in self.controller_node.rig.controller.watch():
            if not state.moving and self.controller_node.rig.controller.progress() is None:
                return

    async def until(self, kind: type[Event], **detail: object) -> None:
        """Wait for the next event of the process layer's node."""
        events = self.controller.events
        async for event in events.follow(len(events)):
            if isinstance(event, kind) and all(event.detail.get(key) == value for key, value in detail.items()):
                return


@asynccontextmanager
async def layer_nodes(
    *, config: Config = CALM, parts: Mapping[str, Point] | None = None, homed: bool = True
) -> AsyncIterator[LayerNodes]:
    """Open all layers on a bus, each as a separate node; see `controller_node` for a robot that is `homed`."""
    bus = Bus()
    names = ("robot_controller", "primitive_server", "process_controller")
    async with AsyncExitStack() as stack:
        low = await stack.enter_async_context(controller_node(bus, config=config, parts=parts, homed=homed))
        nodes = {name: bus.node(name) for name in names}
        deciding = await stack.enter_async_context(robot_layer(nodes["robot_controller"], config))
        await stack.enter_async_context(tasks_forwarded(nodes["primitive_server"]))
        top = nodes["process_controller"]
        controller = await stack.enter_async_context(GraphController.on(top, config))
        await deciding.connected()
        await controller.connected()
        robot = GraphRobot(top, controller, config)
        process = Process(robot, controller, config)
        await process.open()
        stack.push_async_callback(process.close)
        yield LayerNodes(low, bus, controller, robot, process, {**nodes, "hw_simulator": low.node})
