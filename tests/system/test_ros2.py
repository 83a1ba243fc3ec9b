"""A stranger in the ROS 2 graph of a robot: it moves, stops and watches the robot with nothing but DDS."""

from __future__ import annotations

import asyncio
import json
import logging
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from math import cos, dist, sin
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np
import pytest
import requests
from scipy.spatial.transform import Rotation
from websockets.sync.client import connect

pytest.importorskip("cyclonedds", reason="there is no DDS for this machine")

from maya_ros.graph.access import Guest
from maya_ros.graph.bus import Bus
from maya_ros.graph.table import CLOCK, JOINTS, ROS2_TABLE, TABLE, Kind
from maya_ros.graph.urdf import BASE, GRIPPER, NAMES
from maya_ros.ros2 import types
from maya_ros.ros2.edge import NODE, dds_serving
from maya_ros.ros2.trajectory import LONGEST_WAIT
from maya_un.assembly.stack import Stack
from maya_un.edges import Ros2Options
from maya_un.errors import Ros2NotJoined
from maya_un.events import JobAdvanced
from maya_un.http.log import kept, note
from maya_un.kinematics import Floats
from maya_un.machine.log import Window
from maya_un.schema.jobs import JobLine, JobReport
from maya_un.values import Joints, Point
from tests.campaign import Campaign
from tests.description import Tree
from tests.shared_robot import SharedRobot, shared_robot
from tests.system.processes import running
from tests.system.strangers import LOOPBACK, Stranger, own_domain, stranger
from tests.waiting import eventually, until

pytestmark = pytest.mark.system

HERE, THERE = (0.41, 1.13, 0.5), (1.18, 0.21, 0.5)
TABLE_HERE, TABLE_THERE = Point(0.5, 1.2, 0.4), Point(0.9, 0.9, 0.4)
"""Two places for the part."""
NEAR = 2e-3
RESTING = 1e-4
"""The most that an axis may turn or travel at rest, where the motor holds it [rad, m]."""

Place = tuple[float, float, float]

SUCCEEDED, CANCELED, ABORTED = 4, 5, 6


@pytest.fixture(scope="module")
def domain() -> Iterator[int]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CYCLONEDDS_URI", LOOPBACK)
        yield own_domain()


