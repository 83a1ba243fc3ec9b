"""The dashboard's widget in a bare application, with a robot that only remembers what it was asked for."""

from __future__ import annotations

import ast
import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from tests.ros.screen import Screen
from tests.ros.workspace import ROOT
from tests.waiting import eventually

pytestmark = pytest.mark.system

PYTHON = Path("/usr/bin/python3")
UI = ROOT / "ros" / "maya_ui"
HERE = {"master": True, "controller": True, "robot": True, "process": True}
FAULT = (
    "Axis b could not follow its commanded position, so the controller switched its motor off. "
    "Look for an obstacle or a jammed line, "
    "then run `maya recover`."
)


@pytest.fixture(scope="module")
def only(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Screen]:
    folder = tmp_path_factory.mktemp("dashboard")
    folder.chmod(0o700)
    with Screen(PYTHON, {"XDG_RUNTIME_DIR": str(folder)}, folder / "log", "--stand-in") as screen:
        yield screen


@pytest.fixture
def screen(only: Screen) -> Screen:
    """A dashboard in English, of a homed robot at rest, with an empty list."""
    only.ask("speak", language="en")
    only.tell("Presence", **HERE)
    stand(only, "idle")
    for command in ("jog", "task"):
        only.tell("Ended", command=command, done=True)
    only.tell("Position", x=0.41, y=1.13, z=0.75)
    only.tell("Joints", a=0.35, b=1.61, c=1.82)
    if only.read("clear")["enabled"]:
        only.click("clear")
    only.tell("Queue")
    only.ask("choose", name="command_choice", data="task_pick")
    only.ask("focus", name="stop")
    only.asked()
    return only


def stand(screen: Screen, mode: str, **how: Any) -> None:
    """Have the robot tell how it stands."""
    plain: dict[str, Any] = {"mode": mode, "homed": True, "moving": mode == "moving", "gripper_closed": False}
    screen.tell("Happened", word=how.pop("word", mode), code=how.pop("code", ""), standing={**plain, **how})


def test_every_text_is_in_the_chosen_language(screen: Screen) -> None:
    screen.ask("choose", name="language_choice", data="Español")
    assert screen.text("stop") == "PARAR"
    assert screen.text("mode") == "Listo"
    assert screen.text("home") == "Buscar origen"
    assert screen.text("chip_gripper") == "pinza abierta"
    screen.ask("choose", name="language_choice", data="English")
    assert screen.text("stop") == "STOP"
    assert screen.text("mode") == "Ready"


def test_a_fault_shows_its_sentence_in_the_chosen_language_and_recover(screen: Screen) -> None:
    stand(screen, "fault", code="2302", fault_code="2302", fault=FAULT)
    assert screen.text("banner_text") == f"{FAULT} (2302)"
    assert screen.read("banner")["kind"] == "bad"
    assert screen.rows("event_list")[-1][1:] == ["fault", f"{FAULT} (2302)"]
    assert screen.read("home")["tip"] == "There is a fault: press Recover first."
    screen.ask("speak", language="es")
    assert screen.text("banner_text").startswith("El eje b no pudo")
    screen.click("recover")
    assert screen.asked() == [["recover"]]
    stand(screen, "idle")
    assert not screen.read("banner")["visible"]


def test_a_position_is_shown_in_millimetres_and_in_metres(screen: Screen) -> None:
    assert [screen.text(f"value_{axis}") for axis in "xyz"] == ["410.0", "1130.0", "750.0"]
    assert screen.text("metres_y") == "1.1300 m"
    screen.click("here")
    assert [screen.text(f"field_{axis}") for axis in "xyz"] == ["410.0", "1130.0", "750.0"]
    stand(screen, "not_homed", homed=False)
    assert screen.text("value_x") == "—"
    assert not screen.read("here")["enabled"]


def test_typed_value_is_understood_and_shown_before_it_is_sent(screen: Screen) -> None:
    screen.type(x="410", y="1,13 m", z="40 cm")
    assert [screen.text(f"echo_{axis}") for axis in "xyz"] == ["0.4100 m", "1.1300 m", "0.4000 m"]
    screen.click("now")
    assert screen.asked() == [["perform", {"command": "pick", "target": [0.41, 1.13, 0.4], "open": False}]]


