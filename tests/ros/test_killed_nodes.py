"""Every node is killed in turn while the robot moves: it stops, the cause is reported, nothing restarts by itself."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from maya_ros.graph.protocol import GoalStatus
from maya_ros.graph.table import STEP_RESULT
from tests.ros.launched_layers import DONE, HERE, SLOW, THERE, LaunchedLayers, near, primitive

pytestmark = pytest.mark.system

MAYA = str(Path(sys.executable).with_name("maya"))
NODE_GONE = "1011"


@pytest.fixture
def robot(robot: LaunchedLayers) -> LaunchedLayers:
    robot.at_speed(SLOW)  # rospy takes half a second to notice who is gone
    return robot


def comes_to_rest(robot: LaunchedLayers, before: int) -> None:
    """Wait until the motion that was under way has been stopped on its path."""
    robot.until_told("stopped", before)
    robot.at_rest()
    robot.unharmed()


def returns_without_motion(robot: LaunchedLayers, node: str, package: str, ready: str) -> None:
    """Start a node again; nothing moves because of that."""
    before = robot.mark()
    stood = robot.twin()["joints"]
    again = robot.ros.start("rosrun", package, f"{node}.py")
    again.until(ready)
    diagnosed = robot.driver.subscribe("/diagnostics", "diagnostic_msgs/DiagnosticArray")
    for _ in range(3):
        diagnosed.until(after=len(diagnosed.messages))
    assert "moving" not in robot.words(before)
    assert "homing" not in robot.words(before)
    assert near(robot.twin()["joints"], stood, within=1e-9)


def examined(robot: LaunchedLayers) -> str:
    """Return what `maya doctor` finds."""
    doctor = [MAYA, "doctor"]
    return subprocess.run(
        doctor, env=robot.ros.environment, capture_output=True, text=True, timeout=40, check=False
    ).stdout


def works(robot: LaunchedLayers) -> None:
    """Fail if the robot does not obey a command."""
    robot.at_speed(1.0)
    place = robot.away()
    assert robot.task("approach", place).ended() == (GoalStatus.SUCCEEDED, DONE)
    assert near(robot.twin()["point"][:2], place[:2])


@pytest.mark.waits("5 s of homing at fifty times real speed, once for the file, as rospy lives in real time")
def test_without_its_client_a_task_is_stopped(robot: LaunchedLayers) -> None:
    before = robot.mark()
    client = robot.ros.driver()
    client.do("/task", "maya_robot/Task", {"task": primitive("approach", robot.away())})
    robot.until_told("moving", before)
    client.program.kill()
    comes_to_rest(robot, before)
    works(robot)


@pytest.mark.waits("up to 5 s until a step is sent again that the bridge refused after a stop")
def test_death_of_firebase_bridge_stops_its_step_which_is_not_restarted(robot: LaunchedLayers) -> None:
    results = robot.driver.subscribe(STEP_RESULT.name, STEP_RESULT.type)
    before = robot.mark()
    id_ = robot.step("dead", robot.away())
    robot.until_told("moving", before)
    robot.kill("/firebase_bridge")
    comes_to_rest(robot, before)
    returns_without_motion(robot, "firebase_bridge", "maya_process", "Steps from")
    told = json.loads(results.until(lambda message: json.loads(message["data"])["id"] == id_)["data"])
    assert told["success"] is False
    works(robot)


def test_without_process_controller_the_job_is_stopped_and_waits_for_a_person(robot: LaunchedLayers) -> None:
    before = robot.mark()
    tasks = [primitive("approach", place) for place in (robot.away(), HERE, THERE)]
    robot.driver.publish("/start_queue", "maya_process/ProcessQueue", {"tasks": tasks})
    robot.until_told("moving", before)
    robot.kill("/process_controller")
    comes_to_rest(robot, before)
    returns_without_motion(robot, "process_controller", "maya_process", "The queue")
    works(robot)


def test_death_of_primitive_server_stops_its_motion(robot: LaunchedLayers) -> None:
    before = robot.mark()
    goal = robot.begun("approach", robot.away())
    robot.kill("/primitive_server")
    comes_to_rest(robot, before)
    returns_without_motion(robot, "primitive_server", "maya_robot", "Primitives are done")
    assert goal.status.messages[-1]["state"] in {GoalStatus.ACTIVE, GoalStatus.LOST}
    works(robot)


def test_death_of_robot_controller_stops_its_motion(robot: LaunchedLayers) -> None:
    before = robot.mark()
    goal = robot.begun("approach", robot.away())
    robot.kill("/robot_controller")
    outcome, result = goal.ended()
    assert (outcome, result["code"]) == (GoalStatus.ABORTED, NODE_GONE)
    comes_to_rest(robot, before)
    assert "robot_controller has ended" in examined(robot)
    returns_without_motion(robot, "robot_controller", "maya_robot", "The robot layer is offered")
    robot.until_homed()
    works(robot)
    assert "robot_controller" not in examined(robot)


@pytest.mark.waits("5 s of homing at fifty times real speed, as rospy lives in real time")
def test_death_of_hw_simulator_ends_commands_with_the_code_and_needs_homing(robot: LaunchedLayers) -> None:
    goal = robot.begun("approach", robot.away())
    robot.kill("/hw_simulator")
    outcome, result = goal.ended()
    assert (outcome, result["code"]) == (GoalStatus.ABORTED, NODE_GONE)
    before = robot.mark()
    robot.ros.start("rosrun", "maya_controller", "hw_simulator.py").until("is offered to the graph")
    standing = robot.until_told("not_homed", before)
    assert (standing["homed"], standing["moving"]) == (False, False)
    assert robot.driver.do("/move", "maya_controller/Move", {"a": 0.5, "b": 1.6, "c": 1.6}).ended()[1]["code"] == "2103"
    assert {"moving", "homing"}.isdisjoint(robot.words(before))
    robot.home()
    works(robot)


def test_the_bridge_works_without_the_queue_and_the_queue_without_the_bridge(robot: LaunchedLayers) -> None:
    results = robot.driver.subscribe(STEP_RESULT.name, STEP_RESULT.type)
    robot.kill("/process_controller")
    place = robot.away()
    id_ = robot.step("alone", place)
    told = json.loads(results.until(lambda message: json.loads(message["data"])["id"] == id_)["data"])
    assert (told["success"], told["code"]) == (True, None)
    assert near(robot.twin()["point"][:2], place[:2])
    robot.ros.start("rosrun", "maya_process", "process_controller.py").until("The queue is worked")
    robot.kill("/firebase_bridge")
    x, y, z = robot.away()
    robot.ros.tool(MAYA, "approach", str(x), str(y), str(z))
    assert near(robot.twin()["point"][:2], (x, y))
