"""Segmentation of the fastest motion, worked by hand."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from maya_un.config import Config, Units
from maya_un.kinematics import Mechanism
from maya_un.motion import Limits, Path, Segment, SpeedProfile, lay, plan
from maya_un.motion.move import Knots, Segments, divided
from maya_un.motion.speeds import LONGEST, Chords, Ramps, segments
from maya_un.values import Point

CONFIG = Config()
UNITS = Units.of(CONFIG)
LIMITS = Limits.of(CONFIG)
MAYA = Mechanism.of(CONFIG)
SLEW = LIMITS.slew
VA = 5120.0


def chords(*places: tuple[int, int, int]) -> Chords:
    counts = np.array(places)
    ends = np.isin(np.arange(len(counts)), (0, len(counts) - 1))
    return Chords.of(Knots(counts, counts.astype(np.float64), ends, ()))


def ramps(*chord: tuple[float, float, float], up: float = VA, down: float = 5120.0) -> Ramps:
    """Return ramps from (start, top, end) of every chord."""
    start, top, end = np.array(chord).T
    return Ramps(start, top, end, np.full(len(chord), up), np.full(len(chord), down))


def cut(along: Chords, speeds: Ramps, va: float = VA) -> list[Segment]:
    return list(segments(along, speeds, SLEW, va))


def test_rise_at_va_is_no_step_and_a_fall_one_for_every_two_per_cent() -> None:
    # 45 000 to rest in steps of 900; each piece is driven at the mean of its speeds.
    found = cut(chords((0, 0, 0), (0, 600_000, 0)), ramps((0.0, 45_000.0, 0.0)))
    assert len(found) == 1 + 50
    assert (found[0].speed, found[0].end_speed) == (45_000, 44_550)
    assert [segment.speed for segment in found[1:]] == [44_550 - 900 * step for step in range(50)]
    assert [segment.end_speed for segment in found] == [*(segment.speed for segment in found[1:]), 0]
    # The fall takes 45 000²/(2 · 5120) = 197 753.9 counts, which leaves the others to rise and cruise.
    assert found[0].counts == (0, 402_246, 0)
    assert sum(segment.counts[1] for segment in found) == 600_000


def test_steps_take_as_long_as_the_ramp_they_replace() -> None:
    found = segments(chords((0, 0, 0), (0, 600_000, 0)), ramps((0.0, 45_000.0, 0.0)), SLEW, VA)
    taken = SpeedProfile.over(found.lengths, found.speeds, found.end_speeds, VA, 51_200.0).duration
    # Two ramps of 8.79 s; between them 600 000 − 395 508 counts at 45 000.
    assert taken == pytest.approx(2 * 45_000 / 5120 + (600_000 - 45_000**2 / 5120) / 45_000, rel=2e-3)


def test_rise_gentler_than_va_is_cut_into_steps_of_its_limit() -> None:
    # At half of VA the controller runs ahead by half of the rise: 22 500 in steps of 900.
    found = cut(chords((0, 0, 0), (0, 900_000, 0)), ramps((0.0, 45_000.0, 0.0), up=2560.0))
    assert len(found) == 25 + 1 + 50
    assert all(before.speed < behind.speed for before, behind in pairwise(found[:26]))


def test_small_fall_next_to_a_level_span_is_its_own_end() -> None:
    # 45 000 to 44 550 take 3936 of the 100 000 counts, at 225 less than the top: a mean of 8.9 less.
    found = cut(
        chords((0, 0, 0), (0, 100_000, 0), (0, 400_000, 0)),
        ramps((45_000.0, 45_000.0, 44_550.0), (44_550.0, 44_550.0, 0.0)),
    )
    assert found[0] == Segment((0, 100_000, 0), 44_990, 44_550)


def test_a_stub_of_a_level_stretch_is_left_out() -> None:
    # 3936.4 counts are the fall, and 40 more are no segment.
    found = cut(
        chords((0, 0, 0), (0, 3976, 0), (0, 400_000, 0)),
        ramps((45_000.0, 45_000.0, 44_550.0), (44_550.0, 44_550.0, 0.0)),
    )
    assert found[0].counts == (0, 3976, 0)
    assert found[0].end_speed == 44_550


def test_pieces_end_on_whole_counts_of_the_farthest_axis_and_keep_the_direction() -> None:
    found = cut(chords((0, 0, 0), (700, 200_000, -100_000)), ramps((0.0, 25_000.0, 0.0)))
    places = np.cumsum([segment.counts for segment in found], axis=0)
    assert places[-1].tolist() == [700, 200_000, -100_000]
    assert np.all(places[:, 1] > 0)
    assert np.abs(places[:, 2] + 0.5 * places[:, 1]).max() <= 0.5
    assert np.abs(places[:, 0] - 0.0035 * places[:, 1]).max() <= 0.5


def test_rounding_keeps_every_axis_within_its_slew_speed() -> None:
    found = cut(chords((0, 0, 0), (3, 100, 100), (6, 200, 210)), ramps((0.0, 1000.0, 1000.0), (1000.0, 1000.0, 0.0)))
    for segment in found:
        shares = np.abs(segment.counts) / segment.length
        assert np.all(segment.speed * shares <= np.maximum(SLEW, 2.0))


def test_the_last_segment_ends_at_rest() -> None:
    found = cut(chords((0, 0, 0), (0, 100_000, 0)), ramps((0.0, 20_000.0, 20_000.0)))
    assert found[-1].end_speed == 0
    assert found[-1].speed <= 900


def test_too_long_segment_is_cut_into_equal_parts() -> None:
    found = cut(chords((0, 0, 0), (0, 3 * LONGEST, 3)), ramps((0.0, 900.0, 0.0)))
    assert max(abs(count) for segment in found for count in segment.counts) <= LONGEST
    assert np.sum([segment.counts for segment in found], axis=0).tolist() == [0, 3 * LONGEST, 3]


def test_segments_are_arrays_and_a_sequence() -> None:
    given = [Segment((0, 3, 4), 100, 50), Segment((1, 2, -2), 50, 0)]
    found = Segments.of(given)
    assert list(found) == given
    assert (found[0], found[-1], list(found[1:])) == (given[0], given[1], given[1:])
    assert found.lengths.tolist() == [5.0, 3.0]
    assert len(Segments.of(())) == 0


@pytest.mark.parametrize("longest", [100_000.0, 20_000.0])
def test_dividing_chords_costs_little_time(longest: float) -> None:
    knots = lay(Path.line(Point(0.3, 0.9, 0.5), Point(0.3, 1.7, 0.5)), MAYA, UNITS, LIMITS)
    whole, parted = (plan(one, LIMITS, UNITS).duration for one in (knots, divided(knots, longest)))
    assert parted == pytest.approx(whole, rel=2e-3)


def test_an_ordinary_leg_needs_few_segments() -> None:
    for path, most in (
        (Path.line(Point(0.4, 1.1, 0.4), Point(0.4, 1.1, 0.5)), 30),
        (Path.swing((0.3, 1.2, 0.5), (1.5, 1.2, 0.5)), 60),
        (Path.line(Point(0.3, 0.9, 0.5), Point(0.3, 1.7, 0.5)), 100),
    ):
        assert len(plan(lay(path, MAYA, UNITS, LIMITS), LIMITS, UNITS).segments) <= most
