"""Speeds at which a fault does no harm, worked by hand; and braking simulated axis by axis at random places."""

from __future__ import annotations

from math import hypot, inf, sqrt

import numpy as np
import pytest

from maya_un.config import Config, Units
from maya_un.kinematics import Floats, Workspace, hanging, slack, tension
from maya_un.kinematics.zones import HalfSpace
from maya_un.motion.emergency import CREEP, LATE, SLACK, Emergency, emergency_speed
from maya_un.values import Point
from tests.strategies import WORKSPACE, configuration

W = WORKSPACE.mechanism.width
EMERGENCY = Emergency.of(Config())
RATE = 0.0512
"""Deceleration of lines in a stop [m/s²]: 51 200 counts/s²."""

LOW = Workspace.of(configuration(geometry={"height": 2.0}))
"""A lower frame: the table is within reach of the lines."""


def lines(u: float, h: float) -> tuple[float, float]:
    """Return the lengths of the lines at (u, h) [m]."""
    return hypot(u, h), hypot(W - u, h)


def faultless(way: float, rate: float = RATE) -> float:
    """Return the speed from which an axis goes on by `way` [m]: it follows late, then brakes at `rate`."""
    return rate * (sqrt(LATE * LATE + 2.0 * way / rate) - LATE)


def gone_on(speed: float) -> float:
    """Return how far an axis goes on from `speed` [m]."""
    return speed * LATE + speed * speed / (2.0 * RATE)


def speeds(
    knots: list[tuple[float, float, float]],
    fastest: float,
    braking: float = inf,
    workspace: Workspace = WORKSPACE,
) -> Floats:
    """Return the emergency speeds of chords; the way is counted in metres of the axis that goes furthest."""
    joints = np.array(knots)
    ways = np.diff(joints.T)
    ways /= np.abs(ways).max(axis=0)
    return emergency_speed(workspace, EMERGENCY, joints, ways, braking, np.full(ways.shape[1], fastest))


def shorter_until_six_loads(b: float, c: float) -> float:
    """Return by how much line c must be shortened until a line carries 6 loads, found by bisection [m]."""
    little, much = 0.0, 0.1
    for _ in range(60):
        middle = 0.5 * (little + much)
        if max(tension(*hanging(b, c - middle, W), W)) < 6.0:
            little = middle
        else:
            much = middle
    return little


def test_the_bounds_are_those_of_the_configuration() -> None:
    per_radian = Units.of(Config()).per_unit[0]
    assert EMERGENCY.tension == pytest.approx(6.0)
    assert EMERGENCY.rates == pytest.approx((10_240 / per_radian, RATE, RATE))
    weak = configuration(axes={"b": Config().axes.b.model_dump() | {"limit_deceleration_counts": 20_480}})
    assert Emergency.of(weak).rates[1] == pytest.approx(0.02048)


def test_nothing_is_slowed_in_the_middle() -> None:
    assert speeds([(0.3, 1.5, 1.5), (0.3, 1.6, 1.4), (0.3, 1.6, 1.5)], 0.045).tolist() == [inf] * 2


def test_one_knot_needs_no_speed() -> None:
    alone = np.array([(0.3, 1.5, 1.5)])
    assert emergency_speed(WORKSPACE, EMERGENCY, alone, np.empty((3, 0)), 1.0, np.empty(0)).tolist() == []


def test_a_line_that_shortens_below_the_ceiling_is_slowed_until_its_stop_ends_at_six_loads() -> None:
    h = sqrt(1.0 / 63.0)  # u = 1: both lines carry ½ √(1 + h²)/h = 4 loads
    b, c = lines(1.0, h)
    assert tension(1.0, h, W) == pytest.approx((4.0, 4.0))
    way = shorter_until_six_loads(b, c)
    # The chord is so short that all of it is one place.
    found = speeds([(0.3, b, c), (0.3, b, c - 1e-7)], 0.045)
    assert found.tolist() == pytest.approx([faultless(way)], rel=3e-3)


