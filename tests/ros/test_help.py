"""Every node describes itself in its help, and needs no master for that."""

from __future__ import annotations

import pytest

from tests.ports import free_port
from tests.ros.workspace import ROOT, Workspace, run

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
    ],
)
def test_help_describes_the_node(workspace: Workspace, package: str, node: str, word: str, told: str) -> None:
    nobody = {"ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}"}
    said = run(["rosrun", package, f"{node}.py", word], ROOT, {**workspace.environment(), **nobody})
    assert said.startswith(f"Node {node}: ")
    assert told in said
