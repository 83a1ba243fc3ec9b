"""With sim_mode:=false the layers run on a box; here on one that this machine serves, with a fast clock."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from maya_ros.graph.protocol import GoalStatus
from maya_un.config import Config, Units
from maya_un.kinematics.mechanism import Mechanism
from tests.ros.driver_client import Driver
from tests.ros.harness import Ros
from tests.ros.launched_layers import DONE, near, read_event
from tests.ros.programs import Program
from tests.ros.workspace import Workspace

pytestmark = pytest.mark.system

HURRY = 100
MOVE = "maya_controller/Move"
NO_GUARD = {"safety": {"guard_time": 0.0}}
"""The guard counts its seconds by the box's clock, and that one hurries."""


class Box:
    """A box, and the controller layer on it."""

    def __init__(self, ros: Ros, hurry: int = HURRY) -> None:
        self.ros = ros
        self.program = ros.start(
            str(Path(sys.executable).with_name("maya")), "dmc", "serve", "--port", "0", "--speed", str(hurry)
        )
        self.program.until("maya dmc fault")
        self.address = self.program.lines[0]
        self.driver: Driver = ros.driver()
        self.events = self.driver.subscribe("/maya_event", "std_msgs/String")

    def launch(self, *, skip_home: bool = False) -> Program:
        """Launch the controller layer on it."""
        seen = len(self.events.messages)
        launched = self.ros.launch(
            "maya_controller", "controller.launch", sim_mode=False, address=self.address, speed=1, skip_home=skip_home
        )
        launched.until("is offered to the graph")
        self.events.until(after=seen)
        return launched

    def until_told(self, word: str, after: int = 0) -> None:
        """Wait for an event."""
        self.events.until(lambda message: read_event(message)[0] == word, after=after)


@pytest.fixture(scope="module")
def box(tmp_path_factory: pytest.TempPathFactory, workspace: Workspace) -> Iterator[Box]:
    with Ros(tmp_path_factory.mktemp("real"), workspace) as ros:
        ros.set_param("/maya/config", NO_GUARD)
        yield Box(ros)


def move(box: Box, a: float, b: float = 1.6, c: float = 1.6) -> tuple[int, str]:
    """Go to joints and return how that ended."""
    outcome, result = box.driver.do("/move", MOVE, {"a": a, "b": b, "c": c}).ended()
    return outcome, result["code"]


@pytest.mark.waits("about 20 s of homing: the box's clock hurries, that of the nodes does not")
def test_without_a_mark_of_homing_the_graph_is_up_and_motion_is_refused(box: Box) -> None:
    launched = box.launch(skip_home=True)
    launched.until("skip_home: error 2106")
    assert move(box, 0.5) == (GoalStatus.REJECTED, "2103")
    assert box.driver.do("/home", "maya_controller/Home").ended() == (GoalStatus.SUCCEEDED, DONE)
    assert launched.end() == 0
    assert box.ros.param("/maya/config") == NO_GUARD


def test_maya_up_next_to_the_nodes_is_refused_and_names_their_process(box: Box) -> None:
    """The box's clock decides whether an owner lives, so it must run in real time here."""
    slow = Box(box.ros, hurry=1)
    launched = slow.launch()
    try:
        maya = str(Path(sys.executable).with_name("maya"))
        up = box.ros.start(maya, "up", "--port", "0", "--journal", "memory", "--address", slow.address)
        assert up.wait() == 1, up.said
        assert "1030" in up.said and "(process " in up.said, up.said
        assert slow.driver.call("/controller/stop")["success"]
    finally:
        launched.end()
        slow.program.end()


def test_homing_is_taken_over_and_measurements_are_converted(box: Box) -> None:
    seen = len(box.events.messages)
    launched = box.launch(skip_home=True)
    box.until_told("homed", seen)
    a, b, c, *_ = box.driver.subscribe("/joint_states", "sensor_msgs/JointState").until()["position"]
    assert move(box, a + 0.02, b, c) == (GoalStatus.SUCCEEDED, "")
    sensors = box.driver.subscribe("/hardware_sensor", "maya_controller/RawSensorData")
    positions = box.driver.subscribe("/maya_position", "geometry_msgs/Point")
    raw = sensors.until(lambda message: not any(message["moving"]), after=len(sensors.messages))
    told = positions.until(after=len(positions.messages) + 2)
    config = Config()
    expected = Mechanism.of(config).fk(Units.of(config).to_joints(tuple(raw["position"])))
    assert near((told["x"], told["y"], told["z"]), expected, within=1e-6)
    before = len(box.events.messages)
    box.program.kill()
    box.until_told("disconnected", before)
    assert move(box, 0.7)[1] in {"1010", "2105"}
    assert launched.end() == 0


@pytest.mark.parametrize("node", ["hardware_interface", "sensor_converter"])
def test_without_a_box_a_node_reports_it_and_ends(node: str, box: Box) -> None:
    program = box.ros.start("rosrun", "maya_controller", f"{node}.py", "_address:=127.0.0.1:1", f"__name:=alone_{node}")
    if node == "hardware_interface":
        assert program.wait() == 1
        assert "error 1002: " in program.said
    else:
        program.until("Waiting for the controller's node.")
        assert program.end() == 0


def test_sim_is_not_an_address_of_a_machine(box: Box) -> None:
    program = box.ros.start("rosrun", "maya_controller", "hardware_interface.py", "_address:=sim", "__name:=wrong")
    assert program.wait() == 2
    assert "error 4001: " in program.said
