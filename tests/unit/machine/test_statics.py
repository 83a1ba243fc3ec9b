"""The load on its two lines, against the cases worked by hand in docs/explanation/mechanics.md."""

from __future__ import annotations

from fractions import Fraction
from math import hypot
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from maya_un.machine.truth import MOTOR_LIMIT, LoadStatics, Statics, TrueConstants

PAGE = Path(__file__).parents[3] / "docs" / "explanation" / "mechanics.md"
LINES = st.tuples(st.floats(0.5, 2.5), st.floats(0.5, 2.5)).filter(lambda bc: sum(bc) > 2.0)


def worked() -> list[list[float]]:
    """Rows of the table: b, c, and the six values of `LoadStatics`."""
    rows = [line.strip("| ").split("|") for line in PAGE.read_text(encoding="utf-8").splitlines() if line[:1] == "|"]
    return [[float(Fraction(cell.strip())) for cell in row[1:9]] for row in rows[2:]]


def test_the_page_works_enough_cases() -> None:
    assert len(worked()) >= 20


@pytest.mark.parametrize("row", worked(), ids=lambda row: f"b={row[0]:.3f} c={row[1]:.3f}")
def test_worked_case(row: list[float]) -> None:
    b, c, *expected = row
    assert Statics().hang(b, c) == pytest.approx(expected, abs=1e-6)


def test_many_at_once_are_the_same() -> None:
    rows = np.array(worked())
    z, tension, slack = Statics().hang_many(rows[:, 0], rows[:, 1])
    np.testing.assert_allclose(z, rows[:, 3], atol=1e-6)
    np.testing.assert_allclose(tension, rows[:, 4:6].max(axis=1), atol=1e-6)
    np.testing.assert_allclose(slack, rows[:, 6:8].max(axis=1), atol=1e-6)


@given(LINES)
def test_forces_balance(lines: tuple[float, float]) -> None:
    b, c = lines
    hang = Statics().hang(b, c)
    assume(hang.slack == 0.0)
    u, h = hang.d - 0.30, 2.15 - hang.z
    assert hypot(u, h) == pytest.approx(b)
    assert hypot(2.0 - u, h) == pytest.approx(c)
    assert hang.tension_b * u / b == pytest.approx(hang.tension_c * (2.0 - u) / c, abs=1e-9)
    assert hang.tension_b * h / b + hang.tension_c * h / c == pytest.approx(1.0)


@given(LINES)
def test_a_mirror_image_hangs_like_its_original(lines: tuple[float, float]) -> None:
    b, c = lines
    one, other = Statics().hang(b, c), Statics().hang(c, b)
    assert one == pytest.approx(
        LoadStatics(2.6 - other.d, other.z, other.tension_c, other.tension_b, other.slack_c, other.slack_b), abs=1e-6
    )


@given(LINES)
def test_one_and_many_agree(lines: tuple[float, float]) -> None:
    statics = Statics.of(TrueConstants())
    hang = statics.hang(*lines)
    many = statics.hang_many(np.array(lines[:1]), np.array(lines[1:]))
    assert [float(column[0]) for column in many] == pytest.approx(
        [hang.z, hang.tension, hang.slack], rel=1e-9, abs=1e-9
    )


@given(st.floats(-1e-9, 1e-9))
def test_straight_lines_carry_the_pull_of_the_motor(surplus: float) -> None:
    statics = Statics.of(TrueConstants(friction=(0.1, 0.1, 0.2)))
    hang = statics.hang(1.0, 1.0 + surplus)
    assert hang.tension_b == pytest.approx((MOTOR_LIMIT - 0.1) / 0.5)
    assert hang.tension_c == pytest.approx((MOTOR_LIMIT - 0.2) / 0.5)
    assert hang.z == pytest.approx(2.15, abs=1e-3)
