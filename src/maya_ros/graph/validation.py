"""Converters that complete and check a received message, made once for each type."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Callable, Mapping
from contextvars import ContextVar
from functools import cache
from math import inf, isinf, nan
from reprlib import repr
from typing import Any

from dmc41x3.i18n import phrase
from maya_ros.graph.catalogue import ANY, SCALAR, Field, is_base, spec
from maya_ros.graph.protocol import Message
from maya_un.errors import UnknownInterface

Converter = Callable[[Any], Any]
"""Returns the value in the form of its type; raises `Mismatch`."""

INTEGERS = {
    "int8": (-(2**7), 2**7 - 1), "uint8": (0, 2**8 - 1), "byte": (-(2**7), 2**7 - 1), "char": (0, 2**8 - 1),
    "int16": (-(2**15), 2**15 - 1), "uint16": (0, 2**16 - 1),
    "int32": (-(2**31), 2**31 - 1), "uint32": (0, 2**32 - 1),
    "int64": (-(2**63), 2**63 - 1), "uint64": (0, 2**64 - 1),
}  # fmt: skip
"""The smallest and the largest value of every integer type; in ROS 1 `byte` is int8 and `char` is uint8."""

BYTES = frozenset({"uint8", "char"})
"""Arrays of these types may come as base64 text or as bytes."""

_GREATEST_SINGLE = 3.4028235677973366e38
_SECOND = 1_000_000_000
_STAMPS = {"time": "uint32", "duration": "int32"}
_OTHERS = ({"sec": "secs", "nanosec": "nsecs"}, {"sec": "secs", "nsec": "nsecs"})

NOW: ContextVar[Mapping[str, int] | None] = ContextVar("now", default=None)
"""The time {"secs", "nsecs"} for the word "now" while a message is converted; None if "now" is not allowed."""

_NOTHING: dict[str, Callable[[], Any]] = {
    "string": str,
    "bool": bool,
    "float32": float,
    "float64": float,
    **dict.fromkeys(INTEGERS, int),
}


class Mismatch(Exception):
    """A value does not fit; `path` leads to it, built while the error propagates."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason
        self.path = ""

    def within(self, place: str) -> Mismatch:
        """Return this error with `place` in front of its path: the place of the value in its container."""
        link = "." if self.path and not self.path.startswith("[") else ""
        self.path = f"{place}{link}{self.path}"
        return self


@cache
def converter(kind: str) -> Converter:
    """Return the converter of a message type or a base type; raises `UnknownInterface`."""
    if is_base(kind):
        return _base(kind)
    fields = [(field.name, _of_field(field), _default(field)) for field in spec(kind).fields]
    names = frozenset(name for name, _, _ in fields)

    def convert(data: Any) -> Message:
        if not isinstance(data, Mapping):
            raise Mismatch(phrase("it must be an object, not {data}", data=repr(data)))
        out: Message = {}
        for name, one, default in fields:
            if name in data:
                try:
                    out[name] = one(data[name])
                except Mismatch as misfit:
                    raise misfit.within(name) from None
            else:
                out[name] = default()
        if not names.issuperset(data):
            unknown = next(name for name in data if name not in names)
            reason = phrase("it has {names}, and no other", names=", ".join(sorted(names)) or phrase("no field"))
            raise Mismatch(reason).within(str(unknown)[:64])
        return out

    return convert


def _of_field(field: Field) -> Converter:
    one = converter(field.type)
    return one if field.length == SCALAR else _array(one, field)


def _default(field: Field) -> Callable[[], Any]:
    if field.length == ANY:
        return list
    if field.length != SCALAR:
        item = _default(Field(field.name, field.type))
        return lambda: [item() for _ in range(field.length)]
    if field.type in _NOTHING:
        return _NOTHING[field.type]
    whole = converter(field.type)
    return lambda: whole({})


def _array(one: Converter, field: Field) -> Converter:
    length, as_bytes = field.length, field.type in BYTES

    def convert(data: Any) -> list[Any]:
        values = _bytes(data) if as_bytes and isinstance(data, str | bytes | bytearray) else data
        if not isinstance(values, list | tuple):
            raise Mismatch(phrase("it must be an array, not {data}", data=repr(data)))
        if length not in (ANY, len(values)):
            raise Mismatch(phrase("it must have {length} items, not {given}", length=length, given=len(values)))
        try:
            return [one(value) for value in values]
        except Mismatch:
            for place, value in enumerate(values):
                _checked(one, value, place)
            raise

    return convert


