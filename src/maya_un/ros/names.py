"""Translate between the manual's names and the names in the ROS graph, which may contain several Mayas.

The code uses the manual's absolute names ("/maya_event"). In the graph, the namespace of the node stands before them.
Without a namespace both names are equal.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import TypeVar

import rospy

from maya_un.namespace import VARIABLE

T = TypeVar("T")


def settle_namespace() -> None:
    """Set $ROS_NAMESPACE, also if an argument (`__ns:=`) names the namespace: it determines the files of this Maya."""
    os.environ[VARIABLE] = rospy.get_namespace()


def whole(name: str) -> str:
    """Return the name in the graph for the manual's `name`; "~NAME" is private to this node."""
    return rospy.resolve_name(name.lstrip("/") or rospy.get_namespace())


def inner(name: str) -> str | None:
    """Return the manual's name for a name in the graph, None for one outside of the namespace."""
    space = rospy.get_namespace()
    return name[len(space) - 1 :] if name.startswith(space) else None


def inner_names(names: Iterable[str]) -> list[str]:
    """Return the manual's names for names in the graph, without those outside of the namespace."""
    return [found for name in names if (found := inner(name)) is not None]


def inner_keys(values: Mapping[str, T]) -> dict[str, T]:
    """Return values under the manual's names instead of those in the graph, without those outside of the namespace."""
    return {found: value for name, value in values.items() if (found := inner(name)) is not None}
