"""A stranger in the ROS 2 graph of a robot: it moves, stops and watches the robot with nothing but DDS."""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from math import dist
from pathlib import Path
from typing import Any

import pytest
import requests

pytest.importorskip("cyclonedds", reason="there is no DDS for this machine")

from maya_ros.graph.access import Guest
from maya_ros.graph.bus import Bus
from maya_ros.graph.table import TABLE, Kind
from maya_ros.ros2 import types
from maya_ros.ros2.edge import dds_serving
from maya_un.assembly import Stack
from maya_un.edges import Ros2Options
from maya_un.errors import Ros2NotJoined
from maya_un.values import Point
from tests.campaign import Campaign
from tests.shared_robot import SharedRobot, shared_robot
from tests.waiting import eventually

pytestmark = pytest.mark.system

HERE, THERE = (0.41, 1.13, 0.5), (1.18, 0.21, 0.5)
NEAR = 2e-3
SUCCEEDED, CANCELED = 4, 5

LOOPBACK = """<CycloneDDS><Domain>
<General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""
"""Nothing leaves this machine."""

PEER = Path(__file__).with_name("ros2_peer.py")


class Stranger:
    """A program with a DDS of its own."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process

    def ask(self, do: str, **values: Any) -> Any:
        """Have it do something, and return what it says."""
        answer = self.begin(do, **values)
        return answer()

    def begin(self, do: str, **values: Any) -> Any:
        """Have it do something, and return what waits for the answer."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        out = self.process.stdout
        self.process.stdin.write(json.dumps({"do": do, **values}) + "\n")
        self.process.stdin.flush()

        def said() -> Any:
            answer = json.loads(out.readline())
            assert "error" not in answer, answer
            return answer

        return said

    def carry_out(self, command: str, **task: Any) -> Any:
        """Send a goal, and return its result."""
        sent = self.ask("send", task={"command": command, **task})
        assert sent["accepted"]
        return self.ask("result", id=sent["id"])


@contextmanager
def stranger(domain: int, namespace: str = "") -> Iterator[Stranger]:
    process = subprocess.Popen(
        [sys.executable, str(PEER), *([namespace] if namespace else [])],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
    )
    with process:
        try:
            yield Stranger(process)
        finally:
            assert process.stdin is not None
            process.stdin.close()
            process.wait(30.0)


@pytest.fixture(scope="module")
def domain() -> Iterator[int]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CYCLONEDDS_URI", LOOPBACK)
        yield random.Random(os.getpid()).randrange(100, 230)


@pytest.fixture(scope="module")
def robot(domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[SharedRobot]:
    with shared_robot(tmp_path_factory.mktemp("ros2"), users=False, ros2=Ros2Options(domain)) as shared:
        yield shared


@pytest.fixture(scope="module")
def peer(domain: int, robot: SharedRobot) -> Iterator[Stranger]:
    with stranger(domain) as found:
        yield found


def gripper(robot: SharedRobot) -> Point:
    """Return the true place of the gripper [m]."""

    async def looked(stack: Stack) -> Point:
        assert stack.twin is not None
        stack.twin.controller.sync()
        return Point(*stack.twin.mechanics.gripper_point())

    return robot.do(looked)


def moving(robot: SharedRobot) -> bool:
    async def looked(stack: Stack) -> bool:
        return stack.controller.state.moving

    return robot.do(looked)


def at(robot: SharedRobot, place: tuple[float, float, float]) -> bool:
    return dist(gripper(robot)[:2], place[:2]) < NEAR


@pytest.mark.waits("motions of a robot whose clock runs at 250 times real speed, as DDS lives in real time")
def test_every_interface_moves_the_robot(peer: Stranger, robot: SharedRobot) -> None:
    assert peer.carry_out("approach", target=HERE) == {"status": SUCCEEDED, "success": True, "code": "", "message": ""}
    assert at(robot, HERE)
    answer = peer.ask("command", task={"command": "approach", "target": THERE})
    assert answer == {"success": True, "code": "", "message": ""}
    assert at(robot, THERE)

    def published() -> bool:
        """Send it again until it moves the robot: a reader may not know the writer yet, and a busy robot refuses."""
        peer.ask("publish", topic="/maya_move", task={"command": "approach", "target": HERE})
        return at(robot, HERE)

    eventually(published, "the robot is moved by a topic")


def test_goals_that_cannot_be_reached_are_rejected_with_the_reason_of_the_service(
    peer: Stranger, robot: SharedRobot
) -> None:
    before = gripper(robot)
    assert peer.ask("send", task={"command": "approach", "target": (9.0, 9.0, 9.0)})["accepted"] is False
    refusal = peer.ask("command", task={"command": "approach", "target": (9.0, 9.0, 9.0)})
    assert refusal["success"] is False
    assert refusal["code"] == "2101"
    assert gripper(robot) == before


@pytest.mark.waits("motions of a robot whose clock runs at 250 times real speed, as DDS lives in real time")
def test_goals_are_cancelled_and_stopped_at_any_instant(peer: Stranger, robot: SharedRobot, campaign: Campaign) -> None:
    for case in range(campaign.size(ci=6, long=100)):
        rng = campaign.rng(case)
        goal = THERE if at(robot, HERE) else HERE
        sent = peer.ask("send", task={"command": "approach", "target": goal})
        assert sent["accepted"]
        for _ in range(rng.randrange(8)):
            peer.ask("last", topic="/maya_position", type="geometry_msgs/Point", late=True)
        stops = rng.random() < 0.5
        if stops:
            assert peer.ask("trigger", service="/controller/stop")["success"]
        else:
            peer.ask("cancel", id=sent["id"])
        result = peer.ask("result", id=sent["id"])
        assert result["status"] in {SUCCEEDED, CANCELED}, result
        assert (result["code"] == "") == result["success"] == (result["status"] == SUCCEEDED)
        assert not moving(robot)
        if result["success"]:
            assert at(robot, goal)


def test_the_graph_names_nodes_types_and_hashes(peer: Stranger) -> None:
    graph = peer.ask("graph")
    ends: dict[str, Any] = graph["ends"]
    assert {"/hw_simulator", "/robot_controller", "/process_controller", "/firebase_bridge"} <= graph["nodes"].keys()
    known = {end for node in graph["nodes"].values() for end in node}
    ours = {key: end for key, end in ends.items() if key in known}
    seen = {(form, topic): (type_, data) for form, topic, type_, data in ours.values()}
    for row in TABLE:
        match row.form:
            case Kind.TOPIC:
                kind = types.message_type(row.type)
                type_, data = seen["reader" if row.heard else "writer", f"rt{row.name}"]
            case Kind.SERVICE:
                kind = types.service_types(row.type)[0]
                type_, data = seen["reader", f"rq{row.name}Request"]
                assert "serviceid=" in data
            case Kind.ACTION:
                kind = types.action_types(row.type).send_goal[0]
                type_, data = seen["reader", f"rq{row.name}/_action/send_goalRequest"]
        package, form, own = kind.name.split("/")
        assert type_ == f"{package}::{form}::dds_::{own}_"
        assert f"typehash={kind.hash};" in data
    assert types.message_type("std_msgs/String").hash == (
        "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
    )


@pytest.mark.waits("a robot whose clock runs at 250 times real speed, as DDS lives in real time")
def test_a_second_goal_is_rejected_while_the_first_moves_the_robot(peer: Stranger, robot: SharedRobot) -> None:
    place = THERE if at(robot, HERE) else HERE
    requests.post(f"{robot.url}/v1/speed", json={"ratio": 0.01}, timeout=30.0).raise_for_status()
    try:
        first = peer.ask("send", task={"command": "approach", "target": place})
        assert first["accepted"]
        assert peer.ask("send", task={"command": "home"})["accepted"] is False
        assert peer.ask("command", task={"command": "home"})["code"] == "2104"
        assert peer.ask("trigger", service="/controller/stop")["success"]
        assert peer.ask("result", id=first["id"])["status"] == CANCELED
    finally:
        requests.post(f"{robot.url}/v1/speed", json={"ratio": 1.0}, timeout=30.0).raise_for_status()


@pytest.mark.waits("a robot whose clock runs at 250 times real speed, as DDS lives in real time")
def test_malformed_samples_are_reported_and_move_nothing(
    peer: Stranger, robot: SharedRobot, campaign: Campaign, caplog: pytest.LogCaptureFixture
) -> None:
    before = gripper(robot)
    assert peer.ask("impostor", topic="/maya_move", count=100)["matched"] == 0
    count = campaign.size(ci=150, long=1000)

    def reported() -> bool:
        assert peer.ask("junk", topic="/maya_move", count=count, seed=campaign.seed)["sent"] > 0
        return any("malformed" in record.message for record in caplog.records)

    eventually(reported, "a warning of malformed samples")
    assert peer.ask("command", task={"command": "can_teleop"})["success"]
    assert gripper(robot) == before
    assert peer.carry_out("approach", target=HERE)["success"]


def test_robots_of_other_namespaces_and_domains_do_not_meet(domain: int, robot: SharedRobot, tmp_path: Path) -> None:
    with (
        shared_robot(tmp_path, users=False, ros2=Ros2Options(domain, "left")) as other,
        stranger(domain, "/left") as near,
    ):
        before = gripper(robot)
        assert near.carry_out("approach", target=THERE)["success"]
        assert at(other, THERE)
        assert gripper(robot) == before
        names = near.ask("graph")["nodes"].keys()
        assert {"/left/hw_simulator", "/hw_simulator"} <= names
    with stranger(domain - 50) as far:
        assert far.ask("graph", within=2.0) == {"nodes": {}, "ends": {}}


async def test_dds_that_does_not_start_is_an_error_with_the_domain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", "<nonsense>")
    with pytest.raises(Ros2NotJoined, match="of domain 231: DDS did not start"):
        async with dds_serving(Bus(), Guest(), Ros2Options(231)):
            pass
