"""Node sensor_converter: what the machine's sensors show, by a connection of its own to the controller.

It tells /hardware_sensor, hears it, and tells what that means: position, joints and what rviz draws. Parameters,
private or under /maya: address (real for the configured one, or HOST:PORT).
"""

from __future__ import annotations

from dmc41x3.address import REAL, SIM, meant
from maya_ros.graph.servers.sensors import SensorServer
from maya_ros.ros1.configuration import awaited, checked
from maya_ros.ros1.controlling import ros_time
from maya_ros.ros1.node import RosNode, run
from maya_ros.ros1.sensing import Probe, SensedController
from maya_un.errors import InvalidValue


def main() -> int:
    """Be the node; return the exit code."""
    return run("sensor_converter", serve)


async def serve(node: RosNode) -> None:
    """Tell what is measured until cancelled; raises what connecting raises."""
    address = checked(await node.parameter("address", REAL))
    if address == SIM:
        raise InvalidValue(key="address", value=address, reason="with sim_mode:=false it is that of a machine")
    config = await awaited(node.graph.parameters, waiting=lambda: node.say("Waiting for the controller's node."))
    heard = SensedController(config)
    server = SensorServer(heard, config, clock=ros_time, speed=node.speed)
    probe = Probe(config, meant(address, config.controller.address), ros_time)
    async with server.open(node.graph), heard.listening(node.graph):
        await probe.tell(node.graph)
