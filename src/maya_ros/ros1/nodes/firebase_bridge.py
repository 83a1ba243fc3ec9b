"""Node firebase_bridge: carries out steps of remote processes, from /step_command to /step_result.

It is a client of /task and needs no other node of the process layer. Finished steps are stored in the state folder. If
users exist, the graph acts with the token in the file that $MAYA_GRAPH_TOKEN_FILE names.
"""

from __future__ import annotations

import asyncio

from maya_ros.graph.servers.steps import TaskServer
from maya_ros.ros1.configuration import CONFIG
from maya_ros.ros1.controlling import ros_time
from maya_ros.ros1.node import RosNode, run
from maya_ros.ros1.rights import rights_of_node
from maya_un.config import load
from maya_un.config.state_folder import state_folder
from maya_un.http import dates
from maya_un.steps.store import NAME, StepStore


def main() -> int:
    """Run the node; return the exit code."""
    return run("firebase_bridge", serve)


async def serve(node: RosNode) -> None:
    """Carry out steps until cancelled; raises `StorageInUse`, `StorageDamaged`, `FileUnwritable` and related errors."""
    store = await StepStore.open(state_folder() / NAME)
    try:
        async with (
            rights_of_node(node.speed) as rights,
            TaskServer(
                store,
                dates.now,
                clock=ros_time,
                speed=node.speed,
                permit=rights.permit,
                name=str(await node.graph.parameters.get(f"{CONFIG}/coms/name", load().coms.name)),
            ).open(node.graph),
        ):
            await node.say_ready(
                f"Steps from /step_command are carried out by /task; {state_folder() / NAME} records them."
            )
            await asyncio.Event().wait()
    finally:
        await store.close()
