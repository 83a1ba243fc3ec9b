"""The ROS 2 form of every type of the graph: its name, its type hash, and how a message becomes a DDS sample.

Messages of the graph have the form of ROS 1 (`graph.protocol`). ROS 2 has the same fields, but for three differences:
times are builtin_interfaces/Time, a header has no sequence number, and Maya's packages are one, maya_interfaces.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import new_class
from typing import Any, NamedTuple, cast

from cyclonedds.idl import IdlStruct
from cyclonedds.idl import types as idl
from cyclonedds.idl.annotations import final
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from maya_ros.graph import catalogue
from maya_ros.graph.protocol import Message
from maya_ros.ros2.names import OWN, PACKAGE, name_of
from maya_un.errors import UnknownInterface

_DEFINITIONS = Path(__file__).parent / "definitions"
"""Definitions that only ROS 2 has and the library lacks."""

_TIMES = {"time": "builtin_interfaces/Time", "duration": "builtin_interfaces/Duration"}
_EMPTY = "uint8 structure_needs_at_least_one_member\n"
_BASES: Mapping[str, Any] = {
    "bool": bool, "byte": idl.uint8, "char": idl.uint8, "int8": idl.int8, "uint8": idl.uint8, "int16": idl.int16,
    "uint16": idl.uint16, "int32": idl.int32, "uint32": idl.uint32, "int64": idl.int64, "uint64": idl.uint64,
    "float32": idl.float32, "float64": idl.float64, "string": str,
}  # fmt: skip

_UUID = "unique_identifier_msgs/UUID goal_id\n"
_STAMP = "builtin_interfaces/Time stamp\n"
_HEADER = (("guid", "uint64"), ("seq", "int64"))
"""The head that rmw_cyclonedds gives each request and response: the client, and the number of its request."""


class SampleType(NamedTuple):
    """A type on the wire: its name in ROS 2, its class in DDS, its hash (REP 2016), and conversions.

    `sample` makes a DDS sample of a complete message, `message` the opposite. Both raise `ValueError` and `TypeError`
    for values that do not fit.
    """

    name: str
    cls: type[Any]
    hash: str
    sample: Callable[[Mapping[str, Any]], Any]
    message: Callable[[Any], Message]


def message_type(kind: str) -> SampleType:
    """Return the wire form of a message type of the graph, or of a ROS 2 type; raises `UnknownInterface`."""
    return _sample_type(kind if kind.count("/") == 2 else name_of(kind))


@cache
def service_types(kind: str) -> tuple[SampleType, SampleType]:
    """Return the wire forms of the request and the response of a service type of the graph."""
    name = name_of(kind, "srv")
    for part, text in _parts(kind, "srv", ("Request", "Response")).items():
        _register(f"{name}_{part}", text)
    return _service(name)


class ActionTypes(NamedTuple):
    """The wire forms of the three services and the feedback of an action."""

    send_goal: tuple[SampleType, SampleType]
    get_result: tuple[SampleType, SampleType]
    cancel_goal: tuple[SampleType, SampleType]
    feedback: SampleType
    status: SampleType


@cache
def action_types(kind: str) -> ActionTypes:
    """Return the wire forms of an action type of the graph."""
    name = name_of(kind, "action")
    for part, text in _parts(kind, "action", ("Goal", "Result", "Feedback")).items():
        _register(f"{name}_{part}", text)
    _register(f"{name}_SendGoal_Request", f"{_UUID}{name}_Goal goal\n")
    _register(f"{name}_SendGoal_Response", f"bool accepted\n{_STAMP}")
    _register(f"{name}_GetResult_Request", _UUID)
    _register(f"{name}_GetResult_Response", f"int8 status\n{name}_Result result\n")
    _register(f"{name}_FeedbackMessage", f"{_UUID}{name}_Feedback feedback\n")
    _register("action_msgs/srv/CancelGoal_Request", "action_msgs/GoalInfo goal_info\n")
    _register("action_msgs/srv/CancelGoal_Response", "int8 return_code\naction_msgs/GoalInfo[] goals_canceling\n")
    return ActionTypes(
        _service(f"{name}_SendGoal"),
        _service(f"{name}_GetResult"),
        _service("action_msgs/srv/CancelGoal"),
        _sample_type(f"{name}_FeedbackMessage"),
        _sample_type("action_msgs/msg/GoalStatusArray"),
    )


def _parts(kind: str, form: str, parts: tuple[str, ...]) -> dict[str, str]:
    """Return the ROS 2 definitions of the parts of a service or an action."""
    package, _, own = kind.partition("/")
    file = _DEFINITIONS / package / form / f"{own}.{form}"
    if not file.exists():
        return {part: _definition(kind + part) for part in parts}
    return dict(zip(parts, catalogue.parts(file.read_text(encoding="utf-8")), strict=True))


def _service(name: str) -> tuple[SampleType, SampleType]:
    return _sample_type(f"{name}_Request", _HEADER), _sample_type(f"{name}_Response", _HEADER)


@cache
def _store() -> Typestore:
    """Return the definitions: those of Jazzy, and Maya's own messages as they are used."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for name, (constants, fields) in tuple(store.fielddefs.items()):
        store.fielddefs[name] = constants, [(label, _without_char(node)) for label, node in fields]
    for file in sorted(_DEFINITIONS.glob("*/msg/*.msg")):
        name = f"{file.parent.parent.name}/msg/{file.stem}"
        store.register(get_types_from_msg(file.read_text(encoding="utf-8"), name))
    return store


