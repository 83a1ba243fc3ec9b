"""The joints that follow from a, b and c: their places, their speeds, and nothing where nothing is known."""

from __future__ import annotations

from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_ros.graph import types
from maya_ros.graph.urdf import JAW_CLOSED, JAW_OPEN, NAMES, PART_RADIUS, jaw, joint_state, positions, velocities
from maya_un.config import Config
from maya_un.kinematics import Mechanism
from maya_un.values import Joints
from tests.fakes import state_of
from tests.strategies import reachable_joints

MECHANISM = Mechanism.of(Config())
STEP = 1e-6
RATES = st.tuples(*[st.floats(-0.05, 0.05)] * 3)


def test_straight_below_the_middle_both_lines_have_one_angle() -> None:
    _, _, _, inner, outer, _ = positions(MECHANISM, Joints(0.0, 2.0, 2.0))
    assert (inner, outer) == pytest.approx((pi / 3.0, 2.0 * pi / 3.0))


def test_lines_that_cannot_meet_are_drawn_along_the_boom() -> None:
    assert positions(MECHANISM, Joints(0.0, 0.6, 0.6))[3:5] == (0.0, pi)


@given(joints=reachable_joints(), rates=RATES)
def test_velocities_are_the_slopes_of_positions(joints: Joints, rates: tuple[float, float, float]) -> None:
    def after(time: float) -> tuple[float, ...]:
        return positions(MECHANISM, Joints(*(at + time * rate for at, rate in zip(joints, rates, strict=True))))

    slopes = [(late - early) / (2.0 * STEP) for early, late in zip(after(-STEP), after(STEP), strict=True)]
    assert velocities(MECHANISM, joints, rates) == pytest.approx(slopes, abs=1e-6)


def test_lines_that_cannot_meet_have_no_swing() -> None:
    assert velocities(MECHANISM, Joints(0.0, 0.9, 0.9), (0.1, 0.2, 0.3)) == (0.1, 0.2, 0.3, 0.0, 0.0, 0.0)


def test_the_message_is_one_that_ros_takes_and_names_every_joint() -> None:
    message = joint_state(state_of(Joints(0.5, 2.0, 2.0)), MECHANISM, 12.25)
    assert message is not None
    checked = types.conform("sensor_msgs/JointState", message)
    assert checked["header"]["stamp"] == {"secs": 12, "nsecs": 250_000_000}
    assert checked["name"] == list(NAMES)
    assert len(checked["position"]) == len(checked["velocity"]) == len(NAMES)
    assert checked["position"][:3] == pytest.approx([0.5, 2.0, 2.0])


def test_before_homing_there_is_nothing_to_draw() -> None:
    assert joint_state(state_of(None), MECHANISM, 0.0) is None


def test_gripper_closes_on_a_part_or_on_nothing() -> None:
    assert jaw(closed=False) == jaw(closed=False, holding=True) == JAW_OPEN
    assert jaw(closed=True) == JAW_CLOSED
    assert jaw(closed=True, holding=True) == PART_RADIUS
