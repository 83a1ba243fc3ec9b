"""Paths and primitives as messages, and back; and the speed for a path that must take a given time.

Paths are trajectory_msgs/JointTrajectory:

    joint_names a, b, c     straight in the joints [rad, m, m], the names in any order
                x, y, z     straight in space [m]
                a, d, z     straight around axis a [rad, m, m]

The `effort` of a point between the ends cuts its corner, [before, after, fall, rise] (`motion.path.Blend`). Velocities
and accelerations are ignored. A `time_from_start` of the last point above 0 is the least time of the motion.

Primitives are maya_robot/MayaPrimitive: `target` is the target [m], `open` the state of a switch. `line` and `move` are
additions to the manual's six commands. `move` has its joints a, b, c in `target` as x, y, z (rad, m, m).
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from typing import Any, Protocol

from dmc41x3.i18n import phrase
from maya_ros.graph.protocol import Message, header, in_seconds, stamp
from maya_un.controller.protocol import Preview
from maya_un.errors import InvalidMessage, InvalidValue, TrajectoryRefused
from maya_un.motion.path import SHARP, Blend, Path, Route, Space, Waypoint
from maya_un.robot.primitives import PRIMITIVES, Primitive, from_dict
from maya_un.robot.primitives.primitive import JointTarget, Switch, Target
from maya_un.values import FARTHEST, LEAST_SPEED, WITHIN, Joints

NAMES = {
    Space.JOINT: ("a", "b", "c"),
    Space.CARTESIAN: ("x", "y", "z"),
    Space.CYLINDRICAL: ("a", "d", "z"),
}
"""The names of the coordinates of every space, in order."""

_LESS = 0.999
"""Additional factor of the speed when a motion is slowed to reach a duration, so that few steps suffice."""

_ENOUGH = 1.02
"""A duration within this factor of the wanted one needs no better speed."""

_SAME = 1.005
"""Speeds within this factor of each other count as equal."""


class MotionPreviewer(Protocol):
    """Computes how long a motion takes (`controller.protocol.Controller.preview`)."""

    def __call__(self, path: Route, *, speed: float = 1.0) -> Preview:
        """Return what the motion along `path` at `speed` will be; raises what the motion would raise."""
        ...


def path_to_message(path: Route, least: float = 0.0) -> Message:
    """Return a path as trajectory_msgs/JointTrajectory with `least` as its least duration [s]."""
    whole = path if isinstance(path, Path) else Path.joints(*path)
    blends = whole.blends or (SHARP,) * (len(whole.waypoints) - 2)
    efforts = [[], *([] if blend == SHARP else list(blend) for blend in blends), []]
    points = [_point(waypoint, effort) for waypoint, effort in zip(whole.waypoints, efforts, strict=True)]
    points[-1]["time_from_start"] = stamp(least)
    return {"header": header(), "joint_names": list(NAMES[whole.space]), "points": points}


def path_from_message(trajectory: Mapping[str, Any]) -> tuple[Path, float]:
    """Return the path of a complete message, and its least duration [s], 0 if the message has none.

    Raises `InvalidMessage` for unknown names and for a wrong number of values, `TrajectoryRefused` for fewer than two
    points, and `InvalidValue` for numbers that are not finite or too large.
    """
    space, places = _space(trajectory["joint_names"])
    points: Sequence[Mapping[str, Any]] = trajectory["points"]
    waypoints = tuple(_waypoint(point["positions"], places, index) for index, point in enumerate(points))
    if len(waypoints) < 2:
        raise TrajectoryRefused(reason="a path needs at least a start and an end")
    blends = tuple(_blend(point["effort"], index) for index, point in enumerate(points[1:-1], start=1))
    return Path(space, waypoints, blends if any(blend != SHARP for blend in blends) else ()), _least(points[-1])


def speeds_for(preview: MotionPreviewer, path: Route, least: float) -> Generator[None, None, float]:
    """Return about the greatest speed (above 0 up to 1) at which the motion along `path` takes at least `least` [s].

    It yields between two previews, for `maya_un.workers`. Raises what `preview` raises, and `TrajectoryRefused` if the
    motion would have to be slower than possible.
    """
    if least <= 0.0:
        return 1.0
    fast, speed, duration = 1.0, 1.0, preview(path).duration
    while 0.0 < duration < least:
        if speed <= LEAST_SPEED:
            reason = phrase(
                "it is to take {least:.1f} s, and at its slowest it takes {duration:.1f} s",
                least=least,
                duration=duration,
            )
            raise TrajectoryRefused(reason=reason)
        fast, speed = speed, max(LEAST_SPEED, _LESS * speed * duration / least)
        yield
        duration = preview(path, speed=speed).duration
    while speed < fast and duration > _ENOUGH * least and fast > _SAME * speed:
        between = (speed * fast) ** 0.5
        yield
        found = preview(path, speed=between).duration
        if found < least:
            fast = between
        else:
            speed, duration = between, found
    return speed


def _point(waypoint: Waypoint, effort: Sequence[float]) -> Message:
    return {
        "positions": list(waypoint),
        "velocities": [],
        "accelerations": [],
        "effort": list(effort),
        "time_from_start": stamp(0.0),
    }


def _space(names: Sequence[str]) -> tuple[Space, tuple[int, int, int]]:
    """Return the space of some names, and the index of each coordinate."""
    for space, own in NAMES.items():
        if sorted(names) == sorted(own) and (space is Space.JOINT or tuple(names) == own):
            first, second, third = (list(names).index(name) for name in own)
            return space, (first, second, third)
    choices = ", ".join(" ".join(own) for own in NAMES.values())
    reason = phrase("it must be one of {choices}, not {given!r}", choices=choices, given=" ".join(names)[:60])
    raise InvalidMessage(name="joint_names", reason=reason)


def _waypoint(positions: Sequence[float], places: tuple[int, int, int], index: int) -> Waypoint:
    if len(positions) != 3:
        raise InvalidMessage(
            name=f"points[{index}].positions", reason=phrase("it must have 3 items, not {count}", count=len(positions))
        )
    first, second, third = (positions[place] for place in places)
    if max(abs(first), abs(second), abs(third)) > FARTHEST:
        raise InvalidValue(key=f"points[{index}].positions", value=tuple(positions), reason=WITHIN)
    return first, second, third


def _blend(effort: Sequence[float], index: int) -> Blend:
    if not effort:
        return SHARP
    if len(effort) != len(SHARP):
        reason = phrase(
            "it is empty or has {wanted} items, before, after, fall and rise, not {given}",
            wanted=len(SHARP),
            given=len(effort),
        )
        raise InvalidMessage(name=f"points[{index}].effort", reason=reason)
    return Blend(*effort)


def _least(last: Mapping[str, Any]) -> float:
    return max(0.0, in_seconds(last["time_from_start"]))


def joints_of(message: Mapping[str, float]) -> Joints:
    """Return the joints of a goal with a, b, c (rad, m, m); raises `InvalidValue` for values out of range."""
    joints = Joints(message["a"], message["b"], message["c"])
    if not all(abs(value) <= FARTHEST for value in joints):
        raise InvalidValue(key="joints", value=tuple(joints), reason=WITHIN)
    return joints


_NOWHERE = (0.0, 0.0, 0.0)


def primitive_to_message(primitive: Primitive) -> dict[str, Any]:
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


def primitive_from_message(message: Mapping[str, Any]) -> Primitive:
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
