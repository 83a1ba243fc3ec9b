"""Moves as the controller gets them: commands, registers, axes, small and large ways."""

from __future__ import annotations

from itertools import pairwise

import pytest

from maya_un.config import Config, Units
from maya_un.config.files import parse
from maya_un.errors import InvalidValue
from maya_un.motion import CoordinatedMove, Limits, commands, plan
from maya_un.motion.move import straight
from maya_un.values import Joints, Point
from tests.strategies import WORKSPACE, configuration

UNITS = Units.of(Config())
LIMITS = Limits.of(Config())
HERE = Joints(0.5, 1.5, 1.7)

FASTEST = 15_000_000
"""Greatest value of SP and VS [counts/s] (Galil DMC-41x3)."""

STEEPEST = 1_073_740_800
"""Greatest value of AC, DC, VA and VD [counts/s²] (Galil DMC-41x3)."""


def move(*waypoints: Joints, speed_scale: float = 1.0) -> CoordinatedMove:
    return plan(straight(UNITS, waypoints), LIMITS, UNITS, speed_scale)


def shifted(a: int = 0, b: int = 0, c: int = 0) -> Joints:
    """Return HERE moved by whole counts."""
    at = UNITS.to_counts(HERE)
    return UNITS.to_joints((at[0] + a, at[1] + b, at[2] + c))


def test_the_commands_of_a_small_move_in_their_order() -> None:
    # L = 50; line c is the faster: A = D = 5120 · 50/40 = 6400, VA the next step above it, VD = 51200 · 50/40 the next
    # below. v² = A L gives 565.7 at half way; the fall is one stair, driven at the mean of 565.7 and 0.
    assert commands(move(HERE, shifted(b=30, c=-40))) == [
        "CA S",
        "CS S",
        "VR 1",
        "LM BC",
        "VA 7168",
        "VD 63488",
        "VS 534",
        "LI ,15,-20<534>282",
        "LI ,15,-20<282>0",
        "LE",
    ]


def test_the_first_line_of_a_long_move_cruises_and_the_last_stops() -> None:
    lines = commands(move(HERE, shifted(b=500_000)))
    assert lines[6] == "VS 45000"
    assert lines[7].startswith("LI ,") and lines[7].endswith("<45000>44550")
    assert lines[-2].endswith(">0")
    assert lines[-1] == "LE"


def test_acceleration_and_stop_registers_are_the_axes_own() -> None:
    for way, va, vd in ((shifted(a=9000), 1024, 10_240), (shifted(b=9000), 5120, 51_200)):
        found = move(HERE, way)
        assert (found.va, found.vd) == (va, vd)


def test_axes_with_the_greatest_registers_stay_within_the_controllers_range() -> None:
    registers = ("acceleration_counts", "deceleration_counts", "stop_deceleration_counts", "limit_deceleration_counts")
    axis = dict.fromkeys(registers, STEEPEST) | {"speed_counts": FASTEST}
    config = parse({"axes": dict.fromkeys("abc", axis)})
    found = plan(straight(Units.of(config), [shifted(), shifted(300_000, 300_000, 300_000)]), Limits.of(config), UNITS)
    assert (found.va, found.vd, found.vs) == (STEEPEST, STEEPEST, FASTEST)


@pytest.mark.parametrize(
    ("way", "axes"),
    [((5, 0, 0), "A"), ((0, 5, 0), "BC"), ((0, 0, 5), "BC"), ((5, 5, 0), "ABC"), ((0, 0, 0), "")],
)
def test_only_axes_that_move_take_part_and_the_lines_together(way: tuple[int, int, int], axes: str) -> None:
    assert move(HERE, shifted(*way)).axes == axes


def test_letters_decide_the_column() -> None:
    axes = Config().axes
    swapped = configuration(
        axes={
            "a": axes.a.model_copy(update={"letter": "C"}),
            "b": axes.b.model_copy(update={"letter": "A"}),
            "c": axes.c.model_copy(update={"letter": "B"}),
        }
    )
    knots = straight(UNITS, (HERE, shifted(b=30, c=-40)))
    assert commands(plan(knots, Limits.of(swapped), UNITS))[3:8:4] == ["LM AB", "LI 15,-20<534>282"]


def test_standing_still_needs_no_commands() -> None:
    still = move(HERE, HERE, HERE)
    assert (commands(still), still.duration, still.start) == ([], 0.0, still.end)
    assert still.position_at(0.0) == pytest.approx(HERE, abs=1e-4)
    assert still.velocity_at(0.0) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("way", [(1, 0, 0), (-3, 0, 0), (0, 1, 0), (0, 0, -1), (1, 1, 1), (2, -7, 1)])
