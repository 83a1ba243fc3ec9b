"""Clearance of paths from limits worked by hand, and their lowest and highest points."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from maya_un.errors import Unreachable
from maya_un.kinematics.limits import MEASURED, NAMES
from maya_un.kinematics.zones import Box, HalfSpace
from maya_un.motion.clearance import LIMITS, ClosestApproach, closest, highest, lowest
from maya_un.values import Joints, Limit, Point
from tests.strategies import WORKSPACE

MAYA = WORKSPACE.mechanism


def by_name(*knots: tuple[float, float, float]) -> dict[str, ClosestApproach]:
    """Return the approaches of the way through knots."""
    return {approach.name: approach for approach in closest(WORKSPACE, np.array(knots))}


def test_every_limit_has_its_unit() -> None:
    found = by_name((0.1, 1.5, 1.5), (0.5, 1.6, 1.5))
    assert {name: approach.unit for name, approach in found.items()} == LIMITS
    assert not any(approach.zone for approach in found.values())


def test_strokes_and_coupling_are_nearest_at_a_knot() -> None:
    found = by_name((0.1, 1.0, 1.5), (0.5, 2.0, 1.2), (0.3, 1.9, 1.3))
    margins = {name: approach.margin for name, approach in found.items()}
    assert margins["boom_start"] == pytest.approx(0.1)
    assert margins["boom_end"] == pytest.approx(2.0 * pi / 3.0 - 0.5)
    assert margins["line_b_short"] == pytest.approx(0.425)
    assert margins["line_b_long"] == pytest.approx(0.26)
    assert margins["line_c_short"] == pytest.approx(0.635)
    assert margins["line_c_long"] == pytest.approx(0.8)
    assert margins["coupling"] == pytest.approx(0.5)
    assert found["line_b_short"].place == (0, 0.0)
    assert found["boom_end"].place == (1, 0.0)
    assert by_name((0.1, 1.0, 1.5), (0.5, 2.0, 1.2))["line_b_long"].place == (0, 1.0)


def test_a_vertex_inside_a_chord_is_found() -> None:
    # b = 1.5 − 0.6 t, c = 2.1 − 0.4 t: b² − c² = −2.16 − 0.12 t + 0.2 t², least at t = 0.3, where u = 1 − 2.178/4.
    inner = by_name((0.1, 1.5, 2.1), (0.1, 0.9, 1.7))["inner"]
    assert inner.margin == pytest.approx(1.0 - 2.178 / 4.0, abs=1e-12)
    assert inner.place.chord == 0
    assert inner.place.share == pytest.approx(0.3, abs=1e-6)


def test_tension_and_height_of_a_symmetrical_rise() -> None:
    # Both lines 1.25 long: h = 0.75, T = 5/6; at 1.1: h² = 0.21, T = 0.55/√0.21.
    found = by_name((0.1, 1.25, 1.25), (0.1, 1.1, 1.1))
    assert found["floor"].margin == pytest.approx(2.15 - 0.75)
    assert found["floor"].place == (0, 0.0)
    for name in ("tension_b", "tension_c"):
        assert found[name].margin == pytest.approx(5.0 - 0.55 / 0.21**0.5)
        assert found[name].place == (0, 1.0)


def test_standing_still_has_margins_too() -> None:
    found = by_name((0.1, 1.25, 1.25))
    assert found["inner"].margin == pytest.approx(1.0)
    assert found["inner"].place.chord == 0


def test_beyond_limits_margins_are_negative() -> None:
    found = by_name((-0.1, 1.25, 1.25), (0.1, 0.9, 0.9))
    assert found["boom_start"].margin == pytest.approx(-0.1)
    assert found["coupling"].margin == pytest.approx(-0.2)
    assert found["tension_b"].margin < -1e6


def test_zones_follow_the_limits() -> None:
    # The gripper point passes 0.6 m above the table's zone of 0.4 m, and sags where the way is straight in the joints.
    table = HalfSpace("table", Point(0.0, 0.0, 0.4), Point(0.0, 0.0, 1.0))
    far = Box("far", Point(5.0, 0.0, 0.0), Point(6.0, 1.0, 1.0))
    ends = np.array([MAYA.ik(Point(0.0, radius, 1.0)) for radius in (0.6, 2.0)])
    *_, table_found, far_found = closest(WORKSPACE.with_zones([table, far]), ends)
    low = lowest(MAYA, ends)
    assert (table_found.name, table_found.unit, table_found.zone) == ("table", "m", True)
    assert table_found.margin == pytest.approx(low.z - 0.45, abs=5e-4)
    assert table_found.place.share == pytest.approx(0.5, abs=0.05)
    # At its start the gripper is right beside the far box, 5 m away.
    assert far_found.margin == pytest.approx(4.95, abs=1e-6)
    assert far_found.place == (0, 0.0)


def test_a_straight_line_in_joints_dips_in_space() -> None:
    ends = [MAYA.ik(Point(0.0, radius, 1.0)) for radius in (0.5, 2.1)]
    assert lowest(MAYA, ends).z < 0.99
    assert highest(MAYA, ends).z == pytest.approx(1.0)


def test_extremes_look_at_every_chord() -> None:
    knots = [MAYA.ik(Point(0.0, 1.3, z)) for z in (1.0, 0.4, 1.6, 1.0)]
    assert lowest(MAYA, knots) == pytest.approx(Point(0.0, 1.3, 0.4))
    assert highest(MAYA, np.array(knots)) == pytest.approx(Point(0.0, 1.3, 1.6))


def test_the_extremes_of_standing_still_are_the_place() -> None:
    here = MAYA.ik(Point(0.2, 1.3, 0.7))
    assert lowest(MAYA, [here]) == pytest.approx(Point(0.2, 1.3, 0.7))
    assert highest(MAYA, [here, here]) == pytest.approx(Point(0.2, 1.3, 0.7))


def test_lines_that_cannot_meet_have_no_highest_place() -> None:
    with pytest.raises(Unreachable, match="cannot meet"):
        highest(MAYA, [Joints(0.0, 1.25, 1.25), Joints(0.0, 0.9, 0.9)])


def test_every_limit_with_a_distance_has_a_name() -> None:
    assert set(NAMES) == {*MEASURED, Limit.ZONE, *LIMITS}
