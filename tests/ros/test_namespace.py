"""Two Mayas on one master: one with the manual's names, one below /maya2."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import connect

from maya_ros.graph.protocol import GoalStatus
from maya_ros.graph.table import EVENT, SENSORS, START_QUEUE, STEP_COMMAND, STEP_RESULT, TABLE, Kind
from tests.ros.driver_client import Driver, Feed, Goal, Message
from tests.ros.harness import Ros
from tests.ros.launched_layers import DONE, near, primitive, read_event
from tests.ros.programs import Program
from tests.ros.workspace import Workspace, python
from tests.system.brokers import Broker, broker
from tests.system.test_coms import call, supervisor

pytestmark = [pytest.mark.system, pytest.mark.timeout(240)]

SPEED = 20
PART = {"": (0.5, 1.2, 0.4), "/maya2": (0.6, 1.1, 0.4)}
"""Position of each robot's part."""
THERE = (0.9, 0.9, 0.4)


@dataclass
class Maya:
    """One of them: its namespace, its launch, and a node that drives both."""

    space: str
    launched: Program
    driver: Driver
    events: Feed

    def do(self, action: str, kind: str, goal: Message | None = None) -> Goal:
        return self.driver.do(self.space + action, kind, goal)

    def call(self, service: str, request: Message | None = None) -> Message:
        return self.driver.call(self.space + service, request)

    def publish(self, topic: str, kind: str, message: Message) -> None:
        self.driver.publish(self.space + topic, kind, message)

    def task(self, command: str, target: tuple[float, float, float]) -> Goal:
        return self.do("/task", "maya_robot/Task", {"task": primitive(command, target)})

    def twin(self) -> dict[str, Any]:
        """Return what its mechanics know."""
        known: dict[str, Any] = json.loads(self.call("/hw_simulator/twin")["message"])
        return known

    def homed(self) -> bool:
        return bool(self.call("/maya_command", {"task": primitive("can_teleop")})["success"])


@dataclass
class Pair:
    """Both, and what they share."""

    ros: Ros
    broker: Broker
    first: Maya
    second: Maya

    def both(self) -> tuple[Maya, Maya]:
        return self.first, self.second


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory, workspace: Workspace) -> Iterator[Pair]:
    folder = tmp_path_factory.mktemp("pair")
    with broker(folder) as one, Ros(folder, workspace) as ros:
        launches = {}
        for space, part in PART.items():
            ros.set_param(f"{space}/maya/parts", {"part": list(part)})
            choice = {"ns": space.strip("/")} if space else {}
            environment = {"MAYA_COMS_URL": one.url}
            launches[space] = ros.launch(
                "maya_process", "process.launch", environment, speed=SPEED, skip_firebase=False, **choice
            )
        for launched in launches.values():
            launched.until("The queue is worked", 90.0)
            launched.until("POST /connect", 90.0)
        driver = ros.driver()
        mayas = [
            Maya(space, launched, driver, driver.subscribe(space + EVENT.name, EVENT.type))
            for space, launched in launches.items()
        ]
        for maya in mayas:
            maya.events.until()
        pair = Pair(ros, one, *mayas)
        goals = [maya.do("/home", "maya_controller/Home") for maya in pair.both()]
        assert [goal.ended(90.0) for goal in goals] == [(GoalStatus.SUCCEEDED, DONE)] * 2
        for maya in mayas:
            ros.until(maya.homed, "homed")
        yield pair


@pytest.mark.waits("12 s of homing at twenty times real speed, once for the file, as rospy lives in real time")
def test_names_of_the_first_are_the_manuals_and_those_of_the_second_below(pair: Pair) -> None:
    topics, services, nodes = pair.ros.topics(), pair.ros.services(), pair.ros.nodes()
    for space in ("", "/maya2"):
        for row in set(TABLE) - {SENSORS}:  # the twin's node tells what they mean at once
            if row.form is Kind.SERVICE:
                assert space + row.name in services
            else:
                name = row.name if row.form is Kind.TOPIC else f"{row.name}/goal"
                assert space + name in topics
        assert f"{space}/hw_simulator" in nodes
        assert f"{space}/tf" in topics
    mine = {"/rosout", "/rosout_agg", "/clock"}
    seconds = {name for node in nodes if node.startswith("/maya2/") for name in _published(pair.ros, node)} - mine
    assert seconds
    assert all(name.startswith("/maya2/") for name in seconds), seconds


def _published(ros: Ros, node: str) -> list[str]:
    return [name for name, publishers in ros.ask_master("getSystemState")[0] if node in publishers]


def test_both_run_a_job_at_once_and_each_moves_its_own_part(pair: Pair) -> None:
    for maya, there in zip(pair.both(), ((0.8, 0.8, 0.4), (0.4, 1.3, 0.4)), strict=True):
        tasks = [primitive("pick", PART[maya.space]), primitive("place", there)]
        maya.publish(START_QUEUE.name, START_QUEUE.type, {"tasks": tasks})
    for maya, there in zip(pair.both(), ((0.8, 0.8, 0.4), (0.4, 1.3, 0.4)), strict=True):
        pair.ros.until(lambda maya=maya, there=there: near(maya.twin()["parts"]["part"], there, 0.01), "placed")
        assert maya.twin()["drops"] == 0


