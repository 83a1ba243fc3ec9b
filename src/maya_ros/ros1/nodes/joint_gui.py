"""Node joint_gui: draws the joints that the sliders set while the robot is silent (`graph.urdf.Sliders`)."""

from __future__ import annotations

import asyncio

from maya_ros.graph.urdf import Relay, Sliders
from maya_ros.ros1.node import RosNode, run
from maya_un.config import load
from maya_un.kinematics.mechanism import Mechanism


def main() -> int:
    """Run the node; return the exit code."""
    return run("joint_gui", serve)


async def serve(node: RosNode) -> None:
    """Choose what is drawn until cancelled. The silence of the robot is measured in real time."""
    loop = asyncio.get_running_loop()
    relay = Relay(node.graph, Sliders(Mechanism.of(load()), lambda: loop.time() / node.speed))
    try:
        await asyncio.Event().wait()
    finally:
        relay.close()
