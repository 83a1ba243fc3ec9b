"""The ROS packages agree with the project: copies, constants, events, arguments, and the table of the graph."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree as Xml

import pytest

from maya_ros.graph import types
from maya_ros.graph.events import words
from maya_ros.graph.table import TABLE, Kind, Row
from maya_ros.ros1.constants import constants
from maya_un import __version__
from maya_un.config.files import parse
from tests.conventions.source import ROOT

ROS = ROOT / "ros"
CONFIG = ROS / "maya_controller" / "src" / "maya_controller" / "config"
BARE = str(Path(sys.base_prefix, "bin", "python3"))
"""A Python without the packages of this project's environment."""

OURS = {"address": "$(eval 'sim' if arg('sim_mode') else 'real')", "speed": "1", "ns": ""}
COMMON = {"core_debug": "false", "sim_mode": "true", "skip_home": "false"}
ARGUMENTS = {
    "maya_controller/launch/controller.launch": {
        "gui": "false", **COMMON, "rvizconfig": "$(find maya_controller)/rviz/urdf.rviz",
    },
    "maya_robot/launch/robot.launch": COMMON,
    "maya_process/launch/process.launch": {
        **COMMON, "core_debug": "true", "custom_gui": "true", "skip_firebase": "false", "ros2": "false",
    },
}  # fmt: skip
"""The manual's arguments and defaults, by launch file, and `ros2`."""
NODES = {
    "hw_simulator", "hardware_interface", "sensor_converter", "robot_controller", "primitive_server",
    "process_controller", "firebase_bridge", "rosbridge", "ros2",
}  # fmt: skip
MANUAL = {
    "/maya_event": "std_msgs/String", "/maya_move": "maya_robot/MayaPrimitive",
    "/maya_position": "geometry_msgs/Point", "/hardware_sensor": "maya_controller/RawSensorData",
    "/send_task": "maya_robot/MayaPrimitive", "/start_queue": "maya_process/ProcessQueue",
    "/stop_queue": "std_msgs/Empty", "/step_command": "std_msgs/String", "/step_result": "std_msgs/String",
    "/gripper": "std_srvs/SetBool", "/home": "maya_controller/Home", "/move": "maya_controller/Move",
    "/controller/follow": "maya_controller/Follow", "/controller/stop": "std_srvs/Trigger",
    "/controller/recover": "std_srvs/Trigger", "/maya_command": "maya_robot/MayaCommand", "/task": "maya_robot/Task",
}  # fmt: skip
"""Names and types as the manual's users know them."""


def assigned(module: str) -> dict[str, ast.expr]:
    """Return what a module of the ROS packages assigns to names in capitals."""
    tree = ast.parse((CONFIG / module).read_text(encoding="utf-8"))
    pairs = ((node.targets[0], node.value) for node in tree.body if isinstance(node, ast.Assign))
    return {target.id: value for target, value in pairs if isinstance(target, ast.Name) and target.id.isupper()}


