"""`maya fk|ik|reach`: questions about the machine that need no machine."""

from __future__ import annotations

from math import degrees

from maya_un.api.messages import Reach, to_data
from maya_un.cli import output
from maya_un.cli.configure import configuration
from maya_un.cli.settings import Settings
from maya_un.cli.words import word
from maya_un.kinematics.workspace import Workspace
from maya_un.values import Joints, Point


def joints_text(joints: Joints) -> str:
    """Return joints for people: degrees and millimetres."""
    return f"a {degrees(joints.a):.4f}°  b {joints.b * 1e3:.3f} mm  c {joints.c * 1e3:.3f} mm"


def point_text(point: Point) -> str:
    """Return a point for people: millimetres."""
    return "  ".join(f"{name} {value * 1e3:.3f} mm" for name, value in zip("xyz", point, strict=True))


def fk(joints: Joints, settings: Settings) -> int:
    """Print where `joints` (rad, m, m) hold the gripper [m]; raises `Unreachable`."""
    point = Workspace.of(configuration(settings)).fk(joints)
    return output.answer(point._asdict(), point_text(point), settings)


def ik(point: Point, settings: Settings) -> int:
    """Print the joints (rad, m, m) that hold the gripper at `point` [m]; raises `Unreachable`."""
    joints = Workspace.of(configuration(settings)).require(point)
    return output.answer(joints._asdict(), joints_text(joints), settings)


def reach(point: Point, settings: Settings) -> int:
    """Print whether `point` [m] can be reached, else why not and the nearest that can.

    Exit code 0 where it can, 1 where not: both are answers.
    """
    found = Reach.of(Workspace.of(configuration(settings)), point)
    joints = None if found.joints is None else found.joints._asdict()
    value = {**to_data(found), "joints": joints, "nearest": found.nearest._asdict()}
    output.answer(value, _reach_text(found, settings.language), settings)
    return output.DONE if found.reachable else output.FAILED


def _reach_text(found: Reach, language: str) -> str:
    if found.joints is not None:
        return f"{word('reachable', language)}: {joints_text(found.joints)}"
    return word("out_of_reach", language, reason=found.reason, nearest=point_text(found.nearest))
