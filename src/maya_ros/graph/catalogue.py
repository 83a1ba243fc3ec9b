"""Definitions of every type of the graph: ROS types from the library rosbags, types of Maya from ros/.

Each definition is that of its package, by its name; in a service, `---` separates request and response.

Names are ROS 1 names ("std_msgs/String"); the two halves of a service are "std_srvs/SetBoolRequest" and "...Response",
and an action X has the messages XAction, XActionGoal, XGoal and so on, as ROS' generators make them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from maya_un.errors import UnknownInterface

SERVICES = {
    "std_srvs/Empty": "---",
    "std_srvs/SetBool": "bool data\n---\nbool success\nstring message",
    "std_srvs/Trigger": "---\nbool success\nstring message",
    "rosapi/Topics": "---\nstring[] topics\nstring[] types",
    "rosapi/TopicType": "string topic\n---\nstring type",
    "rosapi/TopicsForType": "string type\n---\nstring[] topics",
    "rosapi/TopicsAndRawTypes": "---\nstring[] topics\nstring[] types\nstring[] typedefs_full_text",
    "rosapi/Services": "---\nstring[] services",
    "rosapi/ServicesForType": "string type\n---\nstring[] services",
    "rosapi/ServiceType": "string service\n---\nstring type",
    "rosapi/ServiceNode": "string service\n---\nstring node",
    "rosapi/ServiceHost": "string service\n---\nstring host",
    "rosapi/ServiceProviders": "string service\n---\nstring[] providers",
    "rosapi/ServiceRequestDetails": "string type\n---\nTypeDef[] typedefs",
    "rosapi/ServiceResponseDetails": "string type\n---\nTypeDef[] typedefs",
    "rosapi/MessageDetails": "string type\n---\nTypeDef[] typedefs",
    "rosapi/Nodes": "---\nstring[] nodes",
    "rosapi/NodeDetails": "string node\n---\nstring[] subscribing\nstring[] publishing\nstring[] services",
    "rosapi/Publishers": "string topic\n---\nstring[] publishers",
    "rosapi/Subscribers": "string topic\n---\nstring[] subscribers",
    "rosapi/GetParam": "string name\nstring default\n---\nstring value",
    "rosapi/SetParam": "string name\nstring value\n---",
    "rosapi/HasParam": "string name\n---\nbool exists",
    "rosapi/DeleteParam": "string name\n---",
    "rosapi/SearchParam": "string name\n---\nstring global_name",
    "rosapi/GetParamNames": "---\nstring[] names",
    "rosapi/GetTime": "---\ntime time",
    "rosapi/GetActionServers": "---\nstring[] action_servers",
}

MESSAGES = {
    "rosapi/TypeDef": (
        "string type\nstring[] fieldnames\nstring[] fieldtypes\nint32[] fieldarraylen\n"
        "string[] examples\nstring[] constnames\nstring[] constvalues"
    ),
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms",
}


SCALAR = -1
"""Length of a field that is no array."""

ANY = 0
"""Length of an array of any length."""

_DEFINITIONS = Path(__file__).parent / "definitions"
_NOTHING = "structure_needs_at_least_one_member"
_RENAMED = {"builtin_interfaces/msg/Time": "time", "builtin_interfaces/msg/Duration": "duration"}
_SEPARATOR = "---"
_STATUS = "std_msgs/Header header\nactionlib_msgs/GoalStatus status\n"
_DERIVED = {
    "ActionGoal": "std_msgs/Header header\nactionlib_msgs/GoalID goal_id\n{name}Goal goal",
    "ActionResult": _STATUS + "{name}Result result",
    "ActionFeedback": _STATUS + "{name}Feedback feedback",
    "Action": "{name}ActionGoal action_goal\n{name}ActionResult action_result\n{name}ActionFeedback action_feedback",
}


@dataclass(frozen=True, slots=True)
class Field:
    """A field: its name, its type without brackets, and its `length`: -1 for no array, 0 for an array of any length."""

    name: str
    type: str
    length: int = SCALAR

    @property
    def written(self) -> str:
        """The type as a definition writes it."""
        if self.length == SCALAR:
            return self.type
        return f"{self.type}[{self.length or ''}]"


@dataclass(frozen=True, slots=True)
class Constant:
    """A constant of a type."""

    type: str
    name: str
    value: object


@dataclass(frozen=True, slots=True)
class Spec:
    """A type: its constants and fields, in order."""

    name: str
    constants: tuple[Constant, ...]
    fields: tuple[Field, ...]


@cache
def spec(kind: str) -> Spec:
    """Return the definition of a type; raises `UnknownInterface`. ROS 2's form of the name is accepted too."""
    found = _specs().get(kind) or _specs().get(kind.replace("/msg/", "/"))
    if found is None:
        raise UnknownInterface(form="type", name=kind)
    return found