def test_the_copies_of_the_definitions_are_current() -> None:
    check = subprocess.run(
        [sys.executable, ROOT / "scripts" / "ros_definitions.py", "--check"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert check.returncode == 0, check.stdout + check.stderr


def test_a_copy_that_is_not_current_is_named_and_renewed(tmp_path: Path) -> None:
    for name in ("scripts", "src/maya_ros/graph/definitions", "ros"):
        (tmp_path / name).mkdir(parents=True)
    script = tmp_path / "scripts" / "ros_definitions.py"
    for one in (script, script.with_name("generated_files.py")):
        one.write_bytes((ROOT / "scripts" / one.name).read_bytes())
    new = tmp_path / "src" / "maya_ros" / "graph" / "definitions" / "maya_robot" / "msg" / "New.msg"
    old = tmp_path / "ros" / "maya_robot" / "msg" / "Old.msg"
    for file in (new, old):
        file.parent.mkdir(parents=True)
        file.write_text("bool yes\n")

    view = Path("ros", "maya_controller", "rviz", "urdf.rviz")
    (tmp_path / view).parent.mkdir(parents=True)
    (tmp_path / view).write_bytes((ROOT / view).read_bytes())

    def run(*arguments: str) -> tuple[int, list[str]]:
        done = subprocess.run([sys.executable, script, *arguments], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout.splitlines()

    places = ("ros/maya_robot/msg/New.msg", "ros/maya_robot/msg/Old.msg", "ros2/maya_interfaces/msg/New.msg")
    stale = [
        f"{place} is not current: run scripts/docs"
        for place in sorted((*places, "ros2/maya_description/rviz/maya.rviz"))
    ]
    assert run("--check") == (1, stale)
    assert run()[0] == 0
    assert run("--check") == (0, [])
    assert not old.exists()


def test_every_name_of_the_manual_is_among_the_constants() -> None:
    assert assigned("constants.py").keys() == constants(parse({})).keys()


def test_constant_has_the_value_of_its_own_name() -> None:
    filled = {name: ast.unparse(value) for name, value in assigned("constants.py").items()}
    assert filled == {name: f"_values['{name}']" for name in filled}


def test_the_words_of_events_are_those_of_the_graph() -> None:
    made = {name: value for name, value in assigned("events.py").items() if isinstance(value, ast.Call)}
    found = {name: ast.literal_eval(value.args[0]) for name, value in made.items()}
    assert list(found.values()) == words()
    assert all(name == word.upper() for name, word in found.items())


@pytest.mark.parametrize("file", ARGUMENTS)
def test_a_launch_file_has_the_arguments_of_the_manual_and_ours(file: str) -> None:
    given = {arg.attrib["name"]: arg.attrib["default"] for arg in Xml.parse(ROS / file).getroot().findall("arg")}
    assert given == {**ARGUMENTS[file], **OURS}


@pytest.mark.parametrize("file", ARGUMENTS)
def test_an_argument_is_explained_and_nothing_is_started_again(file: str) -> None:
    launch = Xml.parse(ROS / file).getroot()
    assert [arg.attrib["name"] for arg in launch.findall("arg") if not arg.get("doc")] == []
    assert [node.attrib["name"] for node in launch.iter("node") if node.get("respawn") or node.get("required")] == []


def test_a_node_is_three_lines_that_call_the_project() -> None:
    programs = {path.stem: path for path in ROS.glob("maya_[cpr]*/src/**/*.py") if path.stem in NODES}
    assert programs.keys() == NODES
    for name, path in programs.items():
        body = ast.parse(path.read_text(encoding="utf-8")).body[1:]
        called = f"from maya_ros.ros1.nodes.{name} import main"
        assert [ast.unparse(part) for part in body] == [
            called, "if __name__ == '__main__':\n    raise SystemExit(main())",
        ]  # fmt: skip
        assert not os.access(path, os.X_OK), "rosrun would find it beside the one that is built"


def test_the_manuals_names_have_the_manuals_types() -> None:
    assert {row.name: row.type for row in TABLE if row.manual} == MANUAL


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.name)
def test_every_type_of_the_table_exists(row: Row) -> None:
    if row.form is Kind.TOPIC:
        assert types.known(row.type)
    elif row.form is Kind.SERVICE:
        assert row.type in types.services()
    else:
        assert all(types.known(f"{row.type}{part}") for part in ("Action", "Goal", "Result", "Feedback"))


def test_names_in_the_table_are_there_once() -> None:
    assert len({row.name for row in TABLE}) == len(TABLE)


def test_packages_share_one_version_and_licence() -> None:
    manifests = [Xml.parse(path).getroot() for path in ROS.glob("*/package.xml")]
    assert {manifest.findtext("name") for manifest in manifests} == {
        "maya_controller", "maya_robot", "maya_process", "maya_ui", "maya_ros_un",
    }  # fmt: skip
    said = {(manifest.findtext("version"), manifest.findtext("license")) for manifest in manifests}
    assert said == {(__version__, "Apache-2.0")}


def test_the_stack_holds_the_other_packages() -> None:
    stack = Xml.parse(ROS / "maya_ros_un" / "package.xml").getroot()
    others = {path.parent.name for path in ROS.glob("*/package.xml")} - {"maya_ros_un"}
    assert {depend.text for depend in stack.findall("exec_depend")} == others


def test_the_constants_of_an_unconfigured_machine_are_those_of_the_project() -> None:
    assert ast.literal_eval(assigned("defaults.py")["VALUES"]) == constants(parse({}))


@pytest.mark.parametrize("python", [None, "/no/such/python", BARE])
def test_constants_without_maya_are_the_defaults_with_a_warning(python: str | None, tmp_path: Path) -> None:
    """As on a computer that has the messages alone: no workspace, no such Python, or one without maya_un."""
    package = tmp_path / "maya_controller"
    shutil.copytree(CONFIG.parent, package)
    if python is not None:
        (package / "nodes_python.py").write_text(f"PATH = {python!r}\n")
    program = "from maya_controller.config import constants; print(constants.MAYA_HEIGHT)"
    said = subprocess.run(
        [BARE, "-c", program],
        env={"PYTHONPATH": str(tmp_path), "PATH": os.environ["PATH"]},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert float(said.stdout) == constants(parse({}))["MAYA_HEIGHT"]
    assert "Maya is not installed here" in said.stderr


EVERYWHERE = [
    *(ROS / name / "setup.py" for name in ("maya_controller", "maya_robot", "maya_process")),
    *CONFIG.glob("*.py"),
    *ROS.glob("maya_[cpr]*/src/maya_*/__init__.py"),
]
"""The modules that a program on a computer with the messages alone needs, under the Python of its ROS."""
TOO_NEW = (
    ast.JoinedStr, ast.AnnAssign, ast.NamedExpr, ast.Starred, ast.YieldFrom, ast.Await, ast.AsyncFunctionDef,
    ast.Nonlocal, ast.MatMult,
)  # fmt: skip


@pytest.mark.parametrize("file", EVERYWHERE, ids=lambda path: str(path.relative_to(ROS)))
def test_what_messages_need_is_python_2_as_well(file: Path) -> None:
    nodes = list(ast.walk(ast.parse(file.read_text(encoding="utf-8"))))
    assert [ast.unparse(node) for node in nodes if isinstance(node, TOO_NEW)] == []
    functions = [node for node in nodes if isinstance(node, ast.FunctionDef)]
    assert not any(one.returns or one.args.kwonlyargs or one.args.posonlyargs for one in functions)
    assert not any(argument.annotation for one in functions for argument in one.args.args)
    assert not any(isinstance(node, ast.ImportFrom) and node.module == "__future__" for node in nodes)


@pytest.mark.parametrize("python", ["python2.7", "python3.6", "python3.8", BARE])
def test_events_are_compared_by_old_and_new_pythons(python: str) -> None:
    found = shutil.which(python)
    environment = {"PATH": os.environ["PATH"], "PYTHONPATH": str(CONFIG.parent.parent), "PYTHONDONTWRITEBYTECODE": "1"}
    if found is None or subprocess.run([found, "-V"], env=environment, capture_output=True, check=False).returncode:
        pytest.skip(f"there is no {python}")
    subprocess.run([found, "-c", COMPARE], env=environment, check=True)


COMPARE = """
from maya_controller.config import events as e
text = 'homed {"mode":"idle"}'
assert text == e.HOMED and e.HOMED == text and not text != e.HOMED and not e.HOMED != text
assert text != e.HOMING and text not in (e.HOMING, e.IDLE) and text in [e.IDLE, e.HOMED]
assert e.HOMED == "homed" and e.HOMED == e.HOMED and e.HOMED != e.HOMING and "homed2 {}" != e.HOMED and e.HOMED != 3
assert {e.HOMED: 1}["homed"] == 1 and e.HOMED.upper() == "HOMED" and "%s" % e.HOMED == "homed"
assert e.read(text) == ("homed", {"mode": "idle"}) and e.read("idle") == ("idle", {})
"""


@pytest.mark.parametrize("package", ["maya_controller", "maya_robot", "maya_process", "maya_ui"])
def test_a_package_asks_for_an_old_cmake(package: str) -> None:
    """Kinetic has CMake 3.5. The second number gives the behaviour of later ones, which 3.11 and older ignore."""
    first = (ROS / package / "CMakeLists.txt").read_text(encoding="utf-8").splitlines()[0]
    assert first == "cmake_minimum_required(VERSION 3.0.2...3.16)"


def test_the_metapackage_is_written_as_every_catkin_asks() -> None:
    """catkin 0.8.0 (Ubuntu) compares it with the template of catkin_pkg word for word, later ones by a pattern."""
    assert (ROS / "maya_ros_un" / "CMakeLists.txt").read_text(encoding="utf-8").splitlines() == [
        "cmake_minimum_required(VERSION 2.8.3)",
        "project(maya_ros_un)",
        "find_package(catkin REQUIRED)",
        "catkin_metapackage()",
    ]
