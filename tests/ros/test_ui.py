"""The dashboard on a real graph: actions of a person, and motion of the twin."""

from __future__ import annotations

import ast
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast
from xmlrpc.client import ServerProxy

import pytest

from tests.ports import free_port
from tests.ros.driver_client import Driver
from tests.ros.harness import Ros
from tests.ros.screen import Screen
from tests.ros.workspace import ROOT, Workspace
from tests.waiting import eventually

pytestmark = pytest.mark.system

SPEED = 60
PYTHON = Path("/usr/bin/python3")
MAYA = str(Path(sys.executable).with_name("maya"))
CUBE = [0.41, 1.13, 0.40]
TRAY = [1.18, 0.21, 0.40]
BORDER = 195.0
"""Height that a robot in the homed pose could go down to [mm]: there line b has its full length."""

CONTROLLER_LAYER = ("rosrun", "maya_controller", "hw_simulator.py")
SCRIPT = ("rosrun", "maya_ui", "maya_ui.py", "--window")


def screen(ros: Ros) -> Screen:
    return Screen(PYTHON, ros.environment, ros.folder / "screen.log")


@pytest.fixture(scope="module")
def ros(tmp_path_factory: pytest.TempPathFactory, workspace: Workspace) -> Iterator[Ros]:
    with Ros(tmp_path_factory.mktemp("ui"), workspace) as shared:
        shared.set_param("/hw_simulator/parts", {"cube": CUBE})
        launched = shared.launch("maya_process", "process.launch", speed=SPEED)
        for layer in ("The robot layer is offered", "The queue is worked"):
            launched.until(layer)
        yield shared


@pytest.fixture(scope="module")
def driver(ros: Ros) -> Driver:
    return ros.driver()


@pytest.fixture(scope="module")
def shown(ros: Ros) -> Iterator[Screen]:
    with screen(ros) as dashboard:
        yield dashboard


@pytest.fixture
def ready(shown: Screen) -> Screen:
    """The dashboard of a robot that is homed and waits, with all layers running and its list empty."""
    eventually(lambda: _at_home(shown), "a homed robot")
    shown.wait("open_gripper", enabled=True)
    if shown.text("chip_gripper") == "gripper closed":
        shown.click("open_gripper")
        shown.wait("chip_gripper", "open")
    shown.wait("send", enabled=True)
    shown.wait("home", enabled=True)
    if shown.read("clear")["enabled"]:
        shown.click("clear")
    return shown


def _at_home(shown: Screen) -> bool:
    """Tell whether the robot is homed and waits; home it, again if the second stop of a stopped queue ended that."""
    if shown.text("mode") == "Not homed" and shown.read("home")["enabled"]:
        shown.click("home")
    return shown.text("mode") == "Ready"


def twin(driver: Driver) -> dict[str, Any]:
    """Return what the twin's mechanics know."""
    answer: dict[str, Any] = json.loads(driver.call("/hw_simulator/twin")["message"])
    return answer


def maya(ros: Ros, *words: str) -> None:
    """Run a command; fails where it fails."""
    subprocess.run([MAYA, *words], env=ros.environment, check=True, capture_output=True, timeout=40)


def height(dashboard: Screen) -> float:
    return float(dashboard.text("value_z"))


def resting_height(driver: Driver) -> float:
    """Return the height of the gripper [mm] as soon as two new messages have the same one."""
    positions = driver.subscribe("/maya_position", "geometry_msgs/Point").messages
    seen = len(positions)
    eventually(lambda: len(positions) > seen + 1 and positions[-1]["z"] == positions[-2]["z"], "a robot at rest")
    return float(positions[-1]["z"]) * 1000.0


def words(dashboard: Screen) -> list[str]:
    return [row[1] for row in dashboard.rows("event_list")]


def choose(dashboard: Screen, command: str, place: list[float]) -> None:
    dashboard.ask("choose", name="command_choice", data=command)
    dashboard.type(**{axis: f"{length * 1e3:g}" for axis, length in zip("xyz", place, strict=True)})


@pytest.mark.waits("4 s of homing at sixty times real speed, as rospy and Qt live in real time")
def test_home_is_clicked_and_the_robot_is_homed(shown: Screen) -> None:
    shown.wait("banner_text", "press Home first")
    assert "Home first" in shown.wait("jog_x_plus", enabled=False)["tip"]
    shown.wait("home", enabled=True)
    shown.click("home")
    shown.wait("progress", "Home")
    shown.wait("mode", "Ready")
    shown.wait("note", "Home: done.")
    assert words(shown)[-2:] == ["homing", "homed"]
    assert shown.wait("chip_homed", "homed", kind="")["visible"]
    assert float(shown.text("value_x")) > 0.0


