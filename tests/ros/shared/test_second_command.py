"""While one command runs, every interface for single commands refuses another with a code; the first is unharmed."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from maya_ros.graph.protocol import GoalStatus
from tests.ros.driver_client import Message
from tests.ros.launched_layers import DONE, HERE, SLOW, LaunchedLayers, near, primitive

pytestmark = pytest.mark.system

BUSY = "2104"
JOINTS = {"a": 0.9, "b": 1.6, "c": 1.6}
TRAJECTORY = {
    "trajectory": {
        "joint_names": ["a", "b", "c"],
        "points": [{"positions": [0.5, 1.6, 1.6]}, {"positions": [0.9, 1.6, 1.6]}],
    }
}


def _action(name: str, kind: str, goal: Message) -> Callable[[LaunchedLayers], tuple[int, str]]:
    def second(robot: LaunchedLayers) -> tuple[int, str]:
        outcome, result = robot.driver.do(name, kind, goal).ended()
        return outcome, result["code"]

    return second


def _by_service(robot: LaunchedLayers) -> tuple[int, str]:
    answer = robot.command("approach", HERE)
    return GoalStatus.ABORTED if answer["success"] else GoalStatus.REJECTED, answer["code"]


def _by_gripper(robot: LaunchedLayers) -> tuple[int, str]:
    answer = robot.driver.call("/gripper", {"data": True})
    return GoalStatus.ABORTED if answer["success"] else GoalStatus.REJECTED, str(answer["message"]).partition(":")[0]


SECONDS = {
    "/home": _action("/home", "maya_controller/Home", {}),
    "/move": _action("/move", "maya_controller/Move", JOINTS),
    "/controller/follow": _action("/controller/follow", "maya_controller/Follow", TRAJECTORY),
    "/task": _action("/task", "maya_robot/Task", {"task": primitive("approach", HERE)}),
    "/maya_command": _by_service,
    "/gripper": _by_gripper,
}


@pytest.mark.parametrize("interface", SECONDS)
def test_second_command_is_refused_and_the_first_goes_on(interface: str, robot: LaunchedLayers) -> None:
    robot.at_speed(SLOW)
    place = robot.away()
    first = robot.begun("approach", place)
    assert SECONDS[interface](robot) == (GoalStatus.REJECTED, BUSY)
    assert not robot.can_teleop()
    robot.at_speed(1.0)
    assert first.ended() == (GoalStatus.SUCCEEDED, DONE)
    assert near(robot.twin()["point"][:2], place[:2])


def test_a_second_goal_at_the_controller_leaves_the_first_alone(robot: LaunchedLayers) -> None:
    robot.at_speed(SLOW)
    a = robot.twin()["joints"][0]
    target = {"a": 0.4 if a > 0.8 else 1.2, "b": 1.6, "c": 1.6}
    before = robot.mark()
    first = robot.driver.do("/move", "maya_controller/Move", target)
    robot.until_told("moving", before)
    assert SECONDS["/move"](robot) == (GoalStatus.REJECTED, BUSY)
    assert SECONDS["/task"](robot)[1] == BUSY
    robot.at_speed(1.0)
    assert first.ended()[0] == GoalStatus.SUCCEEDED
    assert near(robot.twin()["joints"], target.values())


def test_second_command_on_a_topic_is_refused_by_an_event(robot: LaunchedLayers) -> None:
    robot.at_speed(SLOW)
    first = robot.begun("approach", robot.away())
    before = robot.mark()
    robot.driver.publish("/controller/command", "trajectory_msgs/JointTrajectory", TRAJECTORY["trajectory"])
    assert str(robot.until_told("refused", before)["code"]) == BUSY
    robot.at_speed(1.0)
    assert first.ended() == (GoalStatus.SUCCEEDED, DONE)
