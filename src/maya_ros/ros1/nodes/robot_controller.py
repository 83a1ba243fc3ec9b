"""Node robot_controller: the robot layer, on the controller layer of the graph.

It serves /maya_command, subscribes to /maya_move, and carries out the goals that primitive_server forwards. If users
exist, the graph acts with the token in the file that $MAYA_GRAPH_TOKEN_FILE names.
"""

from __future__ import annotations

import asyncio

from maya_ros.graph.distributed import robot_layer
from maya_ros.graph.permissions import PermittedGraph
from maya_ros.ros1.configuration import awaited
from maya_ros.ros1.controlling import ros_time
from maya_ros.ros1.node import RosNode, run
from maya_ros.ros1.rights import rights_of_node
from maya_un.assembly.staff import staffed


def main() -> int:
    """Run the node; return the exit code."""
    return run("robot_controller", serve)


async def serve(node: RosNode) -> None:
    """Serve the robot layer until cancelled."""
    waiting = "Waiting for the controller layer (hw_simulator or hardware_interface)."
    config = await awaited(node.graph.parameters, speed=node.speed, waiting=lambda: node.say(waiting))
    with staffed(config) as staff:
        staff.own.warm()
        async with rights_of_node(node.speed) as rights:
            graph = PermittedGraph(node.graph, rights.permit)
            async with robot_layer(graph, config, staff.own, clock=ros_time, speed=node.speed) as controller:
                await controller.connected()
                await node.say_ready("The robot layer is offered to the graph.")
                await asyncio.Event().wait()
