from __future__ import annotations

import pytest

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.expressions import Rejection, axes_and_planes, axis_place, by_axis, mask, split


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("", [""]),
        ("1,2", ["1", "2"]),
        (" 1 , ,3 ", ["1", "", "3"]),
        ("(1,2),3", ["(1,2)", "3"]),
        ("a[1,2],b", ["a[1,2]", "b"]),
        ('"a,b",c', ['"a,b"', "c"]),
        ('"(",1,")"', ['"("', "1", '")"']),
        ("(1),2)", ["(1)", "2)"]),
        ("((1,2),3", ["((1,2),3"]),
        ('"a,b', ['"a,b']),
    ],
)
def test_arguments_part_outside_brackets_and_quotes(text: str, parts: list[str]) -> None:
    assert split(text) == parts


@pytest.mark.parametrize(
    ("text", "given"),
    [
        ("1,,3", [(0, "1"), (2, "3")]),
        (",?", [(1, "?")]),
        ("B=5", [(1, "5")]),
        ("Y=5", [(1, "5")]),
        (" C = v+1 ", [(2, "v+1")]),
        ("*=0", [(0, "0"), (1, "0"), (2, "0")]),
        ("(1=1),2", [(0, "(1=1)"), (1, "2")]),
        ("v=1", [(0, "v=1")]),
    ],
)
def test_arguments_belong_to_axes(text: str, given: list[tuple[int, str]]) -> None:
    assert by_axis(text, "ABC") == given


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", ErrorCode.NOT_ENOUGH_FIELDS),
        (",,", ErrorCode.NOT_ENOUGH_FIELDS),
        ("A=", ErrorCode.NOT_ENOUGH_FIELDS),
        ("*=", ErrorCode.NOT_ENOUGH_FIELDS),
        (",,,4", ErrorCode.OPERAND_ERROR),
        ("D=1", ErrorCode.INVALID_AXIS),
        ("W=1", ErrorCode.INVALID_AXIS),
        ("S=1", ErrorCode.S_OPERAND_INVALID),
    ],
)
def test_arguments_that_belong_to_no_axis(text: str, code: ErrorCode) -> None:
    with pytest.raises(Rejection) as refusal:
        by_axis(text, "ABC")
    assert refusal.value.code is code


@pytest.mark.parametrize(
    ("text", "places"), [("", [0, 1, 2]), ("CA", [0, 2]), ("A A", [0]), ("XZ", [0, 2]), (" B ", [1])]
)
def test_masks(text: str, places: list[int]) -> None:
    assert mask(text, "ABC") == places


@pytest.mark.parametrize(
    ("text", "code"),
    [("1", ErrorCode.OPERAND_ERROR), ("A,B", ErrorCode.OPERAND_ERROR), ("AD", ErrorCode.INVALID_AXIS)],
)
def test_invalid_mask(text: str, code: ErrorCode) -> None:
    with pytest.raises(Rejection) as refusal:
        mask(text, "ABC")
    assert refusal.value.code is code


@pytest.mark.parametrize(
    ("text", "found"),
    [("", ([], [])), ("S", ([], ["S"])), ("ATS", ([0], ["S", "T"])), ("B", ([1], [])), ("S S", ([], ["S"]))],
)
def test_axes_and_planes_of_one_mask(text: str, found: tuple[list[int], list[str]]) -> None:
    assert axes_and_planes(text, "ABC") == found


def test_w_is_another_name_of_d() -> None:
    assert axis_place("W", "ABCD") == 3