def test_a_chord_is_as_slow_as_its_worst_place() -> None:
    b, c = lines(1.0, 0.4)
    end = c - 0.9 * shorter_until_six_loads(b, c)
    left = shorter_until_six_loads(b, end)
    found = speeds([(0.3, b, c), (0.3, b, end)], 0.1)
    assert found.tolist() == pytest.approx([faultless(left)], rel=3e-3)


def test_slow_braking_along_the_path_counts_where_it_is_longer() -> None:
    # c fails, b still shortens on the way of braking; 5.2 mm/s² is a tenth of what b can.
    h = sqrt(1.0 / 63.0)
    b, c = lines(1.0, h)
    path = [(0.3, b, c), (0.3, b - 1e-7, c + 1e-7)]
    way = shorter_until_six_loads(b, c)
    assert speeds(path, 0.045, braking=RATE / 10.0).tolist() == pytest.approx([faultless(way, RATE / 10.0)], rel=2e-2)


def test_the_way_of_braking_may_turn_ahead() -> None:
    # c shortens only on the second chord, which braking from the first one reaches.
    b, c = lines(1.0, 1.0 / sqrt(4.0 * 4.9**2 - 1.0))  # 4.9 loads
    first, second = (0.3, b + 0.02, c - 0.0005), (0.3, b + 0.035, c - 0.0035)
    straight = speeds([(0.3, b, c), first], 0.045, braking=RATE)
    turning = speeds([(0.3, b, c), first, second], 0.045, braking=RATE)
    assert straight[0] == inf
    assert turning[0] < 0.045


def test_slack_is_kept_within_its_bound() -> None:
    b, c = lines(0.01, 1.0)
    found = float(speeds([(0.3, b, c), (0.3, b, c + 1e-7)], 0.2)[0])
    loose = slack(b, c + gone_on(found), W)[1]
    assert 0.6 * SLACK < loose < SLACK


def test_the_table_is_not_touched() -> None:
    b, c = lines(1.0, LOW.mechanism.reach_down - 0.01)
    found = float(speeds([(0.3, b, c), (0.3, b + 1e-7, c)], 0.2, workspace=LOW)[0])
    _, h = hanging(b + gone_on(found), c, W)
    assert h == pytest.approx(LOW.mechanism.reach_down, abs=1e-4)


def test_on_the_table_a_creep_is_left() -> None:
    b, c = lines(1.0, LOW.mechanism.reach_down)
    found = speeds([(0.3, b, c), (0.3, b - 1e-7, c + 1e-7)], 0.045, workspace=LOW)
    assert found.tolist() == pytest.approx([sqrt(2.0 * RATE * CREEP)])


def test_the_margin_of_a_zone_may_be_used_up_but_no_more() -> None:
    table = HalfSpace("table", Point(0.0, 0.0, 0.9), Point(0.0, 0.0, 1.0), margin=0.01)
    b, c = lines(1.0, WORKSPACE.mechanism.reach_down - 0.92)
    path = [(0.3, b, c), (0.3, b + 1e-7, c)]
    assert speeds(path, 0.045).tolist() == [inf]
    found = float(speeds(path, 0.2, workspace=WORKSPACE.with_zones([table]))[0])
    way = gone_on(found)
    # It is 20 mm to the zone itself; the meeting point turns about the outer anchor, at right angles to line c.
    sine = W * (WORKSPACE.mechanism.reach_down - 0.92) / (b * c)
    assert way == pytest.approx(0.02 * sine, rel=0.1)
    assert hanging(b + way, c, W)[1] < WORKSPACE.mechanism.reach_down - 0.9


def test_far_zones_slow_nothing() -> None:
    wall = HalfSpace("wall", Point(0.0, -1.0, 0.0), Point(0.0, 1.0, 0.0))
    path = [(0.3, 1.5, 1.5), (0.4, 1.9, 1.4), (0.9, 1.9, 1.9)]
    assert speeds(path, 0.045, workspace=WORKSPACE.with_zones([wall])).tolist() == [inf] * 2
