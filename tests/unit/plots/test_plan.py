"""The plan: rings at a height, and what is drawn in them."""

from __future__ import annotations

from math import hypot

import numpy as np
import pytest
from matplotlib.patches import Wedge

from maya_un.config import Config
from maya_un.kinematics import Workspace
from maya_un.plots.plan import draw_plan, rings
from maya_un.plots.style import blank, house_style

WORKSPACE = Workspace.of(Config())


def test_at_the_grasp_height_the_long_ends_bound_the_ring() -> None:
    # h = 1.75: c = 2.3 gives W − u = √(2.3² − 1.75²) = 1.49248, b = 2.26 gives u = √(2.26² − 1.75²) = 1.43000.
    ((inner, outer),) = rings(WORKSPACE, 0.4)
    assert (inner, outer) == pytest.approx((0.3 + 2.0 - 1.49248, 0.3 + 1.43000), abs=3e-3)


def test_near_the_table_only_a_strip_is_left_and_below_it_nothing() -> None:
    ((inner, outer),) = rings(WORKSPACE, 0.15)
    assert outer - inner == pytest.approx(0.19, abs=0.005)
    assert rings(WORKSPACE, 0.10) == []
    assert rings(WORKSPACE, 2.2) == []


def test_right_under_the_limit_of_tension_the_middle_is_out_of_reach() -> None:
    # Along 5 × load the depth is least beside the middle: the top of the section is hollow.
    found = rings(WORKSPACE, 2.06)
    assert len(found) == 2
    assert found[0][1] < 1.3 < found[1][0]


@pytest.mark.parametrize("height", [0.3, 0.9, 1.7, 2.0])
def test_the_ends_of_a_ring_are_reachable_and_a_step_beyond_is_not(height: float) -> None:
    for inner, outer in rings(WORKSPACE, height):
        for edge, out in ((inner, -0.004), (outer, 0.004)):
            h = 2.15 - height
            assert WORKSPACE.section.depths(edge - 0.3) is not None
            u = edge + out - 0.3
            b, c = hypot(u, h), hypot(2.0 - u, h)
            bounds = (u >= 0.0, u <= 2.0, 0.575 <= b <= 2.26, 0.565 <= c <= 2.3)
            assert not all(bounds)


def test_the_sector_opens_clockwise_from_plus_y() -> None:
    with house_style():
        axes = blank().add_subplot()
        draw_plan(axes, WORKSPACE, 0.4, 1.0)
    (wedge,) = (patch for patch in axes.patches if isinstance(patch, Wedge))
    # α from 0 to 120° clockwise from +y is, counter-clockwise from +x, 90° down to −30°.
    assert (wedge.theta1, wedge.theta2) == pytest.approx((-30.0, 90.0))
    assert wedge.r == pytest.approx(1.73, abs=3e-3)
    said = {text.get_text() for text in axes.texts}
    assert {"+x", "+y", "α", "α = 0°", "α = 120°", "0.81 m", "1.73 m", "axis a"} <= said


def test_boom_has_the_right_direction() -> None:
    with house_style():
        axes = blank().add_subplot()
        draw_plan(axes, WORKSPACE, 0.4, 0.5 * np.pi)
    tips = [tuple(np.asarray(line.get_xydata())[-1]) for line in axes.lines]
    assert any(tip == pytest.approx((2.36, 0.0), abs=1e-9) for tip in tips)
