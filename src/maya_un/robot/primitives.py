"""The skills as data: what every queue, file and edge calls them.

    {"command": "home"}                                {"command": "can_teleop"}
    {"command": "pick", "target": [x, y, z]}           place, approach, line alike; z may be left out; or {"x": …}
    {"command": "gripper", "open": true}
    {"command": "move", "joints": [a, b, c]}           or {"a": …}

Units are metres and radians.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from reprlib import repr

from maya_un.errors import InvalidRequest, InvalidValue, UnknownName
from maya_un.robot.approach import Approach
from maya_un.robot.can_teleop import CanTeleop
from maya_un.robot.gripper import Gripper
from maya_un.robot.home import Home
from maya_un.robot.line import Line
from maya_un.robot.move import MoveJoints
from maya_un.robot.pick import Pick
from maya_un.robot.place import Place
from maya_un.values import FARTHEST, WITHIN, Joints, Point

Primitive = Home | Approach | Pick | Place | Line | Gripper | MoveJoints | CanTeleop
"""Any skill."""


def to_dict(primitive: Primitive) -> dict[str, object]:
    """Return a primitive as plain data, as `from_dict` reads it."""
    match primitive:
        case Approach(target) | Pick(target) | Place(target) | Line(target):
            return {"command": primitive.command, "target": list(target)}
        case Gripper(open_):
            return {"command": primitive.command, "open": open_}
        case MoveJoints(joints):
            return {"command": primitive.command, "joints": list(joints)}
        case Home() | CanTeleop():
            return {"command": primitive.command}


def from_dict(data: object, grasp_height: float) -> Primitive:
    """Return the primitive that plain data names; a target without z is at `grasp_height` [m].

    Raises `InvalidRequest` for a missing, extra or wrong key, `UnknownName` for a command that is not one,
    `InvalidValue` for coordinates that are no numbers, not finite, or beyond `FARTHEST`.
    """
    if not isinstance(data, Mapping):
        raise InvalidRequest(key="task", reason='it must be an object like {"command": "home"}')
    rest = {str(key): value for key, value in data.items()}
    if "command" not in rest:
        raise InvalidRequest(key="command", reason="it is missing")
    command = rest.pop("command")
    if not isinstance(command, str) or command not in _READERS:
        raise UnknownName(name=str(command)[:64], known=", ".join(_READERS))
    key, read = _READERS[command]
    extra = sorted(set(rest) - {key})
    if extra:
        raise InvalidRequest(key=extra[0], reason=f"{command} takes {key or 'nothing'}, and no other key")
    if key and key not in rest:
        raise InvalidRequest(key=key, reason="it is missing")
    return read(rest.get(key), grasp_height)


def read_point(value: object, key: str, grasp_height: float) -> Point:
    """Return [x, y, z], [x, y] or {"x": …, "y": …, "z": …} as a point [m]; raises `InvalidValue` naming `key`."""
    if isinstance(value, Mapping):
        numbers = _by_name(value, "xyz", key, optional="z")
    else:
        numbers = _in_order(value, key, (2, 3), "[x, y] or [x, y, z] in metres")
    return Point(numbers[0], numbers[1], numbers[2] if len(numbers) > 2 else grasp_height)


def read_joints(value: object, key: str) -> Joints:
    """Return [a, b, c] or {"a": …, "b": …, "c": …} as joints (rad, m, m); raises `InvalidValue` naming `key`."""
    if isinstance(value, Mapping):
        return Joints(*_by_name(value, "abc", key))
    return Joints(*_in_order(value, key, (3,), "[a, b, c] in radians and metres"))


def _in_order(value: object, key: str, lengths: tuple[int, ...], form: str) -> list[float]:
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) not in lengths:
        raise InvalidValue(key=key, value=repr(value), reason=f"it must be {form}")
    return [_number(item, f"{key}.{place}") for place, item in enumerate(value)]


def _by_name(value: Mapping[object, object], names: str, key: str, optional: str = "") -> list[float]:
    for name in value:
        if not isinstance(name, str) or name not in tuple(names):
            raise InvalidValue(key=f"{key}.{name}", value=repr(value[name]), reason=f"it has {', '.join(names)} only")
    for name in names:
        if name not in value and name not in optional:
            raise InvalidValue(key=f"{key}.{name}", value=None, reason="it must be a number")
    return [_number(value[name], f"{key}.{name}") for name in names if name in value]


def _number(value: object, key: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InvalidValue(key=key, value=repr(value), reason="it must be a number")
    try:
        number = float(value)
    except OverflowError:
        number = float("inf")
    if not abs(number) <= FARTHEST:
        raise InvalidValue(key=key, value=repr(value), reason=WITHIN)
    return number


def _read_gripper(value: object, _: float) -> Gripper:
    if not isinstance(value, bool):
        raise InvalidValue(key="open", value=repr(value), reason="it must be true or false")
    return Gripper(value)


_READERS: dict[str, tuple[str, Callable[[object, float], Primitive]]] = {
    Home.command: ("", lambda _, __: Home()),
    Approach.command: ("target", lambda value, height: Approach(read_point(value, "target", height))),
    Pick.command: ("target", lambda value, height: Pick(read_point(value, "target", height))),
    Place.command: ("target", lambda value, height: Place(read_point(value, "target", height))),
    Line.command: ("target", lambda value, height: Line(read_point(value, "target", height))),
    Gripper.command: ("open", _read_gripper),
    MoveJoints.command: ("joints", lambda value, _: MoveJoints(read_joints(value, "joints"))),
    CanTeleop.command: ("", lambda _, __: CanTeleop()),
}
