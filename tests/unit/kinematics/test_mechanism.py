"""The triangle solved by hand, its derivative, and what has no solution."""

from __future__ import annotations

from math import hypot, nan, pi, sqrt

import numpy as np
import pytest

from maya_un.config import Config
from maya_un.errors import Unreachable
from maya_un.kinematics import Mechanism, tension
from maya_un.values import Joints, Point
from tests.strategies import configuration

MAYA = Mechanism.of(Config())


def test_a_hand_worked_place() -> None:
    # d = 1.3 along +y: u = 1.0, z = 0.9: h = 2.35 − 0.2 − 0.9 = 1.25.
    joints = MAYA.ik(Point(0.0, 1.3, 0.9))
    assert joints == pytest.approx(Joints(0.0, hypot(1.0, 1.25), hypot(1.0, 1.25)))


def test_the_drop_counts_downwards_in_both_directions() -> None:
    # Both lines as long as they get when the meeting point is 1 m below the middle: the gripper is 0.2 lower.
    assert MAYA.fk(Joints(0.0, sqrt(2.0), sqrt(2.0))) == pytest.approx(Point(0.0, 1.3, 1.15))


def test_alpha_turns_clockwise_from_y_seen_from_above() -> None:
    assert MAYA.ik(Point(1.0, 0.0, 1.0)).a == pytest.approx(pi / 2)
    x, y, _ = MAYA.fk(Joints(pi / 2, 1.5, 1.5))
    assert (x, y) == pytest.approx((1.3, 0.0))


def test_angles_are_counted_around_the_middle_of_the_range() -> None:
    boom = Config().axes.a.model_copy(update={"maximum": 6.0})
    wide = Mechanism.of(configuration(axes={"a": boom}))
    assert MAYA.ik(Point(-1.0, 0.0, 1.0)).a == pytest.approx(-pi / 2)
    assert wide.ik(Point(-1.0, 0.0, 1.0)).a == pytest.approx(1.5 * pi)


def test_both_lines_fully_out_are_the_lowest_point() -> None:
    assert MAYA.fk(Joints(0.0, 2.260, 2.300)).z == pytest.approx(0.101, abs=5e-4)


@pytest.mark.parametrize("joints", [Joints(0.0, 0.575, 0.565), Joints(0.0, 2.9, 0.6), Joints(0.0, nan, 1.0)])
def test_lines_that_cannot_meet_have_no_place(joints: Joints) -> None:
    with pytest.raises(Unreachable, match="cannot meet"):
        MAYA.fk(joints)
    with pytest.raises(Unreachable, match="cannot meet"):
        MAYA.jacobian(joints)


def test_above_the_anchors_nothing_holds_the_gripper() -> None:
    with pytest.raises(Unreachable, match="meet 50 mm above their anchors"):
        MAYA.ik(Point(0.5, 1.2, 2.20))


@pytest.mark.parametrize("point", [Point(nan, 1.0, 1.0), Point(1.0, 1.0, nan), Point(1.0, float("inf"), 1.0)])
def test_a_place_must_be_finite(point: Point) -> None:
    with pytest.raises(Unreachable, match="not finite"):
        MAYA.ik(point)


def test_the_jacobian_is_the_derivative() -> None:
    joints, step = Joints(0.7, 1.7, 1.5), 1e-6
    columns: list[np.ndarray] = []
    for axis in range(3):
        up, down = list(joints), list(joints)
        up[axis] += step
        down[axis] -= step
        columns.append((np.array(MAYA.fk(Joints(*up))) - np.array(MAYA.fk(Joints(*down)))) / (2 * step))
    np.testing.assert_allclose(MAYA.jacobian(joints), np.array(columns).T, atol=1e-9)


def test_the_gripper_sinks_by_the_tension_times_the_length_paid_out() -> None:
    joints = Joints(0.7, 1.7, 1.5)
    u, square = MAYA.section(joints)
    assert tuple(MAYA.jacobian(joints)[2, 1:]) == pytest.approx(
        tuple(-pull for pull in tension(u, sqrt(square), MAYA.width))
    )


def test_many_points_across_block_borders_equal_single_ones() -> None:
    rng = np.random.default_rng(4)
    joints = np.column_stack([rng.uniform(0.0, 2.0, 9001), rng.uniform(1.3, 2.2, 9001), rng.uniform(1.3, 2.2, 9001)])
    points = MAYA.fk_many(joints)
    for row in (0, 4095, 4096, 9000):
        np.testing.assert_allclose(points[row], MAYA.fk(Joints(*joints[row])), rtol=0, atol=1e-15)
    np.testing.assert_allclose(MAYA.ik_many(points), joints, rtol=0, atol=1e-12)


def test_rows_without_a_solution_are_not_numbers() -> None:
    assert np.isnan(MAYA.fk_many(np.array([[0.0, 0.6, 0.6]]))[0, 2])
    assert np.isnan(MAYA.ik_many(np.array([[0.5, 1.2, 2.3]]))[0, 1:]).all()


def test_no_rows_give_no_rows() -> None:
    assert MAYA.fk_many(np.empty((0, 3))).shape == MAYA.ik_many(np.empty((0, 3))).shape == (0, 3)
