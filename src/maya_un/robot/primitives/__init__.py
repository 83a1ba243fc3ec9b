"""The primitives of Maya: one module declares one primitive, and this list holds them all.

    {"command": "home"}                                {"command": "can_teleop"}
    {"command": "pick", "target": [x, y, z]}           place, approach, line likewise; z may be omitted; or {"x": …}
    {"command": "gripper", "open": true}
    {"command": "move", "joints": [a, b, c]}           or {"a": …}

Units are metres and radians.
"""

from __future__ import annotations

from collections.abc import Mapping

from dmc41x3.i18n import phrase
from maya_un.errors import InvalidRequest, UnknownName
from maya_un.robot.primitives.approach import Approach
from maya_un.robot.primitives.can_teleop import CanTeleop
from maya_un.robot.primitives.gripper import Gripper
from maya_un.robot.primitives.home import Home
from maya_un.robot.primitives.line import Line
from maya_un.robot.primitives.move import MoveJoints
from maya_un.robot.primitives.pick import Pick
from maya_un.robot.primitives.place import Place
from maya_un.robot.primitives.primitive import Primitive

PRIMITIVES: dict[str, type[Primitive]] = {
    one.command: one for one in (Home, Pick, Place, Approach, Line, Gripper, MoveJoints, CanTeleop)
}
"""The primitives by their names."""


def to_dict(primitive: Primitive) -> dict[str, object]:
    """Return a primitive as plain data, as `from_dict` reads it."""
    argument = primitive.argument
    value = {argument.key: argument.plain(primitive.value)} if argument.key else {}
    return {"command": primitive.command, **value}


def from_dict(data: object, grasp_height: float) -> Primitive:
    """Return the primitive that plain data names; a target without z is at `grasp_height` [m].

    Raises `InvalidRequest` for a missing, extra or wrong key, `UnknownName` for a command that is not one,
    `InvalidValue` for coordinates that are no numbers, not finite, or beyond `FARTHEST`.
    """
    if not isinstance(data, Mapping):
        raise InvalidRequest(key="task", reason=phrase('it must be an object like {{"command": "home"}}'))
    rest = {str(key): value for key, value in data.items()}
    if "command" not in rest:
        raise InvalidRequest(key="command", reason="it is missing")
    command = rest.pop("command")
    if not isinstance(command, str) or command not in PRIMITIVES:
        raise UnknownName(name=str(command)[:64], known=", ".join(PRIMITIVES))
    primitive = PRIMITIVES[command]
    argument = primitive.argument
    extra = sorted(set(rest) - {argument.key})
    if extra:
        raise InvalidRequest(
            key=extra[0],
            reason=phrase(
                "{command} takes {key}, and no other key", command=command, key=argument.key or phrase("nothing")
            ),
        )
    if not argument.key:
        return primitive()
    if argument.key not in rest:
        raise InvalidRequest(key=argument.key, reason="it is missing")
    return primitive(**{argument.key: argument.read(rest[argument.key], grasp_height)})
