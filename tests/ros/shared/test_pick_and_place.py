"""A part is picked and placed by each way that the manual names; the mechanics' own record judges."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from maya_ros.graph.protocol import GoalStatus
from tests.ros.launched_layers import DONE, HERE, THERE, LaunchedLayers, near, primitive

pytestmark = pytest.mark.system

Place = tuple[float, float, float]


def by_task(robot: LaunchedLayers, here: Place, there: Place) -> None:
    assert robot.task("pick", here).ended() == (GoalStatus.SUCCEEDED, DONE)
    assert robot.task("place", there).ended() == (GoalStatus.SUCCEEDED, DONE)


def by_maya_command(robot: LaunchedLayers, here: Place, there: Place) -> None:
    assert robot.command("pick", here) == DONE
    assert robot.command("place", there) == DONE


def by_maya_move(robot: LaunchedLayers, here: Place, there: Place) -> None:
    for word, place in (("pick", here), ("place", there)):
        before = robot.mark()
        robot.driver.publish("/maya_move", "maya_robot/MayaPrimitive", primitive(word, place))
        robot.until_told("gripper_closed" if word == "pick" else "gripper_open", before)
        robot.eventually(robot.can_teleop, "at rest after it")


def by_send_task(robot: LaunchedLayers, here: Place, there: Place) -> None:
    robot.driver.publish("/send_task", "maya_robot/MayaPrimitive", primitive("pick", here))
    robot.driver.publish("/send_task", "maya_robot/MayaPrimitive", primitive("place", there))


def by_start_queue(robot: LaunchedLayers, here: Place, there: Place) -> None:
    tasks = [primitive("pick", here), primitive("place", there)]
    robot.driver.publish("/start_queue", "maya_process/ProcessQueue", {"tasks": tasks})


WAYS = [by_task, by_maya_command, by_maya_move, by_send_task, by_start_queue]


@pytest.mark.parametrize("way", WAYS)
def test_a_part_is_moved(way: Callable[[LaunchedLayers, Place, Place], None], robot: LaunchedLayers) -> None:
    lies = robot.twin()["parts"]["part"]
    here, there = (HERE, THERE) if near(lies, HERE) else (THERE, HERE)
    assert near(lies, here)
    way(robot, here, there)
    robot.eventually(lambda: near(robot.twin()["parts"]["part"], there), "the part is there")
    robot.eventually(lambda: robot.twin()["carried"] is None, "the part is let go")
    robot.eventually(robot.can_teleop, "at rest")
