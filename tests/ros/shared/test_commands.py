"""Beside the graph: the `maya` commands find the queue of a ROS stack."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.ros.launched_layers import HERE, THERE, LaunchedLayers, near, primitive

pytestmark = pytest.mark.system

MAYA = str(Path(sys.executable).with_name("maya"))
SLOW = 0.01
"""Share of the speed at which a motion outlasts the start of a few commands."""


def output_of(robot: LaunchedLayers, *words: str) -> str:
    """Return the output of a command."""
    return robot.ros.tool(MAYA, *words)


@pytest.mark.waits("5 s of homing at fifty times real speed, once for the folder, as rospy lives in real time")
def test_the_commands_find_the_robot_and_its_queue(robot: LaunchedLayers) -> None:
    assert json.loads(output_of(robot, "status", "--json"))["state"]["homed"] is True
    x, y, z = robot.away()
    output_of(robot, "approach", str(x), str(y), str(z))
    assert near(robot.twin()["point"][:2], (x, y))
    assert "running" in output_of(robot, "queue")


def test_robot_events_are_printed_once_on_the_screen_and_jobs_are(robot: LaunchedLayers) -> None:
    before = len(robot.launched.said)

    def lines(word: str) -> int:
        return sum(word in line for line in robot.launched.said[before:].splitlines())

    output_of(robot, "gripper", "close")
    output_of(robot, "gripper", "open")
    robot.eventually(lambda: lines("name=gripper state=done") == 2, "both jobs are said to be done")
    assert (lines("gripper_closed"), lines("gripper_open")) == (1, 1)


def test_a_second_service_is_refused_while_the_node_runs(robot: LaunchedLayers) -> None:
    second = subprocess.run(
        [MAYA, "up"], env=robot.ros.environment, capture_output=True, text=True, timeout=30, check=False
    )
    assert second.returncode != 0
    assert "5004" in second.stderr


def test_stop_ends_the_job_and_pauses_the_queue_until_resume(robot: LaunchedLayers) -> None:
    robot.at_speed(SLOW)
    first = robot.away()
    second = next(place for place in (HERE, THERE) if place != first)
    before = robot.mark()
    robot.driver.publish("/send_task", "maya_robot/MayaPrimitive", primitive("approach", first))
    robot.until_told("moving", before)
    robot.driver.publish("/send_task", "maya_robot/MayaPrimitive", primitive("approach", second))
    robot.eventually(
        lambda: len(json.loads(output_of(robot, "queue", "--json"))["waiting"]) == 1, "the second one waits"
    )
    output_of(robot, "stop")
    robot.until_told("stopped", before)
    robot.at_rest()
    stood = robot.twin()["joints"]
    robot.at_speed(1.0)
    assert "paused" in output_of(robot, "queue")
    assert near(robot.twin()["joints"], stood, within=1e-9)
    output_of(robot, "queue", "resume")
    robot.eventually(lambda: near(robot.twin()["point"][:2], second[:2]), "the second one is done")
