from __future__ import annotations

import pytest
from maya_ui import reasons
from maya_ui.robot import Command, Ended, Happened, Joints, Position, Presence, Standing, Under
from maya_ui.seen import Seen, event
from maya_ui.tasks import Task
from maya_ui.words import WORDS

from maya_ros.graph.events import ControllerCondition as Stands
from maya_ros.graph.events import ReportedEvent
from maya_un.values import Mode, Notice

ALL = Presence(master=True, controller=True, robot=True, process=True)
IDLE = Standing("idle", homed=True, gripper_closed=False)


def seen(standing: Standing | None = IDLE, presence: Presence = ALL) -> Seen:
    one = Seen()
    one.take(presence)
    if standing is not None:
        one.take(Happened("idle", standing))
    return one


def test_event_of_the_controller_layer_is_read() -> None:
    stands = Stands(
        Mode.FAULT, homed=True, moving=False, gripper_closed=True, override=0.5, fault=Notice(2302, "Axis b")
    )
    heard = event(ReportedEvent("fault", stands, 2302, {"axis": "b"}).text())
    assert heard.word == "fault"
    assert heard.code == "2302"
    assert heard.detail == {"axis": "b"}
    assert heard.standing == Standing("fault", True, False, True, 0.5, "2302", "Axis b")


def test_an_event_without_a_code_has_none() -> None:
    stands = Stands(Mode.IDLE, homed=True, moving=False, gripper_closed=False)
    assert event(ReportedEvent("idle", stands).text()).code == ""


@pytest.mark.parametrize(
    "text", ["", "idle", "idle {", "idle [1]", "idle null", "some day", 'x {"mode":1,"override":"y"}']
)
def test_unreadable_part_of_an_event_is_omitted(text: str) -> None:
    assert event(text).word == text.partition(" ")[0]


def test_event_before_the_layer_is_found_is_kept() -> None:
    one = Seen()
    one.take(Happened("idle", IDLE))
    one.take(Presence(master=True, process=True))
    one.take(ALL)
    assert one.standing == IDLE


def test_lost_layer_removes_its_values() -> None:
    one = seen()
    one.take(Position(0.4, 1.1, 0.7))
    one.take(Joints(0.1, 1.5, 1.6))
    assert one.position == Position(0.4, 1.1, 0.7)
    one.take(Presence(master=True))
    assert one.standing.mode == "disconnected"
    one.take(ALL)
    assert one.position is None
    assert one.joints is None
    assert not one.connected


def test_a_position_counts_only_once_homed() -> None:
    one = seen(Standing("not_homed"))
    one.take(Position(0.4, 1.1, 0.7))
    assert one.position is None


def test_command_is_under_way_until_its_own_end() -> None:
    one = seen()
    one.take(Under(Command.TASK, "lower", 0.5))
    one.take(Ended(Command.STOP, done=True))
    assert one.busy
    one.take(Ended(Command.TASK, done=False, code="2201"))
    assert not one.busy


@pytest.mark.parametrize(
    ("standing", "presence", "command", "reason"),
    [
        (IDLE, ALL, Command.TASK, ""),
        (IDLE, ALL, Command.JOG, ""),
        (IDLE, ALL, Command.RECOVER, "no_fault"),
        (IDLE, ALL, Command.PAUSE, "nothing_moves"),
        (IDLE, ALL, Command.RESUME, "nothing_paused"),
        (None, Presence(), Command.HOME, "no_master"),
        (None, Presence(master=True), Command.HOME, "no_controller"),
        (None, ALL, Command.HOME, "silent"),
        (IDLE, Presence(True, True, True, True, True), Command.HOME, "silent"),
        (Standing("disconnected"), ALL, Command.HOME, "no_machine"),
        (Standing("not_homed"), ALL, Command.HOME, ""),
        (Standing("not_homed"), ALL, Command.TASK, "home_first"),
        (Standing("not_homed"), ALL, Command.JOG, "home_first"),
        (Standing("fault", homed=True), ALL, Command.JOG, "recover_first"),
        (Standing("fault", homed=True), ALL, Command.RECOVER, ""),
        (Standing("paused", homed=True), ALL, Command.HOME, "resume_first"),
        (Standing("paused", homed=True), ALL, Command.RESUME, ""),
        (Standing("moving", homed=True), ALL, Command.HOME, "busy"),
        (Standing("moving", homed=True), ALL, Command.PAUSE, ""),
        (IDLE, Presence(master=True, controller=True), Command.TASK, "no_robot_layer"),
        (IDLE, Presence(master=True, controller=True), Command.JOG, ""),
        (IDLE, Presence(master=True, controller=True), Command.SEND, "no_process_layer"),
        (None, Presence(), Command.START_QUEUE, "no_master"),
        (Standing("moving", homed=True), ALL, Command.START_QUEUE, ""),
    ],
)
def test_why_not(standing: Standing | None, presence: Presence, command: Command, reason: str) -> None:
    assert reasons.why_not(command, seen(standing, presence)) == reason


def test_stop_is_always_there() -> None:
    for presence in (Presence(), ALL):
        for mode in ("disconnected", "homing", "moving", "fault"):
            assert reasons.why_not(Command.STOP, seen(Standing(mode), presence)) == ""


def test_a_pick_needs_an_open_gripper_and_a_place_a_closed_one() -> None:
    closed = seen(Standing("idle", homed=True, gripper_closed=True))
    assert reasons.why_not_now(Task("pick"), closed) == "gripper_is_closed"
    assert reasons.why_not_now(Task("place"), closed) == ""
    assert reasons.why_not_now(Task("place"), seen()) == "gripper_is_open"
    assert reasons.why_not_now(Task("approach"), closed) == ""
    assert reasons.why_not_now(Task("home"), seen(Standing("not_homed"))) == ""
    assert reasons.why_not_now(Task("gripper"), seen(Standing("not_homed"))) == ""


def test_every_reason_has_words() -> None:
    found = {
        reasons.why_not(command, seen(standing, presence))
        for command in Command
        for standing in (None, IDLE, *(Standing(mode.value, homed=True) for mode in Mode), Standing("not_homed"))
        for presence in (Presence(), Presence(True), ALL, Presence(True, True), Presence(True, True, True))
    }
    assert found - {""} <= WORDS.keys()
    assert len(found) > 10
