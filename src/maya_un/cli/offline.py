"""`maya fk|ik|reach`: questions about the machine that need no machine."""

from __future__ import annotations

from math import degrees

from maya_un.cli import output
from maya_un.cli.configure import configuration
from maya_un.cli.settings import Settings
from maya_un.cli.words import word
from maya_un.errors import Unreachable
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
    workspace = Workspace.of(configuration(settings))
    try:
        joints = workspace.require(point)
    except Unreachable as refusal:
        return _out_of_reach(workspace, point, refusal, settings)
    value = {"reachable": True, "joints": joints._asdict(), "reason": None, "nearest": point._asdict()}
    text = f"{word('reachable', settings.language)}: {joints_text(joints)}"
    return output.answer(value, text, settings)


def _out_of_reach(workspace: Workspace, point: Point, refusal: Unreachable, settings: Settings) -> int:
    nearest = workspace.nearest(point)
    reason = str(refusal.details["reason"])
    value = {"reachable": False, "joints": None, "reason": reason, "nearest": nearest._asdict()}
    text = word("out_of_reach", settings.language, reason=reason, nearest=point_text(nearest))
    output.answer(value, text, settings)
    return output.FAILED
