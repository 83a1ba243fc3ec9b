"""Edges of `maya up`: entry points, and the error for one that is missing."""

from __future__ import annotations

import sys
from contextlib import AsyncExitStack
from importlib.metadata import EntryPoint, entry_points
from typing import Any, cast

import pytest

from maya_ros.edge import in_ros2
from maya_un.cli.service.up import ros2_of
from maya_un.edges import GROUP, Ros2Options, edge
from maya_un.errors import EdgeNotInstalled, InvalidValue, Ros2Missing


@pytest.mark.parametrize("point", entry_points(group=GROUP), ids=lambda point: point.name)
def test_every_edge_has_both_functions(point: EntryPoint) -> None:
    found = edge(point.name)
    assert callable(found.endpoint)
    assert callable(found.configured)


def test_the_graph_of_ros_is_an_edge() -> None:
    assert "ros" in entry_points(group=GROUP).names


def test_a_missing_edge_is_named() -> None:
    with pytest.raises(EdgeNotInstalled, match="provides the interface fieldbus"):
        edge("fieldbus")


async def test_without_dds_the_command_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith(("cyclonedds", "maya_ros.ros2"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "cyclonedds", None)
    with pytest.raises(Ros2Missing, match="pip install cyclonedds") as missing:
        async with AsyncExitStack() as held:
            await held.enter_async_context(
                in_ros2(cast("Any", None), cast("Any", None), Ros2Options(0), cast("Any", None))
            )
    assert missing.value.code == 5016


@pytest.mark.parametrize(
    ("domain", "namespace"), [("233", ""), ("\u0663", ""), ("one", ""), ("-1", ""), ("0", "a b"), ("0", "1st")]
)
def test_a_domain_or_namespace_that_cannot_be_is_named(
    domain: str, namespace: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    with pytest.raises(InvalidValue, match="--ros-namespace" if namespace else "ROS_DOMAIN_ID"):
        ros2_of(namespace)
    monkeypatch.setenv("ROS_DOMAIN_ID", "")
    assert ros2_of("lab/left") == Ros2Options(0, "lab/left")


def test_names_of_ros_2_can_be_others() -> None:
    found = ros2_of("left", ["/maya_event:=/events", "task:=work"])
    assert found.remappings == {"/maya_event": "/events", "/task": "work"}
    for wrong in ("/task", "/task:=", "/task:=a b", ":=/x", "/task:=/1x", "a" * 40 + "!:=b"):
        with pytest.raises(InvalidValue, match="--ros-remap"):
            ros2_of("", [wrong])
