"""Node primitive_server: serves /task, and forwards its goals to the robot layer.

If users exist, the graph acts with the token in the file that $MAYA_GRAPH_TOKEN_FILE names.
"""

from __future__ import annotations

import asyncio

from maya_ros.graph.permissions import PermittedGraph
from maya_ros.graph.servers.forwarding import tasks_forwarded
from maya_ros.ros1.node import RosNode, run
from maya_ros.ros1.rights import rights_of_node


def main() -> int:
    """Run the node; return the exit code."""
    return run("primitive_server", serve)


async def serve(node: RosNode) -> None:
    """Forward tasks until cancelled."""
    async with rights_of_node(node.speed) as rights, tasks_forwarded(PermittedGraph(node.graph, rights.permit)):
        await node.say_ready("Primitives are done by /task.")
        await asyncio.Event().wait()
