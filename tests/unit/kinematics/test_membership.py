"""Many at once are one at a time, wherever the boom may turn and whatever the zones."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from maya_un.config import Config
from maya_un.kinematics import Box, Cylinder, Floats, Workspace
from maya_un.values import Joints, Point
from tests.campaign import Campaign
from tests.strategies import WORKSPACE, configuration

ZONES = (
    Box("tower", Point(0.4, 0.9, 0.0), Point(0.8, 1.3, 0.6)),
    Cylinder("post", 1.2, 0.3, 0.05, 0.0, 1.0, lines=False),
)
RANGES = [(0.0, 2 * pi / 3), (0.5, 0.6), (0.0, pi), (1.0, 1.0 + pi), (0.2, 5.0), (0.0, 2 * pi)]


def turning(start: float, end: float) -> Workspace:
    boom = Config().axes.a.model_copy(update={"minimum": start, "maximum": end})
    return Workspace.of(configuration(axes={"a": boom}))


def places(campaign: Campaign, count: int) -> Floats:
    """Places in and around the workspace, every third of them close to its edge."""
    draw = np.random.default_rng(campaign.rng().getrandbits(64))
    found = draw.uniform((-2.4, -2.4, -0.1), (2.4, 2.4, 2.3), (count, 3))
    for row in range(0, count, 3):
        found[row] = WORKSPACE.nearest(Point(*found[row])) + draw.normal(0.0, 1e-5, 3)
    return found


@pytest.mark.parametrize("boom", RANGES)
@pytest.mark.parametrize("zones", [(), ZONES], ids=["bare", "zones"])
def test_points_at_once_are_points_one_at_a_time(
    campaign: Campaign, boom: tuple[float, float], zones: tuple[Box | Cylinder, ...]
) -> None:
    workspace = turning(*boom).with_zones(zones)
    points = places(campaign, campaign.size(ci=1000, long=30_000))
    expected = [workspace.why_not(Point(*point)) is None for point in points]
    assert workspace.reachable_many(points).tolist() == expected
    assert any(expected)
    assert not all(expected)


@pytest.mark.parametrize("zones", [(), ZONES], ids=["bare", "zones"])
def test_joints_at_once_are_joints_one_at_a_time(campaign: Campaign, zones: tuple[Box | Cylinder, ...]) -> None:
    workspace = WORKSPACE.with_zones(zones)
    draw = np.random.default_rng(campaign.rng().getrandbits(64))
    joints = draw.uniform((-0.2, 0.5, 0.5), (2.3, 2.4, 2.4), (campaign.size(ci=2000, long=50_000), 3))
    expected = [workspace.contains(Joints(*row)) for row in joints]
    assert workspace.contains_many(joints).tolist() == expected
    assert any(expected)


def test_result_is_written_in_place_over_many_blocks() -> None:
    points = np.tile(np.array([[0.5, 1.2, 0.4], [0.5, 1.2, 3.0]]), (30_000, 1))
    joints = np.tile(np.array([[0.4, 1.7, 1.5], [0.4, 0.6, 0.6]]), (30_000, 1))
    out = np.empty(len(points), dtype=np.bool_)
    assert WORKSPACE.reachable_many(points, out) is out
    assert (out[::2].all(), out[1::2].any()) == (True, False)
    assert WORKSPACE.contains_many(joints, out) is out
    assert (out[::2].all(), out[1::2].any()) == (True, False)


def test_invalid_number_is_nowhere() -> None:
    numbers = np.array([[np.nan, 1.0, 1.0], [0.5, np.inf, 1.0], [0.5, 1.2, -np.inf], [1e200, 1e200, 0.4], [0, 0, 1]])
    assert not WORKSPACE.reachable_many(numbers).any()
    assert not WORKSPACE.contains_many(numbers).any()


def test_no_places_have_no_answers() -> None:
    for zones in ((), ZONES):
        assert WORKSPACE.with_zones(zones).reachable_many(np.empty((0, 3))).shape == (0,)
        assert WORKSPACE.with_zones(zones).contains_many(np.empty((0, 3))).shape == (0,)
