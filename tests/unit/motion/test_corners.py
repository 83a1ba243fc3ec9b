"""The width of cut corners, worked by hand."""

from __future__ import annotations

from math import sqrt

import pytest

from maya_un.config import Config, Units
from maya_un.kinematics import Mechanism
from maya_un.motion import Limits, Space
from maya_un.motion.path import Blend, LegLimits, Waypoint, overlap, pace, reversed_blend

CONFIG = Config()
MAYA = Mechanism.of(CONFIG)


def paced(space: Space, start: Waypoint, end: Waypoint, length: float) -> LegLimits:
    return pace(space, start, end, length, MAYA, Units.of(CONFIG), Limits.of(CONFIG))


def test_single_line_has_its_own_pace() -> None:
    found = paced(Space.JOINT, (0.5, 1.0, 1.5), (0.5, 1.4, 1.5), 0.4)
    assert found == pytest.approx((0.045, 0.00512, 1.0))


def test_a_slow_boom_leaves_the_lines_their_share() -> None:
    # 1000 counts/s of the boom are 0.0470 rad/s; b has to keep up with 0.5 m on 1 rad: 23.5 of 45 mm/s.
    found = paced(Space.JOINT, (0.5, 1.0, 1.5), (1.5, 1.5, 1.5), 1.0)
    assert found.speed == pytest.approx(1000.0 / Units.of(CONFIG).per_unit[0])
    assert found.lines == pytest.approx(0.5 * found.speed / 0.045)


def test_straight_up_the_lines_are_shortened_by_less_than_the_way() -> None:
    # In the middle under the boom with h = 1 both lines are √2 long and change by h/√2 of the way.
    found = paced(Space.CYLINDRICAL, (0.5, 1.3, 1.15), (0.5, 1.3, 1.25), 0.1)
    assert found.speed == pytest.approx(0.045 * sqrt(2.0), rel=1e-3)
    assert found.acceleration == pytest.approx(0.00512 * sqrt(2.0), rel=1e-3)


def test_the_speed_after_a_run_up() -> None:
    leg = LegLimits(1.0, 0.5, 1.0)
    assert leg.after(0.25) == pytest.approx(0.5)
    assert leg.after(4.0) == 1.0


def test_one_leg_slows_down_while_the_other_speeds_up() -> None:
    # 1 s to stop, 2 s to speed up, which takes 1 m. The leg before goes on for 1 s at 1 m/s, then 0.5 m more.
    blend = overlap(LegLimits(1.0, 1.0, 1.0), 1.0, LegLimits(1.0, 0.5, 1.0), 5.0)
    assert blend == pytest.approx(Blend(1.5, 1.0, 0.5, 1.0))


def test_a_quick_second_leg_waits_for_none() -> None:
    # 2 s to stop over 1 m; the leg behind is at 1 m/s after 0.5 s and 0.25 m, and goes on for 1.5 s.
    blend = overlap(LegLimits(1.0, 0.5, 1.0), 1.0, LegLimits(1.0, 2.0, 1.0), 5.0)
    assert blend == pytest.approx(Blend(1.0, 1.75, 1.0, 0.25))


def test_short_leg_only_accelerates() -> None:
    # 0.25 m at 0.5 m/s² take 1 s, in which the leg before stops over its 0.5 m.
    blend = overlap(LegLimits(1.0, 1.0, 1.0), 1.0, LegLimits(1.0, 0.5, 1.0), 0.25)
    assert blend == pytest.approx(Blend(0.5, 0.25, 1.0, 1.0))


def test_a_corner_gone_through_the_other_way() -> None:
    assert reversed_blend(Blend(0.1, 0.2, 0.3, 0.4)) == Blend(0.2, 0.1, 0.4, 0.3)
    assert reversed_blend(reversed_blend(Blend(0.1, 0.2, 0.3, 0.4))) == Blend(0.1, 0.2, 0.3, 0.4)
