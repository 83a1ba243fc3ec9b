from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.expressions import FUNCTIONS, ONE, OPERATORS, Rejection, pack, unpack, whole, wrap

LARGEST, SMALLEST = 2**47 - 1, -(2**47)

raws = st.integers(SMALLEST, LARGEST)


@pytest.mark.parametrize(
    ("a", "operator", "b", "value"),
    [
        (LARGEST, "+", 1, SMALLEST),
        (SMALLEST, "-", 1, LARGEST),
        (SMALLEST, "/", -ONE, SMALLEST),
        (LARGEST, "*", 2 * ONE, -2),
        (1, "*", 1, 0),
        (-1, "*", ONE - 1, 0),
        (1, "/", 3 * ONE, 0),
        (-7 * ONE, "%", 3 * ONE, -ONE),
        (7 * ONE, "%", -3 * ONE, ONE),
        (-1, "&", ONE - 1, ONE - 1),
        (SMALLEST, "|", LARGEST, -1),
    ],
)
def test_results_at_the_ends_of_the_range(a: int, operator: str, b: int, value: int) -> None:
    assert OPERATORS[operator](a, b) == value


def test_value_without_a_positive_counterpart_keeps_its_sign() -> None:
    assert FUNCTIONS["ABS"](SMALLEST) == SMALLEST
    assert FUNCTIONS["RND"](LARGEST) == SMALLEST


@given(raws, raws.filter(bool))
def test_quotient_and_remainder_belong_together(a: int, b: int) -> None:
    remainder = OPERATORS["%"](a, b)
    assert (a - remainder) % b == 0
    assert abs(remainder) < abs(b)
    assert remainder == 0 or (remainder < 0) == (a < 0)


@given(raws, raws, st.sampled_from(sorted(set(OPERATORS) - {"/", "%"})))
def test_every_result_is_in_range(a: int, b: int, operator: str) -> None:
    assert SMALLEST <= OPERATORS[operator](a, b) <= LARGEST


@given(raws, st.sampled_from(sorted(FUNCTIONS)))
def test_a_function_has_a_value_in_range_or_is_refused(a: int, name: str) -> None:
    try:
        value = FUNCTIONS[name](a)
    except Rejection as refused:
        assert refused.code is ErrorCode.OUT_OF_RANGE
        assert name in {"ASIN", "ACOS", "TAN", "REAL"}
        return
    assert SMALLEST <= value <= LARGEST


@given(st.integers(-(2**31), 2**31 - 1))
def test_a_whole_turn_more_changes_nothing(degrees: int) -> None:
    for name in ("SIN", "COS"):
        assert FUNCTIONS[name](degrees * ONE) == FUNCTIONS[name](degrees % 360 * ONE)


@pytest.mark.parametrize("name", ["TAN", "ASIN"])
@pytest.mark.parametrize("degrees", [90, -90, 270])
def test_undefined_values_of_functions(name: str, degrees: int) -> None:
    with pytest.raises(Rejection):
        FUNCTIONS[name](degrees * ONE)


def test_tangent_is_large_one_step_from_the_pole() -> None:
    # tan(90° - x) = 1/x for a small x, here 1/65536 degree = 2.6632e-7 rad.
    assert FUNCTIONS["TAN"](90 * ONE - 1) / ONE == pytest.approx(3754936.206, abs=0.01)
    assert FUNCTIONS["TAN"](90 * ONE + 1) == -FUNCTIONS["TAN"](90 * ONE - 1)


@pytest.mark.parametrize(
    ("value", "bits"),
    [(1.0, 0x3F800000), (-2.0, 0xC0000000), (0.0, 0), (0.5, 0x3F000000), (16777217.0, 0x4B800000)],
)
def test_the_bits_of_a_single(value: float, bits: int) -> None:
    assert FUNCTIONS["FLOT"](int(value * ONE)) == wrap(bits * ONE)


@given(st.integers(-(2**23), 2**23))
def test_value_of_a_single_is_unchanged(raw: int) -> None:
    assert FUNCTIONS["REAL"](FUNCTIONS["FLOT"](raw)) == raw


@pytest.mark.parametrize("bits", [0x7F800000, 0xFF800000, 0x7FC00000, 0x4F000000, 0xCF000001])
def test_singles_outside_the_controllers_range(bits: int) -> None:
    with pytest.raises(Rejection):
        FUNCTIONS["REAL"](wrap(bits * ONE))


@given(raws)
def test_the_parts_of_a_number(raw: int) -> None:
    assert FUNCTIONS["INT"](raw) + FUNCTIONS["FRAC"](raw) == raw
    assert abs(FUNCTIONS["FRAC"](raw)) < ONE
    assert whole(raw) == int(raw / ONE)


@given(raws)
def test_the_complement_twice_is_the_whole_number(raw: int) -> None:
    assert FUNCTIONS["COM"](FUNCTIONS["COM"](raw)) == raw // ONE * ONE


@given(st.text(alphabet=st.characters(min_codepoint=33, max_codepoint=126), max_size=6))
def test_strings_live_in_the_bytes_of_a_number(text: str) -> None:
    assert unpack(pack(text)) == text
    assert wrap(pack(text)) == pack(text)


@given(st.text("abc", max_size=6), st.text("abc", max_size=6))
def test_strings_compare_by_the_alphabet(first: str, second: str) -> None:
    assert OPERATORS["<"](pack(first), pack(second)) == ONE * (first < second)


def test_a_string_too_long() -> None:
    with pytest.raises(Rejection) as refused:
        pack("seven!!")
    assert refused.value.code is ErrorCode.BAD_STRING
