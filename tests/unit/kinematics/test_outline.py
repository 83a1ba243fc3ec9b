"""The edges of the workspace: the area of the manual's formulas, closed, and on the border."""

from __future__ import annotations

from math import hypot

import numpy as np
import pytest

from maya_un.kinematics import Workspace
from maya_un.kinematics.outline import outline, rings
from maya_un.values import Point
from tests.strategies import WORKSPACE, configuration
from tests.unit.kinematics.manual_grid import STEP, manuals_grid


def shoelace(x: np.ndarray, y: np.ndarray) -> float:
    return abs(float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))) / 2.0


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


@pytest.mark.parametrize(
    "workspace",
    [WORKSPACE, Workspace.of(configuration(safety={"tension_limit": 1.5}))],
    ids=["the manual's", "light tension"],
)
def test_outline_is_the_edge_of_the_workspace(workspace: Workspace) -> None:
    edge = np.column_stack(outline(workspace, bend=0.2, stride=0.4))
    assert edge[0] == pytest.approx(edge[-1])
    boom = 0.5 * sum(workspace.boom)
    middle = edge[:-1].mean(axis=0)
    for share, inside in ((0.999, True), (1.002, False)):
        d, z = (middle + share * (edge - middle)).T
        points = np.column_stack((d * np.sin(boom), d * np.cos(boom), z))
        found = workspace.reachable_many(points)
        assert found.mean() > 0.9 if inside else found.mean() < 0.2


def test_an_outline_of_few_points_has_the_size_of_the_section() -> None:
    d, z = outline(WORKSPACE, bend=0.2, stride=0.4)
    assert shoelace(d, z) == pytest.approx(WORKSPACE.section.area(), rel=0.02)


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
