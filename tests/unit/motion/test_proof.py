"""Knots of a path: those that may lie outside, the waypoints, and the text of a refusal."""

from __future__ import annotations

from math import nan

import numpy as np
import pytest

from maya_un.errors import PathRefused, Unreachable
from maya_un.kinematics import Floats, Workspace
from maya_un.kinematics.mechanism import Mechanism
from maya_un.kinematics.zones import HalfSpace, Zone
from maya_un.motion.proof import between, prove
from maya_un.values import Joints, Point
from tests.strategies import WORKSPACE, configuration, prove_ways

LOW = Workspace.of(configuration(geometry={"height": 2.0}))
"""A lower frame: the table is within reach of the lines."""


def level(workspace: Workspace, z: float, inner: float, outer: float, knots: int) -> Floats:
    """Return the knots of a straight level way of the gripper at height z, evenly spaced between two radii."""
    radii = np.linspace(inner, outer, knots)
    return np.array([workspace.mechanism.ik(Point(0.0, radius, z)) for radius in radii])


def test_a_curve_in_the_middle_is_accepted() -> None:
    prove(WORKSPACE, level(WORKSPACE, 1.0, 0.5, 2.1, 101))


def test_curve_that_leaves_between_waypoints_is_refused_with_its_progress() -> None:
    # Both lines carry 5 loads at z = 2.0624, radius 0.93; at z = 2.07 it is too high from 1.07 to 1.53.
    path = level(WORKSPACE, 2.065, 0.90, 1.70, 81)
    with pytest.raises(PathRefused, match="times the load; the limit is 5 times") as refused:
        prove(WORKSPACE, path)
    share, at = refused.value.details["share"], refused.value.details["at"]
    assert isinstance(at, tuple)
    assert not WORKSPACE.contains(Joints(*at))
    assert share == pytest.approx(0.5, abs=0.02)
    assert f"{share:.0%} of the way there" in str(refused.value)


def test_unreachable_waypoint_is_refused_as_unreachable() -> None:
    path = level(WORKSPACE, 2.065, 0.90, 1.70, 81)
    with pytest.raises(Unreachable, match="times the load"):
        prove(WORKSPACE, path, vias=[40])


def test_shares_count_from_the_waypoint_before() -> None:
    up = level(WORKSPACE, 2.065, 0.90, 1.70, 81)
    path = np.concatenate((level(WORKSPACE, 1.0, 0.5, 0.9, 20), up))
    with pytest.raises(PathRefused) as whole:
        prove(WORKSPACE, path)
    with pytest.raises(PathRefused) as leg:
        prove(WORKSPACE, path, vias=[20])
    assert leg.value.details["share"] == pytest.approx(0.5, abs=0.02)
    assert leg.value.details["at"] == whole.value.details["at"]
    share = whole.value.details["share"]
    assert isinstance(share, float)
    assert share > 0.6


def test_a_stroke_that_is_too_short_between_waypoints_is_refused() -> None:
    path = np.array([(0.0, 2.0, 1.8), (0.0, 2.2, 1.8), (0.0, 2.3, 1.8), (0.0, 2.2, 1.8)])
    with pytest.raises(PathRefused, match=r"line b would have to be 2\.3 m long"):
        prove(WORKSPACE, path)


def test_the_dip_between_two_knots_is_refused_though_all_knots_are_good() -> None:
    path = np.concatenate((level(LOW, 0.3, 0.9, 0.9, 1), level(LOW, 0.02, 0.9, 1.6, 2), level(LOW, 0.3, 1.6, 1.6, 1)))
    with pytest.raises(PathRefused, match="below the table top") as refused:
        prove(LOW, path)
    at = refused.value.details["at"]
    assert isinstance(at, tuple)
    assert at == pytest.approx((path[1] + path[2]) / 2.0, abs=0.01)
    finer = level(LOW, 0.02, 0.9, 1.6, 80)
    prove(LOW, np.concatenate((path[:1], finer, path[3:])))


def test_knots_on_the_edge_that_counts_have_rounded_outside_are_accepted() -> None:
    path = np.array([(0.0, 1.8, 1.8), (0.0, 2.2600005, 1.9), (0.0, 2.2600005, 2.1), (0.0, 1.8, 1.8)])
    prove(WORKSPACE, path)
    with pytest.raises(PathRefused, match="line b"):
        prove(WORKSPACE, path + np.array((0.0, 2e-6, 0.0)))


def test_outside_start_and_non_finite_knots_are_named() -> None:
    good = np.array([(0.0, 1.5, 1.7)] * 3)
    start = good.copy()
    start[0] = 0.0, 0.575, 2.30
    with pytest.raises(PathRefused, match="it starts outside the workspace"):
        prove(WORKSPACE, start)
    end = good.copy()
    end[2, 1] = nan
    with pytest.raises(Unreachable, match="it must be a number"):
        prove(WORKSPACE, end)


