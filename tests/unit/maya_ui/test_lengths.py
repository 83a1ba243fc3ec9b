from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from maya_ui.lengths import FARTHEST, NotALength, metres, millimetres, parsed


@pytest.mark.parametrize(
    ("text", "length"),
    [
        ("410", 0.41),
        (" 410,5 ", 0.4105),
        ("0.41 m", 0.41),
        ("41cm", 0.41),
        ("-3 MM", -0.003),
        (".5", 0.0005),
        ("5.", 0.005),
    ],
)
def test_a_length_is_read_in_millimetres_or_in_its_unit(text: str, length: float) -> None:
    assert parsed(text) == pytest.approx(length, abs=1e-12)


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("", "length_missing"),
        ("  ", "length_missing"),
        ("abc", "length_unreadable"),
        ("1e3", "length_unreadable"),
        ("nan", "length_unreadable"),
        ("1,000.0", "length_unreadable"),
        ("410 inch", "length_unreadable"),
        ("6 m", "length_too_long"),
        ("9" * 400, "length_too_long"),
    ],
)
def test_invalid_length_is_refused_with_the_reason(text: str, key: str) -> None:
    with pytest.raises(NotALength) as refusal:
        parsed(text)
    assert refusal.value.key == key


@given(st.floats(-FARTHEST, FARTHEST))
def test_shown_length_is_read_again_to_a_twentieth_of_a_millimetre(length: float) -> None:
    assert parsed(millimetres(length)) == pytest.approx(length, abs=5.1e-5)


def test_nothing_has_no_sign() -> None:
    assert millimetres(-1e-9) == "0.0"
    assert millimetres(-0.0001) == "-0.1"
    assert metres(0.41) == "0.4100 m"
