"""Counts and SI, converted in one place."""

from __future__ import annotations

from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.config import Config, Units
from maya_un.config.files import parse
from maya_un.values import Joints

UNITS = Units.of(Config())
COUNTS = st.integers(-(2**31), 2**31 - 1)


def test_a_degree_and_a_metre_have_the_manuals_counts() -> None:
    assert UNITS.to_counts(Joints(pi / 180, 1.0, 1.0)) == (371, 1_000_000, 1_000_000)
    assert UNITS.to_counts(Joints(2 * pi / 3, 0.575, 2.3)) == (44_527, 575_000, 2_300_000)


def test_zero_is_zero() -> None:
    assert UNITS.to_counts(Joints(0.0, 0.0, 0.0)) == (0, 0, 0)


@given(st.tuples(COUNTS, COUNTS, COUNTS))
def test_counts_survive_the_way_there_and_back(counts: tuple[int, int, int]) -> None:
    assert UNITS.to_counts(UNITS.to_joints(counts)) == counts


@given(st.builds(Joints, st.floats(-7.0, 7.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)))
def test_rounding_moves_no_joint_by_more_than_half_a_count(joints: Joints) -> None:
    back = UNITS.to_joints(UNITS.to_counts(joints))
    moved = [abs(x - y) * scale for x, y, scale in zip(joints, back, UNITS.per_unit, strict=True)]
    assert max(moved) <= 0.5 + 1e-6


def test_scale_is_from_the_configuration() -> None:
    units = Units.of(parse({"scale": {"pulses_per_metre": 5e5, "pulses_per_degree": 180.0}}))
    assert units.to_counts(Joints(pi, 1.0, 2.0)) == (32_400, 500_000, 1_000_000)
    assert units.to_joints((32_400, 500_000, 1_000_000)) == pytest.approx((pi, 1.0, 2.0))
