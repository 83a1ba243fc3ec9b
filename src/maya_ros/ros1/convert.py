"""Convert between the classes that ROS generates from message definitions and plain data.

A class names its fields in `__slots__` and their types in `_slot_types`, so that unknown types are converted too.
Single values are checked as everywhere in the graph (`graph.validation`).
"""

from __future__ import annotations

import re
from base64 import b64decode
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, NamedTuple, TypeVar

import genpy
import roslib.message
import rospy

from dmc41x3.i18n import phrase
from maya_ros.graph.catalogue import is_base
from maya_ros.graph.protocol import Message
from maya_ros.graph.validation import Mismatch, converter
from maya_un.errors import InvalidMessage, UnknownInterface

MessageClass = genpy.Message

T = TypeVar("T")


class ServiceClass(NamedTuple):
    """A generated service class, with those of its request and response."""

    kind: type[genpy.Service]
    request: type[MessageClass]
    response: type[MessageClass]


def message_class(name: str) -> type[MessageClass]:
    """Return the class of a message type ("std_msgs/String"); raises `UnknownInterface`."""
    found = _found(roslib.message.get_message_class, name)
    if found is None:
        raise UnknownInterface(form="message type", name=name)
    return found


def service_class(name: str) -> ServiceClass:
    """Return the class of a service type ("std_srvs/Trigger"); raises `UnknownInterface`."""
    found = _found(roslib.message.get_service_class, name)
    if found is None:
        raise UnknownInterface(form="service type", name=name)
    return ServiceClass(found, found._request_class, found._response_class)


def _found(look: Callable[[str], T | None], name: str) -> T | None:
    """Return a class, None if the name is unknown or invalid."""
    try:
        return look(name)
    except ValueError:
        return None


Change = Callable[[Any], Any]

_ARRAY = re.compile(r"(.+)\[(\d*)\]")
_OCTETS = {"uint8", "char"}
_TIMES: dict[str, type[genpy.Time] | type[genpy.Duration]] = {"time": genpy.Time, "duration": genpy.Duration}


class TypeConversion(NamedTuple):
    """Conversion of a type: `plain` to plain data, None for no change; `made` back, which raises `Mismatch`.

    `default` returns the default value of ROS.
    """

    plain: Change | None
    made: Change
    default: Callable[[], Any]


class Converter:
    """Converts the messages of one generated class."""

    def __init__(self, kind: type[MessageClass]) -> None:
        self.name = kind._type
        self._ways = _of_class(kind)

    def plain(self, message: MessageClass) -> Message:
        """Return a message as plain data."""
        assert self._ways.plain is not None
        found: Message = self._ways.plain(message)
        return found

    def made(self, message: Mapping[str, Any]) -> MessageClass:
        """Return the message of plain data; missing fields have their defaults. Raises `InvalidMessage`."""
        try:
            made: MessageClass = self._ways.made(message)
        except Mismatch as misfit:
            name = f"{misfit.path} of {self.name}" if misfit.path else self.name
            raise InvalidMessage(name=name, reason=misfit.reason) from None
        return made


@cache
def converter_of(kind: type[MessageClass]) -> Converter:
    """Return the converter of a generated class."""
    return Converter(kind)


@cache
def _of_class(kind: type[MessageClass]) -> TypeConversion:
    names = tuple(kind.__slots__)
    fields = [(name, _of(text)) for name, text in zip(names, kind._slot_types, strict=True)]
    deep = [(name, ways.plain) for name, ways in fields if ways.plain is not None]

    def plain(message: Any) -> Message:
        data = {name: getattr(message, name) for name in names}
        for name, change in deep:
            data[name] = change(data[name])
        return data

    def made(data: Any) -> MessageClass:
        if not isinstance(data, Mapping):
            raise Mismatch(phrase("it must be an object, not {data}", data=f"{data!r:.40}"))
        message = kind.__new__(kind)
        for name, ways in fields:
            setattr(message, name, _field(ways, name, data[name]) if name in data else ways.default())
        if len(data) > len(names) or any(name not in names for name in data):
            unknown = next(str(name) for name in data if name not in names)
            reason = phrase("it has {names}, and no other", names=", ".join(sorted(names)) or phrase("no field"))
            raise Mismatch(reason).within(unknown[:64])
        return message

    return TypeConversion(plain, made, lambda: made({}))


def _field(ways: TypeConversion, name: str, value: Any) -> Any:
    try:
        return ways.made(value)
    except Mismatch as misfit:
        raise misfit.within(name) from None


@cache
def _of(text: str) -> TypeConversion:
    """Return the conversion of a field's type, as a class writes it."""
    array = _ARRAY.fullmatch(text)
    if array is not None:
        return _of_array(array[1], int(array[2]) if array[2] else None)
    if text in _TIMES:
        return _of_time(text)
    if is_base(text):
        nothing = {"string": str, "bool": bool, "float32": float, "float64": float}.get(text, int)
        return TypeConversion(None, converter(text), nothing)
    return _of_class(message_class(text))


def _of_array(item: str, length: int | None) -> TypeConversion:
    each = _of(item)
    octets = item in _OCTETS
    plain, change = each.plain, each.made
    whole: Callable[[list[Any]], Any] = bytes if octets else list

    def made(values: Any) -> Any:
        if octets and isinstance(values, str | bytes | bytearray):
            values = _octets(values)
        if not isinstance(values, list | tuple):
            raise Mismatch(phrase("it must be an array, not {data}", data=f"{values!r:.40}"))
        if length is not None and len(values) != length:
            raise Mismatch(phrase("it must have {length} items, not {given}", length=length, given=len(values)))
        return whole([change(value) for value in values])

    def default() -> Any:
        return whole([each.default() for _ in range(length or 0)])

    return TypeConversion(list if plain is None else lambda values: [plain(value) for value in values], made, default)


def _octets(data: str | bytes | bytearray) -> list[int]:
    try:
        return list(b64decode(data, validate=True) if isinstance(data, str) else data)
    except ValueError:
        raise Mismatch(phrase("it must be an array, or bytes as base64")) from None


def _of_time(name: str) -> TypeConversion:
    kind, checked = _TIMES[name], converter(name)

    def made(value: Any) -> genpy.Time | genpy.Duration:
        if value == "now" and name == "time":
            now = rospy.Time.now()
            return kind(now.secs, now.nsecs)
        found = checked(value)
        return kind(found["secs"], found["nsecs"])

    return TypeConversion(lambda value: {"secs": value.secs, "nsecs": value.nsecs}, made, kind)
