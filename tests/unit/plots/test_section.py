"""The section that is drawn is the one that is reachable, and the manual's is the manual's."""

from __future__ import annotations

from math import hypot

import numpy as np
import pytest

from maya_un.config import Config
from maya_un.kinematics import Workspace
from maya_un.plots.overlays import MarkedTarget
from maya_un.plots.section import draw_section, manual_margin, outline
from maya_un.plots.style import blank, house_style
from maya_un.values import Point

WORKSPACE = Workspace.of(Config())
STEP = 0.0025
U = np.arange(0.5 * STEP, 2.0, STEP)
Z = np.arange(0.5 * STEP, 2.35, STEP)


def shoelace(x: np.ndarray, y: np.ndarray) -> float:
    return abs(float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))) / 2.0


def manuals_grid() -> tuple[np.ndarray, np.ndarray]:
    """Return which places of a grid have lines within their strokes, and the greater tension there [loads]."""
    u, z = np.meshgrid(U, Z)
    h = 2.15 - z
    b, c = np.hypot(u, h), np.hypot(2.0 - u, h)
    accepted = (b >= 0.575) & (b <= 2.26) & (c >= 0.565) & (c <= 2.3)
    tension = np.where(h > 0.0, np.maximum((2.0 - u) * b, u * c) / (2.0 * np.abs(h)), np.inf)
    return accepted, tension


def test_outline_encloses_the_area_of_the_manuals_formulas_and_the_tension() -> None:
    d, z = outline(WORKSPACE)
    accepted, tension = manuals_grid()
    counted = np.count_nonzero(accepted & (tension <= 5.0)) * STEP * STEP
    assert shoelace(d, z) == pytest.approx(counted, rel=1e-3)


def test_the_outline_is_closed_and_has_the_known_ends() -> None:
    d, z = outline(WORKSPACE)
    assert (d[0], z[0]) == (d[-1], z[-1])
    # Both lines fully out: u = (4 + 2.26² − 2.3²)/4 = 0.9544, h = √(2.26² − u²) = 2.04859.
    lowest = np.argmin(z)
    assert (d[lowest], z[lowest]) == pytest.approx((1.2544, 0.101410), abs=1e-6)
    assert z.max() == pytest.approx(2.07, abs=2e-3)
    assert (d.min(), d.max()) == pytest.approx((0.3, 2.3))


def test_every_place_just_inside_the_outline_is_reachable() -> None:
    d, z = outline(WORKSPACE)
    middle = np.array([1.3, 1.3])
    for place in np.column_stack((d, z)):
        at, up = place + 1e-6 * (middle - place)
        assert WORKSPACE.why_not(Point(0.0, float(at), float(up))) is None


def test_the_manuals_listing_accepts_the_known_area_above_the_anchors() -> None:
    margin = manual_margin(WORKSPACE, *np.meshgrid(U, Z))
    accepted, _ = manuals_grid()
    assert np.array_equal(margin >= 0.0, accepted)
    above = np.count_nonzero((margin >= 0.0) & (Z[:, None] > 2.15)) * STEP * STEP
    assert above == pytest.approx(0.18, abs=0.005)


def test_lines_are_drawn_to_the_meeting_point_of_the_held_place() -> None:
    with house_style():
        axes = blank().add_subplot()
        draw_section(axes, WORKSPACE, 0.0, MarkedTarget.of(WORKSPACE, Point(0.0, 1.3, 1.0)))
    ends = {tuple(np.ravel(line.get_xydata())) for line in axes.lines}
    assert (0.3, 2.35, 1.3, 1.2) in ends
    assert (2.3, 2.35, 1.3, 1.2) in ends
    assert (1.3, 1.2, 1.3, 1.0) in ends


def test_curves_of_tension_are_at_their_values() -> None:
    with house_style():
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
    with house_style():
        axes = blank().add_subplot()
        draw_section(axes, measured, 0.5)
    said = {text.get_text() for text in axes.texts}
    assert {"b = 0.600 m", "b = 2.200 m", "c = 0.500 m", "c = 2.250 m", "limit: 5 × load"} <= said
    assert axes.get_title(loc="left") == "From the side, boom at 29°"