def _checked(one: Converter, value: Any, place: int) -> None:
    try:
        one(value)
    except Mismatch as misfit:
        raise misfit.within(f"[{place}]") from None


def _bytes(data: str | bytes | bytearray) -> list[int]:
    if not isinstance(data, str):
        return list(data)
    try:
        return list(base64.b64decode(data, validate=True))
    except (binascii.Error, ValueError):
        raise Mismatch(phrase("it must be an array, or bytes as base64")) from None


def _base(kind: str) -> Converter:
    if kind in _STAMPS:
        stamp = _stamp(*INTEGERS[_STAMPS[kind]])
        return _time(stamp) if kind == "time" else stamp
    if kind not in _NOTHING:
        raise UnknownInterface(form="type", name=kind)
    return _integer(*INTEGERS[kind]) if kind in INTEGERS else _SCALARS[kind]


def _bool(value: Any) -> bool:
    if value is True or value is False:
        return value
    raise Mismatch(phrase("it must be true or false, not {value}", value=repr(value)))


def _string(value: Any) -> str:
    """Return a text; raises `Mismatch` for a lone surrogate, which JSON can contain."""
    if not isinstance(value, str):
        raise Mismatch(phrase("it must be text, not {value}", value=repr(value)))
    if not value.isascii():
        try:
            value.encode()
        except UnicodeEncodeError:
            raise Mismatch(phrase("it must be text that can be encoded")) from None
    return value


def _integer(least: int, greatest: int) -> Converter:
    def convert(value: Any) -> int:
        if not isinstance(value, int) or isinstance(value, bool):
            raise Mismatch(phrase("it must be a whole number, not {value}", value=repr(value)))
        if not least <= value <= greatest:
            raise Mismatch(
                phrase("it must be {least} to {most}, not {value}", least=least, most=greatest, value=repr(value))
            )
        return value

    return convert


def _float(value: Any) -> float:
    """Return a number; null is NaN, because JSON has no NaN."""
    if type(value) is float:
        return value
    if value is None:
        return nan
    if not isinstance(value, int | float) or isinstance(value, bool):
        raise Mismatch(phrase("it must be a number, not {value}", value=repr(value)))
    try:
        return float(value)
    except OverflowError:
        raise Mismatch(phrase("it must fit a float64, unlike {value}", value=repr(value))) from None


def _single(value: Any) -> float:
    number = _float(value)
    if _GREATEST_SINGLE <= abs(number) < inf and not isinf(number):
        raise Mismatch(phrase("it must fit a float32, unlike {value}", value=repr(value)))
    return number


def _time(stamp: Converter) -> Converter:
    """Return the converter of a time, which may be the word "now" while `NOW` is set."""

    def convert(data: Any) -> dict[str, int]:
        now = NOW.get() if data == "now" else None
        return stamp(data) if now is None else dict(now)

    return convert


def _stamp(least: int, greatest: int) -> Converter:
    """Return the converter of {"secs", "nsecs"}; nanoseconds beyond a second are carried over.

    The names of ROS 2, {"sec", "nanosec"}, and of rosbag.js, {"sec", "nsec"}, are accepted too.
    """
    whole, names = _integer(-(2**63), 2**63), {"secs", "nsecs"}

    def convert(data: Any) -> dict[str, int]:
        if isinstance(data, Mapping) and "sec" in data:
            data = _renamed(data)
        if not isinstance(data, Mapping) or not names.issuperset(data):
            raise Mismatch(phrase('it must be {{"secs", "nsecs"}}, not {data}', data=repr(data)))
        carried, nsecs = divmod(whole(data.get("nsecs", 0)), _SECOND)
        secs = whole(data.get("secs", 0)) + carried
        if not least <= secs <= greatest:
            raise Mismatch(
                phrase("its secs must be {least} to {most}, not {secs}", least=least, most=greatest, secs=repr(secs))
            )
        return {"secs": secs, "nsecs": nsecs}

    return convert


def _renamed(data: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a time under the names of ROS 1, if it has those of ROS 2 or rosbag.js."""
    for others in _OTHERS:
        if others.keys() >= data.keys():
            return {others[name]: value for name, value in data.items()}
    return data


_SCALARS: dict[str, Converter] = {"bool": _bool, "string": _string, "float64": _float, "float32": _single}
