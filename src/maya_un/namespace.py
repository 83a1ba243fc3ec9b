"""The ROS namespace of this Maya, which separates several Mayas on one computer and one ROS master.

In a namespace (`roslaunch … ns:=maya2`, or $ROS_NAMESPACE) every name of the graph begins with it, and a Maya has
separate files and a separate robot's name. Without a namespace, all names are the manual's.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

VARIABLE = "ROS_NAMESPACE"
"""The environment variable by which roslaunch passes the namespace to a program."""

_LONGEST_NAME = 64


def namespace() -> str:
    """Return the namespace without outer slashes, "" for none."""
    return os.environ.get(VARIABLE, "").strip("/")


def own(folder: Path) -> Path:
    """Return `folder`; in a namespace, the subfolder of that namespace."""
    inner = namespace()
    return folder / f"ns-{inner.replace('/', '-')}" if inner else folder


def robot_name() -> str:
    """Return the default name of the robot: MAYA; in the namespace maya2, MAYA2. Two namespaces have two names.

    Small letters become capitals and capitals small letters, / becomes -, another sign becomes its hexadecimal code
    between two pairs of hyphens. The namespace maya gives MAYA-. A long name is cut, and ends in a digest of its
    namespace.
    """
    inner = re.sub("/+", "/", namespace())
    if not inner:
        return "MAYA"
    if inner == "maya":
        return "MAYA-"
    name = "".join(_sign(one) for one in inner)
    if len(name) <= _LONGEST_NAME:
        return name
    import hashlib  # noqa: PLC0415 - slow to load, and few names are that long

    return f"{name[:40]}--{hashlib.sha256(inner.encode(errors='replace')).hexdigest()[:20]}"


def _sign(one: str) -> str:
    if one == "/":
        return "-"
    return one.swapcase() if re.fullmatch("[A-Za-z0-9_]", one) else f"--{ord(one):x}--"
