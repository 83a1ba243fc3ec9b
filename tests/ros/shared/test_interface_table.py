"""Every row of the interface table, exercised by ROS' own tools and clients from other processes."""

from __future__ import annotations

import json

import pytest

from maya_ros.graph.protocol import GoalStatus
from maya_ros.graph.table import (
    ABORT,
    CALL_OPERATION,
    COMMAND,
    DIAGNOSTICS,
    EVENT,
    FOLLOW,
    GRIPPER,
    HOME,
    JOINTS,
    MARKERS,
    MAYA_COMMAND,
    MOVE,
    PAUSE,
    POSITION,
    PRIMITIVE,
    RECOVER,
    RESUME,
    SENSORS,
    SPEED,
    STEP_RESULT,
    STOP,
    TABLE,
    TASK,
    Kind,
    Row,
)
from tests.ros.driver_client import Message
from tests.ros.launched_layers import DONE, HERE, SLOW, LaunchedLayers, near, primitive

pytestmark = pytest.mark.system

IN_SIMULATION = [row for row in TABLE if row is not SENSORS]
ACTION_TOPICS = {
    "goal": "ActionGoal",
    "cancel": None,
    "status": None,
    "feedback": "ActionFeedback",
    "result": "ActionResult",
}
"""The topics of an action, and what their types end in; the others belong to actionlib."""


def _joints(robot: LaunchedLayers, a: float) -> Message:
    """Return a path from where the robot stands to another angle of the boom, as ROS tools send one."""
    _, *now = robot.twin()["joints"]
    told = robot.driver.subscribe(JOINTS.name, JOINTS.type)
    here = told.until(after=len(told.messages))
    b, c = (here["position"][here["name"].index(axis)] for axis in "bc")
    assert near((b, c), now)
    start = here["position"][here["name"].index("a")]
    return {"joint_names": ["a", "b", "c"], "points": [{"positions": [start, b, c]}, {"positions": [a, b, c]}]}


@pytest.mark.parametrize("row", IN_SIMULATION, ids=lambda row: row.name)
def test_the_row_is_in_the_graph_with_its_type_at_its_node(row: Row, robot: LaunchedLayers) -> None:
    published, heard, served = (dict(part) for part in robot.ros.ask_master("getSystemState"))
    types = robot.ros.topics()
    match row.form:
        case Kind.TOPIC:
            assert types[row.name] == row.type
            nodes = heard[row.name] if row.heard else published[row.name]
            assert {f"/{name}" for name in (row.sinks if row.heard else row.sources)} & set(nodes)
        case Kind.SERVICE:
            assert {f"/{name}" for name in row.sources} & set(served[row.name])
            assert robot.ros.service_type(row.name) == row.type
        case Kind.ACTION:
            for part, ending in ACTION_TOPICS.items():
                expected = f"{row.type}{ending}" if ending else "actionlib_msgs/Goal"
                assert types[f"{row.name}/{part}"].startswith(expected)
            assert {f"/{name}" for name in row.sources} & set(published[f"{row.name}/result"])


def _echo(robot: LaunchedLayers, row: Row) -> str:
    return robot.ros.tool("rostopic", "echo", "-n", "1", row.name)


def test_published_topic_can_be_echoed(robot: LaunchedLayers) -> None:
    assert _echo(robot, EVENT).startswith('data: "')
    assert _echo(robot, POSITION).startswith("x: ")
    assert "name: \n  - a\n  - b\n  - c" in _echo(robot, JOINTS).replace("name:\n", "name: \n")
    assert "ns: " in _echo(robot, MARKERS)
    assert "name: " in _echo(robot, DIAGNOSTICS)


def test_position_is_that_of_the_twin(robot: LaunchedLayers) -> None:
    told = robot.driver.subscribe(POSITION.name, POSITION.type)
    count = len(told.messages)
    message = told.until(after=count)
    assert near((message["x"], message["y"], message["z"]), robot.twin()["point"])


def test_the_gripper_says_its_new_state(robot: LaunchedLayers) -> None:
    for open_, word in ((True, "gripper_open"), (False, "gripper_closed"), (True, "gripper_open")):
        before = robot.mark()
        said = robot.ros.tool("rosservice", "call", GRIPPER.name, f"data: {str(open_).lower()}")
        assert "success: True" in said
        assert robot.until_told(word, before)["gripper_closed"] is not open_
        assert robot.twin()["closed"] is not open_


@pytest.mark.parametrize(
    ("row", "code"), [(PAUSE, "2111"), (RESUME, "2112"), (RECOVER, "2108")], ids=["pause", "resume", "recover"]
)
def test_services_that_have_nothing_to_do_refuse_with_a_code(row: Row, code: str, robot: LaunchedLayers) -> None:
    answer = robot.driver.call(row.name)
    assert not answer["success"]
    assert answer["message"].startswith(f"{code}: ")


def test_stop_at_rest_says_that_nothing_moved(robot: LaunchedLayers) -> None:
    answer = robot.driver.call(STOP.name)
    assert answer["success"]
    assert json.loads(answer["message"])["was_moving"] is False


def test_pause_and_resume_hold_a_motion_and_continue_it(robot: LaunchedLayers) -> None:
    robot.at_speed(SLOW)
    goal = robot.begun("approach", robot.away())
    assert robot.driver.call(PAUSE.name)["success"]
    robot.eventually(lambda: robot.told[1]["mode"] == "paused", "paused")
    assert robot.driver.call(RESUME.name)["success"]
    robot.at_speed(1.0)
    assert goal.ended() == (GoalStatus.SUCCEEDED, DONE)


