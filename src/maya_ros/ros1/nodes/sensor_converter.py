"""Node sensor_converter: the machine's sensor values, over a separate connection to the controller.

It publishes /hardware_sensor, subscribes to it, and publishes the converted values: position, joints and what rviz
draws. Parameters, private or under /maya: address (real for the configured one, or HOST:PORT).
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
    """Run the node; return the exit code."""
    return run("sensor_converter", serve)


async def serve(node: RosNode) -> None:
    """Publish measurements until cancelled; raises the errors of connecting."""
    address = checked(await node.parameter("address", REAL))
    if address == SIM:
        raise InvalidValue(key="address", value=address, reason="with sim_mode:=false it is that of a machine")
    config = await awaited(node.graph.parameters, waiting=lambda: node.say("Waiting for the controller's node."))
    heard = SensedController(config)
    server = SensorServer(heard, config, clock=ros_time, speed=node.speed)
    probe = Probe(config, meant(address, config.controller.address), ros_time)
    async with server.open(node.graph), heard.listening(node.graph):
        await probe.tell(node.graph)
