from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.expressions import ONE, Rejection, evaluate, is_name, pack, unpack, wrap


class _Scope:
    def variable(self, name: str) -> int:
        if name != "v":
            raise Rejection(ErrorCode.VARIABLE_ERROR)
        return 7 * ONE

    def operand(self, name: str) -> int:
        return {"TPA": -3 * ONE, "TIME": 1024 * ONE}[name]

    def element(self, name: str, index: int) -> int:
        raise Rejection(ErrorCode.BAD_FUNCTION)

    def bank(self, function: str, bit: int) -> int:
        return ONE * bit if function == "IN" else 0


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1+2*3", 9.0),
        ("1+(2*3)", 7.0),
        ("2-3-4", -5.0),
        ("-v+1", -6.0),
        ("10/4", 2.5),
        ("-10/4", -2.5),
        ("7%4", 3.0),
        ("$FF.8", 255.5),
        ("$FFFFFFFF", -1.0),
        ("v=7", 1.0),
        ("v<>7", 0.0),
        ("(v>6)&(v<8)", 1.0),
        ("12|3", 15.0),
        ("v<=7", 1.0),
        ("v >= 8", 0.0),
        ("_TPA*2", -6.0),
        ("TIME", 1024.0),
        ("@SIN[30]", 0.5),
        ("@COS[60]", 0.5),
        ("@ATAN[1]", 45.0),
        ("@ASIN[1]", 90.0),
        ("@ACOS[1]", 0.0),
        ("@TAN[45]", 1.0),
        ("@SQR[-9]", 3.0),
        ("@ABS[_TPA]", 3.0),
        ("@INT[-2.7]", -2.0),
        ("@FRAC[-2.5]", -0.5),
        ("@RND[-2.5]", -2.0),
        ("@RND[2.5]", 3.0),
        ("@RND[5.5]", 6.0),  # both halves of 5.5 as in Galil's command reference
        ("@RND[-5.5]", -5.0),
        ("@RND[-5.7]", -6.0),
        ("@COM[0]", -1.0),
        ("@IN[@INT[3.9]]", 3.0),
        (".5+2.", 2.5),
    ],
)
def test_values(text: str, value: float) -> None:
    assert evaluate(text, _Scope()) / ONE == value


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", ErrorCode.NOT_ENOUGH_FIELDS),
        ("?", ErrorCode.QUESTION_MARK_INVALID),
        ("1+ ?", ErrorCode.QUESTION_MARK_INVALID),
        ('"open', ErrorCode.BAD_STRING),
        ("arr[]", ErrorCode.INDEX_OUT_OF_RANGE),
        ("1+", ErrorCode.OPERAND_ERROR),
        ("1 2", ErrorCode.OPERAND_ERROR),
        ("(1+2", ErrorCode.PARENTHESES),
        ("1+2)", ErrorCode.PARENTHESES),
        ("@SIN 30", ErrorCode.MISSING_BRACKET),
        ("@SIN[30", ErrorCode.MISSING_BRACKET),
        ("@FOO[1]", ErrorCode.BAD_FUNCTION),
        ("arr[0]", ErrorCode.BAD_FUNCTION),
        ("1/0", ErrorCode.OUT_OF_RANGE),
        ("1%0", ErrorCode.OUT_OF_RANGE),
        ("@ASIN[2]", ErrorCode.OUT_OF_RANGE),
        ("2147483648", ErrorCode.OUT_OF_RANGE),
        ("unknown", ErrorCode.VARIABLE_ERROR),
        ('"toolong"', ErrorCode.BAD_STRING),
        ("(" * 200, ErrorCode.PARENTHESES),
    ],
)
def test_error_has_its_code(text: str, code: ErrorCode) -> None:
    with pytest.raises(Rejection) as refused:
        evaluate(text, _Scope())
    assert refused.value.code is code


@given(st.integers(-(2**31), 2**31 - 1), st.integers(-(2**31), 2**31 - 1))
def test_sums_wrap_at_the_ends_of_the_range(a: int, b: int) -> None:
    value = evaluate(f"{a}+({b})", _Scope()) // ONE
    assert (value - a - b) % 2**32 == 0
    assert -(2**31) <= value < 2**31


@given(st.fractions(-1000, 1000), st.fractions(-1000, 1000))
def test_products_are_truncated_towards_zero(x: float, y: float) -> None:
    a, b = int(x * ONE), int(y * ONE)
    product = evaluate(f"{_literal(a)}*({_literal(b)})", _Scope())
    assert abs(product) == abs(a) * abs(b) // ONE
    assert product == 0 or (product < 0) == ((a < 0) != (b < 0))


def _literal(raw: int) -> str:
    bits = raw % 2**48
    return f"${bits >> 16:X}.{bits & 0xFFFF:04X}"


@given(st.text(alphabet=st.characters(min_codepoint=33, max_codepoint=126), max_size=6))
def test_strings_live_in_the_bytes_of_a_number(text: str) -> None:
    assert unpack(pack(text)) == text
    assert wrap(pack(text)) == pack(text)


@given(st.text(max_size=90))
def test_any_text_has_a_value_or_a_code(text: str) -> None:
    try:
        value = evaluate(text, _Loose())
    except Rejection:
        return
    assert -(2**47) <= value < 2**47


class _Loose(_Scope):
    def operand(self, name: str) -> int:
        return 0


def test_names_have_eight_characters_and_begin_with_a_letter() -> None:
    assert is_name("mayahome")
    assert is_name("a1")
    assert not is_name("toolongname")
    assert not is_name("1a")
    assert not is_name("")
