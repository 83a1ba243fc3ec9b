"""Primitives as messages (maya_robot/MayaPrimitive) and back.

Besides the manual's six commands `line` goes to its target and `move` to the joints a, b, c that its target holds as
x, y, z (rad, m, m): both are ours.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from maya_un.robot.approach import Approach
from maya_un.robot.can_teleop import CanTeleop
from maya_un.robot.gripper import Gripper
from maya_un.robot.home import Home
from maya_un.robot.line import Line
from maya_un.robot.move import MoveJoints
from maya_un.robot.pick import Pick
from maya_un.robot.place import Place
from maya_un.robot.primitives import Primitive, from_dict

_TARGETED = {Pick.command, Place.command, Approach.command, Line.command}


def to_message(primitive: Primitive) -> dict[str, Any]:
    """Return the message of a primitive."""
    target, open_ = (0.0, 0.0, 0.0), False
    match primitive:
        case Approach(target) | Pick(target) | Place(target) | Line(target) | MoveJoints(target):
            pass
        case Gripper(open_):
            pass
        case Home() | CanTeleop():
            pass
    return {"command": primitive.command, "target": dict(zip("xyz", target, strict=True)), "open": open_}


def from_message(message: Mapping[str, Any]) -> Primitive:
    """Return the primitive of a message (m; rad); raises `UnknownName`, `InvalidValue`."""
    command, target = message["command"], message["target"]
    data: dict[str, object] = {"command": command}
    if command in _TARGETED:
        data["target"] = dict(target)
    elif command == MoveJoints.command:
        data["joints"] = [target["x"], target["y"], target["z"]]
    elif command == Gripper.command:
        data["open"] = message["open"]
    return from_dict(data, 0.0)