def test_both_carry_out_steps_at_once(pair: Pair) -> None:
    places = {"": (0.7, 1.0, 0.6), "/maya2": (0.5, 0.9, 0.5)}
    feeds = {space: pair.ros.driver().subscribe(space + STEP_RESULT.name, STEP_RESULT.type) for space in places}
    for maya in pair.both():
        args = dict(zip("xyz", places[maya.space], strict=True))
        step = {"id": "the same id", "command": "approach", "args": args}
        maya.publish(STEP_COMMAND.name, STEP_COMMAND.type, {"data": json.dumps(step)})
    for maya in pair.both():
        assert json.loads(feeds[maya.space].until()["data"])["success"] is True
        assert near(maya.twin()["point"][:2], places[maya.space][:2], 0.01)


@pytest.mark.parametrize("stopped", [0, 1])
def test_stop_of_one_leaves_the_other_running(pair: Pair, stopped: int) -> None:
    one, other = pair.both()[stopped], pair.both()[1 - stopped]
    for maya in pair.both():
        assert maya.task("approach", PART[""]).ended()[0] == GoalStatus.SUCCEEDED
        maya.publish("/controller/speed", "std_msgs/Float64", {"data": 0.05})
    marks = {maya.space: len(maya.events.messages) for maya in pair.both()}
    goals = {maya.space: maya.task("approach", THERE) for maya in pair.both()}
    for maya in pair.both():
        maya.events.until(lambda message: read_event(message)[0] == "moving", after=marks[maya.space])
    assert one.call("/controller/stop")["success"]
    assert goals[one.space].ended()[0] == GoalStatus.PREEMPTED
    for maya in pair.both():
        maya.publish("/controller/speed", "std_msgs/Float64", {"data": 1.0})
    assert goals[other.space].ended()[0] == GoalStatus.SUCCEEDED
    assert near(other.twin()["point"][:2], THERE[:2], 0.01)
    assert not near(one.twin()["point"][:2], THERE[:2], 0.01)
    assert "stopped" not in [read_event(message)[0] for message in other.events.messages[marks[other.space] :]]


def test_rosbridge_of_the_second_serves_the_second_by_the_manuals_names(pair: Pair) -> None:
    assert pair.ros.param("/rosbridge/url") != pair.ros.param("/maya2/rosbridge/url")
    before = pair.first.twin()["joints"]
    with connect(pair.ros.param("/maya2/rosbridge/url")) as socket:
        ask = {"op": "call_service", "id": "1", "service": "/maya_command"}
        task = primitive("approach", (0.6, 1.2, 0.5))
        socket.send(json.dumps({**ask, "args": {"task": task}}))
        assert json.loads(socket.recv(40.0))["values"]["success"] is True
        socket.send(json.dumps({"op": "call_service", "id": "2", "service": "/rosapi/topics"}))
        topics = json.loads(socket.recv(40.0))["values"]["topics"]
    assert "/maya_event" in topics
    assert not [name for name in topics if name.startswith("/maya2")]
    assert near(pair.second.twin()["point"][:2], (0.6, 1.2), 0.01)
    assert pair.first.twin()["joints"] == before


def test_supervisors_command_each_by_its_name_on_one_broker(pair: Pair) -> None:
    for maya, name in zip(pair.both(), ("MAYA", "MAYA2"), strict=True):
        line = maya.launched.until("POST /connect", 10.0)
        url = next(word for word in line.split() if word.startswith("http://")).rstrip(":")
        assert call("POST", url, "/connect")["status"] == 200
        before = [each.twin()["joints"] for each in pair.both() if each is not maya]
        with supervisor(pair.broker, name) as lab:
            lab.until_online()
            lab.send(f"to {name}", "approach", x=0.75, y=1.05, z=0.5)
            assert lab.hear("results")["success"] is True
        assert near(maya.twin()["point"][:2], (0.75, 1.05), 0.01)
        assert [each.twin()["joints"] for each in pair.both() if each is not maya] == before


def test_each_has_its_own_files(pair: Pair) -> None:
    state = Path(pair.ros.environment["MAYA_STATE_DIR"])
    run = Path(pair.ros.environment["MAYA_RUNTIME_DIR"])
    for name in ("maya.db", "steps.db"):
        assert (state / name).exists()
        assert (state / "ns-maya2" / name).exists()
    assert (run / "service.json").read_text() != (run / "ns-maya2" / "service.json").read_text()


@pytest.mark.parametrize(("words", "name"), [([], "MAYA"), (["__ns:=maya2"], "MAYA2")])
def test_ros_coms_has_the_name_of_the_namespace_of_its_arguments(words: list[str], name: str) -> None:
    code = """
from maya_ros.ros1.nodes.rosbridge import settle_environment
settle_environment()
from maya_un.coms.settings import from_environment
print(from_environment().name)
"""
    kept = {key: value for key, value in os.environ.items() if key not in {"NAME", "PORT", "ROS_NAMESPACE"}}
    environment = {**kept, "IP": "ws://127.0.0.1:1"}
    done = subprocess.run([python(), "-c", code, *words], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == name
