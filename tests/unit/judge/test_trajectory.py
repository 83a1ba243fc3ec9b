"""Speeds and accelerations of motions whose law is known."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from tests.judge.mechanism import Floats, Frame, joints_at
from tests.judge.trajectory import Trajectory
from tests.judge.zones import Block

FRAME = Frame(2.35, 2.30, 0.30, 0.20, ((-0.5, 2.0 * pi / 3.0), (0.575, 2.260), (0.565, 2.300)), 5.0)


def trapezoid(times: Floats) -> Floats:
    """Rest for 1 s, 2 s at 0.02 m/s², 3 s at 0.04 m/s, 4 s down at 0.01 m/s², rest."""
    speeds = np.interp(times, (1.0, 3.0, 6.0, 10.0), (0.0, 0.04, 0.04, 0.0))
    return np.concatenate(([0.0], np.cumsum(0.5 * (speeds[1:] + speeds[:-1]) * np.diff(times))))


def motion() -> Trajectory:
    times = np.linspace(0.0, 12.0, 1_201)
    way = trapezoid(times)
    return Trajectory(times, np.column_stack((0.5 - way, 1.2 + way, np.full_like(way, 1.5))))


def test_speeds_and_mean_accelerations() -> None:
    moved = motion()
    assert moved.speeds() == pytest.approx((0.04, 0.04, 0.0), abs=1e-9)
    assert moved.mean_accelerations(0.5) == pytest.approx((0.02, 0.02, 0.0), rel=1e-3, abs=1e-9)
    assert moved.mean_accelerations(4.0) == pytest.approx((0.01, 0.01, 0.0), rel=1e-2, abs=1e-9)


def test_start_and_end_of_motion() -> None:
    assert motion().moving() == pytest.approx((1.0, 10.0), abs=0.011)
    still = Trajectory(np.array([0.0, 1.0]), np.ones((2, 3)))
    assert still.moving() == (1.0, 1.0)
    assert (still.mean_accelerations(0.5) == 0.0).all()


def test_finer_points_lie_on_the_way() -> None:
    coarse = Trajectory(np.array([0.0, 1.0, 2.0]), np.array([(0.0, 1.0, 1.0), (0.2, 1.1, 1.0), (0.2, 1.1, 1.05)]))
    fine = coarse.finer(0.0101)
    assert len(fine) == 26
    assert np.abs(np.diff(fine, axis=0)).max() <= 0.0101
    assert fine[10] == pytest.approx((0.1, 1.05, 1.0))


def test_worst_value_lies_between_the_samples() -> None:
    """Below the outer anchor, straight in joints between two places 1 mm inside, the way bulges outwards."""
    ends = joints_at(FRAME, np.array([(0.0, 2.299, 1.55), (0.0, 2.299, 1.15)]))
    assert Trajectory(np.array([0.0, 1.0]), ends[:1].repeat(2, axis=0)).least(FRAME)["outer"] == pytest.approx(0.001)
    middle_b, middle_c = ends[:, 1:].mean(axis=0)
    u = (4.0 + middle_b**2 - middle_c**2) / 4.0
    least = Trajectory(np.array([0.0, 20.0]), ends).least(
        FRAME, [Block("far", 0.1, False, (3.0, 3.0, 0.0), (4.0, 4.0, 1.0))]
    )
    assert least["outer"] == pytest.approx(2.0 - u, abs=1e-6)
    assert least["outer"] < -1e-3
    assert 2.0 < least["far"] < 3.2
