"""Names and qualities of the graph in ROS 2; this module needs no DDS."""

from __future__ import annotations

from typing import NamedTuple

from maya_ros.graph.table import Kind, Row

PACKAGE = "maya_interfaces"
"""The package of Maya's own types in ROS 2."""

OWN = frozenset({"maya_controller", "maya_process", "maya_robot"})
"""Maya's packages in ROS 1."""

FORMS = {Kind.TOPIC: "msg", Kind.SERVICE: "srv", Kind.ACTION: "action"}
"""The form of definition of each kind of a row."""


PARAMETER_SERVICES = {
    "list_parameters": "ListParameters",
    "get_parameters": "GetParameters",
    "get_parameter_types": "GetParameterTypes",
    "describe_parameters": "DescribeParameters",
    "set_parameters": "SetParameters",
    "set_parameters_atomically": "SetParametersAtomically",
}
"""The services of a node's parameters, and their types in rcl_interfaces."""


class Quality(NamedTuple):
    """The quality of service of a reliable endpoint: how many messages it keeps; with `late`, for later readers too."""

    depth: int = 10
    late: bool = False


SERVICE = Quality(100)
"""The quality of services, those of actions included."""


def name_of(kind: str, form: str = "msg") -> str:
    """Return the ROS 2 name of a type of the graph: maya_interfaces/action/Home for maya_controller/Home."""
    package, _, own = kind.partition("/")
    return f"{PACKAGE if package in OWN else package}/{form}/{own}"


def quality(row: Row) -> Quality:
    """Return the quality of a topic."""
    return Quality(max(1, row.queue_size), late=row.latch)