@pytest.mark.parametrize(("text", "why"), [("abc", "write a number"), ("", "is missing"), ("410 m", "enter mm")])
def test_invalid_length_is_marked_and_sends_nothing(screen: Screen, text: str, why: str) -> None:
    screen.type(x="410", y=text, z="400")
    for button in ("now", "send", "add"):
        screen.click(button)
        assert screen.read("target_why")["text"].startswith("y: ")
    screen.ask("focus", name="stop")
    screen.type(z="400")
    assert why in screen.text("target_why")
    assert screen.read("field_y")["kind"] == "bad"
    assert screen.asked() == []
    assert screen.rows("task_list") == []


def test_a_list_is_put_together_changed_kept_and_given_away(screen: Screen, tmp_path: Path) -> None:
    screen.type(x="410", y="1130", z="400")
    screen.click("add")
    screen.ask("choose", name="command_choice", data="task_open")
    assert not screen.read("field_x")["enabled"]
    screen.click("add", "add", "up", "up", "remove")
    assert screen.rows("task_list") == ["1.  Pick   410 · 1130 · 400", "2.  Open gripper"]
    screen.ask("file", how="save", path=str(tmp_path / "list"))
    screen.click("clear")
    assert screen.read("start")["tip"] == "The list is empty."
    screen.ask("file", how="load", path=str(tmp_path / "list.yaml"))
    screen.click("start")
    pick = {"command": "pick", "target": [0.41, 1.13, 0.4], "open": False}
    assert screen.asked() == [["start_queue", [pick, {"command": "gripper", "target": [0.0, 0.0, 0.0], "open": True}]]]
    screen.click("stop_queue")
    assert screen.asked() == [["stop_queue"]]


def test_a_paused_queue_is_shown_and_resumed(screen: Screen) -> None:
    screen.tell("Queue", mode="paused", reason="failure")
    assert screen.text("mode") == "Ready, queue paused"
    assert screen.read("light")["kind"] == "warn"
    assert "The queue is paused (a job failed)." in screen.text("banner_text")
    screen.ask("add", command="home", target=[0, 0, 0])
    assert screen.text("queue_why") == "The queue is paused: your tasks wait in it."
    screen.click("start")
    assert "It waits, because the queue is paused." in screen.text("note")
    assert screen.read("note")["kind"] == "warn"
    screen.asked()
    screen.click("resume_queue")
    assert screen.asked() == [["resume_queue"]]
    screen.tell("Queue")
    assert screen.text("mode") == "Ready"
    assert not screen.read("resume_queue")["visible"]
    assert not screen.read("banner")["visible"]


def test_an_interrupted_job_is_shown_and_decided_on(screen: Screen) -> None:
    choices = [["redo", "yes"], ["redo", "no"], ["skip", ""], ["abort", ""]]
    screen.tell("Queue", mode="paused", reason="restart", job="3 (parts)", step="pick", choices=choices)
    stand(screen, "not_homed", homed=False)
    said = screen.text("banner_text")
    assert said.startswith("Not homed")
    assert "Job 3 (parts) was interrupted (pick)" in said
    assert not screen.read("resume_queue")["visible"]
    screen.ask("speak", language="es")
    assert screen.ask("menu", name="recover_queue")[0] == "Repetir el paso: la pinza tiene una pieza"
    screen.ask("speak", language="en")
    offered = screen.ask("menu", name="recover_queue", choose=1)
    assert offered == [
        "Repeat the step: the gripper holds a part", "Repeat the step: the gripper is empty", "Skip the step",
        "End the job",
    ]  # fmt: skip
    assert screen.asked() == [["recover_queue", {"name": "redo", "holding": "no"}]]
    screen.tell("Presence", master=True, controller=True, robot=True)
    assert not screen.read("recover_queue")["visible"]


