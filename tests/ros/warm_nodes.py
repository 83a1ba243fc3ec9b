"""Start nodes of ROS fast: fork them from a process that has loaded ROS and our modules for it.

To load them takes most of the processor time of a launch. `roslaunch` starts `warm_python` as the Python of a node,
which orders the node from that process. The environment variable `FORKER` tells where it listens; without it, and for
other programs, `warm_python` is the Python of .venv-ros.
"""

from __future__ import annotations

import functools
import importlib
import os
import pkgutil
import sys
from collections.abc import Mapping
from pathlib import Path

from tests import fork_server

FORKER = "MAYA_TEST_FORKER"
"""The variable with the abstract address of the forking process, in hexadecimal."""


def warm(python: Path, environment: Mapping[str, str]) -> dict[str, str]:
    """Return what a program needs in its environment besides, so that the nodes that it starts are forked."""
    starting = fork_server.starting(environment)
    return {FORKER: _forker(python, frozenset(starting.items())).hex()}


@functools.cache
def _forker(python: Path, starting: frozenset[tuple[str, str]]) -> bytes:
    """Return the address of a forking process for nodes that start with these variables."""
    return fork_server.Forker.started(python, {**os.environ, **dict(starting)}, __name__).address


def main(first: int, listening: int) -> None:
    """Load what nodes need, and serve."""
    fork_server.serve(first, listening, _load, _begin)


def _load() -> None:
    package = importlib.import_module("maya_ros.ros1")
    for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        importlib.import_module(found.name)


def _begin() -> None:
    """Have rospy read the arguments of the node, as it does when it loads."""
    names = importlib.import_module("rospy.names")
    names.reload_mappings(sys.argv)
