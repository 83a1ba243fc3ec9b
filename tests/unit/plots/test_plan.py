"""The plan: rings at a height, and what is drawn in them."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.patches import Wedge

from maya_un.config import Config
from maya_un.kinematics import Workspace
from maya_un.plots.plan import draw_plan
from maya_un.plots.style import blank, figure_style

WORKSPACE = Workspace.of(Config())


def test_the_sector_opens_clockwise_from_plus_y() -> None:
    with figure_style():
        axes = blank().add_subplot()
        draw_plan(axes, WORKSPACE, 0.4, 1.0)
    (wedge,) = (patch for patch in axes.patches if isinstance(patch, Wedge))
    # α from 0 to 120° clockwise from +y is, counter-clockwise from +x, 90° down to −30°.
    assert (wedge.theta1, wedge.theta2) == pytest.approx((-30.0, 90.0))
    assert wedge.r == pytest.approx(1.73, abs=3e-3)
    said = {text.get_text() for text in axes.texts}
    assert {"+x", "+y", "α", "α = 0°", "α = 120°", "0.81 m", "1.73 m", "axis a"} <= said


def test_boom_has_the_right_direction() -> None:
    with figure_style():
        axes = blank().add_subplot()
        draw_plan(axes, WORKSPACE, 0.4, 0.5 * np.pi)
    tips = [tuple(np.asarray(line.get_xydata())[-1]) for line in axes.lines]
    assert any(tip == pytest.approx((2.36, 0.0), abs=1e-9) for tip in tips)
