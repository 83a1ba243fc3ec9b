"""The model in a real graph: robot_state_publisher and tf agree with kinematics, and sliders wait for the robot."""

from __future__ import annotations

from collections.abc import Iterator
from math import atan2, dist, pi

import numpy as np
import pytest

from maya_ros.graph.urdf import BASE, DRAWN, GRIPPER, NAMES, ROBOT, describe, positions
from maya_un.config import Config
from maya_un.kinematics import Mechanism, Workspace
from maya_un.values import Joints
from tests.campaign import Campaign
from tests.description import MACROS
from tests.ros.display import Display
from tests.ros.driver_client import Driver, Message
from tests.ros.harness import Ros

SUCCEEDED = 3
POSES = 100
MICROMETRE = 1e-6
NEAR = 1e-4
QUICK = 60
MECHANISM = Mechanism.of(Config())


def place(driver: Driver, stamp: Message) -> list[float]:
    """Return where tf has the gripper point at a time [m]."""
    return driver.ask("transform", target=BASE, source=GRIPPER, **stamp)[:3]


def seconds(header: Message) -> float:
    """Return the time of a message [s]."""
    return header["stamp"]["secs"] + 1e-9 * header["stamp"]["nsecs"]


def listening(driver: Driver) -> None:
    """Wait for tf: static transforms reach each new subscriber."""
    assert driver.ask("transform", target=BASE, source="mast", secs=0, nsecs=0)[:3] == [0.0, 0.0, 0.0]


def reached(driver: Driver, joints: Joints) -> None:
    outcome, result = driver.do("/move", "maya_controller/Move", joints._asdict()).ended()
    assert outcome == SUCCEEDED, result


def homed(driver: Driver) -> None:
    outcome, result = driver.do("/home", "maya_controller/Home").ended(within=120.0)
    assert outcome == SUCCEEDED, result


