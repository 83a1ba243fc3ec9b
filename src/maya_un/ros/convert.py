"""Between the classes that ROS generates from message definitions and plain data, in functions made once per type.

A class names its fields in `__slots__` and their types in `_slot_types`; fields that plain data leaves out have their
default, those of plain data that the type lacks are refused. Bytes (uint8[] and char[]) are text in base64, as
rosbridge writes them, and are also taken as a list of numbers.
"""

from __future__ import annotations

import math
import re
from base64 import b64decode, b64encode
from binascii import Error as NotBase64
from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import genpy

from maya_un.errors import InvalidMessage
from maya_un.graph.protocol import Message
from maya_un.ros.classes import MessageClass, message_class

Convert = Callable[[Any], Any]

_ARRAY = re.compile(r"(.+)\[(\d*)\]")
_OCTETS = {"uint8", "char"}
_WHOLE = {
    "int8": (-(1 << 7), 1 << 7),
    "byte": (-(1 << 7), 1 << 7),
    "uint8": (0, 1 << 8),
    "char": (0, 1 << 8),
    "int16": (-(1 << 15), 1 << 15),
    "uint16": (0, 1 << 16),
    "int32": (-(1 << 31), 1 << 31),
    "uint32": (0, 1 << 32),
    "int64": (-(1 << 63), 1 << 63),
    "uint64": (0, 1 << 64),
}
_LARGEST_FLOAT32 = (2.0 - 2.0**-23) * 2.0**127


class Pair(NamedTuple):
    """Both ways of one type: `plain` to plain data, `made` back; that one raises `ValueError`, and `KeyError` never."""

    plain: Convert
    made: Convert
    default: Callable[[], Any]
    same: bool = False
    """Whether `plain` returns what it gets."""


class Converter:
    """Converts the messages of one class."""

    def __init__(self, kind: type[MessageClass]) -> None:
        self.kind = kind
        self._pair = _of_class(kind)

    def plain(self, message: MessageClass) -> Message:
        """Return a message as plain data."""
        found: Message = self._pair.plain(message)
        return found

    def made(self, message: Message) -> MessageClass:
        """Return the message that plain data says; raises `InvalidMessage`."""
        try:
            made: MessageClass = self._pair.made(message)
        except (ValueError, TypeError) as error:
            raise InvalidMessage(name=self.kind._type, reason=str(error)) from None
        return made


@lru_cache(maxsize=None)
def converter(kind: type[MessageClass]) -> Converter:
    """Return the converter of a generated class."""
    return Converter(kind)


@lru_cache(maxsize=None)
def _of_class(kind: type[MessageClass]) -> Pair:
    names = tuple(kind.__slots__)
    pairs = [_of(text) for text in kind._slot_types]
    known = frozenset(names)
    blank = tuple(zip(names, pairs, strict=True))
    deep = [(name, pair.plain) for name, pair in blank if not pair.same]

    def plain(message: Any) -> Message:
        data = {name: getattr(message, name) for name in names}
        for name, convert in deep:
            data[name] = convert(data[name])
        return data

    def made(data: Any) -> Any:
        if not isinstance(data, dict):
            raise ValueError(f"{kind._type} is a mapping of its fields")  # noqa: TRY004 - one error for all of it
        message = kind.__new__(kind)
        for name, pair in blank:
            if name in data:
                try:
                    value = pair.made(data[name])
                except (ValueError, TypeError) as error:
                    raise ValueError(f"{name}: {error}") from None
            else:
                value = pair.default()
            setattr(message, name, value)
        if not known.issuperset(data):
            raise ValueError(f"{kind._type} has no field {min(str(key) for key in data if key not in known)}")
        return message

    return Pair(plain, made, lambda: made({}))


