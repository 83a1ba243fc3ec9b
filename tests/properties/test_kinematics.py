"""The mechanism's theorems, over the whole default workspace."""

from __future__ import annotations

from math import dist

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.errors import Unreachable
from maya_un.kinematics import tension
from maya_un.kinematics.workspace import Workspace
from maya_un.values import Joints, Point
from tests.strategies import (
    WORKSPACE,
    any_points,
    configuration,
    reachable_joints,
    reachable_points,
    reachable_sections,
)

MAYA = WORKSPACE.mechanism
EXACT = 1e-12


@given(reachable_points())
def test_fk_undoes_ik(point: Point) -> None:
    assert max(abs(one - two) for one, two in zip(MAYA.fk(MAYA.ik(point)), point, strict=True)) <= EXACT


@given(reachable_joints())
def test_ik_undoes_fk(joints: Joints) -> None:
    assert max(abs(one - two) for one, two in zip(MAYA.ik(MAYA.fk(joints)), joints, strict=True)) <= EXACT


@given(st.lists(reachable_joints(), min_size=1, max_size=20))
def test_vectors_agree_with_single_calls(joints: list[Joints]) -> None:
    points = MAYA.fk_many(np.array(joints))
    np.testing.assert_allclose(points, np.array([MAYA.fk(row) for row in joints]), rtol=0, atol=EXACT)
    np.testing.assert_allclose(MAYA.ik_many(points), joints, rtol=0, atol=EXACT)


@given(reachable_joints())
def test_the_section_between_its_curves_is_the_workspace(joints: Joints) -> None:
    assert WORKSPACE.contains(joints)
    assert WORKSPACE.why_not(joints) is None
    assert WORKSPACE.check(joints).reachable
    assert min(WORKSPACE.margins(joints).limits.values()) >= -1e-8


@given(reachable_sections())
def test_neither_line_carries_more_than_the_limit(place: tuple[float, float]) -> None:
    assert max(tension(*place, MAYA.width)) <= WORKSPACE.tension_limit * (1 + 1e-12)


@given(any_points())
def test_refused_places_and_only_those_have_a_reason(point: Point) -> None:
    reason = WORKSPACE.why_not(point)
    if reason is None:
        assert WORKSPACE.contains(WORKSPACE.require(point))
    else:
        assert reason.excess >= 0.0
        with pytest.raises(Unreachable, match="nearest reachable"):
            WORKSPACE.require(point)


@given(any_points())
def test_the_nearest_place_is_reachable(point: Point) -> None:
    assert WORKSPACE.why_not(WORKSPACE.nearest(point)) is None


@given(any_points(), st.lists(reachable_points(), min_size=5, max_size=5))
def test_no_reachable_place_is_nearer_than_the_nearest(point: Point, others: list[Point]) -> None:
    best = dist(point, WORKSPACE.nearest(point))
    assert all(best <= dist(point, other) + 1e-4 for other in others)


@given(
    point=any_points(),
    height=st.floats(1.8, 2.6),
    tension_limit=st.floats(1.2, 12.0),
    long_b=st.floats(1.6, 2.4),
)
def test_other_machines_have_a_nearest_place_too(
    point: Point, height: float, tension_limit: float, long_b: float
) -> None:
    config = configuration(geometry={"height": height}, safety={"tension_limit": tension_limit})
    workspace = Workspace.of(config, ((0.0, 2.0), (0.575, long_b), (0.565, 2.3)))
    assert workspace.why_not(workspace.nearest(point)) is None


@given(reachable_joints())
def test_whole_counts_next_to_a_reachable_place_hold_within_a_grain(joints: Joints) -> None:
    rounded = (round(value / grain) * grain for value, grain in zip(joints, WORKSPACE.grain, strict=True))
    assert WORKSPACE.holds_grain(Joints(*rounded))