def test_unreachable_target_is_refused_with_its_sentence(ready: Screen) -> None:
    choose(ready, "task_approach", [2.9, 2.9, 0.4])
    ready.click("now")
    ready.wait("note", "(2101)", kind="bad")
    ready.ask("speak", language="es")
    ready.wait("now", enabled=True)
    ready.click("now")
    ready.wait("note", "No se puede alcanzar", kind="bad")
    ready.ask("speak", language="en")


@pytest.mark.waits("about 1.5 s of a pick and a place at sixty times real speed, as rospy and Qt live in real time")
def test_a_part_is_picked_and_placed_by_the_fields(ready: Screen, driver: Driver) -> None:
    choose(ready, "task_pick", CUBE)
    ready.wait("now", enabled=True)
    ready.click("now")
    ready.wait("chip_gripper", "closed")
    ready.wait("note", "Task: done.")
    choose(ready, "task_place", TRAY)
    ready.wait("now", enabled=True)
    ready.click("now")
    ready.wait("chip_gripper", "open")
    ready.wait("now", enabled=False, tip="The gripper is open: there is nothing to place.")
    assert twin(driver)["parts"]["cube"] == pytest.approx(TRAY, abs=2e-3)


@pytest.mark.waits("about 1.5 s of a place and a pick at sixty times real speed, as rospy and Qt live in real time")
def test_a_list_is_prepared_and_given_to_the_queue_as_one_job(ready: Screen, driver: Driver) -> None:
    choose(ready, "task_place", CUBE)
    ready.click("add")
    choose(ready, "task_pick", TRAY)
    ready.click("add", "up")
    ready.wait("start", enabled=True)
    ready.click("start")
    ready.wait("chip_gripper", "closed")
    ready.wait("chip_gripper", "open")
    ready.wait("mode", "Ready")
    assert twin(driver)["parts"]["cube"] == pytest.approx(CUBE, abs=2e-3)


def slow_down(dashboard: Screen, driver: Driver, ratio: float, shown: str) -> None:
    """Slow all motion down, so that what is done to it meets it on its way."""
    driver.publish("/controller/speed", "std_msgs/Float64", {"data": ratio})
    dashboard.wait("speed_choice", shown)


def test_the_queue_is_stopped(ready: Screen, driver: Driver) -> None:
    events = driver.subscribe("/maya_event", "std_msgs/String")
    slow_down(ready, driver, 0.02, "5 %")
    choose(ready, "task_approach", TRAY)
    ready.click("send")
    ready.wait("mode", "Moving")
    before = len(events.messages)
    ready.click("stop_queue")
    events.until(lambda message: message["data"].startswith("stopped "), after=before)
    ready.wait("mode", "Ready")
    slow_down(ready, driver, 1.0, "100 %")


def over(status: dict[str, Any]) -> bool:
    """Tell whether the queue has nothing left to do."""
    return not status["waiting"] and status["running"] is None


def test_paused_queue_is_shown_and_resumed_from_the_dashboard(ready: Screen, ros: Ros, driver: Driver) -> None:
    status = driver.subscribe("/queue_status", "std_msgs/String")
    maya(ros, "queue", "pause")
    ready.wait("mode", "Ready, queue paused")
    choose(ready, "task_approach", CUBE)
    ready.click("send")
    status.until(lambda message: json.loads(message["data"])["waiting"] == 1)
    before = len(status.messages)
    ready.click("resume_queue")
    status.until(lambda message: over(json.loads(message["data"])), after=before)
    ready.wait("mode", "Ready")
    ready.wait("note", "Resume queue: done.")


def test_an_interrupted_job_is_shown_and_ended_from_the_dashboard(ready: Screen, ros: Ros, driver: Driver) -> None:
    slow_down(ready, driver, 0.02, "5 %")
    choose(ready, "task_approach", TRAY)
    ready.click("send")
    ready.wait("mode", "Moving")
    with ServerProxy(ros.ask_master("lookupNode", "/process_controller")) as node:
        _, _, process = cast("tuple[int, str, int]", node.getPid("/test"))
    os.kill(process, signal.SIGKILL)
    slow_down(ready, driver, 1.0, "100 %")
    ros.start("rosrun", "maya_process", "process_controller.py")
    ready.wait("banner_text", "was interrupted (approach 1.18 0.21 0.4)")
    assert not driver.call("/resume_queue")["success"]
    assert ready.ask("menu", name="recover_queue")[-1] == "End the job"
    ready.ask("menu", name="recover_queue", choose=len(ready.ask("menu", name="recover_queue")) - 1)
    ready.wait("note", "Interrupted job: done.")
    ready.wait("recover_queue", visible=False)
    ready.click("resume_queue")
    ready.wait("resume_queue", visible=False)
    ready.wait("mode", "Ready")


