"""The nearest place clear of zones, against all places of a fine grid and against geometry."""

from __future__ import annotations

from math import dist, hypot, inf
from random import Random

import numpy as np
import pytest
from hypothesis import given, settings

from maya_un.errors import Unreachable
from maya_un.kinematics import Box, Cylinder, HalfSpace, Workspace, Zone
from maya_un.values import Point
from tests.campaign import Campaign
from tests.strategies import WORKSPACE, any_points

OVERLOOKED = 6e-3
"""By how much another place may be nearer where zones leave much that is almost as near [m]."""

EXACT = 4e-4
"""The distance kept off a zone for the rounding to counts is part of it [m]."""
TOWER = Box("tower", Point(0.4, 0.9, 0.0), Point(0.8, 1.3, 0.6))
PILLAR = Cylinder("pillar", 0.9, 0.9, 0.3, 0.0, 2.5)
CEILING = HalfSpace("ceiling", Point(0.0, 0.0, 1.5), Point(0.2, 0.0, -1.0))
CELLS = {
    "tower": WORKSPACE.with_zones([TOWER]),
    "pillar": WORKSPACE.with_zones([PILLAR]),
    "ceiling": WORKSPACE.with_zones([CEILING]),
    "all": WORKSPACE.with_zones([TOWER, PILLAR, CEILING]),
}
TARGETS = [
    Point(0.5, 1.1, 0.3),
    Point(0.75, 1.0, 0.55),
    Point(0.85, 0.95, 0.8),
    Point(0.6, 1.3, 1.7),
    Point(0.2, 0.3, 2.0),
    Point(-0.5, 0.4, 1.2),
    Point(1.6, 1.6, 0.3),
]


def sampled(workspace: Workspace, target: Point, best: float, around: Point, reach: float) -> float:
    """The distance of the nearest reachable place on a grid around a place, `best` where none is nearer."""
    axes = [np.linspace(at - reach, at + reach, 41) for at in around]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    apart = np.sqrt(((grid - np.array(target)) ** 2).sum(axis=1))
    nearer = apart < best
    inside = workspace.reachable_many(grid[nearer])
    return float(apart[nearer][inside].min(initial=best))


@pytest.mark.parametrize("name", CELLS)
@pytest.mark.parametrize("target", TARGETS)
def test_no_place_of_a_grid_is_nearer(name: str, target: Point) -> None:
    workspace = CELLS[name]
    found = workspace.nearest(target)
    assert workspace.why_not(found) is None
    best = dist(target, found)
    # Coarsely everywhere that is nearer at all, and finely beside the place that was found.
    assert best <= sampled(workspace, target, best, target, best) + EXACT
    assert best <= sampled(workspace, target, best, found, 0.03) + EXACT


def a_zone(draw: Random, number: int) -> Zone:
    """Draw a zone somewhere in the workspace."""
    x, y, z = draw.uniform(0.0, 1.8), draw.uniform(0.3, 1.8), draw.uniform(0.0, 1.4)
    name, margin, lines = f"zone{number}", draw.uniform(0.0, 0.1), draw.random() < 0.5
    match draw.choice(["box", "cylinder", "half_space"]):
        case "box":
            half = [draw.uniform(0.05, 0.4) for _ in range(3)]
            low = Point(x - half[0], y - half[1], z - half[2])
            return Box(name, low, Point(x + half[0], y + half[1], z + half[2]), margin, lines)
        case "cylinder":
            return Cylinder(name, x, y, draw.uniform(0.05, 0.4), z - 0.3, z + draw.uniform(0.1, 1.0), margin, lines)
        case _:
            normal = Point(draw.gauss(0.0, 1.0), draw.gauss(0.0, 1.0), draw.gauss(0.0, 1.0))
            return HalfSpace(name, Point(x, y, z), normal, margin)


def test_no_random_place_is_nearer(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=15, long=400)):
        draw = campaign.rng(case)
        workspace = WORKSPACE.with_zones([a_zone(draw, number) for number in range(draw.randint(1, 4))])
        target = Point(draw.uniform(-0.3, 2.0), draw.uniform(0.0, 2.0), draw.uniform(0.0, 2.0))
        places = np.random.default_rng(draw.getrandbits(64)).uniform(-0.5, 0.5, (20_000, 3)) + np.array(target)
        apart = np.sqrt(((places - np.array(target)) ** 2).sum(axis=1))[workspace.reachable_many(places)]
        try:
            found = workspace.nearest(target)
        except Unreachable:
            assert not len(apart), f"case {case}"
            continue
        assert workspace.why_not(found) is None
        assert dist(target, found) <= apart.min(initial=inf) + OVERLOOKED, f"case {case}"


def test_above_a_flat_top_is_nearest_from_just_below_it() -> None:
    found = CELLS["tower"].nearest(Point(0.6, 1.1, 0.62))
    assert found == pytest.approx((0.6, 1.1, 0.65), abs=EXACT)


def test_next_to_a_pillar_it_is_on_the_ray_from_its_axis() -> None:
    narrow = WORKSPACE.with_zones([Cylinder("pillar", 0.9, 0.9, 0.3, 0.0, 2.5, lines=False)])
    found = narrow.nearest(Point(0.9, 0.7, 0.9))
    assert hypot(found.x - 0.9, found.y - 0.9) == pytest.approx(0.35, abs=EXACT)
    assert dist(found, (0.9, 0.7, 0.9)) == pytest.approx(0.15, abs=EXACT)


def test_lines_that_would_cross_a_zone_are_reason_enough_to_go_elsewhere() -> None:
    # A bar high up between the outer anchor and the place: the gripper itself is far from it.
    bar = Box("bar", Point(-0.05, 1.7, 1.5), Point(0.05, 1.9, 1.9), margin=0.0)
    target = Point(0.0, 1.2, 1.2)
    assert WORKSPACE.with_zones([bar]).nearest(target) != target
    free = Box("bar", bar.low, bar.high, margin=0.0, lines=False)
    assert WORKSPACE.with_zones([free]).nearest(target) == target


def test_result_stays_reachable_when_it_is_rounded_to_counts() -> None:
    for workspace in CELLS.values():
        for target in TARGETS:
            joints = workspace.require(workspace.nearest(target))
            counts = (round(value / grain) * grain for value, grain in zip(joints, workspace.grain, strict=True))
            assert min(clearance for _, clearance in workspace.margins(type(joints)(*counts)).zones) >= 0.0


@settings(max_examples=30)
@given(any_points())
def test_the_nearest_place_is_reachable_and_farther_than_without_zones(target: Point) -> None:
    workspace = CELLS["all"]
    found = workspace.nearest(target)
    assert workspace.why_not(found) is None
    assert dist(target, found) >= dist(target, WORKSPACE.nearest(target)) - 1e-5


@pytest.mark.parametrize("zone", [TOWER, PILLAR, CEILING], ids=lambda zone: zone.name)
def test_a_zone_in_nobodys_way_changes_nothing(zone: Zone) -> None:
    target = Point(1.5, -1.6, 0.9)
    assert WORKSPACE.with_zones([zone]).nearest(target) == WORKSPACE.nearest(target)
