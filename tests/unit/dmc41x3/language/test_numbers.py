from __future__ import annotations

from fractions import Fraction

import pytest

from dmc41x3.language import numbers
from dmc41x3.language.numbers import format_value, parse_fixed, parse_number


@pytest.mark.parametrize(
    ("value", "raw"),
    [
        (1, 65536),
        (-1, -65536),
        (0.1, 6553),
        (-0.1, -6553),
        (Fraction(1, 65536), 1),
        (1e300, numbers.RAW_MAX),
        (float("inf"), numbers.RAW_MAX),
        (float("-inf"), numbers.RAW_MIN),
        (-(2**31), numbers.RAW_MIN),
        (2**31, numbers.RAW_MAX),
    ],
)
def test_fixed_truncates_towards_zero_and_saturates(value: float, raw: int) -> None:
    assert numbers.fixed(value) == raw


def test_nan_has_no_fixed_form() -> None:
    with pytest.raises(ValueError, match="NaN"):
        numbers.fixed(float("nan"))


@pytest.mark.parametrize(("value", "inside"), [(2**31 - 1, True), (2**31, False), (-(2**31), True)])
def test_fits_is_the_range_of_32_integer_bits(value: int, inside: bool) -> None:
    assert numbers.fits(value) is inside


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("5", 5.0),
        ("-12.5", -12.5),
        (" 200", 200.0),
        (".5", 0.5),
        ("5.", 5.0),
        ("$FF", 255.0),
        ("$FFFFFFFF", -1.0),
        ("-$10", -16.0),
        ("$0.8", 0.5),
        ("$7FFFFFFF.FFFF", 2147483647.9999847),
    ],
)
def test_literals(text: str, value: float) -> None:
    assert parse_number(text) == value
    assert parse_fixed(text) == numbers.fixed(value)


@pytest.mark.parametrize("text", ["", "x", "1e5", "1/2", "1,2", "$", "$123456789", "- 1", "nan", "١"])
def test_invalid_number_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="not a number"):
        parse_number(text)


def test_the_most_negative_hexadecimal_negated_saturates() -> None:
    assert parse_fixed("-$80000000") == numbers.RAW_MAX


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1, " 1.0000"),
        (0, " 0.0000"),
        (-12.5, "-12.5000"),
        (Fraction("12345678.9101"), " 12345678.9101"),
        (9.9982, " 9.9982"),
        (1234.5678, " 1234.5678"),
        (-0.00001, " 0.0000"),
        (2**31, " 2147483647.9999"),
        (-(2**31), "-2147483648.0000"),
    ],
)
def test_values_as_mg_prints_them(value: float, text: str) -> None:
    assert format_value(value) == text


@pytest.mark.parametrize(
    ("before", "after", "text"), [(3, 2, " 999.99"), (4, 2, " 1234.53"), (0, 4, " .9999"), (10, 0, " 1235")]
)
def test_too_few_digits_print_the_largest_they_can_show(before: int, after: int, text: str) -> None:
    assert format_value(1234.53, before, after) == text


def test_leading_zeros_fill_the_digits_before_the_point() -> None:
    assert format_value(5, 4, 2, leading_zeros=True) == " 0005.00"


@pytest.mark.parametrize(
    ("value", "before", "after", "text"),
    [(8, 4, 0, "$0008"), (-2, 4, 0, "$FFFE"), (2**31 - 1, 8, 4, "$7FFFFFFF.0000"), (70000, 4, 0, "$FFFF")],
)
def test_hexadecimal_is_the_twos_complement(value: int, before: int, after: int, text: str) -> None:
    assert format_value(value, before, after, leading_zeros=True, hex=True) == text


def test_replies_for_several_axes() -> None:
    positions = [format_value(x, 10, 0) for x in (200, -10, 0, -110)]
    assert numbers.join_positions(positions) == " 200, -10, 0, -110"
