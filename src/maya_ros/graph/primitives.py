"""Primitives as messages (maya_robot/MayaPrimitive) and back.

A target is in `target` [m], the state of a switch in `open`. Besides the manual's six commands there are ours: `line`,
and `move`, whose joints a, b, c stand in `target` as x, y, z (rad, m, m).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from maya_un.robot.primitives import PRIMITIVES, Primitive, from_dict
from maya_un.robot.primitives.arguments import JointTarget, Switch, Target

_NOWHERE = (0.0, 0.0, 0.0)


def to_message(primitive: Primitive) -> dict[str, Any]:
    """Return the message of a primitive."""
    target, state = _NOWHERE, False
    match primitive.argument:
        case Target() | JointTarget():
            target = primitive.value
        case Switch():
            state = primitive.value
        case _:
            pass
    return {"command": primitive.command, "target": dict(zip("xyz", target, strict=True)), "open": state}


def from_message(message: Mapping[str, Any]) -> Primitive:
    """Return the primitive of a message (m; rad); raises `UnknownName`, `InvalidValue`."""
    command = message["command"]
    argument = PRIMITIVES[command].argument if command in PRIMITIVES else None
    data: dict[str, object] = {"command": command}
    match argument:
        case Target(key=key):
            data[key] = dict(message["target"])
        case JointTarget(key=key):
            data[key] = [message["target"][axis] for axis in "xyz"]
        case Switch(key=key):
            data[key] = message["open"]
        case _:
            pass
    return from_dict(data, 0.0)
