"""The launch files: which nodes every choice of arguments starts, with a display and without, and how they end."""

from __future__ import annotations

import itertools
import json
import re
import signal
import socket
import subprocess
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from tests.ros.display import RVIZ_CRASH, Display
from tests.ros.harness import Ros
from tests.ros.programs import Program
from tests.ros.workspace import PACKAGES as PLACES
from tests.ros.workspace import Workspace, python, run

CONTROLLER, ROBOT, PROCESS = "controller.launch", "robot.launch", "process.launch"
PACKAGES = {CONTROLLER: "maya_controller", ROBOT: "maya_robot", PROCESS: "maya_process"}
SWITCHES = {
    CONTROLLER: ("gui", "core_debug", "sim_mode", "skip_home"),
    ROBOT: ("core_debug", "sim_mode", "skip_home"),
    PROCESS: ("core_debug", "sim_mode", "skip_home", "custom_gui", "skip_firebase", "ros2"),
}
"""The arguments that are true or false."""
LAYERS = {
    CONTROLLER: set[str](),
    ROBOT: {"robot_controller", "primitive_server"},
    PROCESS: {
        "robot_controller", "primitive_server", "process_controller", "firebase_bridge", "rosbridge",
    },
}  # fmt: skip
START = 55.0
"""Longest time for the whole start [s] on a busy machine."""

Choice = dict[str, bool]


def every(names: tuple[str, ...]) -> list[Choice]:
    """Return every choice of some switches."""
    return [dict(zip(names, values, strict=True)) for values in itertools.product((False, True), repeat=len(names))]


def pairwise(names: tuple[str, ...]) -> list[Choice]:
    """Return few choices, among which any two switches have all four pairs of values."""
    left = {
        frozenset({(one, x), (other, y)})
        for one, other in itertools.combinations(names, 2)
        for x, y in itertools.product((False, True), repeat=2)
    }
    chosen: list[Choice] = []
    while left:
        best = max(every(names), key=lambda choice: len({pair for pair in left if pair <= choice.items()}))
        chosen.append(best)
        left = {pair for pair in left if not pair <= best.items()}
    return chosen


def expected(file: str, choice: Mapping[str, bool]) -> set[str]:
    """Return the nodes that a choice starts, according to the manual."""
    nodes = {"robot_state_publisher"} | LAYERS[file]
    nodes |= {"hw_simulator"} if choice.get("sim_mode", True) else {"hardware_interface", "sensor_converter"}
    nodes |= {"joint_gui", "joint_sliders"} if choice.get("gui", False) else set()
    nodes |= set() if choice.get("core_debug", file == PROCESS) else {"rviz"}
    if file == PROCESS:
        nodes |= {"maya_dashboard"} if choice.get("custom_gui", True) else set()
        nodes |= set() if choice.get("skip_firebase", False) else {"ros_coms"}
        nodes |= {"ros2"} if choice.get("ros2", False) else set()
    return nodes


def written(arguments: Mapping[str, Any]) -> list[str]:
    """Return arguments as roslaunch takes them."""
    return [f"{name}:={str(value).lower() if isinstance(value, bool) else value}" for name, value in arguments.items()]


PLANNED = """
import json, sys
import roslaunch.config, roslaunch.loader
read = roslaunch.loader.Loader.param_value
def without_commands(self, verbose, name, kind, value, textfile, binfile, command):
    return read(self, verbose, name, kind, "" if command else value, textfile, binfile, None)
roslaunch.loader.Loader.param_value = without_commands
told = []
for file, arguments in json.loads(sys.argv[1]):
    plan = roslaunch.config.load_config_default([(file, arguments)], None)
    told.append({"nodes": {node.name: f"{node.package}/{node.type} {node.args}".strip() for node in plan.nodes},
                 "params": {name: param.value for name, param in plan.params.items() if name.startswith("/maya/")}})
print(json.dumps(told))
"""
"""Nodes that launch files would start, as roslaunch itself reads them; output of commands is left out."""


def planned(workspace: Workspace, requests: list[tuple[str, Mapping[str, Any]]]) -> list[dict[str, Any]]:
    """Return nodes and parameters that launch files with these arguments would bring."""
    asked = [(str(PLACES / PACKAGES[file] / "launch" / file), written(arguments)) for file, arguments in requests]
    said = run(["/usr/bin/python3", "-c", PLANNED, json.dumps(asked)], workspace.place, workspace.environment())
    return json.loads(said.splitlines()[-1])


