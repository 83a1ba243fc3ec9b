"""Node hw_simulator: the controller layer on the virtual twin, and its sensor values.

Parameters, private or under /maya: speed (the clock's factor), skip_home, address (sim, or HOST:PORT of a twin in
another process), take_over (take that twin, at rest, from another program that owns it), seed (where the twin powers
up), table (a job file whose parts stand on its table) and parts (others by name and place). Its service ~twin returns
the state of the twin's mechanics. If users exist, the graph acts with the token in the file that $MAYA_GRAPH_TOKEN_FILE
names.
"""

from __future__ import annotations

from dmc41x3.address import SIM
from maya_ros.graph.servers.sensors import SensorServer
from maya_ros.ros1.configuration import checked, configured
from maya_ros.ros1.controlling import fast_enough, log_event, offered, ros_time
from maya_ros.ros1.node import RosNode, run
from maya_ros.ros1.twin import parts_on_table, serve_inspection
from maya_un.assembly.controller import controller_layer
from maya_un.assembly.staff import staffed
from maya_un.errors import SpeedOnRealMachine


def main() -> int:
    """Run the node; return the exit code."""
    return run("hw_simulator", serve)


async def serve(node: RosNode) -> None:
    """Serve the controller layer of the twin until cancelled; raises as `assembly.controller_layer` does."""
    address = checked(await node.parameter("address", SIM))
    if address != SIM and node.speed != 1.0:
        raise SpeedOnRealMachine(address=address)
    async with configured(node.graph.parameters) as config:
        job, named = str(await node.parameter("table", "")), await node.parameter("parts", {})
        with staffed(config) as staff:
            staff.own.warm()
            async with controller_layer(
                fast_enough(config, node.speed),
                address,
                take_over=await node.flag("take_over"),
                seed=await node.number("seed", 0),
                parts=parts_on_table(config, job, named),
                speed=node.speed,
                heard=lambda events: events.heard_by(log_event),
                workers=staff.own,
            ) as layer:
                if layer.twin is not None:
                    serve_inspection(node.graph, layer.twin)
                sensors = SensorServer(layer.controller, config, scene=layer.twin, clock=ros_time, speed=node.speed)
                async with sensors.open(node.graph):
                    await offered(node, layer, staff.people, skip_home=await node.flag("skip_home"))
