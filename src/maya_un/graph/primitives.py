"""Primitives as messages (maya_robot/MayaPrimitive) and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from maya_un.errors import NotOverRos
from maya_un.robot.approach import Approach
from maya_un.robot.can_teleop import CanTeleop
from maya_un.robot.gripper import Gripper
from maya_un.robot.home import Home
from maya_un.robot.pick import Pick
from maya_un.robot.place import Place
from maya_un.robot.primitives import Primitive, from_dict

_TARGETED = {Pick.command, Place.command, Approach.command}


def sayable(primitive: Primitive) -> bool:
    """Whether the manual's message has words for a primitive; it has none for a line and for joints."""
    return isinstance(primitive, Home | Approach | Pick | Place | Gripper | CanTeleop)


def to_message(primitive: Primitive) -> dict[str, Any]:
    """Return the message of a primitive; raises `NotOverRos` for one that it has no words for."""
    target = {"x": 0.0, "y": 0.0, "z": 0.0}
    match primitive:
        case Approach(point) | Pick(point) | Place(point):
            return {"command": primitive.command, "target": dict(zip("xyz", point, strict=True)), "open": False}
        case Gripper(open_):
            return {"command": primitive.command, "target": target, "open": open_}
        case Home() | CanTeleop():
            return {"command": primitive.command, "target": target, "open": False}
        case _:
            raise NotOverRos(wish=primitive.command)


def from_message(message: Mapping[str, Any]) -> Primitive:
    """Return the primitive of a message [m]; raises `UnknownName`, `InvalidValue`, and `NotOverRos` as `to_message`."""
    command = message["command"]
    if command in _TARGETED:
        primitive = from_dict({"command": command, "target": dict(message["target"])}, 0.0)
    elif command == Gripper.command:
        primitive = from_dict({"command": command, "open": message["open"]}, 0.0)
    elif command in {"line", "move"}:
        raise NotOverRos(wish=command)
    else:
        primitive = from_dict({"command": command}, 0.0)
    return primitive
