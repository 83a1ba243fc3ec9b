"""Each limit by name, by how much, and in words that a person can act on."""

from __future__ import annotations

import json
import re
from math import degrees, inf, nan, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.config import CellConfig, Config, Geometry
from maya_un.config.files import parse
from maya_un.errors import InvalidConfig, Unreachable
from maya_un.kinematics import Box, Cylinder, HalfSpace, Limit, Workspace
from maya_un.manual import STROKES
from maya_un.values import Joints, Point
from tests.strategies import WORKSPACE, configuration

ANY_ANGLE = 0.4
HALF = 0.5 * WORKSPACE.mechanism.width


@pytest.mark.parametrize(
    ("target", "limit", "excess"),
    [
        (Point(nan, 1.0, 1.0), Limit.NUMBER, 0.0),
        (Point(1.0, 1.0, -1e200), Limit.NUMBER, 0.0),
        (Point(0.5, 1.2, 2.25), Limit.ANCHORS, 0.10),
        (Point(-1.0, 0.0, 1.0), Limit.BOOM, pi / 2),
        (Point(0.0, 0.2, 1.5), Limit.INNER, 0.1),
        (Point(0.0, 2.35, 1.5), Limit.OUTER, 0.05),
        (Point(0.0, 1.3, -0.05), Limit.FLOOR, 0.05),
        (Point(0.0, 1.3, 0.05), Limit.LINE_B, (1.0 + 2.1**2) ** 0.5 - 2.26),
        (Point(0.0, 0.5, 1.8), Limit.LINE_B, 0.575 - (0.2**2 + 0.35**2) ** 0.5),
        (Point(0.0, 2.2, 1.8), Limit.LINE_C, 0.565 - (0.1**2 + 0.35**2) ** 0.5),
        (Point(0.0, 1.3, 2.10), Limit.TENSION_B, 0.5 * (1.0 + 0.05**2) ** 0.5 / 0.05 - 5.0),
        (Joints(ANY_ANGLE, 0.6, 0.6), Limit.COUPLING, 0.8),
        (Joints(ANY_ANGLE, 0.575, 2.30), Limit.INNER, 0.2398),
        (Joints(ANY_ANGLE, HALF, HALF), Limit.COUPLING, 0.0),
    ],
)
def test_a_refusal_names_the_limit_and_by_how_much(target: Point | Joints, limit: Limit, excess: float) -> None:
    reason = WORKSPACE.why_not(target)
    assert reason is not None
    assert reason.limit is limit
    assert reason.excess == pytest.approx(excess, abs=1e-4)


@pytest.mark.parametrize(
    ("target", "words"),
    [
        (Point(0.0, 1.3, -0.05), "50 mm below the table top"),
        (Point(-1.0, 0.0, 1.0), "turn to -90.0°, 90° below its minimum"),
        (Point(-1e-5, 1.0, 1.0), "turn to 0.0°, 0.000573° below its minimum"),
        (Point(0.0, 1.3, 0.05), "line b would have to be 2.326 m long, 65.94 mm longer than its maximum"),
        (Point(0.0, 1.3, 2.10), "line b would carry 10.01 times the load; the limit is 5 times the load"),
        (Point(9.0, 9.0, 0.4), "it lies 10.43 m farther from the boom's axis than the outer anchor"),
        (Point(0.0, 1.3, 2.1499999), "line b would carry 5058521 times the load"),
        (Joints(0.0, 0.6, 0.6), "lines b and c together are 800 mm too short to meet"),
    ],
)
def test_the_words_are_in_metres_millimetres_and_degrees(target: Point | Joints, words: str) -> None:
    assert words in str(WORKSPACE.why_not(target))


def test_reachable_place_has_no_reason() -> None:
    verdict = WORKSPACE.check(Joints(ANY_ANGLE, 1.7, 1.5))
    assert verdict.reachable
    assert min(verdict.margins.limits.values()) > 0.0


