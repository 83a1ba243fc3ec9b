"""CBOR, by the examples of the standard (RFC 8949, appendix A)."""

from __future__ import annotations

import struct
from typing import Any

import pytest

from maya_un.rosbridge.cbor import Tagged, encoded

EXAMPLES: list[tuple[Any, str]] = [
    (0, "00"),
    (1, "01"),
    (10, "0a"),
    (23, "17"),
    (24, "1818"),
    (100, "1864"),
    (1000, "1903e8"),
    (1000000, "1a000f4240"),
    (1000000000000, "1b000000e8d4a51000"),
    (18446744073709551615, "1bffffffffffffffff"),
    (-18446744073709551616, "3bffffffffffffffff"),
    (-1, "20"),
    (-10, "29"),
    (-100, "3863"),
    (-1000, "3903e7"),
    (1.1, "fb3ff199999999999a"),
    (-4.1, "fbc010666666666666"),
    (1.0e300, "fb7e37e43c8800759c"),
    (False, "f4"),
    (True, "f5"),
    (None, "f6"),
    (b"", "40"),
    (b"\x01\x02\x03\x04", "4401020304"),
    ("", "60"),
    ("IETF", "6449455446"),
    ('"\\', "62225c"),
    ("ü", "62c3bc"),
    ("水", "63e6b0b4"),
    ([], "80"),
    ([1, 2, 3], "83010203"),
    ([1, [2, 3], [4, 5]], "8301820203820405"),
    (list(range(1, 26)), "98190102030405060708090a0b0c0d0e0f101112131415161718181819"),
    ({}, "a0"),
    ({"a": 1, "b": [2, 3]}, "a26161016162820203"),
    (["a", {"b": "c"}], "826161a161626163"),
]


@pytest.mark.parametrize(("value", "written"), EXAMPLES, ids=[written for _, written in EXAMPLES])
def test_the_examples_of_the_standard(value: Any, written: str) -> None:
    assert encoded(value).hex() == written


def test_an_array_of_numbers_is_bytes_with_a_tag() -> None:
    packed = struct.pack("<2d", 1.0, -2.0)
    assert encoded(Tagged(86, packed)) == b"\xd8\x56\x50" + packed


@pytest.mark.parametrize("value", [object(), 2**64, -(2**64) - 1, {1, 2}])
def test_what_has_no_form_is_an_error(value: Any) -> None:
    with pytest.raises((TypeError, ValueError)):
        encoded(value)
