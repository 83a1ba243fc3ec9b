"""The layers above the controller as nodes: each a client of the layer below and a server for the layer above.

robot_layer        node robot_controller    /maya_command, /maya_move, and the task action that decides who may move
robot_layer_seen   check for missing nodes of the robot layer

`servers.forwarding` serves /task in node primitive_server.
"""

from __future__ import annotations

from collections.abc import AsyncGenerator, Callable, Generator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass

from maya_ros.graph.clients.controller import GraphController
from maya_ros.graph.outcome import cancel_on_stop
from maya_ros.graph.protocol import Graph
from maya_ros.graph.servers.forwarding import DECIDING_NODE, INNER
from maya_ros.graph.servers.robot import RobotServer
from maya_ros.graph.servers.tasks import Clock
from maya_ros.graph.table import TASK
from maya_un.config import Config
from maya_un.controller.protocol import Controller
from maya_un.errors import MayaError, NodeGone
from maya_un.robot.primitives import Primitive
from maya_un.robot.robot import MayaRobot, OnPhase, Robot
from maya_un.values import Progress, State
from maya_un.workers import Workers


@dataclass(frozen=True, slots=True)
class DistributedLayers:
    """A robot layer and the layer below, as a server uses them."""

    robot: Robot
    controller: Controller

    @property
    def state(self) -> State:
        """Latest state."""
        return self.controller.state

    @property
    def can_teleop(self) -> bool:
        """Whether the robot can take a command."""
        return self.robot.can_teleop

    def progress(self) -> Progress | None:
        """Progress of the motion under way, None at rest."""
        return self.controller.progress()

    async def run(self, primitive: Primitive, on_phase: OnPhase | None = None) -> None:
        """Execute a primitive; a stop ends it also between two of its motions."""
        await cancel_on_stop(self.controller.events, self.robot.run(primitive, on_phase))


@asynccontextmanager
async def robot_layer(
    graph: Graph, config: Config, workers: Workers | None = None, *, clock: Clock | None = None, speed: float = 1.0
) -> AsyncGenerator[GraphController]:
    """Serve the robot layer, on the controller layer of the same graph, while the block runs.

    As long as the controller layer is missing, commands are refused. A running command is at rest when the block ends.
    """
    async with GraphController.on(graph, config, speed=speed) as controller:
        server = RobotServer(
            DistributedLayers(MayaRobot(controller, config, workers), controller), clock=clock, speed=speed
        )
        async with server.commands(graph), server.task(graph, INNER):
            yield controller


@contextmanager
def robot_layer_seen(graph: Graph) -> Generator[Callable[[], list[MayaError]]]:
    """Yield a function that returns an error for each missing node of the robot layer."""
    actions = {DECIDING_NODE: INNER, TASK.sources[0]: TASK.name}
    heard = {
        node: graph.subscribe(f"{action}/status", "actionlib_msgs/GoalStatusArray", lambda _: None, queue_size=1)
        for node, action in actions.items()
    }
    try:
        yield lambda: [NodeGone(node=node) for node, status in heard.items() if not status.writers]
    finally:
        for status in heard.values():
            status.close()
