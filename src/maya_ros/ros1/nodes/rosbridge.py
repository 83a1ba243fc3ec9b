"""Node rosbridge: the endpoint of `maya up --rosbridge` over the real graph, and how ros_coms finds it.

In a namespace it serves only the names there, under the manual's names. Parameters, private or under /maya: port (9090,
in a namespace any free one; 0 for any), origins (pages that may command besides those of this machine). It writes its
address into the parameter `URL`. It listens on the loopback only, in real time, whatever the speed of the twin's clock.

ros_coms, the link to supervisors, is not a node. It waits for that address unless $IP names another rosbridge. In a
namespace, its HTTP server takes any free port, unless $PORT names one.
"""

from __future__ import annotations

import asyncio
import os
from threading import Event

import rosgraph

from maya_ros.ros1.controlling import ros_time
from maya_ros.ros1.master import settle_namespace, told, whole
from maya_ros.ros1.node import RosNode, require_master, run
from maya_ros.ros1.rights import looked
from maya_ros.ros1.serving import edge_of, endpoint_of
from maya_ros.rosbridge.endpoint import PORT
from maya_un.http.sockets import bound_socket
from maya_un.namespace import namespace

URL = "/rosbridge/url"
"""The parameter with the address of rosbridge; the launch file sets it to "" first."""


def main() -> int:
    """Run the node; return the exit code."""
    return run("rosbridge", serve, scaled=False)


async def serve(node: RosNode) -> None:
    """Serve until cancelled; raises `AddressInUse`, `InvalidValue` and `StorageDamaged`."""
    listener = bound_socket(await node.number("port", 0 if namespace() else PORT))
    url = "ws://{}:{}".format(*listener.getsockname()[:2])
    edge = edge_of(await node.parameter("origins", []))
    async with looked() as users:
        endpoint = endpoint_of(node.graph, ros_time, edge, users)
        async with endpoint.serving(listener):
            await node.graph.parameters.set(URL, url)
            node.say(f"rosbridge is served at {url}.")
            await asyncio.Event().wait()


_LOOK = 0.2
"""Period of reading the parameter [s]."""


def settle_environment() -> None:
    """Wait for rosbridge, then set the variables that `maya coms` reads; raises `MasterGone`."""
    settle_namespace()
    if namespace():
        os.environ.setdefault("PORT", "0")
    if not os.environ.get("IP"):
        os.environ["IP"] = _wait_for_url()


def _wait_for_url() -> str:
    """Wait for the rosbridge of this namespace and return its address; raises `MasterGone`."""
    require_master()
    pause = Event()
    while True:
        try:
            found = str(told(lambda at: at.getParam(whole(URL))))
        except rosgraph.MasterError:
            found = ""
        if found:
            return found
        pause.wait(_LOOK)
