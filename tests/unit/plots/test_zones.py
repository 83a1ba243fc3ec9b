"""Zones in pictures: bodies in space, cuts in a plane, and what they take away."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from matplotlib.contour import ContourSet

from maya_un.config import Config
from maya_un.kinematics import Workspace
from maya_un.kinematics.zones import Box, Cylinder, HalfSpace, Zone
from maya_un.plots import overlays
from maya_un.plots.style import blank, figure_style
from maya_un.values import Point

SHOWN = (Point(0.0, -1.0, 0.0), Point(2.0, 2.0, 2.0))
PRESS = Box("press", Point(0.6, 0.9, 0.0), Point(0.9, 1.3, 0.7))


def faces(zone: Zone) -> list[np.ndarray]:
    return overlays._faces(zone, SHOWN)


def distances(zone: Zone, places: np.ndarray) -> np.ndarray:
    found, _ = zone.field(places.T)
    return found


@pytest.mark.parametrize(
    "zone", [PRESS, Cylinder("post", 1.2, -0.2, 0.1, 0.0, 1.2), HalfSpace("wall", Point(0, 1.9, 0), Point(0, -2, 0))]
)
def test_every_corner_of_a_body_lies_on_the_zones_surface(zone: Zone) -> None:
    for face in faces(zone):
        assert distances(zone, face) == pytest.approx(np.zeros(len(face)), abs=1e-12)


def test_a_box_has_six_faces_of_the_right_size() -> None:
    areas = [np.linalg.norm(np.cross(face[1] - face[0], face[3] - face[0])) for face in faces(PRESS)]
    assert sorted(areas) == pytest.approx(sorted([0.12, 0.12, 0.21, 0.21, 0.28, 0.28]))


def test_plane_is_drawn_to_the_edges_of_the_picture() -> None:
    (wall,) = faces(HalfSpace("wall", Point(0.0, 1.9, 0.0), Point(0.0, -1.0, 0.0)))
    assert {tuple(corner) for corner in wall} == {(0, 1.9, 0), (2, 1.9, 0), (2, 1.9, 2), (0, 1.9, 2)}
    # Through the middle of the picture and across all three axes a plane cuts a hexagon out of a cube.
    cube = (Point(0.0, 0.0, 0.0), Point(1.0, 1.0, 1.0))
    (hexagon,) = overlays._plane(Point(0.5, 0.5, 0.5), Point(1.0, 1.0, 1.0), cube)
    sides = np.linalg.norm(hexagon - np.roll(hexagon, 1, axis=0), axis=1)
    assert sides == pytest.approx(np.full(6, np.sqrt(0.5)))


def test_plane_next_to_the_picture_is_not_drawn() -> None:
    assert faces(HalfSpace("far", Point(0.0, 5.0, 0.0), Point(0.0, -1.0, 0.0))) == []


def plan_of(*of: Zone) -> Any:
    """Return axes with the zones cut at z = 0.4."""
    workspace = Workspace.of(Config()).with_zones(of)
    x, y = np.arange(0.0, 2.0, 0.02), np.arange(0.0, 2.0, 0.02)
    across, up = np.meshgrid(x, y)
    with figure_style():
        axes = blank().add_subplot()
    overlays.draw_zones(axes, workspace, x, y, np.stack((across, up, np.full_like(across, 0.4))))
    return axes


def test_a_cut_shows_the_zone_its_name_and_a_wider_edge_to_keep_from() -> None:
    axes = plan_of(PRESS)
    cut, edge = (child for child in axes.get_children() if isinstance(child, ContourSet))
    corners = np.concatenate([path.vertices for path in cut.get_paths()])
    assert corners.min(axis=0) == pytest.approx((0.6, 0.9), abs=0.02)
    assert corners.max(axis=0) == pytest.approx((0.9, 1.3), abs=0.02)
    kept = np.concatenate([path.vertices for path in edge.get_paths()])
    assert kept.min(axis=0)[1] < 0.9 - 0.05 + 0.005
    assert kept.max(axis=0)[0] > 0.9 + 0.05 - 0.005
    assert [text.get_text() for text in axes.texts] == ["press"]


def test_a_zone_above_the_cut_is_not_shown_but_its_lines_are_kept_from() -> None:
    high = Box("beam", Point(0.6, 0.9, 0.9), Point(0.9, 1.3, 1.1))
    axes = plan_of(high)
    assert list(axes.texts) == []
    (edge,) = (child for child in axes.get_children() if isinstance(child, ContourSet))
    kept = np.concatenate([path.vertices for path in edge.get_paths()])
    mechanism = Workspace.of(Config()).mechanism
    for x, y in kept[::10]:
        near = high.clearance(mechanism, mechanism.ik(Point(float(x), float(y), 0.4)))
        assert near == pytest.approx(0.0, abs=0.01)


def test_a_zone_far_from_everything_leaves_the_plan_alone() -> None:
    axes = plan_of(Box("far", Point(5.0, 5.0, 0.0), Point(6.0, 6.0, 1.0), lines=False))
    assert [child for child in axes.get_children() if isinstance(child, ContourSet)] == []
