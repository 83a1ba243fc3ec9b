"""Ways past zones, through them, and along their margin."""

from __future__ import annotations

from math import cos, sin

import numpy as np
import pytest

from maya_un.errors import PathRefused, Unreachable
from maya_un.kinematics import Floats
from maya_un.kinematics.zones import Box, Cylinder, HalfSpace, Zone
from maya_un.motion.proof import between, first_entry, prove
from maya_un.values import Joints, Point
from tests.strategies import WORKSPACE

MAYA = WORKSPACE.mechanism

POST = Cylinder("post", x=1.3 * sin(1.0), y=1.3 * cos(1.0), radius=0.1, low=0.0, high=0.6)
"""A post at radius 1.3, where the boom points at 1 rad; its top is kept clear by 50 mm."""


def swing(z: float, knots: int = 2) -> Floats:
    """Return the knots of a swing of the boom from 0.5 to 1.5 rad, with the gripper at radius 1.3 and height z."""
    _, b, c = MAYA.ik(Point(0.0, 1.3, z))
    return np.array([(a, b, c) for a in np.linspace(0.5, 1.5, knots)])


def level(z: float, inner: float, outer: float, knots: int) -> Floats:
    """Return the knots of a straight level way of the gripper outwards at height z."""
    return np.array([MAYA.ik(Point(0.0, radius, z)) for radius in np.linspace(inner, outer, knots)])


@pytest.mark.parametrize("knots", [2, 3, 40])
def test_a_swing_through_a_post_is_found_and_one_above_its_margin_is_not(knots: int) -> None:
    workspace = WORKSPACE.with_zones([POST])
    assert first_entry(workspace, swing(0.66, knots)) is None
    path = swing(0.64, knots)
    entry = first_entry(workspace, path)
    assert entry is not None
    assert entry.zone is POST
    chord, share = entry.place
    assert POST.clearance(MAYA, between(Joints(*path[chord]), Joints(*path[chord + 1]), share)) < 0.0


def test_a_refusal_names_zone_and_place() -> None:
    workspace = WORKSPACE.with_zones([POST])
    path = swing(0.5)
    with pytest.raises(PathRefused, match="post") as refused:
        prove(workspace, path)
    # The middle of the swing lies in the middle of the post.
    assert refused.value.details["share"] == pytest.approx(0.5, abs=0.05)
    prove(WORKSPACE, path)


def test_a_way_along_the_margin_is_accepted_and_a_millimetre_nearer_is_not() -> None:
    table = HalfSpace("table", Point(0.0, 0.0, 0.45), Point(0.0, 0.0, 1.0))
    workspace = WORKSPACE.with_zones([table])
    along = level(0.5, 0.9, 1.7, 400)
    along[:, 1:] = np.floor(along[:, 1:] * 1e6) * 1e-6
    prove(workspace, along)
    with pytest.raises(PathRefused, match="table"):
        prove(workspace, np.concatenate((along[:1], level(0.499, 0.9, 1.7, 200), along[-1:])))


def test_a_dip_between_two_good_knots_is_found() -> None:
    table = HalfSpace("table", Point(0.0, 0.0, 0.45), Point(0.0, 0.0, 1.0))
    ends = level(0.501, 0.9, 1.7, 2)  # straight in the joints it sags by centimetres
    entry = first_entry(WORKSPACE.with_zones([table]), ends)
    assert entry is not None
    assert 0.0 < entry.place.share < 1.0


def test_lines_are_kept_clear_of_zones_that_require_it() -> None:
    # Between the anchors, below the boom: in the way of line b, far above the gripper.
    low, high = Point(-0.1, 0.75, 1.5), Point(0.1, 0.85, 1.6)
    path = level(0.5, 1.2, 1.4, 10)
    assert first_entry(WORKSPACE.with_zones([Box("lamp", low, high, lines=False)]), path) is None
    assert first_entry(WORKSPACE.with_zones([Box("lamp", low, high)]), path) is not None


def test_the_first_zone_that_is_entered_is_named_though_others_are_far_away() -> None:
    far = HalfSpace("wall", Point(0.0, -1.0, 0.0), Point(0.0, 1.0, 0.0))
    zones: list[Zone] = [far, POST]
    entry = first_entry(WORKSPACE.with_zones(zones), swing(0.5, 9))
    assert entry is not None
    assert entry.zone.name == "post"


def test_start_inside_a_zone_is_refused_with_advice() -> None:
    workspace = WORKSPACE.with_zones([POST])
    path = swing(0.5, 3)[1:]
    with pytest.raises(PathRefused, match="starts too near to the zone post; remove the zone"):
        prove(workspace, path)


def test_an_end_inside_a_zone_cannot_be_reached() -> None:
    workspace = WORKSPACE.with_zones([POST])
    path = swing(0.5, 3)[:2]
    with pytest.raises(Unreachable, match="post"):
        prove(workspace, path)
