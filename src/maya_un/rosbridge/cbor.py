"""Plain data as CBOR (RFC 8949): what `compression` cbor and cbor-raw send."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any, NamedTuple


class Tagged(NamedTuple):
    """Bytes with a tag that says what they are: an array of numbers (RFC 8746)."""

    tag: int
    content: bytes


def encoded(value: Any) -> bytes:
    """Return a value of None, booleans, numbers, texts, bytes, lists, mappings and what is `Tagged`."""
    out = bytearray()
    _put(value, out)
    return bytes(out)


def _head(major: int, number: int, out: bytearray) -> None:
    if number < 24:
        out.append(major << 5 | number)
        return
    for size, (extra, form) in enumerate(((1, ">B"), (2, ">H"), (4, ">I"), (8, ">Q"))):
        if number < 1 << 8 * extra:
            out.append(major << 5 | 24 + size)
            out += struct.pack(form, number)
            return
    raise ValueError("a whole number beyond 64 bits")


def _put(value: Any, out: bytearray) -> None:
    putter = _PUTTERS.get(type(value))
    if putter is None:
        raise TypeError(f"{type(value).__name__} has no form in CBOR")
    putter(value, out)


def _whole(value: int, out: bytearray) -> None:
    if value < 0:
        _head(1, -1 - value, out)
    else:
        _head(0, value, out)


def _real(value: float, out: bytearray) -> None:
    out.append(0xFB)
    out += struct.pack(">d", value)


def _text(value: str, out: bytearray) -> None:
    content = value.encode("utf-8", "surrogatepass")
    _head(3, len(content), out)
    out += content


def _bytes(value: bytes, out: bytearray) -> None:
    _head(2, len(value), out)
    out += value


def _list(value: list[Any], out: bytearray) -> None:
    _head(4, len(value), out)
    for one in value:
        _put(one, out)


def _mapping(value: dict[Any, Any], out: bytearray) -> None:
    _head(5, len(value), out)
    for key, one in value.items():
        _put(key, out)
        _put(one, out)


def _tagged(value: Tagged, out: bytearray) -> None:
    _head(6, value.tag, out)
    _bytes(value.content, out)


def _simple(value: bool | None, out: bytearray) -> None:
    out.append(0xF6 if value is None else 0xF5 if value else 0xF4)


_PUTTERS: dict[type, Callable[[Any, bytearray], None]] = {
    bool: _simple,
    type(None): _simple,
    int: _whole,
    float: _real,
    str: _text,
    bytes: _bytes,
    list: _list,
    dict: _mapping,
    Tagged: _tagged,
}
