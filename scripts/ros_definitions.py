"""Copies into the ROS packages what they must hold to build: definitions, the model's macros, the view of rviz2.

The source of definitions and macros is src/maya_ros/graph. ROS 1 has three packages of definitions in ros/; ROS 2 has
one, ros2/maya_interfaces, in whose definitions Maya's own types have no package, and texts stand in quotation marks.
The view of rviz2 is that of rviz in ros/maya_controller, in its form. With --check it writes nothing and says which
copies are not current.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import yaml
from generated_files import ROOT, update

GRAPH = ROOT / "src" / "maya_ros" / "graph"
SOURCE = GRAPH / "definitions"
MACROS = GRAPH / "description"
URDF = (ROOT / "ros" / "maya_controller" / "urdf", ROOT / "ros2" / "maya_description" / "urdf")
RVIZ = ROOT / "ros" / "maya_controller" / "rviz" / "urdf.rviz"
RVIZ2 = ROOT / "ros2" / "maya_description" / "rviz" / "maya.rviz"
NOTE = "Made by scripts/docs from ros/maya_controller/rviz/urdf.rviz; change that instead."
FORMS = ("msg", "srv", "action")

OWN_PACKAGE = re.compile(r"\bmaya_(?:controller|process|robot)/")
TEXT_CONSTANT = re.compile(r"^(string\s+\w+) = (.*)$", re.MULTILINE)


def main(arguments: list[str]) -> int:
    """Write or check all copies; return 1 where a check found one that is not current."""
    return update({**dict.fromkeys(_present()), **copies()}, arguments, "scripts/docs")


def copies() -> dict[Path, str]:
    """Return every copy with its text."""
    found: dict[Path, str] = {}
    for path in _files(SOURCE):
        text = path.read_text(encoding="utf-8")
        found[ROOT / "ros" / path.relative_to(SOURCE)] = text
        found[ROOT / "ros2" / "maya_interfaces" / path.parent.name / path.name] = in_ros2(text)
    for path in MACROS.glob("*.xacro"):
        found.update({folder / path.name: path.read_text(encoding="utf-8") for folder in URDF})
    found[RVIZ2] = in_rviz2(RVIZ.read_text(encoding="utf-8"))
    return found


def in_ros2(text: str) -> str:
    """Return a definition in the form of ROS 2."""
    return TEXT_CONSTANT.sub(r'\1 = "\2"', OWN_PACKAGE.sub("", text))


def in_rviz2(text: str) -> str:
    """Return a view of rviz in the form of rviz2: its classes, and topics with their quality."""
    own = text.replace("rviz/Displays", "rviz_common/Displays").replace("Class: rviz/", "Class: rviz_default_plugins/")
    view = yaml.safe_load(own)
    for display in view["Visualization Manager"]["Displays"]:
        if "Robot Description" in display:
            del display["Robot Description"]
            display |= {"Description Source": "Topic", "Description Topic": _latched("/robot_description")}
        if "Marker Topic" in display:
            del display["Queue Size"]
            display["Topic"] = _latched(display.pop("Marker Topic"))
    return f"# {NOTE}\n{yaml.safe_dump(view, sort_keys=False)}"


def _latched(topic: str) -> dict[str, Any]:
    """Return a topic that sends its last message to later readers."""
    quality = {"Depth": 5, "Durability Policy": "Transient Local", "History Policy": "Keep Last"}
    return {**quality, "Reliability Policy": "Reliable", "Value": topic}


def _present() -> list[Path]:
    macros = [path for folder in URDF for path in folder.glob("*.xacro")]
    return [*_files(ROOT / "ros"), *_files(ROOT / "ros2"), *macros, *RVIZ2.parent.glob("*.rviz")]


def _files(folder: Path) -> list[Path]:
    return [path for form in FORMS for path in folder.glob(f"*/{form}/*.{form}")]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
