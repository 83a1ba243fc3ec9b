"""The judge's distances against places worked out by hand, and against many more points."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest

from tests.judge.mechanism import Frame
from tests.judge.zones import Behind, Block, Column, Solid, clearances, segments

FRAME = Frame(2.35, 2.30, 0.30, 0.20, ((0.0, 2.0 * pi / 3.0), (0.575, 2.260), (0.565, 2.300)), 5.0)
BLOCK = Block("block", 0.05, True, (-0.2, 0.9, 0.0), (0.2, 1.3, 0.8))
COLUMN = Column("column", 0.0, True, (1.0, 0.5), 0.1, 0.0, 1.0)
WALL = Behind("wall", 0.0, False, (1.0, 0.0, 0.0), (-2.0, 0.0, 0.0))


def test_distances_of_points() -> None:
    points = np.array([(0.0, 1.1, 1.0), (0.5, 1.7, 0.4), (0.0, 1.1, 0.75), (0.5, 1.7, 1.2)])
    assert BLOCK.distance(points) == pytest.approx([0.2, 0.5, -0.05, sqrt(0.09 + 0.16 + 0.16)])
    points = np.array([(1.3, 0.9, 0.5), (1.0, 0.5, 1.5), (1.04, 0.53, 0.5)])
    assert COLUMN.distance(points) == pytest.approx([0.4, 0.5, -0.05])
    assert WALL.distance(np.array([(0.4, 7.0, 3.0), (1.5, 0.0, 0.0)])) == pytest.approx([0.6, -0.5])


def test_the_clearance_is_that_of_the_nearest_of_gripper_and_lines() -> None:
    """Along +y at d = 1.30, z = 1.40: the gripper hangs 0.6 above the block's edge."""
    joints = np.array([[0.0, 1.25, 1.25]])
    assert clearances(FRAME, BLOCK, joints, near=1.0)[0] == pytest.approx(0.55)
    low = Block("line", 0.0, True, (-1.0, 0.75, 1.9), (1.0, 0.85, 1.925))
    # Line b rises from (1.30, 1.60) to (0.30, 2.35), 3 in 4: it passes 12.5 mm above the edge at d = 0.85.
    assert clearances(FRAME, low, joints, near=0.1)[0] == pytest.approx(0.010, abs=1e-9)
    without = Block("gripper", 0.0, False, low.low, low.high)
    assert clearances(FRAME, without, joints, near=1.0)[0] > 0.4


@pytest.mark.parametrize("zone", [BLOCK, COLUMN, WALL], ids=lambda zone: zone.name)
def test_narrowing_agrees_with_a_hundred_thousand_points(zone: Solid) -> None:
    rng = np.random.default_rng(3)
    joints = np.column_stack((rng.uniform(0.0, 2.0, 20), rng.uniform(1.2, 2.2, 20), rng.uniform(1.2, 2.2, 20)))
    found = clearances(FRAME, zone, joints, near=5.0)
    shares = np.linspace(0.0, 1.0, 100_001)[:, None]
    for row, clearance in zip(joints, found, strict=True):
        pieces = segments(FRAME, row[None, :], lines=zone.lines)
        least = min(float(zone.distance(start + shares * (end - start)).min()) for start, end in pieces)
        assert -1e-9 <= least - zone.margin - clearance <= 1.2e-5
