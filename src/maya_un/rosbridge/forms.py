"""Messages as rosbridge writes them: arrays of bytes as base64 in JSON, arrays of numbers packed in CBOR.

What a type needs is worked out once. Of types that are not ours to know, messages go out as they are.
"""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Callable
from functools import cache
from math import isfinite
from typing import Any

from maya_un.errors import UnknownInterface
from maya_un.graph.catalogue import SCALAR, Field, is_base, spec
from maya_un.graph.conforming import BYTES
from maya_un.graph.protocol import Message

Form = Callable[[Any], Any]

_PACKED = {
    "uint16": (69, "H"), "uint32": (70, "I"), "uint64": (71, "Q"), "int8": (72, "b"), "byte": (72, "b"),
    "int16": (77, "h"), "int32": (78, "i"), "int64": (79, "q"), "float32": (85, "f"), "float64": (86, "d"),
}  # fmt: skip
"""The tag of an array of numbers, little-endian (RFC 8746), and how it is packed."""

_encoder = json.JSONEncoder(ensure_ascii=False, check_circular=False, allow_nan=False, separators=(",", ":"))


def as_json(kind: str, message: Message) -> str:
    """Return a message of a type as JSON; what is no number in JSON (NaN, infinity) is null."""
    form = _json_form(kind)
    return text_of(message if form is None else form(message))


def text_of(value: Any) -> str:
    """Return plain data as JSON, with null for what is no number there."""
    try:
        return _encoder.encode(value)
    except ValueError:
        return _encoder.encode(_finite(value))


def as_plain(kind: str, message: Message) -> Message:
    """Return what `as_json` writes, not yet written."""
    form = _json_form(kind)
    return message if form is None else form(message)


def as_cbor(kind: str, message: Message) -> Any:
    """Return what goes into CBOR of a message."""
    form = _cbor_form(kind)
    return message if form is None else form(message)


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_finite(one) for one in value]
    return value


@cache
def _json_form(kind: str) -> Form | None:
    return _form(kind, _json_field)


@cache
def _cbor_form(kind: str) -> Form | None:
    return _form(kind, _cbor_field)


def _form(kind: str, of_field: Callable[[Field], Form | None]) -> Form | None:
    """Return what changes the fields of a message that need it, None where none does."""
    try:
        fields = spec(kind).fields
    except UnknownInterface:
        return None
    changed = [(field.name, form) for field in fields if (form := of_field(field)) is not None]
    if not changed:
        return None
    return lambda message: {**message, **{name: form(message[name]) for name, form in changed}}


def _json_field(field: Field) -> Form | None:
    if field.length != SCALAR and field.type in BYTES:
        return lambda values: base64.b64encode(bytes(values)).decode()
    return None if is_base(field.type) else _each(_json_form(field.type), field)


def _cbor_field(field: Field) -> Form | None:
    if field.length != SCALAR and field.type in BYTES:
        return bytes
    if field.length != SCALAR and field.type in _PACKED:
        from cbor2 import CBORTag  # noqa: PLC0415 - few clients ask for CBOR

        tag, code = _PACKED[field.type]
        return lambda values: CBORTag(tag, struct.pack(f"<{len(values)}{code}", *values))
    return None if is_base(field.type) else _each(_cbor_form(field.type), field)


def _each(form: Form | None, field: Field) -> Form | None:
    if form is None or field.length == SCALAR:
        return form
    return lambda values: [form(value) for value in values]
