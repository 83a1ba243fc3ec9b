"""Arrays as bytes."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.errors import InvalidValue, UnexpectedReply
from dmc41x3.language import transfer
from dmc41x3.language.numbers import RAW_MAX, RAW_MIN, SCALE, parse_fixed

raws = st.integers(RAW_MIN, RAW_MAX)


def elements(data: bytes) -> list[str]:
    """Return the numbers of a download, as a controller reads them: separated by commas and line ends."""
    body = data.decode("ascii").split("\r", 1)[1].partition("\r\\")[0]
    return body.replace("\r", ",").split(",")


@given(st.lists(raws, min_size=1, max_size=50))
def test_a_controller_reads_every_number_exactly(values: list[int]) -> None:
    data = transfer.array_download("a", [raw / SCALE for raw in values])
    assert [parse_fixed(text) for text in elements(data)] == values
    assert max(map(len, data.split(b"\r"))) <= 80


def test_bytes_of_a_download() -> None:
    assert transfer.array_download("pos", [1, -2.5, 0], 3) == b"QD pos[],3,5\r1,-2.50000,0\r\\TC1\r"


def test_no_number_has_a_blank_or_an_exponent() -> None:
    (text,) = elements(transfer.array_download("a", [Fraction(1, SCALE)]))  # pyright: ignore[reportArgumentType]
    assert text == "0.00002"
    assert int(Fraction(text) * SCALE) == 1


@pytest.mark.parametrize("value", [2.0**31, -(2.0**31) - 1, float("inf"), float("nan")])
def test_a_number_out_of_range_is_refused(value: float) -> None:
    with pytest.raises(InvalidValue):
        transfer.array_download("a", [value])


@pytest.mark.parametrize("name", ["", "1a", "a[]", "toolongname", "a b", "a\r"])
def test_a_name_is_a_name(name: str) -> None:
    with pytest.raises(InvalidValue):
        transfer.array_length(name)


@pytest.mark.parametrize(("first", "count", "fits"), [(0, 5, True), (4, 1, True), (4, 2, False), (-1, 1, False)])
def test_invalid_array_is_refused(first: int, count: int, fits: bool) -> None:
    if fits:
        transfer.require_array_fit("a", first, count, 5.0)
        return
    with pytest.raises(InvalidValue, match="elements 0 to 4"):
        transfer.require_array_fit("a", first, count, 5.0)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        (" 1.0000\r 2.5000\r\n", [1.0, 2.5]),
        (" 9.0000, 0.0000, -0.5000\r\n", [9.0, 0.0, -0.5]),
        (" 1.0000\r\n 2.0000\r\n", [1.0, 2.0]),
        ("", []),
    ],
)
def test_upload_text(text: str, values: list[float]) -> None:
    assert transfer.parse_array("QU a[]", text) == values


def test_invalid_upload_is_refused() -> None:
    with pytest.raises(UnexpectedReply):
        transfer.parse_array("QU a[]", " 1.0000\rwhat\r\n")


def test_uploads_name_all_elements_or_a_part() -> None:
    assert transfer.array_upload("a") == "QU a[]"
    assert transfer.array_upload("a", 0, 4) == "QU a[],0,4"