def test_turning_at_the_very_edge_is_accepted() -> None:
    turns = np.linspace(WORKSPACE.boom[0], WORKSPACE.boom[1], 50)
    prove(WORKSPACE, np.column_stack((turns, np.full(50, 2.260), np.full(50, 2.300))))


def across(workspace: Workspace, z: float, inner: float = 0.5, outer: float = 2.1) -> tuple[Joints, Joints]:
    """Return the ends of the way, straight in the joints, from near anchor b to near anchor c, both at height z."""
    return workspace.require(Point(0.0, inner, z)), workspace.require(Point(0.0, outer, z))


def test_a_path_in_the_middle_is_accepted() -> None:
    prove_ways(WORKSPACE, *across(WORKSPACE, 1.0))


def test_a_turn_of_the_boom_alone_is_accepted_at_the_very_edge() -> None:
    low = Joints(0.0, 2.260, 2.300)
    prove_ways(WORKSPACE, low, low._replace(a=2.0))


def test_standing_still_is_a_path() -> None:
    here = Joints(0.3, 1.5, 1.7)
    prove_ways(WORKSPACE, here, here)


def test_lines_that_sag_through_the_table_between_good_ends_are_refused() -> None:
    path = across(LOW, 0.02, 0.9, 1.6)
    with pytest.raises(PathRefused, match=r"50% of the way there it lies .* below the table top"):
        prove_ways(LOW, *path)


def test_lines_too_straight_between_good_ends_are_refused() -> None:
    path = across(WORKSPACE, 2.061, 0.93, 1.67)
    with pytest.raises(PathRefused, match="times the load; the limit is 5 times") as refused:
        prove_ways(WORKSPACE, *path)
    at = refused.value.details["at"]
    assert isinstance(at, tuple)
    assert not WORKSPACE.contains(Joints(*at))


def test_a_waypoint_outside_is_named() -> None:
    here = Joints(0.3, 1.5, 1.7)
    with pytest.raises(Unreachable, match=r"line b would have to be 2\.4 m long"):
        prove_ways(WORKSPACE, here, Joints(0.3, 2.4, 1.7), here)


def test_non_finite_waypoint_is_named() -> None:
    with pytest.raises(Unreachable, match="it must be a number"):
        prove_ways(WORKSPACE, Joints(0.3, 1.5, 1.7), Joints(nan, 1.5, 1.7))


def test_a_start_outside_is_named_as_the_start() -> None:
    with pytest.raises(PathRefused, match=r"it starts outside the workspace: it lies 239\.8 mm nearer"):
        prove_ways(WORKSPACE, Joints(0.0, 0.575, 2.30), Joints(0.0, 1.5, 1.7))


def test_a_long_way_outside_is_refused_without_a_look_at_the_zones_from_every_knot(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    looks: list[Joints] = []

    def clearance(zone: Zone, mechanism: Mechanism, joints: Joints) -> float:
        looks.append(joints)
        return Zone.clearance(zone, mechanism, joints)

    monkeypatch.setattr(HalfSpace, "clearance", clearance)
    guarded = WORKSPACE.with_zones([HalfSpace("wall", Point(-3.0, 0.0, 0.0), Point(1.0, 0.0, 0.0))])
    inside = np.array((0.3, 1.5, 1.7))
    outside = np.linspace((0.3, 2.4, 1.7), (0.3, 2.5, 1.7), 2000)
    with pytest.raises(PathRefused, match="line b would have to be"):
        prove(guarded, np.array([inside, *outside, inside]))
    assert len(looks) < 10


def test_a_start_on_the_edge_that_counts_have_rounded_outside_may_leave_inwards() -> None:
    rounded = Joints(0.0, 2.2600005, 2.3000005)
    inwards = Joints(0.0, 1.8, 1.8)
    prove_ways(WORKSPACE, rounded, inwards)
    prove_ways(WORKSPACE, inwards, rounded)


def test_only_the_leg_that_breaks_a_limit_is_refused() -> None:
    inner, outer = across(LOW, 0.02, 0.9, 1.6)
    up = LOW.require(Point(0.0, 1.3, 0.5))
    prove_ways(LOW, inner, up, outer)
    with pytest.raises(PathRefused):
        prove_ways(LOW, inner, up, inner, outer)


def test_between_is_exact_at_the_start() -> None:
    start, end = Joints(0.1, 1.1, 1.2), Joints(0.3, 1.7, 1.9)
    assert between(start, end, 0.0) == start
    assert between(start, end, 1.0) == pytest.approx(end)
