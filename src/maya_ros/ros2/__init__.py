"""Maya in a ROS 2 graph, over DDS (Cyclone DDS from PyPI), without an installation of ROS 2.

names   names and qualities     types   the ROS 2 form of every type of the graph
dds     nodes, endpoints and discovery, as rmw_cyclonedds makes them
edge    topics, services and actions of one robot
demand  subscriptions that last as long as somebody reads
robot   what the standard interfaces need of a robot beside its graph
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from maya_un.errors import Ros2Missing


@contextmanager
def needed() -> Iterator[None]:
    """Raise `Ros2Missing` if the block imports a package that is not installed."""
    try:
        yield
    except ImportError as missing:
        raise Ros2Missing(name=str(missing.name)) from missing