def test_margins_name_the_distance_to_each_limit() -> None:
    margins = WORKSPACE.margins(WORKSPACE.require(Point(0.0, 1.3, 0.9)))
    assert margins.coupling == pytest.approx(2 * (1.0 + 1.25**2) ** 0.5 - 2.0)
    assert (margins.inner, margins.outer, margins.floor, margins.boom) == pytest.approx((1.0, 1.0, 0.9, 0.0))
    assert margins.tension_b == pytest.approx(5.0 - 0.5 * (1.0 + 1.25**2) ** 0.5 / 1.25)


def test_the_ends_of_all_strokes_that_leave_the_lines_taut_are_inside() -> None:
    assert WORKSPACE.contains(Joints(0.0, 2.260, 2.300))
    assert WORKSPACE.contains(Joints(2 * pi / 3, 2.260, 2.300))


def test_the_ceiling_and_the_lowest_point_are_the_documented_ones() -> None:
    def extremes(workspace: Workspace) -> tuple[float, float]:
        depths = [found for u in np.linspace(0.0, 2.0, 2001) if (found := workspace.section.depths(float(u)))]
        down = workspace.mechanism.reach_down
        return down - min(low for low, _ in depths), down - max(high for _, high in depths)

    assert extremes(WORKSPACE) == pytest.approx((2.07, 0.101), abs=5e-3)
    assert extremes(Workspace.of(configuration(safety={"tension_limit": 2.0})))[0] == pytest.approx(1.94, abs=5e-3)


def test_a_refused_target_says_all_and_its_details_survive_json() -> None:
    with pytest.raises(Unreachable, match="cannot be reached: it lies 50 mm below") as refused:
        WORKSPACE.require(Point(0.0, 1.3, -0.05))
    details = json.loads(json.dumps(refused.value.details, allow_nan=False))
    assert details["limit"] == "floor"
    assert WORKSPACE.contains(WORKSPACE.require(Point(*details["nearest_point"])))


def test_the_nearest_place_can_be_typed_back_as_it_is_printed() -> None:
    for target in (Point(0.1, 0.1, 2.3), Point(-2.0, 1.0, 1.0), Point(3.0, 3.0, 0.0), Point(0.0, 1.3, 0.0)):
        with pytest.raises(Unreachable) as refused:
            WORKSPACE.require(target)
        printed = re.findall(r"-?\d+\.\d+", str(refused.value.details["nearest"]))
        assert WORKSPACE.why_not(Point(*map(float, printed))) is None


@pytest.mark.parametrize("target", [Point(nan, nan, nan), Point(inf, 0.0, 0.0), Point(1e300, 1e300, 1e300)])
def test_absurd_numbers_are_refused_with_a_reachable_alternative(target: Point) -> None:
    assert WORKSPACE.why_not(WORKSPACE.nearest(target)) is None


@given(st.tuples(*[st.sampled_from([1e308, -1e308, 1e-320, 1e4, 1e5]) | st.floats()] * 3), st.booleans())
def test_refusal_is_a_short_sentence_for_any_numbers(numbers: tuple[float, float, float], in_space: bool) -> None:
    target = Point(*numbers) if in_space else Joints(*numbers)
    try:
        WORKSPACE.require(target)
    except Unreachable as refused:
        assert len(str(refused)) < 300


def test_joints_that_are_refused_have_a_nearest_place_too() -> None:
    for joints in (Joints(9.0, 1.0, 1.5), Joints(0.0, 0.6, 0.6), Joints(0.0, 9.0, 0.6), Joints(nan, 1.0, 1.0)):
        with pytest.raises(Unreachable) as refused:
            WORKSPACE.fk(joints)
        assert "nearest_point" in refused.value.details


def test_behind_the_robot_the_nearer_end_of_the_boom_is_taken() -> None:
    assert WORKSPACE.nearest(Point(-0.5, -1.0, 1.0)).x > 0.0  # bearing 207°: 120° is nearer than 360°
    assert WORKSPACE.nearest(Point(-1.0, 0.5, 1.0)).x == 0.0
    bearing = WORKSPACE.require(WORKSPACE.nearest(Point(-0.5, -1.0, 1.0))).a
    assert degrees(bearing) == pytest.approx(120.0)


