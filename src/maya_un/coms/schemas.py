"""JSON Schemas (draft 2020-12) of all messages between supervisors and robots, version 1.

Fields may be added within a version, so readers ignore unknown fields. A new version has new topics.
`docs/reference/schemas` contains the schemas as files.
"""

from __future__ import annotations

from typing import Any

from maya_un.robot.primitives import PRIMITIVES
from maya_un.robot.primitives.primitive import Argument, Switch
from maya_un.steps.text import LONGEST_ID, StepState
from maya_un.values import FARTHEST

CONNECTIONS = ("ONLINE", "OFFLINE", "CONNECTION_BROKEN")
"""The states of a robot's connection, in the terms of VDA 5050."""

_ID = {"type": "string", "minLength": 1, "maxLength": LONGEST_ID, "description": "names the step; used once"}
_DATE = {
    "type": "string",
    "pattern": r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?(Z|[+-]\d\d:\d\d)$",
    "description": "ISO 8601 with a time zone",
}
_COORDINATE = {"type": "number", "minimum": -FARTHEST, "maximum": FARTHEST, "description": "metres"}
_ANGLE = _COORDINATE | {"description": "radians"}


def _schema(name: str, about: str, properties: dict[str, Any], required: list[str], **more: Any) -> dict[str, Any]:
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"maya/v1/{name}.json",
        "title": name,
        "description": about,
        "type": "object",
        "properties": properties,
        "required": required,
        **more,
    }


def _args_of(command: str, argument: Argument) -> dict[str, Any]:
    """Return the condition on `args` for a command."""
    needed = argument.numbers
    args = {"properties": {name: _value(argument, name) for name in needed}, "required": list(needed)}
    then = {"properties": {"args": args}} | ({"required": ["args"]} if needed else {})
    return {"if": {"properties": {"command": {"const": command}}, "required": ["command"]}, "then": then}


def _value(argument: Argument, name: str) -> dict[str, Any]:
    if isinstance(argument, Switch):
        return {"type": "boolean"}
    return _ANGLE if name == "a" else _COORDINATE


SCHEMAS: dict[str, dict[str, Any]] = {
    "commands": _schema(
        "commands",
        "A step for a robot. A command without an id has it in CorrelationData.",
        {
            "id": _ID,
            "command": {"enum": list(PRIMITIVES)},
            "args": {"type": ["object", "null"], "description": "others than the named ones are ignored"},
            "robot": {"type": ["string", "null"], "description": "a robot of another name refuses the step"},
            "deadline": {"anyOf": [_DATE, {"type": "null"}], "description": "the step begins before it, or never"},
            "supervisor": {
                "type": ["string", "null"],
                "description": "names the sender for displays; robots ignore it, and nothing checks it",
            },
        },
        ["id", "command"],
        allOf=[_args_of(name, primitive.argument) for name, primitive in PRIMITIVES.items()],
    ),
    "progress": _schema(
        "progress",
        "A step came into a state.",
        {"id": _ID, "state": {"enum": [state.value for state in StepState]}, "date": _DATE},
        ["id", "state", "date"],
    ),
    "results": _schema(
        "results",
        "How a step ended, or why it was refused. The id is null if its command had none that could be read.",
        {
            "id": {"anyOf": [_ID, {"type": "null"}]},
            "success": {"type": "boolean"},
            "error": {"type": ["string", "null"], "description": "a sentence; null after success"},
            "code": {"type": ["string", "null"], "description": "a code of errors.md, or INTERRUPTED"},
            "started": _DATE,
            "finished": _DATE,
            "warnings": {"type": "array", "items": {"type": "string"}},
            "content": {
                "type": "object",
                "description": "with code 4012: the command and the args that were refused; another one has this id",
            },
        },
        ["id", "success", "error", "code", "started", "finished", "warnings"],
        **{
            "if": {"properties": {"success": {"const": True}}},
            "then": {"properties": {"error": {"type": "null"}, "code": {"type": "null"}}},
            "else": {"properties": {"error": {"type": "string"}, "code": {"type": "string"}}},
        },
    ),
    "connection": _schema(
        "connection",
        "Whether a robot is connected; retained.",
        {
            "connection": {"enum": list(CONNECTIONS)},
            "session": {"type": "string", "description": "with ONLINE: differs between two robots with the same name"},
        },
        ["connection"],
    ),
}
"""The schemas by the last level of their topic."""
