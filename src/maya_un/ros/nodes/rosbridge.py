"""Node rosbridge: the endpoint of `maya up --rosbridge`, over the real graph; any topic, service and action of it.

Parameters, private or under /maya: port (9090; 0 for any), origins (pages that may command besides those of this
machine). It listens on the loopback only, and its clock is that of the wall, however fast the twin's runs.
"""

from __future__ import annotations

import asyncio
from contextlib import nullcontext

from maya_un.ros.controlling import ros_time
from maya_un.ros.node import Node, run
from maya_un.ros.rights import looked
from maya_un.rosbridge.endpoint import PORT, Endpoint
from maya_un.server.doors import bound_socket
from maya_un.server.edge import Edge, host_of, origin_of


def main() -> int:
    """Be the node; return the exit code."""
    return run("rosbridge", serve, scaled=False)


async def serve(node: Node) -> None:
    """Serve until cancelled; raises `AddressInUse`, `InvalidValue` and `StorageDamaged`."""
    door = bound_socket(await node.number("port", PORT))
    async with looked() as users:
        endpoint = Endpoint(lambda _: nullcontext(node.graph), ros_time, await _edge(node), admission=users)
        async with endpoint.serving(door):
            node.say("rosbridge is served at ws://{}:{}.".format(*door.getsockname()[:2]))
            await asyncio.Event().wait()


async def _edge(node: Node) -> Edge:
    origins = frozenset(origin_of(str(page)) for page in await node.parameter("origins", []))
    return Edge(hosts=frozenset(map(host_of, origins)), origins=origins)