@pytest.mark.parametrize("file", PACKAGES)
def test_arguments_choose_the_nodes_as_the_manual_says(file: str, workspace: Workspace) -> None:
    choices = every(SWITCHES[file])
    plans = planned(workspace, [(file, choice) for choice in choices])
    for choice, plan in zip(choices, plans, strict=True):
        assert plan["nodes"].keys() == expected(file, choice), choice
        assert plan["params"] == {
            "/maya/address": "sim" if choice["sim_mode"] else "real",
            "/maya/sim_mode": choice["sim_mode"],
            "/maya/skip_home": choice["skip_home"],
            "/maya/speed": 1.0,
        }


def test_without_arguments_the_defaults_are_the_manuals(workspace: Workspace) -> None:
    controller, robot, process = planned(workspace, [(file, {}) for file in PACKAGES])
    assert controller["nodes"].keys() == {"hw_simulator", "robot_state_publisher", "rviz"}
    assert robot["nodes"].keys() == {*controller["nodes"], "robot_controller", "primitive_server"}
    assert process["nodes"].keys() == {
        *(robot["nodes"].keys() - {"rviz"}),
        *("process_controller", "firebase_bridge", "rosbridge", "ros_coms", "maya_dashboard"),
    }


def test_arguments_are_passed_down(workspace: Workspace) -> None:
    given = {"address": "10.0.0.7:5023", "speed": 4, "sim_mode": False, "skip_home": True}
    for plan in planned(workspace, [(file, given) for file in PACKAGES]):
        assert plan["params"] == {
            "/maya/address": "10.0.0.7:5023", "/maya/speed": 4.0, "/maya/sim_mode": False, "/maya/skip_home": True,
        }  # fmt: skip


def test_rviz_shows_the_selected_displays(workspace: Workspace) -> None:
    own, usual = planned(workspace, [(CONTROLLER, {"rvizconfig": "/tmp/own.rviz"}), (CONTROLLER, {})])
    assert own["nodes"]["rviz"].endswith("rviz -d /tmp/own.rviz")
    assert usual["nodes"]["rviz"].endswith("maya_controller/rviz/urdf.rviz")


WINDOWS = {"rviz", "maya_dashboard", "joint_sliders"}
"""Nodes that open windows."""
PLANNING = {"hw_simulator", "robot_controller", "process_controller"}
"""Nodes that plan motions, each in a worker process of its own."""
OUTSIDE = {"ros_coms"}
"""Programs of a launch file that are no nodes: they reach the graph by rosbridge."""


@pytest.fixture
def ros(tmp_path: Path, workspace: Workspace) -> Iterator[Ros]:
    """Return a ROS of the test's own, whose nodes start from nothing."""
    with Ros(tmp_path, workspace, cold=True) as own:
        yield own


@pytest.fixture(scope="module")
def display(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Display]:
    with Display(tmp_path_factory.mktemp("display")) as shown:
        yield shown


def launched(ros: Ros, file: str, choice: Choice, display: Mapping[str, str]) -> Program:
    """Launch a file; for a machine, use a twin that is served on the wire."""
    told: dict[str, Any] = dict(choice)
    if not choice.get("sim_mode", True):
        twin = ros.start(str(python().with_name("maya")), "dmc", "serve", "--port", "0")
        told.update(address=served_at(twin), speed=1)
    return ros.launch(PACKAGES[file], file, display, **told)


def served_at(twin: Program) -> str:
    """Return the address of a twin from its output."""
    found = re.search(r"127\.0\.0\.1:\d+", twin.until("127.0.0.1:"))
    assert found is not None
    return found[0]


def check(ros: Ros, file: str, choice: Choice, display: Mapping[str, str]) -> None:
    """Launch, find everything that was chosen and nothing that was not, and end it."""
    program = launched(ros, file, choice, display)
    left_out = set[str]() if display else WINDOWS
    stay = expected(file, choice) - left_out - OUTSIDE
    ros.until_nodes(*(f"/{name}" for name in stay), within=START)
    for name in expected(file, choice) & left_out:
        program.until(f"{name} is left out: there is no display", START)
    if "ros_coms" in expected(file, choice):
        program.until("POST /connect", START)
    assert {name.lstrip("/") for name in ros.nodes()} == stay | {"rosout"}
    for name in stay & PLANNING:
        ros.until(partial(workers_of, ros.process(f"/{name}")), f"a worker process of {name}")
    check_state(ros, file, choice)
    assert program.end() == 0
    assert "has died" not in RVIZ_CRASH.sub("", program.said)
    assert "Traceback" not in program.said


