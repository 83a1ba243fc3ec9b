"""A robot's description (urdf) read by its own rules: the tree of joints, and where its links are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import cos, sin
from xml.etree import ElementTree as ET

import numpy as np

from maya_un.kinematics import Floats
from tests.conventions.source import ROOT

MACROS = ROOT / "ros" / "maya_controller" / "urdf" / "maya_robot.xacro"


@dataclass(frozen=True)
class Joint:
    """One joint; `mimics` is the joint that it follows, with factor and offset."""

    name: str
    kind: str
    parent: str
    child: str
    origin: Floats
    axis: Floats
    mimics: tuple[str, float, float] | None


class Tree:
    """The links and joints of a description."""

    def __init__(self, text: str) -> None:
        robot = ET.fromstring(text)
        self.links = [link.attrib["name"] for link in robot.iter("link")]
        self.joints = [_joint(joint) for joint in robot.findall("joint")]
        self.materials = {material.attrib["name"] for material in robot.findall("material")}
        self.used = {material.attrib["name"] for visual in robot.iter("visual") for material in visual.iter("material")}
        self._above = {joint.child: joint for joint in self.joints}

    @property
    def free(self) -> set[str]:
        """The joints that have to be published."""
        return {joint.name for joint in self.joints if joint.kind != "fixed" and joint.mimics is None}

    def frame(self, link: str, positions: Mapping[str, float]) -> Floats:
        """Return the homogeneous transform from the root to a link, shape (4, 4)."""
        found = np.eye(4)
        joint = self._above.get(link)
        while joint is not None:
            found = joint.origin @ _moved(joint, self._position(joint, positions)) @ found
            joint = self._above.get(joint.parent)
        return found

    def _position(self, joint: Joint, positions: Mapping[str, float]) -> float:
        if joint.kind == "fixed":
            return 0.0
        if joint.mimics is None:
            return positions[joint.name]
        followed, factor, offset = joint.mimics
        return factor * positions[followed] + offset


def _joint(element: ET.Element) -> Joint:
    def part(name: str) -> Mapping[str, str]:
        found = element.find(name)
        return {} if found is None else found.attrib

    mimic = part("mimic")
    follows = (mimic["joint"], float(mimic.get("multiplier", 1.0)), float(mimic.get("offset", 0.0))) if mimic else None
    return Joint(
        element.attrib["name"],
        element.attrib["type"],
        part("parent")["link"],
        part("child")["link"],
        _origin(_numbers(part("origin").get("xyz", "0 0 0")), _numbers(part("origin").get("rpy", "0 0 0"))),
        np.array(_numbers(part("axis").get("xyz", "1 0 0"))),
        follows,
    )


def _numbers(text: str) -> list[float]:
    return [float(number) for number in text.split()]


def _origin(xyz: list[float], rpy: list[float]) -> Floats:
    roll, pitch, yaw = (np.array(axis) for axis in np.eye(3))
    frame = np.eye(4)
    frame[:3, :3] = _rotation(yaw, rpy[2]) @ _rotation(pitch, rpy[1]) @ _rotation(roll, rpy[0])
    frame[:3, 3] = xyz
    return frame


def _rotation(axis: Floats, angle: float) -> Floats:
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + sin(angle) * cross + (1.0 - cos(angle)) * cross @ cross


def _moved(joint: Joint, position: float) -> Floats:
    frame = np.eye(4)
    if joint.kind == "prismatic":
        frame[:3, 3] = position * joint.axis
    elif joint.kind != "fixed":
        frame[:3, :3] = _rotation(joint.axis, position)
    return frame