def _without_char(node: Any) -> Any:
    """Return the definition of a field with uint8 in place of char, as ROS 2 hashes it; the library hashes char."""
    if node == ("char", 0):
        return "uint8", 0
    return tuple(_without_char(part) for part in node) if isinstance(node, tuple) else node


def _register(name: str, text: str) -> None:
    if name not in _store().fielddefs:
        (definition,) = get_types_from_msg(text, name).values()  # the library changes the names of services
        _store().register({name: definition})


def _definition(kind: str) -> str:
    """Return the ROS 2 definition of a type of the graph, and register the types in it."""
    lines: list[str] = []
    for field in catalogue.spec(kind).fields:
        base = catalogue.is_base(field.type)
        written = _TIMES.get(field.type, field.type) if base else _required(field.type)
        array = "" if field.length == catalogue.SCALAR else f"[{field.length or ''}]"
        lines.append(f"{written}{array} {field.name}\n")
    return "".join(lines) or _EMPTY


def _required(kind: str) -> str:
    """Register a message type of the graph unless ROS 2 has it, and return its ROS 2 name."""
    name = name_of(kind)
    if name not in _store().fielddefs:
        _register(name, _definition(kind))
    return name


@cache
def _sample_type(name: str, header: tuple[tuple[str, str], ...] = ()) -> SampleType:
    if name not in _store().fielddefs:
        package, _, own = name.split("/")
        origin = next((f"{one}/{own}" for one in OWN if f"{one}/{own}" in catalogue.kinds()), "")
        if package != PACKAGE or not origin:
            raise UnknownInterface(form="type", name=name)
        _register(name, _definition(origin))
    cls = _struct(name, header)
    return SampleType(name, cls, _store().hash_rihs01(name), _writer(name, cls), _reader(name))


@cache
def _struct(name: str, header: tuple[tuple[str, str], ...] = ()) -> type[Any]:
    """Return the class of a type in DDS: pkg::msg::dds_::Type_, final, in the encoding XCDR1."""
    package, form, own = name.split("/")
    hints = {label: _BASES[base] for label, base in header}
    hints |= {label: _hint(*tree) for label, tree in _fields(name)}

    def body(space: dict[str, Any]) -> None:
        space["__annotations__"] = hints
        space["__module__"] = __name__

    made = new_class(f"{own}_", (IdlStruct,), {"typename": f"{package}.{form}.dds_.{own}_"}, body)
    return cast("type[Any]", final(dataclass(made)))


def _fields(name: str) -> list[tuple[str, Any]]:
    return list(_store().fielddefs[name][1])


def _hint(node: Nodetype, tree: Any) -> Any:
    match node:
        case Nodetype.BASE:
            return _BASES[tree[0]]
        case Nodetype.NAME:
            return _struct(tree)
        case Nodetype.ARRAY:
            return idl.array[_hint(*tree[0]), tree[1]]
        case _:
            return idl.sequence[_hint(*tree[0])]


@cache
def _writer(name: str, cls: type[Any]) -> Callable[[Mapping[str, Any]], Any]:
    """Return the conversion of a complete message into a sample; fields that only ROS 2 has get their defaults."""
    if name in ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration"):
        return lambda when: cls(sec=when.get("secs", 0), nanosec=when.get("nsecs", 0))
    fields = [(label, *_convert(*tree)) for label, tree in _fields(name)]

    def write(message: Mapping[str, Any]) -> Any:
        values = {
            label: (default() if label not in message else message[label] if one is None else one(message[label]))
            for label, one, default in fields
        }
        return _made(cls, values)

    return write


def _made(cls: type[Any], values: dict[str, Any]) -> Any:
    sample: Any = object.__new__(cls)  # the constructor of a dataclass takes longer
    sample.__dict__.update(values)
    return sample


Convert = Callable[[Any], Any] | None
"""Converts a value; None leaves it as it is."""


def _convert(node: Nodetype, tree: Any) -> tuple[Convert, Callable[[], Any]]:
    """Return the conversion of a field into its form in a sample, and the maker of its default."""
    match node:
        case Nodetype.BASE:
            return None, {"string": str, "bool": bool, "float32": float, "float64": float}.get(tree[0], int)
        case Nodetype.NAME:
            one = _writer(tree, _struct(tree))
            return one, lambda: one({})
        case Nodetype.ARRAY:
            each, default = _convert(*tree[0])
            return _listed(each), lambda: [default() for _ in range(tree[1])]
        case _:
            each, _ = _convert(*tree[0])
            return _listed(each), list


def _listed(each: Convert) -> Convert:
    return list if each is None else (lambda values: [each(value) for value in values])


@cache
def _reader(name: str) -> Callable[[Any], Message]:
    """Return the conversion of a sample into a message of the graph."""
    if name in ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration"):
        return lambda when: {"secs": when.sec, "nsecs": when.nanosec}
    fields = [
        (label, _reading(*tree)) for label, tree in _fields(name) if label != "structure_needs_at_least_one_member"
    ]

    def read(sample: Any) -> Message:
        values = ((label, one, getattr(sample, label)) for label, one in fields)
        return {label: value if one is None else one(value) for label, one, value in values}

    return read


def _reading(node: Nodetype, tree: Any) -> Convert:
    match node:
        case Nodetype.BASE:
            return None
        case Nodetype.NAME:
            return _reader(tree)
        case _:
            return _listed(_reading(*tree[0]))
