"""The ROS namespace of this Maya: it keeps several Mayas on one computer and one ROS master apart.

In a namespace (`roslaunch … ns:=maya2`, or $ROS_NAMESPACE) every name of the graph begins with it, and a Maya has its
own files and its own robot's name. Without a namespace, all names are the manual's.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

VARIABLE = "ROS_NAMESPACE"
"""The environment variable in which roslaunch gives a program its namespace."""


def namespace() -> str:
    """Return the namespace without outer slashes, "" for none."""
    return os.environ.get(VARIABLE, "").strip("/")


def own(folder: Path) -> Path:
    """Return `folder`; in a namespace, the subfolder for the Maya in that namespace."""
    inner = namespace()
    return folder / f"ns-{inner.replace('/', '-')}" if inner else folder


def robot_name() -> str:
    """Return the default name of the robot: MAYA; in the namespace maya2, MAYA2."""
    return re.sub("[^A-Z0-9_]", "_", namespace().upper())[:64] or "MAYA"