@lru_cache(maxsize=None)
def _of(text: str) -> Pair:
    """Return the pair of a field's type, as a class writes it."""
    array = _ARRAY.fullmatch(text)
    if array is not None:
        length = int(array[2]) if array[2] else None
        return _octets(length) if array[1] in _OCTETS else _array(_of(array[1]), length)
    return _SIMPLE[text] if text in _SIMPLE else _of_class(message_class(text))


def _array(each: Pair, length: int | None) -> Pair:
    plain, convert = each.plain, each.made

    def made(values: Any) -> Any:
        if not isinstance(values, list | tuple):
            raise ValueError("it is a list")  # noqa: TRY004 - one error for all of it
        if length is not None and len(values) != length:
            raise ValueError(f"it has {length} elements")
        return [convert(value) for value in values]

    if each.same:
        return Pair(list, made, lambda: [each.default() for _ in range(length or 0)])
    return Pair(
        lambda values: [plain(value) for value in values], made, lambda: [each.default() for _ in range(length or 0)]
    )


def _octets(length: int | None) -> Pair:
    def made(value: Any) -> bytes:
        octets = _bytes(value)
        if length is not None and len(octets) != length:
            raise ValueError(f"it has {length} elements")
        return octets

    return Pair(lambda value: b64encode(bytes(value)).decode("ascii"), made, lambda: bytes(length or 0))


def _bytes(value: Any) -> bytes:
    if isinstance(value, str):
        try:
            return b64decode(value, validate=True)
        except NotBase64:
            raise ValueError("it is no base64") from None
    if isinstance(value, list | tuple | bytes):
        return bytes(value)
    raise ValueError("it is bytes, as text in base64 or as a list of numbers")


def _whole(least: int, beyond: int) -> Convert:
    def made(value: Any) -> int:
        if isinstance(value, float) and value.is_integer():
            value = int(value)
        if not isinstance(value, int):
            raise ValueError("it is a whole number")  # noqa: TRY004 - one error for all of it
        if not least <= value < beyond:
            raise ValueError(f"it is from {least} to {beyond - 1}")
        return int(value)

    return made


def _number(value: Any) -> float:
    if value is None:  # JSON has no word for what is no number
        return math.nan
    if not isinstance(value, int | float):
        raise ValueError("it is a number")  # noqa: TRY004 - one error for all of it
    return float(value)


def _short_number(value: Any) -> float:
    number = _number(value)
    if math.isfinite(number) and abs(number) > _LARGEST_FLOAT32:
        raise ValueError("it is too large for 32 bits")
    return number


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError("it is text")  # noqa: TRY004 - one error for all of it
    return value


def _truth(value: Any) -> bool:
    if value is True or value is False or (isinstance(value, int) and value in {0, 1}):
        return bool(value)
    raise ValueError("it is true or false")


def _moment(kind: type[genpy.Time] | type[genpy.Duration]) -> Pair:
    seconds = _whole(*_WHOLE["uint32" if kind is genpy.Time else "int32"])
    rest = _whole(*_WHOLE["uint32" if kind is genpy.Time else "int32"])

    def made(value: Any) -> genpy.Time | genpy.Duration:
        if not isinstance(value, dict) or not {"secs", "nsecs"}.issuperset(value):
            raise ValueError("it is a mapping of secs and nsecs")
        return kind(seconds(value.get("secs", 0)), rest(value.get("nsecs", 0)))

    return Pair(lambda value: {"secs": value.secs, "nsecs": value.nsecs}, made, kind)


def _as_it_is(value: Any) -> Any:
    return value


_SIMPLE = {
    **{name: Pair(_as_it_is, _whole(*bounds), int, same=True) for name, bounds in _WHOLE.items()},
    "float64": Pair(_as_it_is, _number, float, same=True),
    "float32": Pair(_as_it_is, _short_number, float, same=True),
    "string": Pair(_as_it_is, _text, str, same=True),
    "bool": Pair(_as_it_is, _truth, bool, same=True),
    "time": _moment(genpy.Time),
    "duration": _moment(genpy.Duration),
}