def test_the_robot_moves_while_a_button_is_held_and_stops_when_it_is_let_go(ready: Screen, driver: Driver) -> None:
    slow_down(ready, driver, 0.1, "10 %")
    ready.ask("choose", name="reach_choice", data="10 mm · 1°")
    before = height(ready)
    ready.wait("jog_z_minus", enabled=True)
    ready.ask("press", name="jog_z_minus")
    ready.wait("value_z", below=before - 12.0)
    ready.ask("release", name="jog_z_minus")
    ready.wait("mode", "Ready")
    ready.wait("home", enabled=True)
    at_rest = resting_height(driver)
    assert BORDER + 100.0 < at_rest < before - 12.0  # on a busy machine, some steps more are made before the release
    ready.ask("strike", key="F12")
    ready.wait("note", "Stop: done.")
    assert resting_height(driver) == pytest.approx(at_rest, abs=0.1)
    eventually(lambda: height(ready) == pytest.approx(at_rest, abs=0.1), "the dashboard shows where it rests")
    slow_down(ready, driver, 1.0, "100 %")


def test_keys_move_the_robot_only_with_the_focus(ready: Screen, driver: Driver) -> None:
    slow_down(ready, driver, 0.02, "5 %")  # the path of the held key outlasts the test
    motions = words(ready).count("moving")  # the end of an earlier motion may still be reported
    ready.ask("focus", name="field_x")
    ready.ask("key", key="PageUp")
    ready.ask("key", key="PageUp", down=False)
    ready.ask("focus", name="keys")
    ready.click("keys")
    ready.wait("jog_z_plus", enabled=True)
    ready.ask("key", key="PageUp")
    ready.wait("mode", "Moving")
    assert words(ready).count("moving") == motions + 1
    ready.ask("key", key="PageUp", repeated=True)
    ready.ask("unfocus")
    ready.wait("mode", "Ready")
    assert not ready.read("keys")["checked"]
    slow_down(ready, driver, 1.0, "100 %")


@pytest.mark.waits("4 s of homing at sixty times real speed, for the second key, as the first has stopped a homing")
@pytest.mark.parametrize("key", ["Escape", "F12"])
def test_key_stops_any_motion(ready: Screen, key: str) -> None:
    ready.ask("focus", name="field_x")
    ready.wait("home", enabled=True)
    ready.click("home")
    ready.wait("mode", "Homing")
    ready.ask("strike", key=key)
    ready.wait("mode", "Not homed")
    assert "stopped" in words(ready)


@pytest.mark.waits("4 s of homing at sixty times real speed, as the test before has stopped one")
def test_a_dashboard_that_dies_while_it_is_held_stops_the_robot(ready: Screen, ros: Ros, driver: Driver) -> None:
    events = driver.subscribe("/maya_event", "std_msgs/String")
    other = Screen(PYTHON, ros.environment, ros.folder / "other.log", "__name:=another")
    slow_down(ready, driver, 0.02, "5 %")
    other.wait("jog_z_minus", enabled=True)
    other.ask("choose", name="reach_choice", data="200 mm · 20°")
    other.ask("press", name="jog_z_minus")
    moving = events.until(lambda message: message["data"].startswith("moving "))
    other.kill()
    after = events.messages.index(moving)
    stopped = events.until(lambda message: message["data"].startswith(("stopped ", "idle ")), after=after)
    assert stopped["data"].startswith("stopped ")
    slow_down(ready, driver, 1.0, "100 %")


def test_dashboard_with_actionlib_1_12_leaves_without_an_error(tmp_path: Path, workspace: Workspace) -> None:
    log = tmp_path / "old.log"
    with Ros(tmp_path, workspace) as own, Screen(PYTHON, own.environment, log, "--old-actionlib") as old:
        own.set_param("/maya/speed", SPEED)
        own.start(*CONTROLLER_LAYER)
        old.wait("home", enabled=True)
        own.until(lambda: "/home/goal" in own.topics(), "the dashboard's action client")
        old.ask("leave")
    assert "Traceback" not in log.read_text(encoding="utf-8")