def workers_of(process: int) -> list[int]:
    """Return the worker processes of a process."""
    listed = subprocess.run(["ps", "-ww", "-o", "pid=,args=", "--ppid", str(process)], capture_output=True, check=False)
    return [int(line.split()[0]) for line in listed.stdout.splitlines() if b"maya_un.workers.child" in line]


def check_state(ros: Ros, file: str, choice: Choice) -> None:
    """Find a robot that reports that it is not homed; after a taken-over homing too."""
    driver = ros.driver()
    state = driver.subscribe("/maya_event", "std_msgs/String").until()["data"].partition(" ")[2]
    assert json.loads(state)["homed"] is False
    if file != CONTROLLER:
        question = {"task": {"command": "can_teleop"}}
        ros.until(lambda: driver.call("/maya_command", question)["code"] == "2103", "all of it is heard, not homed")
    if file == PROCESS:
        socket.create_connection(("127.0.0.1", ros.rosbridge_port), 10.0).close()
    driver.close()
    assert ros.param("/maya/skip_home") is choice.get("skip_home", False)


@pytest.mark.timeout(240)
def test_process_launch_starts_every_node_and_ends(ros: Ros, display: Display) -> None:
    choice = {"core_debug": False, "custom_gui": True, "skip_firebase": False, "skip_home": True}
    check(ros, PROCESS, choice, display.environment)


@pytest.mark.timeout(240)
@pytest.mark.parametrize("seen", [True, False])
def test_controller_layer_runs_alone_with_its_sliders(ros: Ros, display: Display, *, seen: bool) -> None:
    check(ros, CONTROLLER, {"gui": True, "core_debug": True}, display.environment if seen else {})


@pytest.mark.timeout(240)
def test_robot_layer_runs_without_the_process_layer(ros: Ros) -> None:
    check(ros, ROBOT, {"core_debug": True}, {})


@pytest.mark.timeout(240)
def test_launch_without_arguments_starts_the_whole_graph_with_any_python_first(
    tmp_path: Path, workspace: Workspace, other_python: str
) -> None:
    with Ros(tmp_path, workspace, roscore=True, cold=True) as ros:
        program = ros.start("roslaunch", "maya_process", "process.launch", environment={"PATH": other_python})
        ros.until_nodes(*(f"/{name}" for name in {"hw_simulator"} | LAYERS[PROCESS]), within=START)
        program.until("maya_dashboard is left out", START)
        assert ros.param("/maya/speed") == 1.0
        check_state(ros, PROCESS, {})
        assert program.end() == 0


@pytest.mark.timeout(240)
def test_a_node_that_fails_is_named_and_not_started_again(ros: Ros) -> None:
    nobody = f"127.0.0.1:{ros.rosbridge_port}"
    program = ros.launch(PACKAGES[PROCESS], PROCESS, address=nobody, speed=1, sim_mode=False)
    died = program.until("hardware_interface-1] process has died", START)
    assert "exit code" in died
    ros.until_nodes("/rosbridge", "/robot_state_publisher", within=START)
    assert program.said.count("process[hardware_interface-1]: started") == 1
    assert program.end() == 0


@pytest.mark.long
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("file", PACKAGES)
def test_every_pair_of_arguments_starts_and_ends(
    file: str, workspace: Workspace, display: Display, tmp_path_factory: pytest.TempPathFactory
) -> None:
    for choice in pairwise((*SWITCHES[file], "display")):
        shown = display.environment if choice.pop("display") else {}
        with Ros(tmp_path_factory.mktemp("ros"), workspace, cold=True) as ros:
            check(ros, file, choice, shown)


@pytest.mark.timeout(240)
@pytest.mark.parametrize("how", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.long)])
def test_it_ends_while_it_starts(ros: Ros, how: signal.Signals) -> None:
    """Python itself may complain where it is interrupted before a node's first line; nothing may stay."""
    program = ros.launch(PACKAGES[PROCESS], PROCESS)
    program.until("process[rosbridge-")
    program.end(how)
    ros.until(lambda: ros.nodes() == {"/rosout"}, "an empty graph")
