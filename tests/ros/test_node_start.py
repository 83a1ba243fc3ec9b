"""How nodes start: each describes itself in its help without a master, and light ones load only what they need."""

from __future__ import annotations

import json

import pytest

from tests.ports import free_port
from tests.ros.workspace import ROOT, Workspace, python, run

pytestmark = pytest.mark.system


@pytest.mark.parametrize(
    ("package", "node", "word", "told"),
    [
        ("maya_controller", "hw_simulator", "--help", "address (sim, or HOST:PORT"),
        ("maya_controller", "hardware_interface", "-h", "skip_home"),
        ("maya_controller", "sensor_converter", "-h", "/hardware_sensor"),
        ("maya_controller", "joint_gui", "-h", "sliders"),
        ("maya_robot", "robot_controller", "--help", "/maya_command"),
        ("maya_robot", "primitive_server", "-h", "/task"),
        ("maya_process", "process_controller", "-h", "http_port"),
        ("maya_process", "firebase_bridge", "-h", "/step_result"),
        ("maya_process", "rosbridge", "-h", "origins"),
        ("maya_process", "ros2", "-h", "cyclonedds"),
    ],
)
def test_help_describes_the_node(workspace: Workspace, package: str, node: str, word: str, told: str) -> None:
    nobody = {"ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}"}
    said = run(["rosrun", package, f"{node}.py", word], ROOT, {**workspace.environment(), **nobody})
    assert said.startswith(f"Node {node}: ")
    assert told in said


LOADED = """
import importlib, json, sys
importlib.import_module(f"maya_ros.ros1.nodes.{sys.argv[1]}")
print(json.dumps(sorted(sys.modules)))
"""
MOVING = {
    "dmc41x3.driver",
    "dmc41x3.twin",
    "maya_un.assembly",
    "maya_un.controller",
    "maya_un.kinematics",
    "maya_un.motion",
}
"""Modules that move the robot or compute its motion."""


ABOVE = {"maya_un.assembly.stack", "maya_un.process.process", "maya_un.service.service"}
"""Modules of the layers above the controller and the robot."""


@pytest.mark.parametrize(
    ("node", "heavy"),
    [
        ("primitive_server", MOVING),
        ("rosbridge", {"fastapi", "maya_un.http.app", *ABOVE}),
        *((node, ABOVE) for node in ("hw_simulator", "hardware_interface", "sensor_converter", "robot_controller")),
        ("firebase_bridge", ABOVE),
    ],
)
def test_a_light_node_loads_only_what_it_needs(workspace: Workspace, node: str, heavy: set[str]) -> None:
    said = run([str(python()), "-c", LOADED, node], ROOT, workspace.environment())
    assert heavy & set(json.loads(said.splitlines()[-1])) == set()