@pytest.mark.waits("4 s of homing at sixty times real speed, and 2 s until a stop counts as unconfirmed")
def test_it_stops_the_robot_without_a_master_and_shows_a_lost_one_as_disconnected(
    tmp_path: Path, workspace: Workspace
) -> None:
    with Ros(tmp_path, workspace, cold=True) as own, screen(own) as alone:
        alone.wait("banner_text", "No robot")
        own.set_param("/maya/speed", SPEED)
        layer = own.start(*CONTROLLER_LAYER)
        alone.wait("home", enabled=True)
        alone.click("home")
        alone.wait("mode", "Ready")
        assert "robot.launch" in alone.wait("now", enabled=False)["tip"]
        assert "process.launch" in alone.read("start")["tip"]
        own.lose_master()
        alone.wait("banner_text", "The ROS master is gone")
        alone.wait("home", enabled=True)
        alone.click("home")
        alone.wait("mode", "Homing")
        alone.click("stop")
        alone.wait("mode", "Not homed")
        alone.click("stop")
        alone.wait("note", "Stop: done.", kind="good")
        layer.send(signal.SIGSTOP)
        alone.click("stop")
        alone.wait("note", "No node confirmed the stop", kind="bad")
        layer.send(signal.SIGCONT)
        layer.close()
        alone.wait("mode", "Disconnected")
        alone.wait("banner_text", "No ROS master answers.")
        assert not alone.read("home")["enabled"]
        assert alone.read("stop")["enabled"]


def test_it_waits_for_a_master_and_then_takes_part(tmp_path: Path, workspace: Workspace) -> None:
    environment = workspace.environment() | {"ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}", "ROS_IP": "127.0.0.1"}
    with Screen(PYTHON, environment | {"ROS_LOG_DIR": str(tmp_path)}, tmp_path / "log") as alone:
        alone.wait("banner_text", "No ROS master answers.")
        alone.click("stop")
        alone.wait("note", "emergency stop", kind="bad")


def test_script_opens_a_window_as_a_node_and_ends_on_request(ros: Ros) -> None:
    window = ros.start(*SCRIPT, "__name:=window", environment={"QT_QPA_PLATFORM": "offscreen"})
    ros.until_nodes("/window")
    window.send(signal.SIGINT)
    assert window.wait() == 0


def test_with_rqt_the_script_opens_the_perspective(ros: Ros, tmp_path: Path) -> None:
    rqt = tmp_path / "rqt"
    rqt.write_text('#!/bin/sh\necho "rqt $@"\n', encoding="utf-8")
    rqt.chmod(0o755)
    environment = {"PATH": f"{tmp_path}:{ros.environment['PATH']}", "QT_QPA_PLATFORM": "offscreen"}
    opened = ros.start(*SCRIPT[:3], "__name:=another_dashboard", environment=environment)
    words = opened.until("rqt ").split()
    assert words[1] == "--perspective-file"
    assert words[3] == "__name:=another_dashboard"
    manager = json.loads(Path(words[2]).read_text(encoding="utf-8"))["groups"]["pluginmanager"]
    plugins = ast.literal_eval(manager["keys"]["running-plugins"]["repr"])
    assert "maya_ui/Maya" in plugins
    assert {plugin.split("/")[0] for plugin in plugins} <= set(ros.tool("rospack", "list-names").split())
    settings = manager["groups"]["plugin__rqt_rviz__RViz__1"]["groups"]["plugin"]["keys"]["rviz_config_file"]["repr"]
    assert "Fixed Frame: base" in Path(ast.literal_eval(settings)).read_text(encoding="utf-8")


def test_without_a_display_one_line_reports_it(ros: Ros) -> None:
    said = ros.tool(*SCRIPT)
    assert [line for line in said.splitlines() if line] == [
        "maya_dashboard: there is no display, so no dashboard is opened; everything else runs."
    ]


def test_help_is_printed_without_a_display(ros: Ros) -> None:
    assert "--window" in ros.tool(*SCRIPT, "--help")


def of_the_dashboard(rows: list[tuple[str, list[str]]]) -> set[str]:
    return {name for name, nodes in rows if "/maya_dashboard" in nodes}


def test_topics_agree_with_the_manual(ros: Ros, ready: Screen) -> None:
    published, subscribed, _ = ros.ask_master("getSystemState")
    assert {"/send_task", "/start_queue", "/stop_queue"} <= of_the_dashboard(published)
    assert {"/maya_event", "/maya_position"} <= of_the_dashboard(subscribed)
    assert ready.text("mode") == "Ready"


def test_its_picture_shows_all_of_it(ready: Screen, tmp_path: Path) -> None:
    saved, width, tall = ready.ask("grab", path=str(tmp_path / "dashboard.png"))
    assert saved
    assert (width, tall) == (1240, 860)
    assert (ROOT / "docs" / "images" / "dashboard-rqt.png").stat().st_size < 250_000
