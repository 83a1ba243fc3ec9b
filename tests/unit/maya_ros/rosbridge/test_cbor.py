"""CBOR, by the examples of the standard (RFC 8949, appendix A) and the tags of its arrays of numbers (RFC 8746)."""

from __future__ import annotations

import struct
from math import inf, nan
from typing import Any

import pytest
from cbor2 import dumps

from maya_ros.rosbridge.outgoing import MessageFormat, Outgoing
from tests.rosbridge_clients import DATE, unframed

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
def test_the_library_writes_the_examples_of_the_standard(value: Any, written: str) -> None:
    assert dumps(value).hex() == written


def sent(kind: str, data: object) -> bytes:
    """Return the CBOR of a message with the field `data`, without the names before it."""
    ((opcode, content),) = unframed(Outgoing(kind, {"data": data}, DATE).frames(MessageFormat("/t", "cbor")))
    names = b"\xa3\x62op\x67publish\x65topic\x62/t\x63msg\xa1\x64data"
    assert opcode == 2
    assert content.startswith(names)
    return content.removeprefix(names)


@pytest.mark.parametrize(
    ("kind", "data", "written"),
    [
        ("UInt64", 18446744073709551615, "1bffffffffffffffff"),
        ("Int64", -1000, "3903e7"),
        ("Int64", -(2**63), "3b7fffffffffffffff"),
        ("Float64", 1.1, "fb3ff199999999999a"),
        ("Float32", 1.0, "fb3ff0000000000000"),
        ("Float64", nan, "f97e00"),
        ("Float64", inf, "f97c00"),
        ("Float64", -inf, "f9fc00"),
        ("Bool", True, "f5"),
        ("String", "水", "63e6b0b4"),
        ("Time", {"secs": 1, "nsecs": 1000000}, "a264736563730165" + b"nsecs".hex() + "1a000f4240"),
    ],
)
def test_a_message_is_written_as_the_standard_says(kind: str, data: object, written: str) -> None:
    assert sent(f"std_msgs/{kind}", data).hex() == written


@pytest.mark.parametrize(
    ("kind", "tag", "form"),
    [
        ("UInt16", 69, "<3H"),
        ("UInt32", 70, "<3I"),
        ("UInt64", 71, "<3Q"),
        ("Int8", 72, "<3b"),
        ("Int16", 77, "<3h"),
        ("Int32", 78, "<3i"),
        ("Int64", 79, "<3q"),
        ("Float32", 85, "<3f"),
        ("Float64", 86, "<3d"),
    ],
)
def test_an_array_of_numbers_is_bytes_with_a_tag(kind: str, tag: int, form: str) -> None:
    numbers = [1, 2, 100]
    packed = struct.pack(form, *numbers)
    size = bytes([0x40 + len(packed)]) if len(packed) < 24 else bytes([0x58, len(packed)])
    assert sent(f"std_msgs/{kind}MultiArray", numbers) == bytes([0xD8, tag]) + size + packed


def test_an_array_of_bytes_is_bytes() -> None:
    assert sent("std_msgs/UInt8MultiArray", [1, 2, 255]) == b"\x43\x01\x02\xff"
