"""Messages as JSON: `State`, `Event` and everything in this package. Points are [x, y, z], joints [a, b, c]."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any

from pydantic import TypeAdapter

MOST = 2**53
"""The greatest number that JSON carries exactly."""


def to_data(value: object) -> Any:
    """Return a message as plain data for JSON."""
    return _adapter(type(value)).dump_python(value, mode="json")


def to_json(value: object) -> bytes:
    """Return a message, or a list of messages, as JSON.

    A list is encoded message by message: one call for all of them would block the other threads of Python.
    """
    if isinstance(value, list):
        return b"[%b]" % b",".join(map(to_json, value))
    return _adapter(type(value)).dump_json(value)


def in_pieces(data: bytes) -> Iterator[bytes]:
    """Yield an answer in pieces, none of which delays the loop that receives it."""
    for begin in range(0, len(data), _PIECE):
        yield data[begin : begin + _PIECE]


_PIECE = 1 << 18


@cache
def _adapter(kind: type[Any]) -> TypeAdapter[Any]:
    return TypeAdapter(kind)
