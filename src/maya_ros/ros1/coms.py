"""Tell ros_coms, the link to supervisors, where the rosbridge of its namespace is. ros_coms is not a node.

$IP sets the address of another rosbridge. In a namespace, the HTTP server of ros_coms takes any free port, unless $PORT
names one.
"""

from __future__ import annotations

import os
from threading import Event

import rosgraph

from maya_ros.ros1.master import settle_namespace, told, whole
from maya_ros.ros1.node import require_master
from maya_ros.ros1.nodes.rosbridge import URL
from maya_un.namespace import namespace

_LOOK = 0.2
"""Period of reading the parameter [s]."""


def settle_environment() -> None:
    """Wait for rosbridge, then set the variables that `maya coms` reads; raises `MasterGone`."""
    settle_namespace()
    if namespace():
        os.environ.setdefault("PORT", "0")
    if not os.environ.get("IP"):
        os.environ["IP"] = _rosbridge()


def _rosbridge() -> str:
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
