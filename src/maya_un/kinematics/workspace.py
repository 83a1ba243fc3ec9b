"""The workspace: what Maya may reach, why not, and the nearest place that it may.

"The workspace" means everywhere the same set: strokes of the lines and range of the boom, both lines taut
(0 ≤ u ≤ W), no line carrying more than the tension limit, lines long enough to meet (b + c > W), the gripper not
below the table top (z ≥ 0).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import product
from math import atan2, cos, degrees, dist, floor, hypot, inf, isfinite, pi, sin, sqrt, tau
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from maya_un.config import Config, Units
from maya_un.errors import InvalidConfig, Unreachable
from maya_un.kinematics.mechanism import Floats, Mechanism
from maya_un.kinematics.section import Section
from maya_un.kinematics.statics import tension
from maya_un.kinematics.zones import Zone, zone_of
from maya_un.values import Joints, Point

Stroke = tuple[float, float]
"""Short and long end of an axis (rad or m)."""

TOLERANCE = 1e-9
"""Limits hold to this much (m, rad, and as a share of the tension limit): rounding of double precision."""

_INSETS = (1e-6, 1e-5, 1e-4)


class Limit(StrEnum):
    """The limits of the workspace, in the order in which a refusal names them."""

    NUMBER = "number"
    COUPLING = "coupling"
    ANCHORS = "anchors"
    BOOM = "boom"
    INNER = "inner"
    OUTER = "outer"
    FLOOR = "floor"
    LINE_B = "line_b"
    LINE_C = "line_c"
    TENSION_B = "tension_b"
    TENSION_C = "tension_c"


class Margins(NamedTuple):
    """Distance to every limit, negative beyond it: `boom` in rad, tensions in loads, all others in m."""

    coupling: float
    boom: float
    inner: float
    outer: float
    floor: float
    line_b: float
    line_c: float
    tension_b: float
    tension_c: float


@dataclass(frozen=True, slots=True)
class Reason:
    """Why something is not reachable: which limit, by how much (`unit`: "m", "rad" or "load"), in words."""

    limit: Limit
    excess: float
    unit: str
    text: str

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, slots=True)
class Verdict:
    """The answer about one set of joints: the distance to every limit, and the reason where one is broken."""

    margins: Margins
    reason: Reason | None

    @property
    def reachable(self) -> bool:
        """Whether all limits are kept."""
        return self.reason is None


@dataclass(frozen=True, slots=True)
class Workspace:
    """The set of reachable joints and places of one machine.

    `boom`, `line_b`, `line_c` are the ranges of the axes (rad, m, m), `tension_limit` is a multiple of the
    load, `grain` the size of one encoder count (rad, m, m). `zones` are kept out of, too. Made by `Workspace.of`.
    """

    mechanism: Mechanism
    boom: Stroke
    line_b: Stroke
    line_c: Stroke
    tension_limit: float
    grain: tuple[float, float, float]
    zones: tuple[Zone, ...] = ()

    @classmethod
    def of(cls, config: Config, strokes: tuple[Stroke, Stroke, Stroke] | None = None) -> Workspace:
        """Return the workspace of a configuration.

        `strokes` replaces the configured ranges of a, b, c (rad, m, m) by measured ones. Raises
        `InvalidConfig` where nothing at all is reachable.
        """
        boom, line_b, line_c = strokes or tuple(
            (axis.minimum, axis.maximum) for axis in (config.axes.a, config.axes.b, config.axes.c)
        )
        limit = config.safety.tension_limit
        per_unit = Units.of(config).per_unit
        grain = (1.0 / per_unit[0], 1.0 / per_unit[1], 1.0 / per_unit[2])
        zones = tuple(map(zone_of, config.zones))
        workspace = cls(Mechanism.of(config), boom, line_b, line_c, limit, grain, zones)
        if workspace.section.shrunk(_INSETS[-1]).is_empty():
            reason = "with these lengths and strokes no place keeps it, so nothing is reachable"
            raise InvalidConfig(key="safety.tension_limit", value=limit, reason=reason)
        return workspace

    def with_zones(self, zones: Sequence[Zone]) -> Workspace:
        """Return the same workspace with these zones instead of its own."""
        return replace(self, zones=tuple(zones))

    @property
    def zone_grain(self) -> float:
        """Bound of how far one count of every axis moves gripper, lines and anchors [m].

        A place beside a zone, rounded to whole counts, may be that much nearer to it.
        """
        grain_a, grain_b, grain_c = self.grain
        return self.mechanism.length * grain_a + (1.0 + self.tension_limit) * (grain_b + grain_c)

    @property
    def section(self) -> Section:
        """The reachable area of the vertical plane through the boom."""
        mechanism = self.mechanism
        return Section(mechanism.width, self.line_b, self.line_c, self.tension_limit, mechanism.reach_down)

    def contains(self, joints: Joints) -> bool:
        """Whether the joints keep every limit (to `TOLERANCE`); False for numbers that are not finite."""
        a, b, c = joints
        if not (
            self.boom[0] - TOLERANCE <= a <= self.boom[1] + TOLERANCE
            and self.line_b[0] - TOLERANCE <= b <= self.line_b[1] + TOLERANCE
            and self.line_c[0] - TOLERANCE <= c <= self.line_c[1] + TOLERANCE
        ):
            return False
        mechanism = self.mechanism
        W = mechanism.width
        u = 0.5 * W + (b - c) * (b + c) / (2.0 * W)
        square = (b - u) * (b + u)
        if not (-TOLERANCE <= u <= W + TOLERANCE and square > 0.0):
            return False
        deepest = mechanism.height - mechanism.drop + TOLERANCE
        pull = self.tension_limit * (1.0 + TOLERANCE) * W * sqrt(square)
        return square <= deepest * deepest and (W - u) * b <= pull and u * c <= pull

    def contains_many(self, joints: Floats) -> NDArray[np.bool_]:
        """Return for joints of shape (n, 3) which rows `contains` accepts, shape (n,)."""
        a, b, c = joints.T
        W = self.mechanism.width
        u = 0.5 * W + (b - c) * (b + c) / (2.0 * W)
        square = (b - u) * (b + u)
        deepest = self.mechanism.reach_down + TOLERANCE
        pull = self.tension_limit * (1.0 + TOLERANCE) * W * np.sqrt(np.maximum(square, 0.0))
        inside = (square > 0.0) & (square <= deepest * deepest) & ((W - u) * b <= pull) & (u * c <= pull)
        for column, (least, most) in ((a, self.boom), (b, self.line_b), (c, self.line_c), (u, (0.0, W))):
            inside &= (column >= least - TOLERANCE) & (column <= most + TOLERANCE)
        return inside

    def ik(self, point: Point) -> Joints:
        """Return the joints that hold the gripper at `point` [m], or raise `Unreachable` (see `require`)."""
        x, y, z = point
        if isfinite(x + y + z) and z < self.mechanism.height - self.mechanism.drop:
            joints = self.mechanism.ik(point)
            if self.contains(joints):
                return joints
        raise self._unreachable(point)

    def fk(self, joints: Joints) -> Point:
        """Return the gripper point [m] of joints in the workspace, or raise `Unreachable` (see `require`)."""
        if self.contains(joints):
            return self.mechanism.fk(joints)
        raise self._unreachable(joints)

    def require(self, target: Point | Joints) -> Joints:
        """Return the joints of a target in the workspace.

        Raises `Unreachable` otherwise: besides the words its details hold `limit`, `excess` (SI) and
        `nearest_point`, which is reachable.
        """
        if isinstance(target, Point):
            return self.ik(target)
        if self.contains(target):
            return target
        raise self._unreachable(target)

    def margins(self, joints: Joints) -> Margins:
        """Return the distance to every limit (see `Margins`)."""
        a, b, c = joints
        W = self.mechanism.width
        u, square = self.mechanism.section(joints)
        h = sqrt(square) if square > 0.0 else 0.0
        pull_b, pull_c = tension(u, h, W)
        return Margins(
            coupling=b + c - W,
            boom=_inside(a, self.boom),
            inner=u,
            outer=W - u,
            floor=self.mechanism.reach_down - h,
            line_b=_inside(b, self.line_b),
            line_c=_inside(c, self.line_c),
            tension_b=self.tension_limit - pull_b,
            tension_c=self.tension_limit - pull_c,
        )

    def check(self, joints: Joints) -> Verdict:
        """Return the distance to every limit together with the reason for a refusal, if there is one."""
        return Verdict(self.margins(joints), self.why_not(joints))

    def why_not(self, target: Point | Joints) -> Reason | None:
        """Return why a target is not reachable, None where it is.

        Where several limits are broken, the first in the order of `Limit` is named.
        """
        if not _is_sensible(target):
            return Reason(Limit.NUMBER, 0.0, "m", "it is not a place: every coordinate must be a finite number")
        if isinstance(target, Joints):
            return None if self.contains(target) else self._broken(target)
        depth = self.mechanism.reach_down - target.z
        if depth <= 0.0:
            return Reason(Limit.ANCHORS, -depth, "m", f"it lies {_mm(-depth)} above the anchors of the lines")
        joints = self.mechanism.ik(target)
        return None if self.contains(joints) else self._broken(joints)

    def nearest(self, target: Point) -> Point:
        """Return the reachable place nearest to `target` [m], the target itself where it is reachable.

        The boom turns to the nearest angle of its range; in that vertical plane the nearest place of the
        section is taken, a micrometre inside its edge so that rounding cannot push it out again. A target that
        is no place at all (not a finite number, or a million metres away) is taken as the foot of axis a.
        """
        if self.why_not(target) is None:
            return target
        mechanism = self.mechanism
        if not _is_sensible(target):
            target = Point(0.0, 0.0, 0.0)
        bearing = atan2(target.x, target.y)
        a = _nearest_angle(bearing, self.boom)
        radius = hypot(target.x, target.y) * cos(bearing - a)
        u, h = radius - mechanism.delta, mechanism.reach_down - target.z
        for inset in _INSETS:
            near_u, near_h = self.section.shrunk(inset).nearest(u, h)
            d = mechanism.delta + near_u
            found = Point(d * sin(a), d * cos(a), mechanism.reach_down - near_h)
            if self.why_not(found) is None:
                return found
        raise AssertionError("a place inside the shrunk section is in the workspace")

    def holds_grain(self, joints: Joints) -> bool:
        """Whether the joints keep every limit but for the size of an encoder count.

        A place on the very edge, rounded to whole counts, may lie that much outside; so may the readings of an
        axis that stands on its switch. Only limits that the rounding itself can break are eased.
        """
        if self.contains(joints):
            return True
        grain_a, grain_b, grain_c = self.grain
        a, b, c = joints
        coarse = self.margins(joints)
        # Longer lines carry less: if the tension is kept with both one count longer, only rounding breaks it.
        longer = self.margins(Joints(a, b + grain_b, c + grain_c))
        along_u = (b * grain_b + c * grain_c) / self.mechanism.width
        return (
            coarse.boom >= -grain_a
            and coarse.line_b >= -grain_b
            and coarse.line_c >= -grain_c
            and min(coarse.inner, coarse.outer, coarse.floor) >= -along_u
            and min(longer.tension_b, longer.tension_c, longer.coupling) >= 0.0
        )

    def _unreachable(self, target: Point | Joints) -> Unreachable:
        reason = self.why_not(target)
        nearest = self.nearest(target if isinstance(target, Point) else self._place(target))
        return Unreachable(
            target=_text(target),
            reason=str(reason),
            nearest=_text(self._rounded(nearest)),
            limit=str(reason.limit) if reason else "",
            excess=reason.excess if reason else 0.0,
            nearest_point=tuple(nearest),
        )

    def _rounded(self, point: Point) -> Point:
        """Return a reachable place in whole tenths of a millimetre beside `point`, so that its text can be used.

        In a corner too narrow for one it is `point` itself.
        """
        steps = [[(floor(value * 1e4) + step) / 1e4 for step in (-1, 0, 1, 2)] for value in point]
        beside = sorted((Point(*place) for place in product(*steps)), key=lambda place: dist(place, point))
        return next((place for place in beside if self.why_not(place) is None), point)

    def _place(self, joints: Joints) -> Point:
        """Return where joints point to, also outside the workspace: the lines are drawn straight if need be."""
        u, square = self.mechanism.section(joints)
        d = self.mechanism.delta + min(max(u, 0.0), self.mechanism.width)
        h = sqrt(square) if square > 0.0 else 0.0
        return Point(d * sin(joints.a), d * cos(joints.a), self.mechanism.reach_down - h)

    def _broken(self, joints: Joints) -> Reason:
        margins = self.margins(joints)
        for name, margin in zip(Margins._fields, margins, strict=True):
            if -inf < margin < -TOLERANCE:
                return self._reason(Limit(name), -margin, joints)
        # What is left are straight lines: they just meet, at any tension.
        return self._reason(Limit.COUPLING, max(0.0, -margins.coupling), joints)

    def _reason(self, limit: Limit, excess: float, joints: Joints) -> Reason:
        match limit:
            case Limit.BOOM:
                side = _side(joints.a, self.boom, "before its start", "past its end")
                words = f"the boom would have to turn to {degrees(joints.a):.1f}°, {degrees(excess):.3g}° {side}"
                return Reason(limit, excess, "rad", words)
            case Limit.LINE_B | Limit.LINE_C:
                return Reason(limit, excess, "m", self._line_words(limit, excess, joints))
            case Limit.TENSION_B | Limit.TENSION_C:
                pull = self.tension_limit + excess
                words = (
                    f"line {limit[-1]} would carry {pull:.4g} times the load, more than the {self.tension_limit:g} "
                    "allowed, because the lines would be too straight"
                )
                return Reason(limit, excess, "load", words)
            case _:
                return Reason(limit, excess, "m", _WORDS[limit].format(_mm(excess)))

    def _line_words(self, limit: Limit, excess: float, joints: Joints) -> str:
        length, stroke = (joints.b, self.line_b) if limit is Limit.LINE_B else (joints.c, self.line_c)
        side = _side(length, stroke, "shorter", "longer")
        return f"line {limit[-1]} would have to be {length * 1e3:.1f} mm long, {_mm(excess)} {side} than it can be"


_ABSURD = 1e6

_WORDS = {
    Limit.COUPLING: "lines b and c together are {} too short to meet",
    Limit.INNER: "it lies {} inside the inner anchor, where line c would hang slack",
    Limit.OUTER: "it lies {} outside the outer anchor, where line b would hang slack",
    Limit.FLOOR: "it lies {} below the table top",
}


def _is_sensible(target: Point | Joints) -> bool:
    return all(abs(number) < _ABSURD for number in target)


def _inside(value: float, stroke: Stroke) -> float:
    return min(value - stroke[0], stroke[1] - value)


def _side(value: float, stroke: Stroke, below: str, above: str) -> str:
    return below if value < stroke[0] else above


def _mm(length: float) -> str:
    return f"{length * 1e3:.4g} mm"


def _text(target: Point | Joints) -> str:
    if isinstance(target, Point):
        return f"({target.x:.4f}, {target.y:.4f}, {target.z:.4f}) m"
    return f"a = {degrees(target.a):.2f}°, b = {target.b:.4f} m, c = {target.c:.4f} m"


def _nearest_angle(angle: float, boom: Stroke) -> float:
    """Return the angle of the boom's range whose direction is nearest to `angle` [rad]."""
    middle = 0.5 * (boom[0] + boom[1])
    turned = middle + (angle - middle + pi) % tau - pi
    return min(max(turned, boom[0]), boom[1])
