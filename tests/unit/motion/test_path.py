"""Paths that must be refused though their ends are good, and those that must not."""

from __future__ import annotations

from math import nan

import pytest

from maya_un.config import Config
from maya_un.errors import PathRefused, TrajectoryRefused, Unreachable
from maya_un.kinematics import Workspace
from maya_un.motion import JointPath, between, check_path, highest_point, lowest_point
from maya_un.values import Joints, Point
from tests.strategies import WORKSPACE, configuration

MAYA = WORKSPACE.mechanism


def across(workspace: Workspace, z: float, inner: float = 0.5, outer: float = 2.1) -> JointPath:
    """Return the path from near anchor b to near anchor c, both ends at height z."""
    ends = (workspace.require(Point(0.0, radius, z)) for radius in (inner, outer))
    return JointPath.through(*ends)


def test_a_path_needs_two_waypoints() -> None:
    with pytest.raises(TrajectoryRefused, match="start and an end"):
        JointPath.through(Joints(0.0, 1.5, 1.5))


def test_a_path_in_the_middle_is_accepted() -> None:
    check_path(WORKSPACE, across(WORKSPACE, 1.0))


def test_a_turn_of_the_boom_alone_is_accepted_at_the_very_edge() -> None:
    low = Joints(0.0, 2.260, 2.300)
    check_path(WORKSPACE, JointPath.through(low, low._replace(a=2.0)))


def test_standing_still_is_a_path() -> None:
    here = Joints(0.3, 1.5, 1.7)
    check_path(WORKSPACE, JointPath.through(here, here))


def test_lines_that_sag_through_the_table_between_good_ends_are_refused() -> None:
    # A lower frame: the table is within reach of the lines.
    low = Workspace.of(configuration(geometry={"height": 2.0}))
    path = across(low, 0.02, 0.9, 1.6)
    with pytest.raises(PathRefused, match=r"50% of the way there it lies .* below the table top"):
        check_path(low, path)


def test_lines_too_straight_between_good_ends_are_refused() -> None:
    path = across(WORKSPACE, 2.061, 0.93, 1.67)
    with pytest.raises(PathRefused, match="times the load, more than the 5 allowed") as refused:
        check_path(WORKSPACE, path)
    at = refused.value.details["at"]
    assert isinstance(at, tuple)
    assert not WORKSPACE.contains(Joints(*at))


def test_a_waypoint_outside_is_named() -> None:
    here = Joints(0.3, 1.5, 1.7)
    with pytest.raises(Unreachable, match=r"line b would have to be 2400\.0 mm long"):
        check_path(WORKSPACE, JointPath.through(here, Joints(0.3, 2.4, 1.7), here))


def test_a_waypoint_that_is_no_number_is_named() -> None:
    with pytest.raises(Unreachable, match="finite"):
        check_path(WORKSPACE, JointPath.through(Joints(0.3, 1.5, 1.7), Joints(nan, 1.5, 1.7)))


def test_a_start_outside_is_named_as_the_start() -> None:
    with pytest.raises(PathRefused, match=r"it starts outside the workspace: it lies 239\.8 mm inside"):
        check_path(WORKSPACE, JointPath.through(Joints(0.0, 0.575, 2.30), Joints(0.0, 1.5, 1.7)))


def test_a_start_on_the_edge_that_counts_have_rounded_outside_may_leave_inwards() -> None:
    rounded = Joints(0.0, 2.2600005, 2.3000005)
    inwards = Joints(0.0, 1.8, 1.8)
    check_path(WORKSPACE, JointPath.through(rounded, inwards))
    check_path(WORKSPACE, JointPath.through(inwards, rounded))


def test_only_the_leg_that_breaks_a_limit_is_refused() -> None:
    low = Workspace.of(configuration(geometry={"height": 2.0}))
    inner, outer = across(low, 0.02, 0.9, 1.6).waypoints
    up = low.require(Point(0.0, 1.3, 0.5))
    check_path(low, JointPath.through(inner, up, outer))
    with pytest.raises(PathRefused):
        check_path(low, JointPath.through(inner, up, inner, outer))


def test_a_straight_line_in_joints_dips_in_space() -> None:
    path = across(WORKSPACE, 1.0)
    assert lowest_point(MAYA, path).z < 0.99
    assert highest_point(MAYA, path).z == pytest.approx(1.0)


def test_extremes_look_at_every_leg() -> None:
    path = JointPath.through(*(WORKSPACE.require(Point(0.0, 1.3, z)) for z in (1.0, 0.4, 1.6, 1.0)))
    assert lowest_point(MAYA, path).z == pytest.approx(0.4)
    assert highest_point(MAYA, path).z == pytest.approx(1.6)


def test_the_extremes_of_standing_still_are_the_place() -> None:
    here = Workspace.of(Config()).require(Point(0.2, 1.3, 0.7))
    assert lowest_point(MAYA, JointPath.through(here, here)) == pytest.approx(Point(0.2, 1.3, 0.7))


def test_between_is_exact_at_the_start() -> None:
    start, end = Joints(0.1, 1.1, 1.2), Joints(0.3, 1.7, 1.9)
    assert between(start, end, 0.0) == start
    assert between(start, end, 1.0) == pytest.approx(end)
