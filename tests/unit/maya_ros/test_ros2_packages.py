"""The packages that users build in ROS 2: what they install and start is there."""

from __future__ import annotations

import sys
import xml.etree.ElementTree as Xml
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
import yaml
from typer.main import get_command

from maya_ros.graph.table import DESCRIPTION, MARKERS, ROS2_TABLE, TABLE
from maya_un.cli.app import app
from tests.conventions.source import ROOT

ROS2 = ROOT / "ros2"
PACKAGES = ["maya_bringup", "maya_description", "maya_interfaces"]
VIEW = ROS2 / "maya_description" / "rviz" / "maya.rviz"
LAUNCH = ROS2 / "maya_bringup" / "launch" / "maya.launch.py"


@pytest.mark.parametrize("name", PACKAGES)
def test_package_has_its_name_the_version_and_what_it_installs(name: str) -> None:
    package = Xml.parse(ROS2 / name / "package.xml").getroot()
    other = Xml.parse(ROOT / "ros" / "maya_controller" / "package.xml").getroot()
    assert package.findtext("name") == name
    assert package.findtext("version") == other.findtext("version")
    build = (ROS2 / name / "CMakeLists.txt").read_text(encoding="utf-8")
    assert f"project({name})" in build
    installed = build.partition("install(DIRECTORY ")[2].partition(" DESTINATION")[0].split()
    assert {folder.name for folder in (ROS2 / name).iterdir() if folder.is_dir()} - {"msg", "srv", "action"} == set(
        installed
    )


def test_the_view_reads_topics_that_the_robot_has() -> None:
    text = VIEW.read_text(encoding="utf-8")
    assert "Class: rviz/" not in text
    view = yaml.safe_load(text)
    displays = view["Visualization Manager"]["Displays"]
    topics = [part for display in displays for key, part in display.items() if key.endswith("Topic")]
    assert [topic["Value"] for topic in topics] == [DESCRIPTION.name, MARKERS.name]
    latched = {row.name for row in (*TABLE, *ROS2_TABLE) if row.latch}
    assert {topic["Value"] for topic in topics if topic["Durability Policy"] == "Transient Local"} <= latched
    assert (
        "rviz/" not in (ROS2 / "maya_description" / "rviz" / "maya.rviz").read_text(encoding="utf-8").split("\n", 1)[1]
    )


class _Given:
    """A substitution or an action of launch: it holds what it was made with."""

    def __init__(self, *given: Any, **more: Any) -> None:
        self.given, self.more = given, more

    def perform(self, context: dict[str, str]) -> str:
        return context[self.given[0]]


@pytest.fixture
def launch(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Load the launch file with stand-ins of launch, which is not packaged outside ROS 2: each holds its arguments."""
    for name in ("launch", "launch.actions", "launch.conditions", "launch.substitutions", "launch_ros",
                 "launch_ros.actions", "launch_ros.substitutions"):  # fmt: skip
        module: Any = ModuleType(name)
        module.__getattr__ = lambda _: _Given
        monkeypatch.setitem(sys.modules, name, module)
    space: dict[str, Any] = {"__name__": "maya.launch"}
    exec(compile(LAUNCH.read_text(encoding="utf-8"), str(LAUNCH), "exec"), space)
    yield SimpleNamespace(**space)


def test_the_launch_file_starts_the_program_with_options_that_it_has(launch: Any) -> None:
    context = {name: value for name, (value, _) in launch.ARGUMENTS.items()}
    (started,) = launch.program({**context, "options": "--speed 20", "namespace": "left"})
    command = started.more["cmd"]
    assert command == ["maya", "up", "--ros2", "--address", "sim", "--ros-namespace", "left", "--speed", "20"]
    known = {option for param in get_command(app).commands["up"].params for option in param.opts}  # type: ignore[attr-defined]
    assert {word for word in command if word.startswith("--")} <= known


def test_rviz_shows_the_robot_of_the_namespace(launch: Any) -> None:
    names = {name.strip("/") for name, _ in launch.generate_launch_description().given[0][-1].more["remappings"]}
    assert names <= {row.name.strip("/") for row in (*TABLE, *ROS2_TABLE)}


def test_the_folder_holds_these_packages() -> None:
    assert sorted(path.parent.name for path in Path(ROS2).glob("*/package.xml")) == PACKAGES