def test_invalid_job_file_leaves_the_list_unchanged(screen: Screen, tmp_path: Path) -> None:
    screen.ask("add", command="home", target=[0, 0, 0])
    for name, text in {"bad.yaml": "steps: [{line: [1, 1, 1]}]", "worse.yaml": "{", "binary.yaml": "\0"}.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
        screen.ask("file", how="load", path=str(tmp_path / name))
        assert screen.read("note")["kind"] == "bad"
        assert name in screen.text("note")
    screen.ask("file", how="load", path=str(tmp_path / "none.yaml"))
    screen.ask("file", how="save", path=str(tmp_path / "no" / "folder.yaml"))
    assert "Writing folder.yaml failed" in screen.text("note")
    assert screen.rows("task_list") == ["1.  Home"]


def test_a_job_without_heights_takes_that_of_the_robot(screen: Screen) -> None:
    screen.tell("Cell", grasp_height=0.4)
    screen.ask("file", how="load", path=str(ROOT / "examples" / "01_pick_and_place.yaml"))
    assert screen.rows("task_list")[1] == "2.  Pick   410 · 1130 · 400"


@pytest.mark.parametrize("mode", ["disconnected", "homing", "moving", "fault", "paused"])
@pytest.mark.parametrize("key", ["Escape", "F12"])
def test_stop_is_there_in_every_state_by_button_and_key(screen: Screen, mode: str, key: str) -> None:
    stand(screen, mode)
    assert screen.read("stop")["enabled"]
    screen.click("stop")
    screen.ask("focus", name="field_x")
    screen.ask("strike", key=key)
    assert screen.asked() == [["stop"], ["stop"]]


def test_lost_robot_is_shown_and_releases_held_keys(screen: Screen) -> None:
    screen.ask("press", name="jog_z_plus")
    screen.tell("Presence", master=True)
    assert screen.text("mode") == "Disconnected"
    assert "no node publishes /maya_event" in screen.text("banner_text")
    assert [name for name, *_ in screen.asked()] == ["jog", "end_jog"]
    for name in ("home", "now", "send", "start", "jog_z_plus", "pause", "speed_choice"):
        assert not screen.read(name)["enabled"]
        assert screen.read(name)["tip"]
    screen.ask("release", name="jog_z_plus")


def test_silent_layer_counts_as_no_robot(screen: Screen) -> None:
    screen.tell("Presence", **HERE, silent=True)
    assert screen.text("mode") == "Disconnected"
    assert "sends nothing" in screen.text("banner_text")


@pytest.mark.parametrize("loss", ["release", "unfocus", "hide"])
def test_a_key_moves_the_robot_until_it_is_let_go_or_the_focus_is_lost(screen: Screen, loss: str) -> None:
    screen.click("keys")
    screen.ask("focus", name="keys")
    screen.ask("key", key="PageUp")
    screen.ask("key", key="PageUp", repeated=True)
    screen.ask("key", key="PageUp", down=False, repeated=True)
    asked = screen.asked()
    assert [name for name, *_ in asked] == ["jog"]
    assert asked[0][1]["points"] == [[0.41, 1.13, 0.75], [0.41, 1.13, 0.8]]
    if loss == "release":
        screen.ask("key", key="PageUp", down=False)
        screen.click("keys")
    else:
        screen.ask(loss)
    assert screen.asked() == [["end_jog"]]
    assert not screen.read("keys")["checked"]
    screen.ask("show")


def test_keys_do_nothing_to_the_robot_while_they_are_off(screen: Screen) -> None:
    screen.ask("focus", name="keys")
    for key in ("Up", "PageDown", "A", "W"):
        screen.ask("key", key=key)
        screen.ask("key", key=key, down=False)
    assert screen.asked() == []


def test_space_stops_while_keys_move_the_robot(screen: Screen) -> None:
    screen.click("keys")
    assert screen.ask("focus", name="keys") == "keys"
    assert screen.read("keys")["checked"]
    screen.ask("key", key="Space")
    assert screen.asked() == [["stop"]]
    assert screen.read("keys")["checked"]
    screen.click("keys")


