"""Diagnostics of the layers: levels, our codes, and the message for ROS tools."""

from __future__ import annotations

from dataclasses import replace

import pytest

from maya_ros.graph import types
from maya_ros.graph.diagnostics import (
    DiagnosticLevel,
    DiagnosticStatus,
    array,
    axes,
    bridge,
    controller,
    process,
    robot,
)
from maya_un.values import Joints, Mode, Notice, Progress, State
from tests.fakes import state_of

READY = replace(state_of(Joints(0.5, 2.0, 2.0)), motors_on=(True, True, True))


def in_mode(mode: Mode) -> State:
    return replace(READY, mode=mode, fault=Notice(2301, "Axis b met its limit.") if mode is Mode.FAULT else None)


@pytest.mark.parametrize(
    ("mode", "level"),
    [
        (Mode.IDLE, DiagnosticLevel.OK),
        (Mode.MOVING, DiagnosticLevel.OK),
        (Mode.HOMING, DiagnosticLevel.OK),
        (Mode.STOPPING, DiagnosticLevel.OK),
        (Mode.NOT_HOMED, DiagnosticLevel.WARN),
        (Mode.PAUSED, DiagnosticLevel.WARN),
        (Mode.FAULT, DiagnosticLevel.ERROR),
        (Mode.DISCONNECTED, DiagnosticLevel.ERROR),
    ],
)
def test_every_mode_has_a_level_and_a_sentence(mode: Mode, level: DiagnosticLevel) -> None:
    status = controller(in_mode(mode))
    assert status.level is level
    assert status.message


def test_fault_has_its_code_and_sentence() -> None:
    status = controller(in_mode(Mode.FAULT))
    assert status.message == "2301 Axis b met its limit."
    assert status.values["code"] == 2301


def test_progress_is_shown_during_a_motion() -> None:
    assert "progress" not in controller(READY).values
    status = controller(replace(READY, mode=Mode.MOVING, progress=Progress("down", 1.0, 4.0)))
    assert status.values["progress"] == "down 25%"


def test_a_limit_switch_is_a_warning_unless_homing_looks_for_it() -> None:
    on = replace(READY, reverse_limit=(False, True, False))
    assert axes(on).level is DiagnosticLevel.WARN
    assert "b short end" in axes(on).message
    assert axes(replace(on, mode=Mode.HOMING)).level is DiagnosticLevel.OK


def test_motors_that_are_off_are_named() -> None:
    status = axes(replace(READY, motors_on=(True, False, False)))
    assert (status.level, status.message) == (DiagnosticLevel.WARN, "motors off: b, c")


def test_without_a_connection_nothing_is_known_of_the_axes() -> None:
    assert axes(in_mode(Mode.DISCONNECTED)).level is DiagnosticLevel.STALE
    assert axes(READY).level is DiagnosticLevel.OK


def test_robot_layer_is_ready_busy_waiting_or_alone() -> None:
    assert robot(controller_there=True, can_teleop=True).level is DiagnosticLevel.OK
    assert robot(controller_there=True, can_teleop=False, running="pick").message == "at pick"
    assert robot(controller_there=True, can_teleop=False).level is DiagnosticLevel.WARN
    assert robot(controller_there=True, can_teleop=False, why="2103 not homed").message == "2103 not homed"
    alone = robot(controller_there=False, can_teleop=False)
    assert alone.level is DiagnosticLevel.ERROR
    assert alone.message.startswith("1011 ")


def test_process_layer_shows_its_queue() -> None:
    assert process(robot_there=True, paused=False).level is DiagnosticLevel.OK
    assert process(robot_there=True, paused=False, running="job 3", queued=2).message == "at job 3"
    held = process(robot_there=True, paused=True, reason="a fault")
    assert (held.level, held.message) == (DiagnosticLevel.WARN, "the queue is paused: a fault")
    assert process(robot_there=False, paused=False).level is DiagnosticLevel.ERROR


def test_bridge_reports_the_number_of_clients() -> None:
    assert bridge("rosbridge", there=True, clients=3) == DiagnosticStatus(
        "maya: rosbridge", DiagnosticLevel.OK, "connected", {"clients": 3}
    )
    assert bridge("firebase_bridge", there=False).level is DiagnosticLevel.WARN


def test_the_message_is_one_that_ros_takes() -> None:
    message = array([controller(READY), axes(READY)], 3.5)
    checked = types.conform("diagnostic_msgs/DiagnosticArray", message)
    assert types.serialize("diagnostic_msgs/DiagnosticArray", checked)
    assert checked["header"]["stamp"] == {"secs": 3, "nsecs": 500_000_000}
    first = checked["status"][0]
    assert (first["level"], first["name"], first["hardware_id"]) == (0, "maya: controller", "maya")
    values = {pair["key"]: pair["value"] for pair in first["values"]}
    assert values["homed"] == "true"
    assert values["speed override"] == "100%"


def test_axes_before_homing_say_that_joints_and_frames_are_not_published() -> None:
    assert "not known before homing: /joint_states is silent" in str(axes(state_of(None)).values["joints"])
    assert "a " in str(axes(state_of(Joints(0.5, 1.6, 1.6))).values["joints"])