@pytest.fixture(scope="module")
def robot(domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[SharedRobot]:
    parts = {"part": TABLE_HERE}
    with shared_robot(tmp_path_factory.mktemp("ros2"), users=False, ros2=Ros2Options(domain), parts=parts) as shared:
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


def at(robot: SharedRobot, place: Place) -> bool:
    return dist(gripper(robot)[:2], place[:2]) < NEAR


@pytest.mark.waits("motions of a robot whose clock runs at 250 times real speed, as DDS lives in real time")
def test_every_interface_moves_the_robot(peer: Stranger, robot: SharedRobot) -> None:
    assert peer.carry_out("approach", target=HERE) == {"status": SUCCEEDED, "success": True, "code": "", "message": ""}
    assert at(robot, HERE)
    answer = peer.ask("command", task={"command": "approach", "target": THERE})
    assert answer == {"success": True, "code": "", "message": ""}
    assert at(robot, THERE)

    approach_by_topic(peer, robot, HERE)


def approach_by_topic(peer: Stranger, robot: SharedRobot, place: Place) -> None:
    """Send it again until it moves the robot: a reader may not know the writer yet, and a busy robot refuses."""

    def published() -> bool:
        peer.ask("publish", topic="/maya_move", task={"command": "approach", "target": place})
        return at(robot, place)

    eventually(published, "the robot is moved by a topic")
    eventually(lambda: not busy(peer), "the end of the motion")


class PartSeen(NamedTuple):
    """The part by the mechanics' record: its place [m], whether it is held, and how often a part fell."""

    place: Point
    held: bool
    drops: int


def part_of(robot: SharedRobot) -> PartSeen:
    async def looked(stack: Stack) -> PartSeen:
        assert stack.twin is not None
        stack.twin.controller.sync()
        record = stack.twin.mechanics.record
        return PartSeen(Point(*record.parts["part"]), record.carried is not None, len(record.drops))

    return robot.do(looked)


def by_topic(peer: Stranger, robot: SharedRobot, command: str, place: Point) -> None:
    """Send it until it is done: the robot refuses it while a repeated message of the approach still moves it."""
    approach_by_topic(peer, robot, (*place[:2], HERE[2]))

    def published() -> bool:
        peer.ask("publish", topic="/maya_move", task={"command": command, "target": place})
        return part_of(robot).held == (command == "pick")

    eventually(published, f"{command} by a topic", pause=0.5)
    eventually(lambda: not busy(peer), f"the end of {command}")


def by_service(peer: Stranger, _: SharedRobot, command: str, place: Point) -> None:
    assert peer.ask("command", task={"command": command, "target": place})["success"]


def by_action(peer: Stranger, _: SharedRobot, command: str, place: Point) -> None:
    assert peer.carry_out(command, target=place)["success"]


def busy(peer: Stranger) -> bool:
    return not peer.ask("command", task={"command": "can_teleop"})["success"]


@pytest.mark.waits("motions of a robot whose clock runs at 250 times real speed, as DDS lives in real time")
@pytest.mark.parametrize("way", [by_topic, by_service, by_action])
def test_a_part_is_picked_and_placed(
    way: Callable[[Stranger, SharedRobot, str, Point], None], peer: Stranger, robot: SharedRobot
) -> None:
    lies = part_of(robot).place
    place = TABLE_THERE if dist(lies, TABLE_HERE) < NEAR else TABLE_HERE
    way(peer, robot, "pick", lies)
    assert part_of(robot).held
    way(peer, robot, "place", place)
    seen = part_of(robot)
    assert dist(seen.place, place) < NEAR
    assert (seen.held, seen.drops) == (False, 0)


def test_goals_that_cannot_be_reached_are_rejected_with_the_reason_of_the_service(
    peer: Stranger, robot: SharedRobot
) -> None:
    before = gripper(robot)
    assert peer.ask("send", task={"command": "approach", "target": (9.0, 9.0, 9.0)})["accepted"] is False
    refusal = peer.ask("command", task={"command": "approach", "target": (9.0, 9.0, 9.0)})
    assert refusal["success"] is False
    assert refusal["code"] == "2101"
    assert gripper(robot) == before


def begun_by_topic(peer: Stranger, robot: SharedRobot, goal: Place) -> Callable[[], None]:
    peer.ask("publish", topic="/maya_move", task={"command": "approach", "target": goal})
    eventually(lambda: moving(robot) or at(robot, goal), "the begin of the motion")

    return lambda: eventually(lambda: not busy(peer), "the end of the motion")


def begun_by_service(peer: Stranger, _: SharedRobot, goal: Place) -> Callable[[], Any]:
    request = peer.ask("begin_command", task={"command": "approach", "target": goal})

    return lambda: peer.ask("command_result", **request)


def begun_by_action(peer: Stranger, _: SharedRobot, goal: Place) -> Callable[[], Any]:
    sent = peer.ask("send", task={"command": "approach", "target": goal})
    assert sent["accepted"]

    def result() -> Any:
        found = peer.ask("result", id=sent["id"])
        assert (found.pop("status") == SUCCEEDED) == found["success"]
        return found

    return result


def stop(peer: Stranger) -> None:
    assert peer.ask("trigger", service="/controller/stop")["success"]


def cancel(peer: Stranger) -> None:
    """Cancel every goal: the number 0 of a goal stands for all of them."""
    peer.ask("cancel", id=0)


@pytest.mark.waits("motions of a robot whose clock runs at 250 times real speed, as DDS lives in real time")
@pytest.mark.parametrize(
    ("begun", "ends"),
    [(begun_by_topic, [stop]), (begun_by_service, [stop]), (begun_by_action, [stop, cancel])],
    ids=["topic", "service", "action"],
)
def test_motions_with_a_part_end_at_any_instant(
    begun: Callable[[Stranger, SharedRobot, Place], Callable[[], Any]],
    ends: list[Callable[[Stranger], None]],
    peer: Stranger,
    robot: SharedRobot,
    campaign: Campaign,
) -> None:
    """The motion is stopped or cancelled, has one result, and the mechanics judge whether it came to rest safely."""
    assert peer.ask("command", task={"command": "pick", "target": part_of(robot).place})["success"]
    approach_by_topic(peer, robot, HERE)  # the reader of the topic knows the writer from here on
    begin = mark(robot)
    ended_early = 0
    for case in range(campaign.size(ci=6, long=100)):
        rng = campaign.rng(case)
        goal = THERE if at(robot, HERE) else HERE
        result_of = begun(peer, robot, goal)
        for _ in range(rng.randrange(8)):
            peer.ask("last", topic="/maya_position", type="geometry_msgs/Point", late=True)
        rng.choice(ends)(peer)
        result = result_of()
        assert at_rest(robot)
        if result is not None:
            assert result["success"] == (result["code"] == ""), result
            assert at(robot, goal) or not result["success"]  # a stop may also come in the last millimetre
        ended_early += not at(robot, goal)
    assert ended_early
    seen = since(robot, begin)
    assert (seen.stall_time, seen.outside, seen.drops, max(seen.limited)) == (0.0, 0.0, (), 0.0)
    assert part_of(robot).held
    assert peer.ask("command", task={"command": "place", "target": TABLE_HERE})["success"]


def mark(robot: SharedRobot) -> int:
    """Begin a window of the mechanics' record."""

    async def marked(stack: Stack) -> int:
        assert stack.twin is not None
        stack.twin.controller.sync()
        return stack.twin.mechanics.record.mark()

    return robot.do(marked)


def since(robot: SharedRobot, begin: int) -> Window:
    """Return what the mechanics recorded since a mark."""

    async def looked(stack: Stack) -> Window:
        assert stack.twin is not None
        stack.twin.controller.sync()
        return stack.twin.mechanics.record.since(begin)

    return robot.do(looked)


def at_rest(robot: SharedRobot) -> bool:
    """Whether no axis moves by the mechanics' record, from now until it is asked again."""
    seen = since(robot, mark(robot))
    return dist(seen.low, seen.high) < RESTING


def test_the_graph_names_nodes_types_and_hashes(peer: Stranger) -> None:
    graph = peer.ask("graph")
    ends: dict[str, Any] = graph["ends"]
    assert {"/hw_simulator", "/robot_controller", "/process_controller", "/firebase_bridge"} <= graph["nodes"].keys()
    known = {end for node in graph["nodes"].values() for end in node}
    ours = {key: end for key, end in ends.items() if key in known}
    seen = {(form, topic): told for form, topic, *told in ours.values()}
    for row in (*TABLE, *ROS2_TABLE):
        late = False
        match row.form:
            case Kind.TOPIC:
                kind, late = types.message_type(row.type), row.latch
                type_, data, *quality = seen["reader" if row.heard else "writer", f"rt{row.name}"]
            case Kind.SERVICE:
                kind = types.service_types(row.type)[0]
                type_, data, *quality = seen["reader", f"rq{row.name}Request"]
                assert "serviceid=" in data
            case Kind.ACTION:
                kind = types.action_types(row.type).send_goal[0]
                type_, data, *quality = seen["reader", f"rq{row.name}/_action/send_goalRequest"]
        assert quality == [True, late], row.name  # reliable, and whether later readers get the last message
        package, form, own = kind.name.split("/")
        assert type_ == f"{package}::{form}::dds_::{own}_"
        assert f"typehash={kind.hash};" in data
    announcing = [data for _, topic, _, data, *_ in ends.values() if topic == "ros_discovery_info"]
    # ROS 2 Jazzy has this hash, and its tools warn of a writer without one
    assert announcing == ["typehash=RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e;"]
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


def test_the_model_is_the_robot_s(peer: Stranger, robot: SharedRobot) -> None:
    text = peer.ask("last", topic="/robot_description", type="std_msgs/String", late=True)["data"]
    tree = Tree(text)
    assert tree.free == set(NAMES)
    geometry = robot.stack.config.geometry
    assert float(tree.frame("line_c", dict.fromkeys(NAMES, 0.0))[2, 3]) == pytest.approx(geometry.height)


def frames_of(message: Any) -> dict[str, tuple[str, Floats]]:
    """Return the parent and the homogeneous transform of each frame of a tf2_msgs/TFMessage."""
    found: dict[str, tuple[str, Floats]] = {}
    for one in message["transforms"]:
        made = np.eye(4)
        made[:3, :3] = Rotation.from_quat([one["transform"]["rotation"][axis] for axis in "xyzw"]).as_matrix()
        made[:3, 3] = [one["transform"]["translation"][axis] for axis in "xyz"]
        found[one["child_frame_id"]] = (one["header"]["frame_id"], made)
    return found


@pytest.mark.waits("motions of a robot whose clock runs at 250 times real speed, as DDS lives in real time")
def test_the_frames_put_the_gripper_where_it_is(peer: Stranger, robot: SharedRobot, campaign: Campaign) -> None:
    fixed = frames_of(peer.ask("last", topic="/tf_static", type="tf2_msgs/TFMessage", late=True))
    workspace = robot.stack.controller.workspace
    for case in range(campaign.size(ci=4, long=100)):
        rng = campaign.rng(case)
        a, radius = rng.uniform(0.1, 1.9), rng.uniform(0.8, 1.5)
        place = (radius * sin(a), radius * cos(a), rng.uniform(0.5, 0.9))
        if workspace.why_not(Point(*place)) is not None:
            continue
        assert peer.carry_out("approach", target=place)["success"]

        def settled() -> bool:
            moved = frames_of(peer.ask("last", topic="/tf", type="tf2_msgs/TFMessage"))
            shown = peer.ask("last", topic="/maya_position", type="geometry_msgs/Point", late=True)
            frames, link, at = {**fixed, **moved}, GRIPPER, np.eye(4)
            while link != BASE:
                link, step = frames[link]
                at = step @ at
            return dist(at[:3, 3], [shown[axis] for axis in "xyz"]) < 1e-6 and at_point(robot, shown)

        eventually(settled, "frames and position that agree to 1 µm")


def at_point(robot: SharedRobot, shown: dict[str, float]) -> bool:
    """Whether a position is the one that the controller measures now."""
    point = robot.stack.controller.state.point
    return point is not None and dist(point, [shown[axis] for axis in "xyz"]) < 1e-9


def seconds(stamp: dict[str, int]) -> float:
    return stamp["sec"] + 1e-9 * stamp["nanosec"]


def test_clock_in_real_time_is_not_published(domain: int, tmp_path: Path) -> None:
    namespace = "clock_1"
    with (
        shared_robot(tmp_path, users=False, ros2=Ros2Options(domain, namespace), speed=1.0, homed=False),
        stranger(domain, f"/{namespace}") as near,
    ):
        (sim,) = near.ask("get_parameters", names=["use_sim_time"])
        assert not sim["bool_value"]
        ends = near.ask("graph")["ends"].values()
        assert not [end for end in ends if end[1] == f"rt/{namespace}/clock"]
        (now,) = near.ask("get_parameters", names=["speed"])
        assert now["double_value"] == 1.0


SLOWER = 20.0
CLOCK_HERE = {"topic": "/clock_20/clock", "type": "rosgraph_msgs/Clock"}


@pytest.fixture(scope="module")
def slower(domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[SharedRobot, Stranger]]:
    """Yield a robot whose clock runs at 20 times real speed, in a namespace, and a program there."""
    options, state = Ros2Options(domain, "clock_20"), tmp_path_factory.mktemp("slower")
    with shared_robot(state, users=False, ros2=options, speed=SLOWER) as one, stranger(domain, "/clock_20") as near:
        yield one, near


def ticks_of(near: Stranger) -> list[float]:
    """Return the times on /clock since the last call [s]."""
    return [seconds(tick["clock"]) for tick in near.ask("all", **CLOCK_HERE)]


@pytest.mark.waits("a clock that runs at 20 times real speed, as DDS lives in real time")
def test_stamps_are_those_of_the_clock(slower: tuple[SharedRobot, Stranger]) -> None:
    one, near = slower
    (sim,) = near.ask("get_parameters", names=["use_sim_time"])
    assert sim["bool_value"]
    joints = {"topic": "/clock_20/joint_states", "type": "sensor_msgs/JointState"}
    before = robot_time(one)
    near.ask("all", **CLOCK_HERE)
    near.ask("all", **joints)
    stamps: list[float] = []
    ticks: list[float] = []

    def enough() -> bool:
        ticks.extend(ticks_of(near))
        stamps.extend(seconds(state["header"]["stamp"]) for state in near.ask("all", **joints))
        return len(stamps) > 20 and len(set(ticks)) > 20

    eventually(enough, "ticks of the clock, and joints")
    passed = robot_time(one) - before
    assert ticks == sorted(ticks)
    # The first tick shows a time that the robot's loop may have noted before `before`. The next time was noted later.
    noted = [tick for tick in ticks if tick > ticks[0]]
    assert 0.0 < noted[-1] - noted[0] <= passed
    inside = [stamp for stamp in stamps if ticks[0] <= stamp <= ticks[-1]]
    assert inside
    # The robot's loop notes the time as often as the clock ticks, but a busy machine now and then delays a tick.
    distance = median(min(abs(stamp - tick) for tick in ticks) for stamp in inside)
    assert distance <= 3.0 * max(SLOWER / CLOCK.rate, median(np.diff(ticks)))


@pytest.mark.waits("a clock that runs at 20 times real speed, as DDS lives in real time")
def test_stop_by_the_service_ends_a_trajectory_that_waits(slower: tuple[SharedRobot, Stranger]) -> None:
    one, near = slower
    ticks: list[float] = []

    def ticked() -> bool:
        ticks.extend(ticks_of(near))
        return bool(ticks)

    eventually(ticked, "a tick of the clock")
    before = joints_of(one)
    sent = near.ask("send_joints", points=[[20.0, *farther(one, 0.2)]], start=ticks[-1] + LONGEST_WAIT - 5.0)
    assert sent["accepted"]
    one.do(lambda robot: robot.service.stop())
    result = near.ask("joints_result", id=sent["id"])
    assert (result["status"], result["error_code"]) == (ABORTED, -1)
    assert result["error_string"].startswith("2201: ")
    assert joints_of(one) == pytest.approx(before, abs=1e-4)


def robot_time(robot: SharedRobot) -> float:
    """Return the time of the robot's own loop [s]."""

    async def read(_: Stack) -> float:
        return asyncio.get_running_loop().time()

    return robot.do(read)


def joints_of(robot: SharedRobot) -> Joints:
    found = robot.stack.controller.state.joints
    assert found is not None
    return found


def farther(robot: SharedRobot, turn: float) -> list[float]:
    """Return joints with axis a turned further, toward the middle [rad]."""
    a, b, c = joints_of(robot)
    return [a + (turn if a < 1.0 else -turn), b, c]


@pytest.mark.waits("motions of a robot whose clock runs at 250 times real speed, as DDS lives in real time")
def test_a_trajectory_takes_its_time_and_ends_at_its_last_point(peer: Stranger, robot: SharedRobot) -> None:
    goal, before = farther(robot, 0.2), robot_time(robot)
    middle = [0.5 * (x + y) for x, y in zip(joints_of(robot), goal, strict=True)]
    sent = peer.ask("send_joints", points=[[15.0, *middle], [30.0, *goal]], end=dict.fromkeys("abc", 1e-3))
    assert sent["accepted"]
    assert peer.ask("joints_result", id=sent["id"]) == {"status": SUCCEEDED, "error_code": 0, "error_string": ""}
    assert robot_time(robot) - before >= 30.0
    assert joints_of(robot) == pytest.approx(goal, abs=1e-4)


@pytest.mark.waits("motions of a robot whose clock runs at 250 times real speed, as DDS lives in real time")
def test_a_trajectory_is_cancelled_at_any_instant(peer: Stranger, robot: SharedRobot, campaign: Campaign) -> None:
    for case in range(campaign.size(ci=3, long=100)):
        rng = campaign.rng(case)
        sent = peer.ask("send_joints", points=[[10.0, *farther(robot, 0.3)]])
        assert sent["accepted"]
        for _ in range(rng.randrange(8)):
            peer.ask("last", topic="/maya_position", type="geometry_msgs/Point", late=True)
        if rng.random() < 0.5:
            assert peer.ask("trigger", service="/controller/stop")["success"]
        else:
            peer.ask("cancel", id=sent["id"], action="/controller/follow_joint_trajectory")
        result = peer.ask("joints_result", id=sent["id"])
        assert result["status"] in {SUCCEEDED, CANCELED}, result
        assert at_rest(robot)


@pytest.mark.waits("motions of a robot whose clock runs at 250 times real speed, as DDS lives in real time")
@pytest.mark.parametrize(
    ("given", "code", "reason"),
    [
        ({"path": {"a": 1e-4}}, -4, "a is "),
        ({"delay": 1.0, "late": 0.5}, -1, "it is to take"),
    ],
)
def test_a_trajectory_that_leaves_its_tolerances_is_aborted(
    peer: Stranger, robot: SharedRobot, given: dict[str, Any], code: int, reason: str
) -> None:
    goal = farther(robot, 0.3)
    within = given.pop("late", 20.0)
    middle = [0.9 * x + 0.1 * y for x, y in zip(joints_of(robot), goal, strict=True)]
    sent = peer.ask("send_joints", points=[[0.75 * within, *middle], [within, *goal]], **given)
    result = peer.ask("joints_result", id=sent["id"])
    assert (result["status"], result["error_code"]) == (ABORTED, code), result
    assert reason in result["error_string"]
    assert not moving(robot)
    assert joints_of(robot) != pytest.approx(goal, abs=1e-3)


@pytest.mark.parametrize(
    ("change", "code", "reason"),
    [
        ({"names": "abd"}, -2, "4018"),
        ({"points": []}, -1, "2107"),
        ({"points": [[2.0, 1.0, 1.0, 1.0], [1.0, 1.0, 1.0, 1.0]]}, -1, "must grow"),
        ({"points": [[2.0, 1.0, 1.0]]}, -1, "3 items, not 2"),
        ({"points": [[2.0, 1.0, 1.0, float("nan")]]}, -1, "4"),
        ({"points": [[2.0, 1.0, 90.0, 1.0]]}, -1, "2"),
        ({"path": {"d": 1.0}}, -1, "no joint"),
        ({"start": 1.0}, -3, "in the past"),
    ],
)
def test_a_trajectory_that_cannot_be_is_aborted_with_the_reason(
    peer: Stranger, robot: SharedRobot, change: dict[str, Any], code: int, reason: str
) -> None:
    before = joints_of(robot)
    sent = peer.ask("send_joints", **{"points": [[5.0, *farther(robot, 0.1)]], **change})
    result = peer.ask("joints_result", id=sent["id"])
    assert (result["status"], result["error_code"]) == (ABORTED, code), result
    assert reason in result["error_string"]
    assert joints_of(robot) == before


def test_parameters_are_the_configuration(peer: Stranger, robot: SharedRobot) -> None:
    listed = peer.ask("list_parameters", prefixes=["config.geometry"])
    assert listed["names"] == [f"config.geometry.{name}" for name in robot.stack.config.geometry.model_dump()]
    top = peer.ask("list_parameters", prefixes=[], depth=1)["names"]
    assert top == ["speed", "sim_mode", "address", "use_sim_time"]
    names = ["config.geometry.length", "address", "sim_mode", "config.gripper.output", "no.such"]
    values = peer.ask("get_parameters", names=names)
    assert [value["type"] for value in values] == [3, 4, 1, 2, 0]
    assert values[0]["double_value"] == robot.stack.config.geometry.length
    assert values[1]["string_value"] == "sim"


def test_a_parameter_that_may_not_be_set_keeps_its_value_and_has_a_reason(peer: Stranger) -> None:
    refused = peer.ask("set_parameter", name="address", type=4, string_value="192.168.1.2")
    assert refused["successful"] is False
    assert "config." in refused["reason"]
    refused = peer.ask("set_parameter", name="config.geometry.length", type=3, double_value=2.0)
    assert refused["successful"] is False
    assert refused["reason"].startswith("4102: ")


def test_the_log_is_on_rosout(peer: Stranger, robot: SharedRobot) -> None:
    """The reader also gets the refusals of earlier tests: none of them is of this target."""
    peer.ask("all", topic="/rosout", type="rcl_interfaces/Log", late=True)
    with kept(people=False):  # as `maya up` does
        logging.getLogger("maya_ros.ros2").warning("a sentence of a library")
        note("events", logging.INFO, "a sentence of the program")
        assert not peer.ask("send", task={"command": "approach", "target": (9.0, 9.0, 8.0)})["accepted"]

    said: list[tuple[str, int]] = []

    def refused() -> bool:
        lines = peer.ask("all", topic="/rosout", type="rcl_interfaces/Log", late=True)
        said.extend((line["msg"], line["level"]) for line in lines)
        return any(text.startswith("/task refused a goal: 2101: (9.0000, 9.0000, 8.0000) m ") for text, _ in said)

    eventually(refused, "the reason of a rejection on /rosout", told=lambda: str(said))
    assert said.count(("a sentence of a library", logging.WARNING)) == 1
    assert said.count(("a sentence of the program", logging.INFO)) == 1


def test_a_foreign_tool_lists_the_topics_with_their_types(domain: int, robot: SharedRobot) -> None:
    """Use the command line of the library, which reads types by XTypes and knows nothing of ROS."""
    tool = [Path(sys.executable).with_name("cyclonedds")]
    wide = {**os.environ, "COLUMNS": "250", "TERM": "dumb"}

    def said(*words: str) -> str:
        command = [*tool, *words, "-i", str(domain), "--suppress-progress-bar"]
        return subprocess.run(command, env=wide, capture_output=True, text=True, check=True).stdout

    listed = said("ls", "-r", "2s")
    for row in (*TABLE, *ROS2_TABLE):
        if row.form is Kind.TOPIC:
            assert f"rt{row.name}" in listed
            package, form, own = types.message_type(row.type).name.split("/")
            assert f"{package}::{form}::dds_::{own}_" in listed
    point = said("typeof", "rt/maya_position")
    assert "struct Point_" in point
    assert all(f"double {axis};" in point for axis in "xyz")


def waiting(robot: SharedRobot) -> Sequence[JobLine]:
    """Return the jobs that wait in the queue."""

    async def looked(stack: Stack) -> Sequence[JobLine]:
        return stack.service.queue.view().waiting

    return robot.do(looked)


@pytest.mark.waits("motions of a robot whose clock runs at 250 times real speed, as DDS lives in real time")
def test_one_robot_serves_ros_2_rosbridge_and_http_in_turn(peer: Stranger, robot: SharedRobot) -> None:
    places = (HERE, THERE, HERE)
    requests.post(f"{robot.url}/v1/queue/pause", json={"when": "now"}, timeout=30.0).raise_for_status()
    before = len(waiting(robot))
    peer.ask("publish", topic="/send_task", task={"command": "approach", "target": places[0]})
    eventually(lambda: len(waiting(robot)) == before + 1, "the job of ROS 2")
    with connect(robot.rosbridge) as bridge:
        task = {"command": "approach", "target": dict(zip("xyz", places[1], strict=True)), "open": False}
        for said in ({"op": "advertise", "topic": "/send_task", "type": "maya_robot/MayaPrimitive"},
                     {"op": "publish", "topic": "/send_task", "msg": task}):  # fmt: skip
            bridge.send(json.dumps(said))
        eventually(lambda: len(waiting(robot)) == before + 2, "the job of rosbridge")
    job = {"name": "by HTTP", "steps": [{"approach": places[2]}]}
    requests.post(f"{robot.url}/v1/jobs", json=job, timeout=30.0).raise_for_status()
    jobs = waiting(robot)[before:]
    assert len(jobs) == len(places)
    requests.post(f"{robot.url}/v1/queue/resume", timeout=30.0).raise_for_status()

    def reports() -> list[JobReport]:
        return [robot.do(lambda stack, number=line.id: stack.service.job(number)) for line in jobs]

    eventually(lambda: all(report.state.ended for report in reports()), "the end of the jobs")
    ended = reports()
    assert [(report.state.value, report.message) for report in ended] == [("done", "")] * 3
    ids = [report.id for report in ended]
    begun_and_done = [event for event in robot.do(changes) if event.job in ids and event.state in {"running", "done"}]
    order = [(event.job, event.state) for event in begun_and_done]
    assert len(order) == 2 * len(ids)
    assert [(job, "done") for job, state in order[::2] if state == "running"] == order[1::2]  # one after the other
    last = dict(zip(ids, places, strict=True))[order[-1][0]]
    assert at(robot, last)


async def changes(stack: Stack) -> list[JobAdvanced]:
    """Return the changes of jobs, in order."""
    return [event for event in stack.controller.events.since(0) if isinstance(event, JobAdvanced)]


def test_names_can_be_others(domain: int, tmp_path: Path) -> None:
    options = Ros2Options(domain, "left", {"/maya_event": "/events", "/task": "work", "/tf": "tf"})
    others = {"rt/events", "rt/left/tf", "rq/left/work/_action/send_goalRequest"}
    topics: set[str] = set()

    def discovered() -> bool:
        topics.update(end[1] for end in near.ask("graph")["ends"].values())
        return others <= topics

    with shared_robot(tmp_path, users=False, ros2=options, homed=False), stranger(domain, "/left") as near:
        eventually(discovered, "the other names", told=lambda: str(topics))
    assert not {"rt/left/maya_event", "rq/left/task/_action/send_goalRequest"} & topics


@pytest.mark.waits("the lease of a participant that was killed, 2 s")
def test_nodes_of_a_killed_program_disappear(domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain - 1))
    with running(f"up --port 0 --journal {tmp_path}/maya.db --ros2") as up, stranger(domain - 1) as near:
        up.until("ROS 2")
        assert "/hw_simulator" in near.ask("graph")["nodes"]
        up.kill()
        eventually(lambda: not near.ask("graph", within=0.1)["nodes"], "a graph without the nodes")


async def test_dds_that_does_not_start_is_an_error_with_the_domain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", "<nonsense>")
    bus = Bus()
    with pytest.raises(Ros2NotJoined, match="of domain 231: DDS did not start"):
        async with dds_serving(bus.node(NODE), Guest(), Ros2Options(231), bus.now):
            pass


async def test_a_topic_of_measurements_is_followed_only_while_somebody_reads(domain: int) -> None:
    bus = Bus()
    joints = bus.node("hw_simulator").advertise(JOINTS.name, JOINTS.type)
    heard: list[Any] = []
    async with dds_serving(bus.node(NODE), Guest(), Ros2Options(domain, "followed"), bus.now):
        assert joints.readers == 0
        with stranger(domain, "/followed") as near:
            topic = {"topic": "/followed/joint_states", "type": JOINTS.type}
            await asyncio.to_thread(near.ask, "all", **topic)
            await until(lambda: joints.readers == 1)
            while not heard:
                joints.publish({"name": ["a"], "position": [1.0]})
                heard += await asyncio.to_thread(near.ask, "all", **topic)
        await until(lambda: joints.readers == 0)
    assert heard[0]["position"] == [1.0]
