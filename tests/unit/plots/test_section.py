"""The section that is drawn is the one that is reachable, and the manual's is the manual's."""

from __future__ import annotations

from math import hypot

import numpy as np
import pytest

from maya_un.config import Config
from maya_un.kinematics import Workspace
from maya_un.plots.overlays import MarkedTarget
from maya_un.plots.section import draw_section, manual_margin
from maya_un.plots.style import blank, figure_style
from maya_un.values import Point
from tests.unit.kinematics.manual_grid import STEP, U, Z, manuals_grid

WORKSPACE = Workspace.of(Config())


def test_the_manuals_listing_accepts_the_known_area_above_the_anchors() -> None:
    margin = manual_margin(WORKSPACE, *np.meshgrid(U, Z))
    accepted, _ = manuals_grid()
    assert np.array_equal(margin >= 0.0, accepted)
    above = np.count_nonzero((margin >= 0.0) & (Z[:, None] > 2.15)) * STEP * STEP
    assert above == pytest.approx(0.18, abs=0.005)


def test_lines_are_drawn_to_the_meeting_point_of_the_held_place() -> None:
    with figure_style():
        axes = blank().add_subplot()
        draw_section(axes, WORKSPACE, 0.0, MarkedTarget.of(WORKSPACE, Point(0.0, 1.3, 1.0)))
    ends = {tuple(np.ravel(line.get_xydata())) for line in axes.lines}
    assert (0.3, 2.35, 1.3, 1.2) in ends
    assert (2.3, 2.35, 1.3, 1.2) in ends
    assert (1.3, 1.2, 1.3, 1.0) in ends


def test_curves_of_tension_are_at_their_values() -> None:
    with figure_style():
        axes = blank().add_subplot()
        draw_section(axes, WORKSPACE, 0.0)
    curves = [curve for curve in (np.asarray(line.get_xydata()) for line in axes.lines) if len(curve) == 61]
    carried = []
    for curve in curves:
        u, h = curve[30, 0] - 0.3, 2.15 - curve[30, 1]
        carried += [(2.0 - u) / 2.0 * hypot(u, h) / h, u / 2.0 * hypot(2.0 - u, h) / h]
    for k in (1.0, 1.5, 2.0, 3.0, 5.0):
        assert sum(pull == pytest.approx(k) for pull in carried) >= 2
    assert len(curves) == 10


def test_labels_have_the_configured_strokes() -> None:
    measured = Workspace.of(Config(), ((0.0, 1.0), (0.6, 2.2), (0.5, 2.25)))
    with figure_style():
        axes = blank().add_subplot()
        draw_section(axes, measured, 0.5)
    said = {text.get_text() for text in axes.texts}
    assert {"b = 0.600 m", "b = 2.200 m", "c = 0.500 m", "c = 2.250 m", "limit: 5 × load"} <= said
    assert axes.get_title(loc="left") == "From the side, boom at 29°"
