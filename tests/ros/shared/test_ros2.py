"""ROS 2 beside ROS 1 and rosbridge, on one robot: a job from each, one driver at a time, a stop from any."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from websockets.sync.client import ClientConnection, connect

from maya_ros.graph.protocol import GoalStatus
from maya_ros.graph.table import ROS2_TABLE, SENSORS, TABLE, Kind
from tests.ros.driver_client import Message
from tests.ros.launched_layers import DONE, HERE, SLOW, THERE, LaunchedLayers, near, primitive
from tests.ros.ros2_node import ros2_node
from tests.system.strangers import Stranger
from tests.waiting import eventually

pytest.importorskip("cyclonedds", reason="there is no DDS for this machine")
pytestmark = pytest.mark.system

BUSY = "2104"
STOPPED = {"2201", "2202"}
SUCCEEDED, CANCELED = 4, 5
Place = tuple[float, float, float]
BETWEEN = (0.7, 1.05, 0.5)


@pytest.fixture(scope="module")
def peer(shared: LaunchedLayers) -> Iterator[Stranger]:
    with ros2_node(shared.ros) as (node, found):
        yield found
        assert node.end() == 0


class Rosbridge:
    """A client of the node rosbridge."""

    def __init__(self, link: ClientConnection) -> None:
        self._link = link

    def say(self, **message: Any) -> None:
        """Send a message."""
        self._link.send(json.dumps(message))

    def begin(self, place: Place) -> Callable[[], Message]:
        """Have the robot approach a place, and return what waits for the answer."""
        self.say(op="call_service", id="task", service="/maya_command", args={"task": primitive("approach", place)})

        def answer() -> Message:
            while (heard := json.loads(self._link.recv(40.0))).get("id") != "task":
                pass
            return heard["values"]

        return answer


@contextmanager
def rosbridge(robot: LaunchedLayers) -> Iterator[Rosbridge]:
    with connect(f"ws://127.0.0.1:{robot.ros.rosbridge_port}") as link:
        yield Rosbridge(link)


class AllEdges(NamedTuple):
    """One robot by its three edges."""

    robot: LaunchedLayers
    bridge: Rosbridge
    peer: Stranger


@pytest.fixture
def edges(robot: LaunchedLayers, peer: Stranger) -> Iterator[AllEdges]:
    with rosbridge(robot) as bridge:
        yield AllEdges(robot, bridge, peer)


def test_ros_2_has_the_nodes_of_ros_1_with_their_names(peer: Stranger) -> None:
    wanted = {f"rt{row.name}" for row in (*TABLE, *ROS2_TABLE) if row.form is Kind.TOPIC}
    wanted |= {f"rq{row.name}Request" for row in TABLE if row.form is Kind.SERVICE}
    wanted |= {f"rq{row.name}/_action/send_goalRequest" for row in (*TABLE, *ROS2_TABLE) if row.form is Kind.ACTION}
    wanted -= {f"rt{SENSORS.name}", "rt/clock"}  # of a machine alone, and of a scaled clock
    graph: dict[str, Any] = {}

    def seen() -> bool:
        graph.update(peer.ask("graph"))
        return wanted <= {end[1] for end in graph["ends"].values()}

    eventually(seen, "all names", 30.0, lambda: str(wanted - {end[1] for end in graph["ends"].values()}))
    assert {"/hw_simulator", "/robot_controller", "/primitive_server", "/process_controller", "/firebase_bridge"} <= (
        graph["nodes"].keys()
    )


def drive_by_ros_1(edges: AllEdges, place: Place) -> Callable[[], str]:
    goal = edges.robot.task("approach", place)

    def code() -> str:
        outcome, result = goal.ended()
        assert (outcome == GoalStatus.SUCCEEDED) == (result == DONE)
        return str(result["code"])

    return code


def drive_by_rosbridge(edges: AllEdges, place: Place) -> Callable[[], str]:
    answer = edges.bridge.begin(place)
    return lambda: str(answer()["code"])


def drive_by_ros_2(edges: AllEdges, place: Place) -> Callable[[], str]:
    sent = edges.peer.ask("send", task={"command": "approach", "target": place})
    assert sent["accepted"]

    def code() -> str:
        result = edges.peer.ask("result", id=sent["id"])
        assert result["status"] == (SUCCEEDED if result["code"] == "" else CANCELED)
        return str(result["code"])

    return code


def refusals(edges: AllEdges) -> list[str]:
    """Return the codes with which a motion is refused on each edge."""
    by_ros_2 = edges.peer.ask("command", task={"command": "approach", "target": HERE})
    return [str(edges.robot.command("approach", HERE)["code"]), str(edges.bridge.begin(HERE)()["code"]),
            by_ros_2["code"]]  # fmt: skip


WAYS = [drive_by_ros_1, drive_by_rosbridge, drive_by_ros_2]


@pytest.mark.parametrize("way", WAYS)
def test_while_one_edge_drives_all_are_refused_and_a_stop_of_ros_2_ends_it(
    way: Callable[[AllEdges, Place], Callable[[], str]], edges: AllEdges
) -> None:
    robot = edges.robot
    robot.at_speed(SLOW)
    before = robot.mark()
    place = robot.away()
    ended = way(edges, place)
    robot.until_told("moving", before)
    if way is drive_by_rosbridge:  # its answer is still to come, on the same connection
        with rosbridge(robot) as other:
            assert refusals(edges._replace(bridge=other)) == [BUSY] * 3
    else:
        assert refusals(edges) == [BUSY] * 3
    assert edges.peer.ask("trigger", service="/controller/stop")["success"]
    assert ended() in STOPPED
    robot.at_rest()
    assert not near(robot.twin()["point"][:2], place[:2])
    assert robot.until_told("stopped", before)["fault"] is None


def test_a_job_of_each_edge_is_done_one_after_the_other(edges: AllEdges) -> None:
    robot = edges.robot
    introduce(edges)
    robot.at_speed(SLOW)
    before = robot.mark()
    first = robot.away()
    edges.bridge.say(op="publish", topic="/send_task", msg=primitive("approach", first))
    robot.until_told("moving", before)
    second = HERE if first == THERE else THERE
    robot.driver.publish("/send_task", "maya_robot/MayaPrimitive", primitive("approach", second))
    robot.eventually(lambda: waiting(robot) == 1, "the job of ROS 1")
    edges.peer.ask("publish", topic="/send_task", task={"command": "approach", "target": BETWEEN})
    robot.eventually(lambda: waiting(robot) == 2, "the job of ROS 2")
    robot.at_speed(1.0)
    robot.eventually(lambda: near(robot.twin()["point"][:2], BETWEEN[:2]), "the place of the last job")
    robot.until_homed()
    jobs = json.loads(robot.ros.maya("--json", "history", "3").stdout)["jobs"]
    assert [job["state"] for job in jobs] == ["done"] * 3
    assert [word for word in robot.words(before) if word in {"moving", "idle"}] == ["moving", "idle"] * 3


def introduce(edges: AllEdges) -> None:
    """Have rosbridge know the reader of /send_task: what it publishes before that is lost."""
    before = edges.robot.mark()
    edges.bridge.say(op="advertise", topic="/send_task", type="maya_robot/MayaPrimitive")

    def heard() -> bool:
        edges.bridge.say(op="publish", topic="/send_task", msg=primitive("gripper", open_=True))
        return "gripper_open" in edges.robot.words(before)

    eventually(heard, "a job of rosbridge", told=lambda: edges.robot.launched.said, pause=2.0)  # jobs must not pile up
    edges.robot.eventually(lambda: emptied(edges.robot), "an empty queue")
    edges.robot.until_homed()


def emptied(robot: LaunchedLayers) -> bool:
    """Return whether no job waits, and clear those that a client left which did not wait for its answer."""
    if waiting(robot):
        robot.ros.maya("queue", "clear")
    return waiting(robot) == 0


def waiting(robot: LaunchedLayers) -> int:
    """Return how many jobs wait."""
    feed = robot.driver.subscribe("/queue_status", "std_msgs/String")
    feed.until()
    return int(json.loads(feed.messages[-1]["data"])["waiting"])


def test_the_part_is_moved_from_ros_2(robot: LaunchedLayers, peer: Stranger) -> None:
    lies = robot.twin()["parts"]["part"]
    there = THERE if near(lies, HERE) else HERE
    for command, place in (("pick", lies), ("place", there)):
        assert peer.carry_out(command, target=place)["success"]
    assert near(robot.twin()["parts"]["part"], there)


def test_a_trajectory_of_ros_2_is_followed_and_shown(robot: LaunchedLayers, peer: Stranger) -> None:
    a, b, c = robot.twin()["joints"]
    goal = [a + (0.2 if a < 1.0 else -0.2), b, c]
    sent = peer.ask("send_joints", points=[[5.0, *goal]], end=dict.fromkeys("abc", 1e-2))
    assert peer.ask("joints_result", id=sent["id"]) == {"status": SUCCEEDED, "error_code": 0, "error_string": ""}
    assert near(robot.twin()["joints"], goal)
    shown = peer.ask("last", topic="/joint_states", type="sensor_msgs/JointState")
    assert near(shown["position"][:3], goal)
    children = {one["child_frame_id"] for one in peer.ask("last", topic="/tf", type="tf2_msgs/TFMessage")["transforms"]}
    assert "boom" in children


def test_with_a_killed_node_the_motion_that_it_began_ends(robot: LaunchedLayers) -> None:
    with ros2_node(robot.ros, "mortal") as (_, peer):
        robot.at_speed(SLOW)
        before = robot.mark()
        assert peer.ask("send", task={"command": "approach", "target": robot.away()})["accepted"]
        robot.until_told("moving", before)
        robot.kill("/mortal")
        robot.until_told("stopped", before)
    robot.at_rest()


def test_without_the_package_the_node_says_what_to_install(robot: LaunchedLayers, tmp_path: Path) -> None:
    (tmp_path / "cyclonedds.py").write_text("raise ModuleNotFoundError(name='cyclonedds')\n")
    path = f"{tmp_path}:{robot.ros.environment.get('PYTHONPATH', '')}"
    command = ("rosrun", "maya_process", "ros2.py", "__name:=without")
    started = robot.ros.start(*command, environment={"PYTHONPATH": path})
    assert started.wait() == 2
    assert "5016" in started.said
    assert "pip install cyclonedds" in started.said