def test_a_button_held_with_the_pointer_lets_go_when_it_is_hidden(screen: Screen) -> None:
    screen.ask("press", name="jog_x_plus")
    screen.ask("hide")
    assert [name for name, *_ in screen.asked()] == ["jog", "end_jog"]
    screen.ask("show")
    screen.ask("release", name="jog_x_plus")


def test_running_command_is_shown_until_its_end(screen: Screen) -> None:
    screen.tell("Under", command="task", phase="lower", share=0.4)
    assert screen.text("progress") == "Task: lower  %p%"
    assert "is running" in screen.read("now")["tip"]
    screen.tell("Ended", command="task", done=False, code="2201", message="A stop command ended this motion.")
    assert screen.text("note") == "Task: A stop command ended this motion. (2201)"
    assert screen.read("note")["kind"] == ""
    assert screen.text("progress") == ""


@pytest.mark.parametrize("focused", [True, False])
@pytest.mark.parametrize("choice", ["command_choice", "reach_choice", "speed_choice", "language_choice"])
def test_the_wheel_scrolls_and_changes_no_choice(screen: Screen, choice: str, focused: bool) -> None:
    if focused:
        screen.ask("focus", name=choice)
    before = screen.text(choice)
    assert screen.ask("turn_wheel", name=choice) is False
    assert screen.text(choice) == before
    assert screen.asked() == []


@pytest.mark.parametrize("button", ["home", "now"])
def test_a_started_command_leaves_the_focus_on_stop(screen: Screen, button: str) -> None:
    screen.type(x="410", y="1130", z="400")
    screen.ask("focus", name=button)
    screen.click(button)
    screen.asked()
    stand(screen, "moving")
    assert screen.read(button)["enabled"] is False
    screen.ask("strike", key="Space")
    assert screen.asked() == [["stop"]]


def test_speed_and_pause_are_sent_and_shown(screen: Screen) -> None:
    screen.ask("choose", name="speed_choice", data=0.5)
    stand(screen, "moving", override=0.25)
    assert screen.text("speed_choice") == "25 %"
    screen.click("pause")
    stand(screen, "paused")
    assert screen.text("pause") == "Resume"
    screen.click("pause")
    assert screen.asked() == [["speed", 0.5], ["pause"], ["resume"]]


def test_events_are_kept_in_order_and_not_without_end(screen: Screen) -> None:
    screen.tell("Happened", word="refused", code="2104", message="early", times=600)
    screen.tell("Happened", word="refused", code="2104", message="late")
    rows = screen.rows("event_list")
    assert len(rows) == 500
    assert rows[-1][1:] == ["refused", "late (2104)"]
    assert rows[0][1:] == ["refused", "early (2104)"]


def test_it_fits_a_small_screen_at_125_percent(tmp_path: Path) -> None:
    tmp_path.chmod(0o700)
    log = tmp_path / "log"
    environment = {"QT_SCALE_FACTOR": "1.25", "XDG_RUNTIME_DIR": str(tmp_path)}
    with Screen(PYTHON, environment, log, "--stand-in") as small:
        small.ask("speak", language="es")
        small.tell("Presence", **HERE)
        stand(small, "idle")
        assert small.ask("size", width=1092, height=614) == [1092, 614]
        assert small.ask("grab", path=str(tmp_path / "small.png")) == [True, 1365, 768]


def test_narrow_window_stacks_the_columns(screen: Screen) -> None:
    columns = ("where", "primitives", "queue")
    screen.ask("size", width=1240, height=860)
    assert len({screen.ask("place", name=column)[1] for column in columns}) == 1
    for narrower in (950, 850, 760):  # as a window that is dragged
        width, _ = screen.ask("size", width=narrower, height=860)
    places = [screen.ask("place", name=column) for column in columns]
    assert width < 800
    assert len({x for x, _ in places}) == 1
    assert [y for _, y in places] == sorted(y for _, y in places)
    assert screen.ask("size", width=1240, height=860) == screen.ask("hint")


