"""Conditions worked by hand, and polynomials whose course is known: no dip may be missed, none invented."""

from __future__ import annotations

from math import comb

import numpy as np
import pytest

from maya_un.kinematics import Floats
from maya_un.motion.proof import along, falling, values
from tests.strategies import WORKSPACE


def chord(*polynomials: tuple[float, ...]) -> Floats:
    """Return the coefficients (7, 5, 1) of one chord; its first conditions are polynomials in t, all others 1."""
    out = np.ones((7, 5, 1))
    for condition, polynomial in enumerate(polynomials):
        for i in range(7):
            out[i, condition, 0] = sum(a * comb(i, k) / comb(6, k) for k, a in enumerate(polynomial) if k <= i)
    return out


def test_the_conditions_of_a_symmetrical_place_worked_by_hand() -> None:
    # b = c = 1.25 over W = 2: u = 1, h = 0.75, T = ½ · 1.25 / 0.75 = 5/6 on both lines; limit 5, H − Φ = 2.15.
    found = values(WORKSPACE, np.array([1.25]), np.array([1.25]))[:, 0]
    pulled = (25.0 - 25.0 / 36.0) * 0.75**2 / (25.0 * 2.0**2)
    assert found.tolist() == pytest.approx([0.5, 0.5, 1.0 - (0.75 / 2.15) ** 2, pulled, pulled])


def test_condition_is_zero_at_its_limit() -> None:
    # T_b = ½ b/h = 5 at u = 1: h² = 1/99.
    length = (1.0 + 1.0 / 99.0) ** 0.5
    # u = 0 where c² = b² + W², u = W where b² = c² + W².
    found = values(WORKSPACE, np.array([length, 1.5, 2.5]), np.array([length, 2.5, 1.5]))
    assert found[3:, 0].tolist() == pytest.approx([0.0, 0.0], abs=1e-15)
    assert (found[0, 1], found[1, 2]) == pytest.approx((0.0, 0.0), abs=1e-15)


def test_the_coefficients_of_chords_give_the_values_along_them() -> None:
    knots = np.array([(0.1, 1.0, 1.9), (0.4, 1.7, 1.2), (0.4, 2.2, 2.2), (0.0, 0.7, 1.4)])
    coefficients = along(WORKSPACE, knots)
    assert coefficients.shape == (7, 5, 3)
    for t in (0.0, 0.123, 0.5, 0.77, 1.0):
        basis = np.array([comb(6, i) * t**i * (1.0 - t) ** (6 - i) for i in range(7)])
        places = knots[:-1] + t * np.diff(knots, axis=0)
        assert np.tensordot(basis, coefficients, 1) == pytest.approx(
            values(WORKSPACE, places[:, 1], places[:, 2]), abs=1e-13
        )


def test_a_dip_between_two_good_ends_is_found() -> None:
    # (t − ½)² − 1/100 is negative only for 0.4 < t < 0.6.
    assert falling(chord((0.24, -1.0, 1.0))) == [0]


def test_narrow_dip_next_to_a_third_is_found() -> None:
    # (t − ⅓)² − 10⁻⁸: about 2·10⁻⁴ wide, far narrower than any sampling grid.
    assert falling(chord((1 / 9 - 1e-8, -2 / 3, 1.0))) == [0]


def test_a_polynomial_with_a_negative_coefficient_can_still_be_positive() -> None:
    # (t − ½)² + 0.01.
    positive = chord((0.26, -1.0, 1.0))
    assert positive.min() < 0.0
    assert falling(positive) == []


def test_a_condition_that_is_broken_at_an_end_may_not_be_broken_further() -> None:
    rising, sagging = (-1e-3, 1.0), (-1e-3, -0.5, 1.5)
    assert falling(chord(rising)) == []
    assert falling(chord(sagging)) == [0]


def test_touching_the_bound_is_within_rounding() -> None:
    assert falling(chord((1 / 9, -2 / 3, 1.0))) == []


def test_only_the_chords_that_fall_are_named_in_order() -> None:
    good, bad = chord(), chord((1.0,), (0.24, -1.0, 1.0))
    late = chord((1.0,), (1.0,), (1.0,), (1.0,), (0.24, -1.0, 1.0))
    assert falling(np.concatenate((good, late, good, bad, bad), axis=2)) == [1, 3, 4]
