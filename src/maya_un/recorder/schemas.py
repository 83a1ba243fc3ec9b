"""The topics of a recording: what the messages on them are, as JSON schemas that viewers read."""

from __future__ import annotations

from typing import Any, NamedTuple

from maya_un.values import AXES, Mode

_NUMBER: dict[str, Any] = {"type": "number"}
_TEXT: dict[str, Any] = {"type": "string"}
_WHOLE: dict[str, Any] = {"type": "integer"}
_TRUTH: dict[str, Any] = {"type": "boolean"}


class RecordedTopic(NamedTuple):
    """A topic: its name, the name of its schema, and the schema."""

    name: str
    schema_name: str
    schema: dict[str, Any]


def _described(kind: dict[str, Any], description: str) -> dict[str, Any]:
    return {**kind, "description": description}


def _three(kind: dict[str, Any], description: str, *, optional: bool = False) -> dict[str, Any]:
    types = ["array", "null"] if optional else "array"
    return {"type": types, "items": kind, "minItems": 3, "maxItems": 3, "description": description}


def _maybe(properties: dict[str, Any], description: str) -> dict[str, Any]:
    return {"type": ["object", "null"], "properties": properties, "description": description}


def _object(title: str, properties: dict[str, Any]) -> dict[str, Any]:
    required = list(properties)
    return {"title": title, "type": "object", "properties": properties, "required": required}


_TIME = _described(_NUMBER, "clock of the program's event loop [s]")

STATE = RecordedTopic(
    "/state",
    "maya.State",
    _object(
        "Latest known state of the machine, at every sample",
        {
            "time": _TIME,
            "mode": {"type": "string", "enum": [mode.value for mode in Mode]},
            "homed": _TRUTH,
            "counts": _three(_WHOLE, "encoder positions of axes a, b, c [counts]"),
            "joints": _three(_NUMBER, "a [rad], b, c [m]; null before homing", optional=True),
            "point": _three(_NUMBER, "x, y, z of the gripper [m]; null where not known", optional=True),
            "velocity": _three(_NUMBER, "of a [rad/s], b, c [m/s]"),
            "moving": _TRUTH,
            "motors_on": _three(_TRUTH, "of a, b, c"),
            "forward_limit": _three(_TRUTH, "switches of a, b, c, true where active"),
            "reverse_limit": _three(_TRUTH, "switches of a, b, c, true where active"),
            "stop_code": _three(_WHOLE, "why a, b, c stopped last (Galil SC)"),
            "gripper_closed": _TRUTH,
            "progress": _maybe(
                {"phase": _TEXT, "elapsed": _NUMBER, "duration": _NUMBER}, "of the motion under way [s]"
            ),
            "fault": _maybe({"code": _WHOLE, "message": _TEXT}, "what waits for a person to recover"),
            "override": _described(_NUMBER, "factor on the speed of all motion"),
        },
    ),
)

EVENTS = RecordedTopic(
    "/events",
    "maya.Event",
    _object(
        "A fact, in order",
        {
            "seq": _described(_WHOLE, "number, from 1 without gaps"),
            "time": _TIME,
            "kind": _TEXT,
            "code": _described(_WHOLE, "0, or an error's"),
            "detail": {"type": "object"},
        },
    ),
)

WIRE = RecordedTopic(
    "/wire",
    "maya.Wire",
    {
        **_object(
            "Bytes between this program and the controller, as sent and received",
            {
                "t": _TIME,
                "link": _described(_WHOLE, "number of the connection; negative: datagrams"),
                "from": {"type": "string", "enum": ["client", "controller"], "description": "the client is Maya"},
                "data": _described(_TEXT, "each byte as the character of its number (Latin-1)"),
                "event": {"type": "string", "enum": ["open", "end"], "description": "instead of data"},
            },
        ),
        "required": ["t", "link", "from"],
    },
)

EXCHANGES = RecordedTopic(
    "/exchanges",
    "maya.Exchange",
    _object(
        "A command with what answered it, where that is known; at the time of the command",
        {
            "t": _TIME,
            "link": _WHOLE,
            "command": _TEXT,
            "took": _described({"type": ["number", "null"]}, "time to the answer [s], null without one"),
            "ok": {"type": ["boolean", "null"], "description": "whether it was accepted, null without an answer"},
            "reply": _described(_TEXT, "what it printed; of a data record its bytes (Latin-1)"),
        },
    ),
)

_JOINT = {
    "type": "object",
    "properties": {
        "name": {"type": "string", "enum": list(AXES)},
        "position": _described(_NUMBER, "[rad], [m]"),
        "velocity": _described(_NUMBER, "[rad/s], [m/s]"),
    },
}

JOINTS = RecordedTopic(
    "/joint_states",
    "foxglove.JointStates",
    _object(
        "Joints of the robot, once homed",
        {
            "timestamp": {"type": "object", "properties": {"sec": _WHOLE, "nsec": _WHOLE}},
            "joints": {"type": "array", "items": _JOINT},
        },
    ),
)

TOPICS = (STATE, EVENTS, WIRE, EXCHANGES, JOINTS)
"""All of them. `/exchanges` and `/joint_states` follow from the others and are for viewers alone."""
