"""/stop_queue at any instant: everything ends, a homing included; it is named, and the robot can be used again."""

from __future__ import annotations

from functools import partial
from random import Random
from threading import Event

import pytest

from maya_ros.graph.protocol import GoalStatus
from tests.campaign import Campaign
from tests.ros.driver_client import Goal, Message
from tests.ros.launched_layers import HERE, SLOW, THERE, LaunchedLayers, primitive

pytestmark = pytest.mark.system

ENDS = {"stopped", "idle", "homed"}
"""Words after which nothing moves: a stop may come when all is done."""


def _queue(robot: LaunchedLayers, rng: Random) -> list[Goal]:
    places = (HERE, THERE) if rng.random() < 0.5 else (THERE, HERE)
    tasks = [primitive("approach", place) for place in places]
    robot.driver.publish("/start_queue", "maya_process/ProcessQueue", {"tasks": tasks})
    return []


def _task(robot: LaunchedLayers, rng: Random) -> list[Goal]:
    return [robot.task("approach", robot.away())]


def _move(robot: LaunchedLayers, rng: Random) -> list[Goal]:
    target = {"a": rng.uniform(0.2, 1.8), "b": 1.6, "c": 1.6}
    return [robot.driver.do("/move", "maya_controller/Move", target)]


def _home(robot: LaunchedLayers, rng: Random) -> list[Goal]:
    return [robot.driver.do("/home", "maya_controller/Home")]


REQUESTS = (_queue, _home, _task, _move)


def stop(robot: LaunchedLayers) -> None:
    """Say stop by the topic, as the dashboard does."""
    robot.driver.publish("/stop_queue", "std_msgs/Empty", {})


@pytest.mark.waits("about 6 s until ten random instants, and 5 s of homing after each homing that was stopped")
@pytest.mark.timeout(1200)
def test_stop_queue_at_random_instants(robot: LaunchedLayers, campaign: Campaign) -> None:
    for case in range(campaign.size(ci=10, long=100)):
        rng = campaign.rng(case)
        robot.ready()
        before = robot.mark()
        goals = REQUESTS[case % len(REQUESTS)](robot, rng)
        Event().wait(rng.uniform(0.0, 1.2))  # the instant is drawn: no fact is waited for
        stop(robot)
        robot.until_told("stopped", before)  # a stop that comes late would end the next homing
        for goal in goals:
            outcome, result = goal.ended()
            assert outcome in {
                GoalStatus.PREEMPTED,
                GoalStatus.RECALLED,
                GoalStatus.SUCCEEDED,
                GoalStatus.ABORTED,
                GoalStatus.REJECTED,
            }
            assert outcome == GoalStatus.SUCCEEDED or result["code"] in {"2201", "2202"}, result
        robot.eventually(partial(_ended, robot, before), "the end of what was under way")
        robot.at_rest()
        assert robot.told[1]["fault"] is None
        assert robot.told[1]["mode"] in {"idle", "not_homed"}
        robot.unharmed()


def _ended(robot: LaunchedLayers, before: int) -> bool:
    """Tell whether nothing moves, and nothing more will."""
    words = robot.words(before)
    standing: Message = robot.told[1]
    return not standing["moving"] and (not words or words[-1] in ENDS)


@pytest.mark.waits("5 s of homing at fifty times real speed, after the test before has stopped one")
def test_waiting_jobs_of_the_queue_end_too(robot: LaunchedLayers) -> None:
    robot.at_speed(SLOW)
    before = robot.mark()
    tasks = [primitive("approach", place) for place in (robot.away(), HERE, THERE, HERE)]
    robot.driver.publish("/start_queue", "maya_process/ProcessQueue", {"tasks": tasks})
    robot.until_told("moving", before)
    robot.driver.publish("/send_task", "maya_robot/MayaPrimitive", primitive("approach", HERE))
    stop(robot)
    robot.until_told("stopped", before)
    robot.at_rest()
    rested = robot.mark()
    assert robot.command("can_teleop")["success"]
    assert robot.words(rested) == []
