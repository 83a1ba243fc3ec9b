"""Names in the ROS graph: a node's own names lie below its namespace, and without one they are the manual's.

In this project names are absolute ("/maya_event") and those of one Maya. `whole` and `inner` translate between these
and the names of the graph, which may hold several Mayas.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import TypeVar

import rospy

from maya_un.namespace import VARIABLE

T = TypeVar("T")


def settle_namespace() -> None:
    """Put the namespace into the environment if an argument (`__ns:=`) named it: files of this Maya lie by it."""
    os.environ[VARIABLE] = rospy.get_namespace()


def whole(name: str) -> str:
    """Return the name in the graph of what is called `name` here; "~NAME" is private to this node."""
    return rospy.resolve_name(name.lstrip("/") or rospy.get_namespace())


def inner(name: str) -> str | None:
    """Return what a name of the graph is called here, None for one outside of the namespace."""
    space = rospy.get_namespace()
    return name[len(space) - 1 :] if name.startswith(space) else None


def inner_names(names: Iterable[str]) -> list[str]:
    """Return what names of the graph are called here, without those outside of the namespace."""
    return [found for name in names if (found := inner(name)) is not None]


def inner_keys(values: Mapping[str, T]) -> dict[str, T]:
    """Return values by names of the graph under the names here, without those outside of the namespace."""
    return {found: value for name, value in values.items() if (found := inner(name)) is not None}