def test_tf_agrees_with_kinematics_on_the_gripper(ros: Ros, driver: Driver, campaign: Campaign) -> None:
    ros.set_param("/robot_description", describe(Config(), MACROS))
    ros.start("rosrun", "robot_state_publisher", "robot_state_publisher")
    rng, workspace = campaign.rng(), Workspace.of(Config())
    strokes = workspace.boom, workspace.line_b, workspace.line_c
    drawn = (Joints(*(rng.uniform(*stroke) for stroke in strokes)) for _ in range(100 * POSES))
    poses = [joints for joints in drawn if workspace.contains(joints)][: campaign.size(ci=POSES // 4, long=POSES)]
    listening(driver)
    for number, joints in enumerate(poses):
        stamp = {"secs": 1000 + number, "nsecs": 250_000_000}
        position = list(positions(MECHANISM, joints))
        message = {"header": {"stamp": stamp}, "name": list(NAMES), "position": position}
        driver.publish("/joint_states", "sensor_msgs/JointState", message)
        assert dist(place(driver, stamp), MECHANISM.fk(joints)) < MICROMETRE


@pytest.mark.waits("12 s of homing at twenty times real speed, as tf lives in real time")
def test_tf_before_homing_holds_the_two_trees_that_diagnostics_name(ros: Ros, driver: Driver) -> None:
    ros.launch("maya_controller", "controller.launch")
    states = driver.subscribe("/joint_states", "sensor_msgs/JointState")
    health = driver.subscribe("/diagnostics", "diagnostic_msgs/DiagnosticArray")
    still = driver.subscribe("/tf_static", "tf2_msgs/TFMessage").until()["transforms"]
    parents = {one["child_frame_id"]: one["header"]["frame_id"] for one in still}
    assert set(parents.values()) - set(parents) == {"base", "hook"}
    health.until(lambda message: "tf holds two trees, base and hook" in str(message))
    assert states.messages == []
    homed(driver)
    states.until()
    assert len(place(driver, {"secs": 0, "nsecs": 0})) == 3


@pytest.mark.waits("12 s of homing at twenty times real speed and about 2 s of motion, as tf lives in real time")
def test_tf_follows_the_twin_and_turns_as_the_manual_says(ros: Ros, driver: Driver) -> None:
    ros.launch("maya_controller", "controller.launch")
    states = driver.subscribe("/joint_states", "sensor_msgs/JointState")
    told = driver.subscribe("/maya_position", "geometry_msgs/Point")
    frames = driver.subscribe("/tf", "tf2_msgs/TFMessage")
    listening(driver)
    homed(driver)
    ends: list[list[float]] = []
    for angle in (0.0, pi / 2.0, 2.05):
        reached(driver, Joints(angle, 1.7, 1.6))
        there = states.until(
            lambda state, angle=angle: abs(state["position"][0] - angle) < NEAR, after=len(states.messages)
        )
        # robot_state_publisher leaves out states, and tf interpolates between those before and after one left out
        sent = frames.until(
            lambda message, there=there: seconds(message["transforms"][0]["header"]) >= seconds(there["header"])
        )
        ends.append(place(driver, sent["transforms"][0]["header"]["stamp"]))
    assert [atan2(x, y) for x, y, _ in ends] == pytest.approx((0.0, pi / 2.0, 2.05), abs=2.0 * NEAR)
    assert ends[0][1] > 1.0
    assert ends[1][0] > 1.0
    assert ends[2][1] < -0.5
    _assert_same(driver, states.messages, told.messages)


def _assert_same(driver: Driver, states: list[Message], told: list[Message]) -> None:
    """Assert at several different poses that tf at the time of a state equals /maya_position at that time.

    Of positions only the latest counts: one that a busy machine did not send in time is not sent any more.
    """
    places = np.array([[point[axis] for axis in "xyz"] for point in told])
    moments = {tuple(state["position"][:3]): state["header"]["stamp"] for state in states}
    same = 0
    for stamp in reversed(moments.values()):
        away = float(np.linalg.norm(places - place(driver, stamp), axis=1).min())
        same += away < MICROMETRE
        if same == POSES:
            return
    raise AssertionError(f"of {len(moments)} poses only {same} are where /maya_position told")


@pytest.fixture
def display(ros: Ros) -> Iterator[Display]:
    with Display(ros.folder) as own:
        yield own


def stamp_of(message: Message) -> tuple[int, int]:
    """Return when a state was, in seconds and nanoseconds."""
    stamp = message["header"]["stamp"]
    return stamp["secs"], stamp["nsecs"]


@pytest.mark.waits("4 s of homing at sixty times real speed, as tf lives in real time")
def test_sliders_draw_the_joints_until_the_robot_publishes_them(ros: Ros, driver: Driver, display: Display) -> None:
    ros.launch("maya_controller", "controller.launch", display.environment, gui=True, speed=QUICK)
    robot = driver.subscribe(ROBOT, "sensor_msgs/JointState")
    drawn = driver.subscribe(DRAWN, "sensor_msgs/JointState")
    first = drawn.until()
    assert list(first["name"]) == list(NAMES)
    assert first["position"][0] == pytest.approx(pi / 3.0), "the middle of what a can be"
    ros.until(lambda: any("joints drawn" in title for title in display.windows()), "the window of sliders")
    listening(driver)
    at = place(driver, {"secs": 0, "nsecs": 0})
    assert atan2(at[0], at[1]) == pytest.approx(pi / 3.0)
    homed(driver)
    begun = len(robot.messages)
    reached(driver, Joints(1.0, 1.7, 1.6))
    last = robot.messages[-1]
    drawn.until(lambda message: message["header"]["stamp"] == last["header"]["stamp"])
    spoken = {stamp_of(message) for message in robot.messages[begun - 1 :]}
    drawn_states = [place for place, message in enumerate(drawn.messages) if stamp_of(message) in spoken]
    # In the order of drawing, nothing lies between the robot's states: they have velocities, and those of the sliders
    # have none. A busy machine skips messages here and there, since only the newest state counts.
    since = drawn.messages[drawn_states[0] : drawn_states[-1] + 1]
    assert all(len(message["velocity"]) == len(NAMES) for message in since)