def test_measured_strokes_replace_the_configured_ones() -> None:
    shorter = Workspace.of(Config(), ((0.0, 2.0), (0.575, 2.2), (0.565, 2.3)))
    assert not shorter.contains(Joints(0.0, 2.25, 2.2))
    assert WORKSPACE.contains(Joints(0.0, 2.25, 2.2))


def test_a_configuration_in_which_nothing_is_reachable_is_refused() -> None:
    with pytest.raises(InvalidConfig, match="nothing is reachable"):
        low = {
            "geometry": Geometry(height=0.25, gripper_height=0.20),
            "cell": CellConfig(grasp_height=0.02, clearance=0.01),
        }
        Workspace.of(Config().model_copy(update=low))


def test_an_edge_rounded_to_counts_holds_within_a_grain() -> None:
    edge = Joints(2 * pi / 3 + 2e-5, 2.2600005, 2.3000005)
    assert not WORKSPACE.contains(edge)
    assert WORKSPACE.holds_grain(edge)
    assert not WORKSPACE.holds_grain(edge._replace(b=2.26001))


def test_a_tension_broken_by_rounding_holds_within_a_grain() -> None:
    top = WORKSPACE.mechanism.ik(Point(0.0, 1.3, 2.15 - 1.0 / 99.0**0.5))
    rounded = Joints(0.0, top.b - 5e-7, top.c - 5e-7)
    assert not WORKSPACE.contains(rounded)
    assert WORKSPACE.holds_grain(rounded)
    assert not WORKSPACE.holds_grain(Joints(0.0, top.b - 1e-5, top.c - 1e-5))


def test_many_agree_with_one() -> None:
    rng = np.random.default_rng(8)
    joints = rng.uniform((-0.2, 0.4, 0.4), (2.3, 2.5, 2.5), (4000, 3))
    found = WORKSPACE.contains_many(joints)
    assert found.tolist() == [WORKSPACE.contains(Joints(*row)) for row in joints]
    assert 0.2 < found.mean() < 0.9


TOWER = Box("tower", Point(0.4, 0.9, 0.0), Point(0.8, 1.3, 0.6))
GUARDED = WORKSPACE.with_zones([TOWER, Cylinder("post", 1.2, 0.3, 0.05, 0.0, 1.0)])


def test_zones_leave_the_other_limits_as_they_are() -> None:
    far = Joints(2 * pi / 3, 1.5, 1.5)
    assert GUARDED.contains(far)
    assert GUARDED.with_zones(()) == WORKSPACE
    assert GUARDED.margins(far).limits == WORKSPACE.margins(far).limits
    assert WORKSPACE.margins(far).zones == ()


def test_a_zone_that_is_broken_is_named() -> None:
    reason = GUARDED.why_not(Point(0.6, 1.1, 0.62))
    assert reason is not None
    assert (reason.limit, reason.unit, reason.zone) == (Limit.ZONE, "m", "tower")
    assert reason.excess == pytest.approx(0.03, abs=1e-6)
    assert str(reason) == "the gripper or a line would be 20 mm from zone tower, whose margin is 50 mm"


def test_depth_inside_a_zone_is_given() -> None:
    assert str(GUARDED.why_not(Point(0.6, 1.1, 0.55))) == "the gripper or a line would be 50 mm inside zone tower"


def test_all_broken_limits_are_listed_in_order() -> None:
    deep = Point(0.6, 1.1, -0.02)
    limits = [Limit.FLOOR, Limit.LINE_B, Limit.LINE_C, Limit.ZONE]
    assert [reason.limit for reason in GUARDED.all_reasons(deep)] == limits
    assert GUARDED.all_reasons(deep)[0] == GUARDED.why_not(deep)
    assert GUARDED.all_reasons(Point(1.1, 0.8, 1.0)) == ()


