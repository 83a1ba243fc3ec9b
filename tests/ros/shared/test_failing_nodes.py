"""Parts of the graph that hang or are started twice: this is reported, and no stop is lost."""

from __future__ import annotations

import json

import pytest

from tests.ros.launched_layers import LaunchedLayers, near

pytestmark = pytest.mark.system

ALREADY, GONE = "5004", "1011"

SCRIPTS = {
    "hw_simulator": "maya_controller",
    "robot_controller": "maya_robot",
    "process_controller": "maya_process",
}


@pytest.mark.parametrize("node", SCRIPTS)
def test_second_node_of_a_name_is_refused_and_the_first_continues(robot: LaunchedLayers, node: str) -> None:
    before = robot.moving()
    second = robot.ros.start("rosrun", SCRIPTS[node], f"{node}.py")
    assert second.wait() == 2, second.said
    assert f"error {ALREADY}: " in second.said
    assert f"process {robot.ros.process(f'/{node}')}" in second.said
    assert "stopped" not in robot.words(before)
    robot.at_speed(1.0)
    robot.until_told("idle", before)


@pytest.mark.waits("1 s until a node that does not answer a stop counts as one that hangs")
def test_a_stop_against_a_node_that_hangs_names_it_and_is_not_lost(robot: LaunchedLayers) -> None:
    before = robot.moving()
    with robot.frozen("/hw_simulator"):
        said = robot.ros.maya("--json", "stop")
        assert json.loads(said.stdout or said.stderr).get("error", {}).get("code") == int(GONE), said
    robot.until_told("stopped", before)
    robot.at_rest()
    stood = robot.twin()["joints"]
    robot.at_speed(1.0)
    robot.eventually(robot.can_teleop, "the robot layer sees it again")
    assert near(robot.twin()["joints"], stood, within=1e-9)


def test_hanging_node_carries_out_only_the_stop_of_a_disconnected_caller(robot: LaunchedLayers) -> None:
    before = robot.moving()
    with (
        robot.ros.asking("/gripper") as gripper,
        robot.ros.asking("/controller/stop") as stop,
        robot.frozen("/hw_simulator"),
    ):
        gripper.sendall(b"\x01\x00\x00\x00\x01")
        stop.sendall(b"\x00\x00\x00\x00")
        for link in (gripper, stop):
            link.close()
    robot.until_told("stopped", before)
    robot.at_rest()
    assert not {"gripper_opened", "gripper_closed"} & set(robot.words(before))