def test_a_few_counts_are_a_move(way: tuple[int, int, int]) -> None:
    found = move(HERE, shifted(*way))
    assert found.end == tuple(at + step for at, step in zip(found.start, way, strict=True))
    assert all(any(segment.counts) for segment in found.segments)
    assert 0.0 < found.duration < 0.5


def test_a_full_stroke_takes_its_documented_time() -> None:
    # 45 mm/s over 0.9 m: 20 s, and half of the 8.8 s each for the ramps, within the staircase's 2 %.
    assert move(HERE, shifted(b=-900_000)).duration == pytest.approx(20.0 + 8.8, rel=0.02)


def test_the_speed_scale_slows_the_cruise_only() -> None:
    slow = move(HERE, shifted(b=-900_000), speed_scale=0.5)
    assert slow.vs == 22_500
    assert (slow.va, slow.vd) == (5120, 51_200)
    assert slow.duration == pytest.approx(40.0 + 4.4, rel=0.02)


@pytest.mark.parametrize("scale", [0.0, -1.0, 1.01, float("nan")])
def test_a_speed_scale_is_a_share(scale: float) -> None:
    with pytest.raises(InvalidValue, match="speed_scale"):
        move(HERE, shifted(b=10), speed_scale=scale)


def test_a_tiny_speed_scale_still_moves() -> None:
    crawl = move(HERE, shifted(a=3, b=40), speed_scale=1e-9)
    assert crawl.vs == 2
    assert crawl.duration == pytest.approx(crawl.profile.length / 2, rel=1e-3)


def test_paths_longer_than_a_segment_are_split() -> None:
    fine = configuration(scale={"pulses_per_metre": 1e8})
    units = Units.of(fine)
    found = plan(straight(units, (HERE, HERE._replace(b=2.2, c=1.2))), Limits.of(fine), units)
    assert max(abs(count) for segment in found.segments for count in segment.counts) <= 8_388_607
    assert found.end == units.to_counts(HERE._replace(b=2.2, c=1.2))


def test_at_a_sharp_corner_it_is_next_to_rest() -> None:
    corner = shifted(b=200_000)
    found = move(HERE, corner, HERE)
    at = found.places.index(UNITS.to_counts(corner))
    assert found.segments[at - 1].end_speed <= 450
    assert found.end == found.start


def test_straight_waypoint_is_no_corner() -> None:
    halves = move(HERE, shifted(b=100_000), shifted(b=200_000))
    whole = move(HERE, shifted(b=200_000))
    assert halves.duration == pytest.approx(whole.duration, rel=1e-3)


def test_a_pick_of_three_legs_stays_short() -> None:
    legs = [WORKSPACE.require(Point(x, y, z)) for x, y, z in ((0.5, 1.2, 0.4), (0.5, 1.2, 0.5), (1.2, 0.4, 0.5))]
    assert all(len(move(*leg).segments) <= 60 for leg in pairwise(legs))


def test_position_follows_the_segments_and_ends_exactly() -> None:
    found = move(HERE, shifted(a=2000, b=90_000, c=-30_000))
    assert found.position_at(0.0) == pytest.approx(UNITS.to_joints(found.start))
    assert found.position_at(found.duration) == UNITS.to_joints(found.end)
    middle = found.position_at(found.duration / 2)
    share = (middle.b - HERE.b) / 0.09
    assert (middle.a - HERE.a) * UNITS.per_unit[0] / 2000 == pytest.approx(share, abs=1e-3)


def test_velocity_is_the_derivative_of_position() -> None:
    found = move(HERE, shifted(a=2000, b=90_000, c=-30_000))
    t, dt = 1.7, 1e-4
    ahead, behind = found.position_at(t + dt), found.position_at(t - dt)
    slopes = [(one - two) / (2 * dt) for one, two in zip(ahead, behind, strict=True)]
    assert found.velocity_at(t) == pytest.approx(slopes, rel=1e-5)
    assert found.speed_at(t) == pytest.approx(5120 * found.profile.length / 90_000 * t, abs=0.02 * 45_000)


def test_a_stop_from_full_speed_takes_20_millimetres_and_0_88_seconds() -> None:
    found = move(HERE, shifted(b=-900_000))
    seconds, end = found.stop_at(15.0)
    assert seconds == pytest.approx(0.88, abs=0.005)
    assert found.position_at(15.0).b - end.b == pytest.approx(0.0198, abs=1e-4)
    assert found.stop_distance(45_000.0) == pytest.approx(19_775, abs=1)


def test_a_stop_at_the_end_goes_no_further() -> None:
    found = move(HERE, shifted(b=-900_000))
    assert found.stop_at(found.duration - 1e-3)[1].b >= UNITS.to_joints(found.end).b - 1e-9
    assert found.stop_at(found.duration + 1.0) == (0.0, UNITS.to_joints(found.end))
