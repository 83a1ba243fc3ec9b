"""Node primitive_server: serves /task, and has the robot floor carry it out."""

from __future__ import annotations

import asyncio

from maya_un.graph.apart import tasks_handed_on
from maya_un.ros.node import Node, run


def main() -> int:
    """Be the node; return the exit code."""
    return run("primitive_server", serve)


async def serve(node: Node) -> None:
    """Hand tasks on until cancelled."""
    async with tasks_handed_on(node.graph):
        await node.say_ready("Primitives are done by /task.")
        await asyncio.Event().wait()
