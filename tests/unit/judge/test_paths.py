"""The judge's paths, verdicts and distances to lines, by hand."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from tests.judge.mechanism import Floats, Frame, joints_at, places, to_cylinder
from tests.judge.paths import Opinion, Space, deviations, drawn, judged
from tests.judge.zones import Block

FRAME = Frame(2.35, 2.30, 0.30, 0.20, ((-0.5, 2.0 * pi / 3.0), (0.575, 2.260), (0.565, 2.300)), 5.0)
ENDS = joints_at(FRAME, np.array([(0.0, 0.9, 0.5), (1.2, 0.9, 0.8), (1.2, 0.3, 1.0)]))


@pytest.mark.parametrize("space", ["joint", "cartesian", "cylindrical"])
def test_every_path_goes_through_its_waypoints(space: Space) -> None:
    path = drawn(FRAME, space, ENDS, 2_000)
    assert len(path) == 2_001
    assert np.abs(path[[0, 1_000, 2_000]] - ENDS).max() < 1e-12


def test_legs_are_straight_in_their_own_space() -> None:
    line = places(FRAME, drawn(FRAME, "cartesian", ENDS, 2_000))
    assert line[250] == pytest.approx((0.3, 0.9, 0.575))
    swing = to_cylinder(places(FRAME, drawn(FRAME, "cylindrical", ENDS[:2], 1_000)))
    assert swing[500] == pytest.approx((to_cylinder(places(FRAME, ENDS))[:2].sum(axis=0)) / 2.0)
    joint = drawn(FRAME, "joint", ENDS[:2], 1_000)
    assert joint[500] == pytest.approx(ENDS[:2].mean(axis=0))


def along(*places: tuple[float, float]) -> Floats:
    """Return the joints at (radius, height) straight ahead."""
    return joints_at(FRAME, np.array([(0.0, d, z) for d, z in places]))


def test_a_straight_joint_path_between_good_places_may_be_outside() -> None:
    """Below the outer anchor line b changes less than line c: straight in joints, the way bulges outwards."""
    ends = along((2.299, 1.55), (2.299, 1.15))
    assert judged(FRAME, ends).opinion is Opinion.INSIDE
    straight = judged(FRAME, drawn(FRAME, "cartesian", ends))
    assert (straight.opinion, straight.limit) == (Opinion.INSIDE, "outer")
    assert straight.margin == pytest.approx(0.001, abs=1e-9)
    bulging = judged(FRAME, drawn(FRAME, "joint", ends))
    assert (bulging.opinion, bulging.limit) == (Opinion.OUTSIDE, "outer")
    assert 0.4 < bulging.share < 0.6


def test_verdicts_name_the_limit_and_doubt_what_is_near() -> None:
    verdict = judged(FRAME, drawn(FRAME, "cartesian", along((1.0, 1.3), (2.4, 1.3))))
    assert (verdict.opinion, verdict.limit) == (Opinion.OUTSIDE, "outer")
    assert verdict.margin == pytest.approx(-0.1)
    verdict = judged(FRAME, drawn(FRAME, "cartesian", along((1.0, 1.3), (2.3 - 5e-7, 1.3))))
    assert verdict.opinion is Opinion.UNDECIDED


def test_verdicts_name_the_zone() -> None:
    vice = Block("vice", 0.05, True, (-0.1, 1.4, 0.0), (0.1, 1.6, 1.5))
    assert judged(FRAME, along((1.0, 1.3)), [vice]).opinion is Opinion.INSIDE
    verdict = judged(FRAME, drawn(FRAME, "cartesian", along((1.0, 1.3), (2.0, 1.3))), [vice])
    assert (verdict.opinion, verdict.limit) == (Opinion.OUTSIDE, "vice")
    assert verdict.margin == pytest.approx(-0.15, abs=1e-6)


def test_distances_to_a_polyline() -> None:
    line = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)])
    points = np.array([(0.5, 0.2), (-0.3, 0.4), (1.2, 0.5), (0.9, 0.1), (1.3, 1.4)])
    assert deviations(points, line) == pytest.approx([0.2, 0.5, 0.2, 0.1, 0.5])
