"""Node hardware_interface: the controller layer on the machine.

Parameters, private or under /maya: address (real for the configured one, or HOST:PORT), skip_home, and take_over (take
the controller, at rest, from another program that owns it).
If users exist, the graph acts with the token in the file that $MAYA_GRAPH_TOKEN_FILE names.
"""

from __future__ import annotations

from dmc41x3.address import REAL, SIM
from maya_ros.ros1.configuration import checked, configured
from maya_ros.ros1.controlling import log_event, offered
from maya_ros.ros1.node import RosNode, run
from maya_un.assembly.controller import controller_layer
from maya_un.assembly.staff import staffed
from maya_un.errors import InvalidValue


def main() -> int:
    """Run the node; return the exit code."""
    return run("hardware_interface", serve)


async def serve(node: RosNode) -> None:
    """Serve the controller layer of the machine until cancelled; raises as `assembly.controller_layer` does."""
    address = checked(await node.parameter("address", REAL))
    if address == SIM:
        raise InvalidValue(key="address", value=address, reason="with sim_mode:=false it is that of a machine")
    take_over = await node.flag("take_over")
    async with configured(node.graph.parameters) as config:
        with staffed(config) as staff:
            staff.own.warm()
            async with controller_layer(
                config,
                address,
                take_over=take_over,
                heard=lambda events: events.heard_by(log_event),
                workers=staff.own,
            ) as layer:
                await offered(node, layer, staff.people, skip_home=await node.flag("skip_home"))