def is_base(kind: str) -> bool:
    """Return whether a type is a base type of ROS: a number, a text, a time or a duration."""
    return "/" not in kind


def kinds() -> tuple[str, ...]:
    """Return the names of all message types."""
    return tuple(_specs())


def services() -> tuple[str, ...]:
    """Return the names of all service types."""
    return tuple(_services())


def halves(service: str) -> tuple[str, str]:
    """Return the types of the request and the response of a service; raises `UnknownInterface`."""
    if service not in _services():
        raise UnknownInterface(form="type", name=service)
    return service + "Request", service + "Response"


@cache
def _services() -> Mapping[str, str]:
    return {**SERVICES, **_ours("srv")}


@cache
def _specs() -> Mapping[str, Spec]:
    found = {_plain(name): _spec(name, definition) for name, definition in _foreign().items() if name not in _RENAMED}
    for name, text in {**MESSAGES, **_ours("msg"), **_of_services(), **_of_actions()}.items():
        found[name] = _parsed(name, text)
    return found


def _foreign() -> Mapping[str, object]:
    return {**get_typestore(Stores.ROS1_NOETIC).fielddefs}


def _ours(form: str) -> dict[str, str]:
    """Return the texts of Maya's definitions of a form, by name."""
    files = sorted(_DEFINITIONS.glob(f"*/{form}/*.{form}"))
    return {f"{file.parent.parent.name}/{file.stem}": file.read_text(encoding="utf-8") for file in files}


def parts(text: str) -> list[str]:
    """Return the parts of a definition that are separated by `---`."""
    found = [""]
    for line in text.splitlines():
        if line.strip() == _SEPARATOR:
            found.append("")
        else:
            found[-1] += line + "\n"
    return found


def _of_services() -> dict[str, str]:
    found: dict[str, str] = {}
    for name, text in _services().items():
        found[name + "Request"], found[name + "Response"] = parts(text)
    return found


def _of_actions() -> dict[str, str]:
    found: dict[str, str] = {}
    for name, text in _ours("action").items():
        found[name + "Goal"], found[name + "Result"], found[name + "Feedback"] = parts(text)
        for suffix, form in _DERIVED.items():
            found[name + suffix] = form.format(name=name)
    return found


def _parsed(name: str, text: str) -> Spec:
    package, _, own = name.partition("/")
    full = f"{package}/msg/{own}"
    return _spec(full, get_types_from_msg(text, full)[full])


def _spec(name: str, definition: object) -> Spec:
    """Return a type from its definition in the library."""
    constants, fields = definition  # type: ignore[misc]
    return Spec(
        _plain(name),
        tuple(Constant(kind, label, value) for label, kind, value in constants),
        tuple(_field(label, *tree) for label, tree in fields if label != _NOTHING),
    )


def _field(name: str, node: Nodetype, tree: object) -> Field:
    match node, tree:
        case Nodetype.BASE, (str(kind), _):
            return Field(name, kind)
        case Nodetype.NAME, str(kind):
            return Field(name, _plain(kind))
        case _, ((inner, below), int(length)):
            return Field(name, _field(name, inner, below).type, length if node is Nodetype.ARRAY else ANY)
        case _:
            raise UnknownInterface(form="type", name=str(tree))


def _plain(name: str) -> str:
    return _RENAMED.get(name) or name.replace("/msg/", "/")
