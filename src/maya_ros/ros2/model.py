"""The frames of a robot's description (URDF): what robot_state_publisher makes of /joint_states for /tf.

A joint places the frame of its child in that of its parent: first its origin, then its motion along or about its axis
(wiki.ros.org/urdf/XML/joint). Rotations are quaternions (x, y, z, w).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import cos, sin
from typing import NamedTuple
from xml.etree import ElementTree as ET

from maya_ros.graph.protocol import Message, Stamp

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

_STILL: Quaternion = (0.0, 0.0, 0.0, 1.0)


class FrameJoint(NamedTuple):
    """A joint of a description: it moves as `moves`, times a factor, plus an offset; "" for a fixed one."""

    parent: str
    child: str
    place: Vector
    turn: Quaternion
    axis: Vector
    turns: bool
    moves: str
    factor: float = 1.0
    offset: float = 0.0

    def transform(self, value: float) -> tuple[Vector, Quaternion]:
        """Return place and rotation of the child in its parent, where the joint it moves as is at `value`."""
        q = self.factor * value + self.offset
        x, y, z = self.axis
        if self.turns:
            half = sin(0.5 * q)
            return self.place, _product(self.turn, (half * x, half * y, half * z, cos(0.5 * q)))
        way = _rotated(self.turn, (q * x, q * y, q * z))
        return (self.place[0] + way[0], self.place[1] + way[1], self.place[2] + way[2]), self.turn


class FrameTree:
    """All frames of a description."""

    def __init__(self, description: str) -> None:
        joints = [_joint(element) for element in ET.fromstring(description).findall("joint")]
        self._moving = [joint for joint in joints if joint.moves]
        self._fixed = [joint for joint in joints if not joint.moves]

    def moving(self, joint_state: Message) -> Message:
        """Return the frames that move, as tf2_msgs/TFMessage, of a sensor_msgs/JointState with all free joints."""
        values: Mapping[str, float] = dict(zip(joint_state["name"], joint_state["position"], strict=True))
        when = joint_state["header"]["stamp"]
        return {"transforms": [_stamped(joint, values[joint.moves], when) for joint in self._moving]}

    def fixed(self, when: Stamp) -> Message:
        """Return the frames that do not move, as tf2_msgs/TFMessage."""
        return {"transforms": [_stamped(joint, 0.0, when) for joint in self._fixed]}


def _joint(element: ET.Element) -> FrameJoint:
    def part(name: str) -> Mapping[str, str]:
        found = element.find(name)
        return {} if found is None else found.attrib

    kind, mimic = element.attrib["type"], part("mimic")
    moves = "" if kind == "fixed" else mimic.get("joint", element.attrib["name"])
    return FrameJoint(
        part("parent")["link"],
        part("child")["link"],
        _vector(part("origin").get("xyz", "0 0 0")),
        _turned(*_vector(part("origin").get("rpy", "0 0 0"))),
        _vector(part("axis").get("xyz", "1 0 0")),
        kind in ("revolute", "continuous"),
        moves,
        float(mimic.get("multiplier", 1.0)),
        float(mimic.get("offset", 0.0)),
    )


def _vector(text: str) -> Vector:
    x, y, z = (float(word) for word in text.split())
    return x, y, z


def _stamped(joint: FrameJoint, value: float, when: Stamp) -> Message:
    place, turn = joint.transform(value)
    return {
        "header": {"stamp": when, "frame_id": joint.parent},
        "child_frame_id": joint.child,
        "transform": {
            "translation": dict(zip("xyz", place, strict=True)),
            "rotation": dict(zip("xyzw", turn, strict=True)),
        },
    }


def _turned(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the rotation about the fixed axes x, then y, then z."""
    about: Sequence[Quaternion] = (
        (sin(0.5 * roll), 0.0, 0.0, cos(0.5 * roll)),
        (0.0, sin(0.5 * pitch), 0.0, cos(0.5 * pitch)),
        (0.0, 0.0, sin(0.5 * yaw), cos(0.5 * yaw)),
    )
    found = _STILL
    for one in about:
        found = _product(one, found)
    return found


def _product(p: Quaternion, q: Quaternion) -> Quaternion:
    """Return the rotation p after q."""
    px, py, pz, pw = p
    qx, qy, qz, qw = q
    return (
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
        pw * qw - px * qx - py * qy - pz * qz,
    )


def _rotated(q: Quaternion, v: Vector) -> Vector:
    x, y, z, w = q
    rx, ry, rz, _ = _product(_product(q, (*v, 0.0)), (-x, -y, -z, w))
    return rx, ry, rz