def test_margins_have_the_clearance_of_every_zone() -> None:
    names, clearances = zip(*GUARDED.margins(GUARDED.require(Point(0.6, 1.1, 0.9))).zones, strict=True)
    assert names == ("tower", "post")
    assert clearances[0] == pytest.approx(0.25)


def test_refusal_for_a_zone_names_it_and_the_nearest_place() -> None:
    with pytest.raises(Unreachable, match="zone tower") as refused:
        GUARDED.require(Point(0.6, 1.1, 0.55))
    details = json.loads(json.dumps(refused.value.details, allow_nan=False))
    assert (details["limit"], details["zone"]) == ("zone", "tower")
    assert details["nearest_point"] == pytest.approx((0.6, 1.1, 0.65), abs=1e-3)


def test_zones_that_leave_nothing_leave_no_nearest_place() -> None:
    nothing = WORKSPACE.with_zones([HalfSpace("cell", Point(0.0, 0.0, 3.0), Point(0.0, 0.0, 1.0))])
    with pytest.raises(Unreachable, match="zones leave no place"):
        nothing.nearest(Point(0.5, 1.2, 0.4))
    with pytest.raises(Unreachable, match=r"inside zone cell.*nearest reachable point is: none") as refused:
        nothing.require(Point(0.5, 1.2, 0.4))
    assert refused.value.details["nearest_point"] is None


def test_place_next_to_a_zone_rounded_to_counts_holds_within_a_grain() -> None:
    edge = GUARDED.require(Point(0.6, 1.1, 0.65 + 1e-6))
    rounded = edge._replace(b=edge.b - 2e-6, c=edge.c + 2e-6)
    moved = next(
        joints
        for joints in (rounded, rounded._replace(b=edge.b + 2e-6), edge._replace(b=edge.b + 2e-6))
        if not GUARDED.contains(joints)
    )
    assert GUARDED.holds_grain(moved)
    assert not GUARDED.holds_grain(GUARDED.mechanism.ik(Point(0.6, 1.1, 0.6495)))


def test_zones_of_the_configuration_are_the_workspaces() -> None:
    table = {"name": "tower", "kind": "box", "low": [0.4, 0.9, 0.0], "high": [0.8, 1.3, 0.6]}
    post = {"name": "post", "kind": "cylinder", "x": 1.2, "y": 0.3, "radius": 0.05, "low": 0.0, "high": 1.0}
    wall = {"name": "wall", "kind": "half_space", "point": [0, 2, 0], "normal": [0, -1, 0], "margin": 0.1}
    zones = Workspace.of(parse({"zones": [table, post, wall]})).zones
    assert zones[:2] == GUARDED.zones
    assert zones[2] == HalfSpace("wall", Point(0.0, 2.0, 0.0), Point(0.0, -1.0, 0.0), 0.1)


@pytest.mark.parametrize("minimum", [-pi, -3.0, -0.3, -0.1, 0.0])
def test_a_boom_that_turns_all_the_way_round_reaches_its_lower_end(minimum: float) -> None:
    """A homed axis ends short of its upper switch, so the place of both ends has the angle of the lower one."""
    boom = {"minimum": minimum, "maximum": minimum + 2.0 * pi}
    config = parse({"axes": {"a": boom}})
    workspace = Workspace.of(config, ((minimum, minimum + 2.0 * pi - 0.002), *STROKES[1:]))
    for angle in (minimum, minimum + 1e-12, minimum + 1e-4):
        place = workspace.mechanism.fk(Joints(angle, 1.5, 1.5))
        assert workspace.mechanism.ik(place).a == pytest.approx(angle, abs=1e-12)
        assert workspace.nearest(place) == place
    for angle in (minimum - 1e-12, minimum - 1e-4, minimum - 0.001):
        place = workspace.mechanism.fk(Joints(angle, 1.5, 1.5))
        assert workspace.why_not(workspace.nearest(place)) is None
