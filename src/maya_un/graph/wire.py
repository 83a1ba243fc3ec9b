"""Messages as the bytes that ROS 1 sends (wiki.ros.org/msg, little-endian), for rosbridge's cbor-raw."""

from __future__ import annotations

import struct
from collections.abc import Callable
from functools import cache
from typing import Any

from maya_un.graph.catalogue import ANY, SCALAR, Field, is_base, spec

Writer = Callable[[bytearray, Any], None]
"""Appends a value to bytes."""

_CODES = {
    "bool": "?", "int8": "b", "byte": "b", "uint8": "B", "char": "B", "int16": "h", "uint16": "H", "int32": "i",
    "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
_LENGTH = struct.Struct("<I")
_STAMPS = {"time": struct.Struct("<II"), "duration": struct.Struct("<ii")}


@cache
def writer(kind: str) -> Writer:
    """Return what writes values of a type, whole and checked ones; raises `UnknownInterface`."""
    if is_base(kind):
        return _base(kind)
    fields = [(field.name, _of_field(field)) for field in spec(kind).fields]

    def write(out: bytearray, message: Any) -> None:
        for name, one in fields:
            one(out, message[name])

    return write


def _of_field(field: Field) -> Writer:
    if field.length == SCALAR:
        return writer(field.type)
    counted = field.length == ANY
    return _numbers(_CODES[field.type], counted) if field.type in _CODES else _array(writer(field.type), counted)


def _numbers(code: str, counted: bool) -> Writer:
    def write(out: bytearray, values: Any) -> None:
        if counted:
            out += _LENGTH.pack(len(values))
        out += struct.pack(f"<{len(values)}{code}", *values)

    return write


def _array(one: Writer, counted: bool) -> Writer:
    def write(out: bytearray, values: Any) -> None:
        if counted:
            out += _LENGTH.pack(len(values))
        for value in values:
            one(out, value)

    return write


def _base(kind: str) -> Writer:
    if kind == "string":
        return _string
    if kind in _STAMPS:
        return _stamp(_STAMPS[kind])
    packed = struct.Struct("<" + _CODES[kind])

    def write(out: bytearray, value: Any) -> None:
        out += packed.pack(value)

    return write


def _string(out: bytearray, value: Any) -> None:
    encoded = value.encode()
    out += _LENGTH.pack(len(encoded))
    out += encoded


def _stamp(packed: struct.Struct) -> Writer:
    def write(out: bytearray, value: Any) -> None:
        out += packed.pack(value["secs"], value["nsecs"])

    return write