@pytest.mark.parametrize("language", ["en", "es"])
def test_dashboard_beside_rviz_fits_1366_pixels(screen: Screen, language: str) -> None:
    """rviz gets 599 pixels of 1366, and the bar between it and the dashboard 6."""
    screen.ask("speak", language=language)
    screen.tell("Queue", mode="paused", reason="restart", job="3 (parts)", step="pick", choices=[["abort", ""]])
    for narrower in (950, 850, 761):
        width, _ = screen.ask("size", width=narrower, height=700)
    screen.tell("Queue", mode="running")
    screen.ask("speak", language="en")
    assert width == 761


def test_window_kept_on_a_larger_screen_fits_this_one(screen: Screen) -> None:
    screen.ask("size", width=1720, height=900)
    screen.ask("keep_on_screen")

    def fits() -> bool:
        room, frame = screen.ask("frame")
        return bool(frame == room)

    eventually(fits, "a window as large as the screen", 25.0)


def test_the_list_of_events_follows_the_newest_after_a_resize(screen: Screen) -> None:
    screen.tell("Happened", word="refused", code="2104", message="one of many", times=60)
    for height in (700, 900, 860):
        screen.ask("size", width=1240, height=height)
        assert screen.ask("last_row_is_in_view", name="event_list"), height
        screen.tell("Happened", word="refused", code="2104", message="new")
        assert screen.ask("last_row_is_in_view", name="event_list"), height


def test_a_second_dashboard_keeps_its_number_in_every_language(screen: Screen) -> None:
    assert screen.ask("title_of_another", number=1, language="es") == "Maya"
    assert screen.ask("title_of_another", number=2, language="es") == "Maya (2)"


def test_the_perspective_names_plugins_that_there_are_and_fits_a_screen() -> None:
    """The names are those that rqt's own packages export; geometry is a QByteArray of QWidget.saveGeometry."""
    groups = json.loads((UI / "rqt_config" / "maya_tools.perspective").read_text(encoding="utf-8"))["groups"]
    running = ast.literal_eval(groups["pluginmanager"]["keys"]["running-plugins"]["repr"])
    assert set(running) == {"maya_ui/Maya", "rqt_rviz/RViz", "rqt_topic/TopicPlugin"}
    kept = {name: value["repr(QByteArray.hex)"] for name, value in groups["mainwindow"]["keys"].items()}
    state = bytes.fromhex(kept["state"].partition("b'")[2].rstrip("')"))
    assert all(name.replace("/", "__").encode("utf-16-be") in state for name in running)
    geometry = bytes.fromhex(kept["geometry"].partition("b'")[2].rstrip("')"))
    magic, _, _, left, top, right, bottom = struct.unpack_from(">IHHiiii", geometry)
    assert magic == 0x1D9D0CB
    (screen,) = struct.unpack_from(">i", geometry, 46)
    assert screen == 0  # Qt ignores a geometry of a screen of another width; 0 counts for all
    assert (right - left, bottom - top) <= (1920, 1080)


def test_the_tree_of_the_package_is_that_of_the_manual() -> None:
    named = [
        "CMakeLists.txt", "package.xml", "plugin.xml", "resource/MayaPlugin.ui", "rqt_config/maya_tools.perspective",
        "scripts/maya_ui.py", "setup.py", "src/maya_ui/__init__.py", "src/maya_ui/maya_ui_module.py",
        "src/maya_ui/ui_controller.py",
    ]  # fmt: skip
    assert [name for name in named if not (UI / name).is_file()] == []


def test_rqt_finds_the_plugin_by_the_exports_of_the_package() -> None:
    exported = ElementTree.parse(UI / "package.xml").find("export/rqt_gui")
    assert exported is not None
    description = ElementTree.parse(exported.attrib["plugin"].replace("${prefix}", str(UI)))
    plugin = description.find("class")
    assert plugin is not None
    module, _, name = plugin.attrib["type"].rpartition(".")
    source = UI / description.getroot().attrib["path"] / f"{module.replace('.', '/')}.py"
    assert f"class {name}(Plugin)" in source.read_text(encoding="utf-8")
