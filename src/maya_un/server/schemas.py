"""JSON Schemas of what is read further in, where a message has more forms than its dataclass can say."""

from __future__ import annotations

from typing import Any

from pydantic import TypeAdapter

from maya_un.config.zones import ZoneConfig
from maya_un.process.job import Job
from maya_un.process.journal.rows import JobOptions
from maya_un.process.spots import Grid
from maya_un.process.step import BARE, COMMANDS
from maya_un.robot.primitives import PRIMITIVES
from maya_un.robot.primitives.arguments import Argument, JointTarget, Switch, Target
from maya_un.robot.primitives.primitive import Primitive
from maya_un.values import FARTHEST

REFERENCE = "#/components/schemas/{model}"

_NUMBER: dict[str, Any] = {"type": "number", "minimum": -FARTHEST, "maximum": FARTHEST}
_TEXT: dict[str, Any] = {"type": "string", "minLength": 1, "maxLength": 64}


def _numbers(names: str, least: int) -> dict[str, Any]:
    """Return the schema of an array of so many numbers, or of an object that has them by name."""
    array = {"type": "array", "items": _NUMBER, "minItems": least, "maxItems": len(names)}
    by_name = {
        "type": "object",
        "properties": dict.fromkeys(names, _NUMBER),
        "required": list(names[:least]),
        "additionalProperties": False,
    }
    return {"oneOf": [array, by_name]}


POINT = {**_numbers("xyz", 2), "description": "x, y and z [m]; z is the cell's grasp height where it is left out"}
"""A place."""

JOINTS = {**_numbers("abc", 3), "description": "a [rad], b and c [m]"}
"""Joints."""


def _object(properties: dict[str, Any], description: str) -> dict[str, Any]:
    return {
        "type": "object",
        "properties": properties,
        "required": list(properties),
        "additionalProperties": False,
        "description": description,
    }


def _or_name(schema: dict[str, Any]) -> dict[str, Any]:
    named = {**_TEXT, "description": "a name, or a cell like tray[1,2]"}
    return {"anyOf": [schema, named]}


def _schema_of(argument: Argument) -> dict[str, Any]:
    match argument:
        case Target():
            return _or_name(POINT)
        case JointTarget():
            return _or_name(JOINTS)
        case _:
            return {"type": "boolean"}


def _task(primitive: type[Primitive]) -> dict[str, Any]:
    argument = primitive.argument
    value = {argument.key: _schema_of(argument)} if argument.key else {}
    return _object({"command": {"const": primitive.command}, **value}, primitive.help(units=True))


TASK: dict[str, Any] = {
    "title": "Task",
    "description": "One primitive: a step of a job by itself.",
    "oneOf": [_task(primitive) for primitive in PRIMITIVES.values()],
}
"""One primitive."""


def _step(argument: Argument) -> dict[str, Any]:
    match argument:
        case Target() | JointTarget():
            return _schema_of(argument)
        case Switch(on=on, off=off):
            return {"enum": [on, off]}
        case _:
            return {"const": True}


def _job() -> dict[str, Any]:
    schema = TypeAdapter(Job).json_schema(ref_template=REFERENCE)
    schema["$defs"]["Step"]["properties"] = {name: _step(PRIMITIVES[name].argument) for name in COMMANDS}
    schema["$defs"]["Step"] |= {"minProperties": 1, "maxProperties": 1}
    for places in ("parts", "places"):
        schema["properties"][places] |= {"additionalProperties": POINT}
    schema["properties"]["steps"]["items"]["oneOf"].append({"enum": sorted(BARE)})
    schema["properties"]["repeat"] |= {"minimum": 1, "maximum": 10_000}
    schema["description"] = "A job as people write it: named parts and places, pallets, steps, how often."
    return schema


JOB = _job()
"""A job."""


def _changes() -> dict[str, Any]:
    options = TypeAdapter(JobOptions).json_schema(ref_template=REFERENCE)
    options["properties"] = {key: one for key, one in options["properties"].items() if key != "held"}
    options["properties"] = {key: _without_default(one) for key, one in options["properties"].items()}
    options["properties"]["job"] = {"$ref": REFERENCE.format(model="Job")}
    options |= {"title": "Changes", "additionalProperties": False, "minProperties": 1}
    options["description"] = "Changes of a job: its options in the queue, or, as `job`, its steps that have not begun."
    return options


def _without_default(schema: dict[str, Any]) -> dict[str, Any]:
    return {key: one for key, one in schema.items() if key != "default"}


CHANGES = _changes()
"""Changes of a job."""


def _zone() -> dict[str, Any]:
    """Return the schema of a zone that somebody sends: its name is that of the path."""
    schema = TypeAdapter(ZoneConfig).json_schema(ref_template=REFERENCE.format(model="{model}Wish"))
    kinds = {f"{name}Wish": kind for name, kind in schema["$defs"].items()}
    for kind in kinds.values():
        kind["required"] = [key for key in kind["required"] if key != "name"]
    return schema | {"$defs": kinds, "title": "ZoneWish"}


ZONE = _zone()
"""A zone."""

GRID = TypeAdapter(Grid).json_schema(ref_template=REFERENCE)
"""A pallet."""
