"""Tell ros_coms, the link to supervisors, where the rosbridge of its graph is. It is no node itself.

$IP names another rosbridge than that of its namespace. In a namespace its own HTTP server takes any free port, unless
$PORT names one.
"""

from __future__ import annotations

import os
from threading import Event

import rosgraph

from maya_un.namespace import namespace
from maya_un.ros.beginning import require_master
from maya_un.ros.master import told
from maya_un.ros.names import whole
from maya_un.ros.nodes.rosbridge import URL

_LOOK = 0.2
"""How often the parameter is looked at [s]."""


def settle_environment() -> None:
    """Put what `maya coms` needs into the environment, as soon as rosbridge serves; raises `MasterGone`."""
    if namespace():
        os.environ.setdefault("PORT", "0")
    if not os.environ.get("IP"):
        os.environ["IP"] = _rosbridge()


def _rosbridge() -> str:
    """Return the address of the rosbridge of this namespace, as soon as that serves; raises `MasterGone`."""
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
