"""Node ros2: the graph for programs of ROS 2, over DDS, as `maya up --ros2` offers it.

Topics, services and actions appear in ROS 2 a second at most after their nodes. It needs the package cyclonedds in the
Python of the nodes. Parameters, private or under /maya: domain ($ROS_DOMAIN_ID, else 0), namespace (that of this node
in ROS 1). The stamps are real time, whatever the speed of the twin's clock.

ROS 2 has no sign-in: if users exist, its programs act with the token in the file that $MAYA_GRAPH_TOKEN_FILE names.
"""

from __future__ import annotations

import asyncio
import os
from contextlib import suppress

from maya_ros.graph import urdf
from maya_ros.graph.clients.controller import GraphController
from maya_ros.graph.halts import Halts
from maya_ros.graph.protocol import Stamp, stamp
from maya_ros.graph.timing import MotionTimer
from maya_ros.ros1.configuration import awaited
from maya_ros.ros1.controlling import ros_time
from maya_ros.ros1.node import RosNode, run
from maya_ros.ros1.rights import graph_guest, looked
from maya_ros.ros2 import needed
from maya_ros.ros2.robot import RobotInterface
from maya_un.assembly.staff import staffed
from maya_un.edges import DOMAIN, Ros2Options, ros2_domain, ros2_namespace
from maya_un.errors import MasterGone
from maya_un.namespace import namespace
from maya_un.service.computing import Computing

LOOK = 1.0
"""Period of the look for nodes that have come [s]."""


def main() -> int:
    """Run the node; return the exit code."""
    return run("ros2", serve, scaled=False)


async def serve(node: RosNode) -> None:
    """Serve until cancelled; raises `Ros2Missing`, `Ros2NotJoined`, `InvalidValue` and `StorageDamaged`."""
    with needed():
        # an extra
        from maya_ros.ros2.edge import NODE, dds_serving  # noqa: PLC0415
    options = await _options(node)
    waiting = "Waiting for the controller layer (hw_simulator or hardware_interface)."
    config = await awaited(node.graph.parameters, waiting=lambda: node.say(waiting))
    with needed():
        description = await asyncio.to_thread(urdf.describe, config)
    async with (
        looked() as users,
        graph_guest(users, NODE) as guest,
        GraphController.on(node.graph, config) as controller,
    ):
        with staffed(config) as staff, Halts.of(controller) as halts:
            robot = RobotInterface(
                description,
                MotionTimer(controller, Computing(staff.people)),
                lambda: controller.state.joints,
                halts,
                scaled=False,
                settled=controller.settled,
            )
            async with dds_serving(node.graph, guest, options, _now, robot) as edge:
                node.say(f"This graph is in domain {options.domain} of ROS 2.")
                while True:
                    await asyncio.sleep(LOOK)
                    with suppress(MasterGone):
                        await edge.look()


async def _options(node: RosNode) -> Ros2Options:
    domain = await node.parameter("domain", os.environ.get(DOMAIN) or 0)
    return Ros2Options(
        ros2_domain(str(domain), "domain"),
        ros2_namespace(str(await node.parameter("namespace", namespace())), "namespace"),
    )


def _now() -> Stamp:
    return stamp(ros_time())
