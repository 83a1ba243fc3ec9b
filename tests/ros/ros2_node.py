"""The node ros2 of a graph, and a stranger of ROS 2 that sees this graph; nothing leaves this machine."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from tests.ros.harness import Ros
from tests.ros.programs import Program
from tests.system.strangers import LOOPBACK, Stranger, own_domain, stranger


@contextmanager
def ros2_node(ros: Ros, name: str = "ros2") -> Iterator[tuple[Program, Stranger]]:
    """Run the node under a name of ROS 1, and a program of ROS 2, while the block runs; other names do not meet."""
    domain = own_domain() - len(name)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CYCLONEDDS_URI", LOOPBACK)
        command = ("rosrun", "maya_process", "ros2.py", f"__name:={name}", f"_domain:={domain}")
        node = ros.start(*command, environment={"CYCLONEDDS_URI": LOOPBACK})
        node.until(f"domain {domain} of ROS 2")
        with stranger(domain) as peer:
            yield node, peer