def test_stop_ends_a_motion_on_its_path_with_its_code(robot: LaunchedLayers) -> None:
    robot.at_speed(SLOW)
    goal = robot.begun("approach", robot.away())
    assert robot.driver.call(STOP.name)["success"]
    outcome, result = goal.ended()
    assert (outcome, result["code"]) == (GoalStatus.PREEMPTED, "2201")
    robot.at_rest()


def test_home_says_its_phases(robot: LaunchedLayers) -> None:
    goal = robot.driver.do(HOME.name, HOME.type)
    assert goal.ended() == (GoalStatus.SUCCEEDED, DONE)
    phases = [message["phase"] for message in goal.feedback.messages]
    assert phases[0] == "homing"
    assert {"raise", "stroke_b", "stroke_c"} <= set(phases)


def test_move_and_follow_reach_their_targets_and_report_progress(robot: LaunchedLayers) -> None:
    goal = robot.driver.do(MOVE.name, MOVE.type, {"a": 0.5, "b": 1.7, "c": 1.7})
    assert goal.ended() == (GoalStatus.SUCCEEDED, DONE)
    assert near(robot.twin()["joints"], (0.5, 1.7, 1.7))
    assert 0.0 <= goal.feedback.messages[-1]["progress"] <= 1.0
    robot.at_rest()
    goal = robot.driver.do(FOLLOW.name, FOLLOW.type, {"trajectory": _joints(robot, 0.9)})
    assert goal.ended() == (GoalStatus.SUCCEEDED, DONE)
    assert near(robot.twin()["joints"], (0.9, 1.7, 1.7))


def test_unreachable_target_is_refused_with_its_code(robot: LaunchedLayers) -> None:
    outcome, result = robot.driver.do(MOVE.name, MOVE.type, {"a": 0.5, "b": 0.6, "c": 0.6}).ended()
    assert (outcome, result["code"]) == (GoalStatus.REJECTED, "2101")
    assert robot.command("pick", (9.0, 9.0, 0.4))["code"] == "2101"
    assert robot.task("pick", (9.0, 9.0, 0.4)).ended()[1]["code"] == "2101"


def test_a_cancel_of_a_task_stops_on_the_path(robot: LaunchedLayers) -> None:
    robot.at_speed(SLOW)
    goal = robot.begun("approach", robot.away())
    goal.cancel()
    outcome, result = goal.ended()
    assert (outcome, result["code"]) == (GoalStatus.PREEMPTED, "2202")
    robot.at_rest()


def test_controller_command_moves_and_its_refusal_is_an_event(robot: LaunchedLayers) -> None:
    robot.at_rest()
    a = 0.6 if robot.twin()["joints"][0] > 0.8 else 1.1
    before = robot.mark()
    robot.driver.publish(COMMAND.name, COMMAND.type, _joints(robot, a))
    robot.until_told("moving", before)
    robot.eventually(lambda: near(robot.twin()["joints"][:1], (a,)), "the boom is there")
    robot.eventually(robot.can_teleop, "at rest")
    before = robot.mark()
    robot.driver.publish(COMMAND.name, COMMAND.type, {"joint_names": ["a", "b", "d"], "points": []})
    assert robot.until_told("refused", before)["code"] == 4018


def test_the_speed_of_all_motion_is_scaled_by_a_topic(robot: LaunchedLayers) -> None:
    for ratio in (0.5, 1.0):
        before = robot.mark()
        robot.driver.publish(SPEED.name, SPEED.type, {"data": ratio})
        assert robot.until_told("speed", before)["override"] == ratio


def test_maya_move_does_a_primitive(robot: LaunchedLayers) -> None:
    before = robot.mark()
    robot.driver.publish(PRIMITIVE.name, PRIMITIVE.type, primitive("approach", robot.away()))
    robot.until_told("moving", before)
    robot.eventually(robot.can_teleop, "done")


def test_can_teleop_by_the_command_line(robot: LaunchedLayers) -> None:
    said = robot.ros.tool("rosservice", "call", MAYA_COMMAND.name, "task: {command: can_teleop}")
    assert "success: True" in said


def test_task_reports_phase_progress_and_position(robot: LaunchedLayers) -> None:
    goal = robot.driver.do(TASK.name, TASK.type, {"task": primitive("approach", robot.away())})
    assert goal.ended() == (GoalStatus.SUCCEEDED, DONE)
    assert goal.feedback.messages
    assert near(list(goal.feedback.messages[-1]["position"].values()), robot.twin()["point"], within=3.0)


def test_step_is_carried_out_and_reported(robot: LaunchedLayers) -> None:
    results = robot.driver.subscribe(STEP_RESULT.name, STEP_RESULT.type)
    id_ = robot.step("row", HERE)
    told = json.loads(results.until(lambda message: json.loads(message["data"])["id"] == id_)["data"])
    assert (told["success"], told["error"]) == (True, None)


def test_any_operation_is_called_by_its_name(robot: LaunchedLayers) -> None:
    parameters = {"operation": "reach", "arguments": json.dumps({"x": 9.0, "y": 9.0, "z": 0.4})}
    answer = robot.driver.call(CALL_OPERATION.name, parameters)
    assert (answer["success"], json.loads(answer["result"])["reachable"]) == (True, False)
    refused = robot.driver.call(CALL_OPERATION.name, {"operation": "report", "arguments": '{"job": 999999}'})
    assert (refused["success"], refused["code"], refused["result"]) == (False, "4004", "")


def test_abort_stops_without_deceleration_and_a_person_recovers(robot: LaunchedLayers) -> None:
    robot.at_speed(SLOW)
    goal = robot.begun("approach", robot.away())
    robot.driver.call(ABORT.name)
    outcome, _ = goal.ended()
    assert outcome in {GoalStatus.ABORTED, GoalStatus.PREEMPTED}
    robot.at_rest()
