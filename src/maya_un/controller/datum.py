"""The datum that a person gives: the pose in which the robot stands, in place of a switch that shows it.

A machine without switches at the short ends of its lines, or without torque readings, cannot find its position alone.
A person moves it to a known pose by guarded moves, and states its joints. A person can be wrong: by some millimetres,
or by exchanging two lines. So, until a second point confirms the datum, motion is slow, stays away from the ends of the
strokes, and has little tension; the torque limit of its path (`registers.Torque`) bounds what a wrong datum can do.

The controller stores the datum beside the mark of a homing (`monitor`), so it survives a restart of this program:
`mayagiv` is 1 for a given datum, 2 for a confirmed one, and 0 for a homing by switches; `mayagva`, `mayagvb` and
`mayagvc` are the counts of the given pose.
"""

from __future__ import annotations

from dataclasses import replace
from math import sqrt
from typing import NamedTuple

from dmc41x3.driver import Driver
from dmc41x3.i18n import phrase
from maya_un.axes import AXES
from maya_un.config import Units
from maya_un.config.model import APART, STATED_WITHIN
from maya_un.errors import CommandRejected, DatumContradicted, DatumRefused, InvalidValue, UnknownName
from maya_un.kinematics.workspace import Stroke, Workspace
from maya_un.values import Joints

NUDGE = Joints(0.09, 0.05, 0.05)
"""Longest guarded move (rad, m, m)."""

SPEED = 0.1
"""Share of the speeds and accelerations of motion, until the datum is confirmed."""

STRAIGHT = 1.0128
"""Least true b + c until then, as a multiple of W; in the middle of that ellipse a line carries 3.2 loads."""


def tension_limit(width: float) -> float:
    """Return the limit of the tension until the datum is confirmed [loads], for anchors `width` (W) apart [m].

    Both lines may be shorter than stated by `STATED_WITHIN`. In the middle of an ellipse about the anchors, a line
    carries A / (2 sqrt(A² - 1)) loads, with A = (b + c) / W (docs/explanation/homing.md).
    """
    ratio = STRAIGHT + (STATED_WITHIN.b + STATED_WITHIN.c) / width
    return ratio / (2.0 * sqrt(ratio * ratio - 1.0))


class GivenDatum(NamedTuple):
    """The pose that a person has stated (rad, m, m), and whether a second point has confirmed it."""

    joints: Joints
    confirmed: bool = False


def written(datum: GivenDatum | None, units: Units) -> list[str]:
    """Return the commands that store a datum in the controller; None stores that switches have shown the position."""
    if datum is None:
        return ["mayagiv=0"]
    counts = zip(AXES, units.to_counts(datum.joints), strict=True)
    return [*(f"mayagv{axis}={count}" for axis, count in counts), f"mayagiv={2 if datum.confirmed else 1}"]


async def read(driver: Driver, units: Units) -> GivenDatum | None:
    """Return the datum that the controller stores, None if switches have shown the position."""
    try:
        state = await driver.value("mayagiv")
        if not state:
            return None
        a, b, c = [await driver.value(f"mayagv{axis}") for axis in AXES]
    except CommandRejected:  # homed by a program that knew no given datum
        return None
    return GivenDatum(units.to_joints((a, b, c)), state == 2)


def require_nudge(axis: str, distance: float) -> int:
    """Return the number of an axis; raises `UnknownName` for another name, `InvalidValue` for too long a move."""
    if axis not in AXES:
        raise UnknownName(name=axis, known=", ".join(AXES))
    number = AXES.index(axis)
    if distance == 0.0:
        raise InvalidValue(key="distance", value=shown(axis, distance), reason="it must not be 0")
    if not abs(distance) <= NUDGE[number]:
        reason = phrase("one `maya datum move` is at most 50 mm or 5 degrees long")
        raise InvalidValue(key="distance", value=shown(axis, distance), reason=reason)
    return number


def narrowed(workspace: Workspace) -> Workspace:
    """Return the part of a workspace in which the robot may move until its datum is confirmed."""

    def inside(stroke: Stroke, margin: float) -> Stroke:
        low, high = stroke
        return low + margin, high - margin

    return replace(
        workspace,
        boom=inside(workspace.boom, STATED_WITHIN.a),
        line_b=inside(workspace.line_b, STATED_WITHIN.b),
        line_c=inside(workspace.line_c, STATED_WITHIN.c),
        tension_limit=min(workspace.tension_limit, tension_limit(workspace.mechanism.width)),
    )


def second_point(datum: GivenDatum | None, here: Joints) -> GivenDatum:
    """Return a datum as confirmed.

    Raises `DatumRefused` unless it waits for that, and every axis has moved away from its pose.
    """
    if datum is None or datum.confirmed:
        raise DatumRefused(reason=phrase("no datum waits for its confirmation"))
    for axis, given, now, least in zip(AXES, datum.joints, here, APART, strict=True):
        if abs(now - given) < least:
            raise DatumRefused(
                reason=phrase(
                    "the second point must be another one, and axis {axis} has moved by less than {distance} since",
                    axis=axis,
                    distance=shown(axis, least),
                )
            )
    return datum._replace(confirmed=True)


def contradiction(here: Joints, stated: Joints) -> DatumContradicted | None:
    """Return the error for the axis that is not where a person states it; None if all are within `STATED_WITHIN`."""
    for axis, now, value, most in zip(AXES, here, stated, STATED_WITHIN, strict=True):
        if abs(now - value) > most:
            return DatumContradicted(axis=axis, distance=shown(axis, value - now))
    return None


def shown(axis: str, value: float) -> str:
    """Return an angle [rad] or a length [m] of an axis as text."""
    if axis == "a":
        return phrase("{angle} deg", angle=f"{value * 57.29577951308232:.1f}")
    return f"{value * 1000.0:.1f} mm"
