"""All types of the graph: checked messages, their bytes in ROS 1, their text and md5 sums."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from functools import cache
from hashlib import md5
from typing import Any

from maya_ros.graph.catalogue import ANY, SCALAR, Field, Spec, halves, is_base, kinds, services, spec
from maya_ros.graph.protocol import Message
from maya_ros.graph.validation import NOW, Mismatch, converter
from maya_un.errors import InvalidMessage, UnknownInterface

Writer = Callable[[bytearray, Any], None]
"""Appends a value to bytes."""

_CODES = {
    "bool": "?", "int8": "b", "byte": "b", "uint8": "B", "char": "B", "int16": "h", "uint16": "H", "int32": "i",
    "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
_LENGTH = struct.Struct("<I")
_STAMP_FORMATS = {"time": struct.Struct("<II"), "duration": struct.Struct("<ii")}


@cache
def writer(kind: str) -> Writer:
    """Return the writer of complete, checked values of a type; raises `UnknownInterface`."""
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
    if kind in _STAMP_FORMATS:
        return _stamp(_STAMP_FORMATS[kind])
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


__all__ = [
    "action_of", "conform", "default", "details", "fields", "halves", "kinds", "known", "md5sum", "serialize",
    "service_md5sum", "service_text", "services", "text",
]  # fmt: skip

_HEADER = Field("header", "std_msgs/Header")
_RULE = "=" * 80
_STAMPS = {base: Spec(base, (), (Field("secs", "int32"), Field("nsecs", "int32"))) for base in ("time", "duration")}


def known(kind: str) -> bool:
    """Return whether a message of this type exists."""
    try:
        spec(kind)
    except UnknownInterface:
        return False
    return True


def default(kind: str) -> Message:
    """Return the default message of a type: zeros, empty texts and arrays. Raises `UnknownInterface`."""
    return converter(_message(kind))({})


def conform(kind: str, data: object, *, stamp: Mapping[str, int] | None = None) -> Message:
    """Return a message of a type made of `data`, which stays unchanged; missing fields get their defaults.

    `stamp` {"secs", "nsecs"} is the time of a header without one, and of a time that is the word "now", as in
    rosbridge. Null is NaN, and arrays of bytes may be base64. Raises `InvalidMessage` with the field that does not fit,
    and `UnknownInterface`.
    """
    before = NOW.set(stamp)
    try:
        message: Message = converter(_message(kind))(data)
    except Mismatch as misfit:
        name = f"{misfit.path} of {kind}" if misfit.path else kind
        raise InvalidMessage(name=name, reason=misfit.reason) from None
    finally:
        NOW.reset(before)
    if stamp is not None and stamped(kind) and not says_when(data):
        message["header"]["stamp"] = dict(stamp)
    return message


def serialize(kind: str, message: Message) -> bytes:
    """Return the bytes that ROS 1 sends for a complete message, as `conform` returns it."""
    out = bytearray()
    writer(_message(kind))(out, message)
    return bytes(out)


def fields(kind: str) -> tuple[str, ...]:
    """Return the names of the fields of a type, in order; raises `UnknownInterface`."""
    return tuple(field.name for field in spec(kind).fields)


def action_of(kind: str) -> str:
    """Return the action whose sent goal has this type ("...ActionGoal"), "" for other types."""
    action = kind.removesuffix("ActionGoal")
    return action if action != kind and known(action + "ActionResult") else ""


@cache
def md5sum(kind: str) -> str:
    """Return the md5 sum that identifies a message type in ROS 1; raises `UnknownInterface`."""
    return md5(_summed(spec(kind)).encode(), usedforsecurity=False).hexdigest()


@cache
def service_md5sum(service: str) -> str:
    """Return the md5 sum that identifies a service type in ROS 1; raises `UnknownInterface`."""
    whole = "".join(_summed(spec(half)) for half in halves(service))
    return md5(whole.encode(), usedforsecurity=False).hexdigest()


@cache
def text(kind: str) -> str:
    """Return the definition of a type, followed by those of all types in it, as ROS 1 stores them in bags."""
    first, *others = _within(kind)
    return _text(first) + "".join(f"{_RULE}\nMSG: {one.name}\n{_text(one)}" for one in others)


def service_text(service: str) -> str:
    """Return the definition of a service type."""
    return "---\n".join(_text(spec(half)) for half in halves(service))


@cache
def details(kind: str) -> tuple[Message, ...]:
    """Return a type and all types in it as rosapi/TypeDef; raises `UnknownInterface`.

    Of the base types, only times and durations have fields.
    """
    if is_base(kind):
        converter(kind)
        return (_details(_STAMPS[kind]),) if kind in _STAMPS else ()
    found: list[Message] = [_details(one) for one in _within(kind)]
    for base, stamp in _STAMPS.items():
        if any(field.type == base for one in _within(kind) for field in one.fields):
            found.append(_details(stamp))
    return tuple(found)


def _message(kind: str) -> str:
    if is_base(kind):
        raise UnknownInterface(form="type", name=kind)
    return kind


@cache
def stamped(kind: str) -> bool:
    """Return whether messages of a type begin with a header; raises `UnknownInterface`."""
    return _HEADER in spec(kind).fields


def says_when(data: object) -> bool:
    """Return whether the header of a message contains a time."""
    header = data.get("header") if isinstance(data, Mapping) else None
    return isinstance(header, Mapping) and "stamp" in header


def _within(kind: str) -> list[Spec]:
    """Return a type and all types in it, each once, outer ones first."""
    found: dict[str, Spec] = {}
    left = [kind]
    while left:
        one = spec(left.pop(0))
        if one.name not in found:
            found[one.name] = one
            left += [field.type for field in one.fields if not is_base(field.type)]
    return list(found.values())


def _text(one: Spec) -> str:
    lines = [f"{constant.type} {constant.name}={constant.value}" for constant in one.constants]
    lines += [f"{field.written} {field.name}" for field in one.fields]
    return "".join(line + "\n" for line in lines)


def _summed(one: Spec) -> str:
    """Return the text of which a type's md5 sum is made: it contains the sums of the types in it (wiki.ros.org/msg)."""
    lines = [f"{constant.type} {constant.name}={constant.value}" for constant in one.constants]
    for field in one.fields:
        lines.append(f"{field.written if is_base(field.type) else md5sum(field.type)} {field.name}")
    return "\n".join(lines)


def _details(one: Spec) -> Message:
    return {
        "type": one.name,
        "fieldnames": [field.name for field in one.fields],
        "fieldtypes": [field.type for field in one.fields],
        "fieldarraylen": [field.length for field in one.fields],
        "examples": [_example(field) for field in one.fields],
        "constnames": [constant.name for constant in one.constants],
        "constvalues": [str(constant.value) for constant in one.constants],
    }


def _example(field: Field) -> str:
    if field.length != SCALAR:
        return "[]"
    if not is_base(field.type) or field.type in {"time", "duration"}:
        return "{}"
    example: Any = converter(field.type)({"string": "", "bool": False}.get(field.type, 0))
    return str(example)
