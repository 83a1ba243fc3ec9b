"""The sliders draw the joints while the robot is silent, and never at the same time as it."""

from __future__ import annotations

import asyncio

import pytest

from maya_ros.graph.bus import Bus
from maya_ros.graph.protocol import Message
from maya_ros.graph.urdf import DRAWN, JAW_OPEN, NAMES, ROBOT, SILENCE, SLIDERS, Relay, Sliders, joint_state, positions
from maya_un.config import Config
from maya_un.kinematics import Mechanism
from maya_un.values import Joints
from tests.fakes import state_of
from tests.virtual_time import elapse

MECHANISM = Mechanism.of(Config())
KIND = "sensor_msgs/JointState"


def slid(a: float, b: float = 2.0, c: float = 2.0) -> Message:
    """A message of the window with the sliders: more than the four settable joints, in another order."""
    told = {"jaw": 0.02, "c": c, "hook": 0.0, "b": b, "a": a}
    return {"header": {}, "name": list(told), "position": list(told.values()), "velocity": [], "effort": []}


def robot(a: float) -> Message:
    message = joint_state(state_of(Joints(a, 2.0, 2.0)), MECHANISM, 5.0)
    assert message is not None
    return message


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def sliders(clock: Clock) -> Sliders:
    return Sliders(MECHANISM, clock)


def test_without_a_robot_sliders_also_draw_dependent_joints(sliders: Sliders) -> None:
    drawn = sliders.slid(slid(0.5))
    assert drawn is not None
    assert drawn["name"] == list(NAMES)
    assert drawn["position"] == pytest.approx(positions(MECHANISM, Joints(0.5, 2.0, 2.0), 0.02))


def test_active_robot_is_drawn_and_the_sliders_are_not(sliders: Sliders, clock: Clock) -> None:
    message = robot(0.3)
    assert sliders.robot(message) is message
    clock.now += 0.9 * SILENCE
    assert sliders.slid(slid(1.0)) is None


def test_silent_robot_stays_drawn_until_a_slider_moves(sliders: Sliders, clock: Clock) -> None:
    sliders.robot(robot(0.3))
    assert sliders.slid(slid(1.0)) is None
    clock.now += 10.0 * SILENCE
    assert sliders.slid(slid(1.0)) is None
    moved = sliders.slid(slid(1.1))
    assert moved is not None
    assert moved["position"][0] == 1.1
    assert sliders.slid(slid(1.1)) is not None
    sliders.robot(robot(0.3))
    assert sliders.slid(slid(1.2)) is None


def test_silence_measured_by_a_hanging_process_draws_no_sliders(sliders: Sliders, clock: Clock) -> None:
    sliders.slid(slid(1.0))
    sliders.robot(robot(0.3))
    clock.now += 2.0 * SILENCE
    assert sliders.slid(slid(1.0)) is None


def test_incomplete_slider_positions_draw_nothing(sliders: Sliders) -> None:
    assert sliders.slid({"header": {}, "name": ["a", "b"], "position": [0.1, 2.0]}) is None


def test_sliders_without_a_jaw_draw_it_open(sliders: Sliders) -> None:
    drawn = sliders.slid({"header": {}, "name": ["a", "b", "c"], "position": [0.1, 2.0, 2.0]})
    assert drawn is not None
    assert drawn["position"][-1] == JAW_OPEN


async def test_on_a_graph_one_of_them_is_drawn_and_the_robots_topic_is_untouched() -> None:
    bus = Bus()
    loop = asyncio.get_running_loop()
    drawn: list[Message] = []
    of_robot: list[Message] = []
    watcher = bus.node("watcher")
    watcher.subscribe(DRAWN, KIND, drawn.append)
    watcher.subscribe(ROBOT, KIND, of_robot.append)
    relay = Relay(bus.node("joint_gui"), Sliders(MECHANISM, loop.time))
    speaking, moving = bus.node("hw_simulator").advertise(ROBOT, KIND), bus.node("window").advertise(SLIDERS, KIND)
    moving.publish(slid(0.1))
    await elapse(0.01)
    speaking.publish(robot(0.2))
    await elapse(0.01)
    moving.publish(slid(0.3))
    await elapse(2.0 * SILENCE)
    moving.publish(slid(0.3))
    await elapse(0.01)
    moving.publish(slid(0.4))
    await elapse(0.01)
    assert [message["position"][0] for message in drawn] == [0.1, 0.2, 0.4]
    assert [message["position"][0] for message in of_robot] == [0.2]
    relay.close()
    moving.publish(slid(0.5))
    await elapse(0.01)
    assert len(drawn) == 3
