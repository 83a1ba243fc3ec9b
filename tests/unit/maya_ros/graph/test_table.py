"""The table holds the names of the manual's chapter Communications, and marks ours as ours."""

from __future__ import annotations

import pytest

from maya_ros.graph import types
from maya_ros.graph.catalogue import ANY, spec
from maya_ros.graph.events import ControllerCondition, ReportedEvent
from maya_ros.graph.table import TABLE, Kind, Layer, asked_by_call, asked_by_topic, rows, type_of_topic
from maya_un.robot.primitives import from_dict
from maya_un.service.access.operations import Operation
from maya_un.values import Mode

MANUAL = {
    "/maya_event": ("topic", "std_msgs/String"),
    "/maya_move": ("topic", "maya_robot/MayaPrimitive"),
    "/maya_position": ("topic", "geometry_msgs/Point"),
    "/hardware_sensor": ("topic", "maya_controller/RawSensorData"),
    "/send_task": ("topic", "maya_robot/MayaPrimitive"),
    "/start_queue": ("topic", "maya_process/ProcessQueue"),
    "/stop_queue": ("topic", "std_msgs/Empty"),
    "/step_command": ("topic", "std_msgs/String"),
    "/step_result": ("topic", "std_msgs/String"),
    "/gripper": ("service", "std_srvs/SetBool"),
    "/controller/stop": ("service", "std_srvs/Trigger"),
    "/controller/recover": ("service", "std_srvs/Trigger"),
    "/maya_command": ("service", "maya_robot/MayaCommand"),
    "/home": ("action", "maya_controller/Home"),
    "/move": ("action", "maya_controller/Move"),
    "/controller/follow": ("action", "maya_controller/Follow"),
    "/task": ("action", "maya_robot/Task"),
}
"""Names and types of the manual, and of the interface between its layers."""

FIELDS = {
    "maya_controller/RawSensorData": (
        "header position velocity forward_limit reverse_limit moving motor_off stop_code gripper_closed error_code"
    ),
    "maya_controller/HomeResult": "success code message",
    "maya_controller/HomeFeedback": "phase",
    "maya_controller/MoveGoal": "a b c",
    "maya_controller/MoveResult": "success code message",
    "maya_controller/MoveFeedback": "a b c progress",
    "maya_controller/FollowGoal": "trajectory",
    "maya_controller/FollowFeedback": "a b c progress",
    "maya_robot/MayaPrimitive": "command target open",
    "maya_robot/MayaCommandRequest": "task",
    "maya_robot/MayaCommandResponse": "success code message",
    "maya_robot/TaskGoal": "task",
    "maya_robot/TaskResult": "success code message",
    "maya_robot/TaskFeedback": "phase progress position",
    "maya_process/ProcessQueue": "tasks",
}


def test_the_manuals_names_have_the_manuals_types() -> None:
    assert {row.name: (row.form.value, row.type) for row in TABLE if row.manual} == MANUAL


def test_every_name_is_listed_once_and_belongs_to_one_layer() -> None:
    names = [row.name for row in TABLE]
    assert len(names) == len(set(names))
    assert [row for layer in Layer for row in rows(layer)] == sorted(
        TABLE, key=lambda row: list(Layer).index(row.layer)
    )


@pytest.mark.parametrize("kind", FIELDS)
def test_types_have_the_fields_of_the_interface(kind: str) -> None:
    assert types.fields(kind) == tuple(FIELDS[kind].split())


def test_raw_data_comes_by_axis_and_tasks_as_many_as_there_are() -> None:
    lengths = {field.name: field.length for field in spec("maya_controller/RawSensorData").fields}
    assert [name for name, length in lengths.items() if length == 3] == FIELDS["maya_controller/RawSensorData"].split()[
        1:8
    ]
    assert spec("maya_process/ProcessQueue").fields[0].length == ANY


def test_the_constants_of_primitives_are_their_commands() -> None:
    constants = {constant.name: constant.value for constant in spec("maya_robot/MayaPrimitive").constants}
    assert constants == {name: name.lower() for name in ["CAN_TELEOP", "HOME", "GRIPPER", "PICK", "PLACE", "APPROACH"]}
    for command in constants.values():
        rest = {"open": True} if command == "gripper" else {"target": [0.5, 1.0, 0.4]}
        alone = command in {"home", "can_teleop"}
        assert from_dict({"command": command} | ({} if alone else rest), 0.4).command == command


def test_topics_for_late_subscribers_are_latched() -> None:
    latched = {row.name for row in TABLE if row.latch}
    assert latched == {"/maya_event", "/maya_position", "/maya_markers", "/queue_status", "/step_robot"}
    assert all(row.queue_size > 0 for row in TABLE)
    assert {row.form for row in TABLE if row.rate} == {Kind.TOPIC}


def test_an_event_fits_its_topic() -> None:
    told = ReportedEvent("idle", ControllerCondition(Mode.IDLE, homed=True, moving=False, gripper_closed=False))
    assert types.conform("std_msgs/String", {"data": told.text()}) == {"data": told.text()}


def test_every_name_that_commands_has_an_operation() -> None:
    commands = {row.name for row in TABLE if row.form is not Kind.TOPIC or row.heard}
    assert {row.name for row in TABLE if row.asks is not None} == commands


@pytest.mark.parametrize(
    ("topic", "operation"),
    [
        ("/task/goal", Operation.COMMAND),
        ("/task/cancel", Operation.STOP),
        ("/home/cancel", Operation.STOP),
        ("/stop_queue", Operation.STOP),
        ("/send_task", Operation.PROPOSE),
        ("/maya_event", Operation.GRAPH),
        ("/task/status", Operation.GRAPH),
        ("/task/result", Operation.GRAPH),
        ("/of_others/cancel", Operation.GRAPH),
        ("/gripper/cancel", Operation.GRAPH),
        ("/controller/stop", Operation.GRAPH),
        ("/chatter", Operation.GRAPH),
        ("/cancel", Operation.GRAPH),
    ],
)
def test_topic_has_the_operation_of_its_row_or_action(topic: str, operation: Operation) -> None:
    assert asked_by_topic(topic) is operation


@pytest.mark.parametrize(
    ("name", "form", "operation"),
    [
        ("/controller/stop", Kind.SERVICE, Operation.STOP),
        ("/controller/abort", Kind.SERVICE, Operation.ABORT),
        ("/gripper", Kind.SERVICE, Operation.COMMAND),
        ("/task", Kind.ACTION, Operation.COMMAND),
        ("/task", Kind.SERVICE, Operation.GRAPH),
        ("/of_others", Kind.SERVICE, Operation.GRAPH),
    ],
)
def test_call_has_the_operation_of_its_row(name: str, form: Kind, operation: Operation) -> None:
    assert asked_by_call(name, form) is operation


def test_topics_of_actions_have_the_types_of_actionlib() -> None:
    assert type_of_topic("/task/goal") == "maya_robot/TaskActionGoal"
    assert type_of_topic("/task/cancel") == "actionlib_msgs/GoalID"
    assert type_of_topic("/maya_event") == "std_msgs/String"
    assert [type_of_topic(name) for name in ("/task", "/task/x", "/gripper/goal", "/gripper", "/of_others")] == [
        None
    ] * 5
