"""Polynomials whose course is known, and the proof that must neither miss a dip nor invent one."""

from __future__ import annotations

import pytest

from maya_un.motion.bernstein import falls_below, product, raised, value

T = (0.0, 1.0)
ONE_LESS_T = (1.0, 0.0)


def test_scaled_coefficients_give_the_value() -> None:
    assert value((2.0, 5.0), 0.25) == pytest.approx(2.75)


def test_a_product_is_the_product_of_values() -> None:
    p, q = (1.0, -4.0, 3.0), (2.0, 0.5)
    assert value(product(p, q), 0.3) == pytest.approx(value(p, 0.3) * value(q, 0.3))


def test_raising_the_degree_changes_no_value() -> None:
    p = (1.0, -4.0, 3.0)
    assert len(raised(p)) == 5
    assert value(raised(p), 0.7) == pytest.approx(value(p, 0.7))


def test_a_dip_between_two_good_ends_is_found() -> None:
    # (t − ½)² − 1/100 is negative only for 0.4 < t < 0.6.
    dip = [one - two for one, two in zip(product((-0.5, 0.5), (-0.5, 0.5)), (0.01, 0.02, 0.01), strict=True)]
    t = falls_below(dip, 0.0)
    assert t is not None
    assert 0.4 < t < 0.6


def test_a_narrow_dip_beside_a_third_is_found() -> None:
    # (t − ⅓)² − 10⁻⁸: about 2·10⁻⁴ wide, far narrower than any sampling grid.
    third = (-1 / 3, 2 / 3)
    dip = [one - two for one, two in zip(product(third, third), (1e-8, 2e-8, 1e-8), strict=True)]
    t = falls_below(dip, 0.0)
    assert t == pytest.approx(1 / 3, abs=2e-4)


def test_a_polynomial_with_a_negative_coefficient_can_still_be_positive() -> None:
    # (t − ½)² + 0.01: its middle coefficient is negative, its values are not.
    p = [one + two for one, two in zip(product((-0.5, 0.5), (-0.5, 0.5)), (0.01, 0.02, 0.01), strict=True)]
    assert p[1] < 0.0
    assert falls_below(p, 0.0) is None


@pytest.mark.parametrize(("p", "t"), [(T, 0.0), (ONE_LESS_T, 1.0)])
def test_a_bad_end_is_found(p: tuple[float, ...], t: float) -> None:
    assert falls_below(p, 0.1) == t


def test_what_touches_the_bound_where_halving_never_looks_is_refused() -> None:
    third = (-1 / 3, 2 / 3)
    assert falls_below(product(third, third), 1e-30) is not None
