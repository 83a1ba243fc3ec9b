"""The workspace: the points that Maya may reach, why others are refused, and the nearest point that it may reach.

`Membership` checks many places, or many joints, against the limits: block by block, so that all columns stay in the
cache. It computes no angle: two cross products decide whether the boom's range contains a direction. Lengths and
tensions are compared as squares. With v = u − W/2, measured from the middle between the anchors, and the limit k,

    b² − W²/4 = h² + v² + Wv     c² − W²/4 = h² + v² − Wv     T ≤ k  ⟺  (W²/4 − v²)² ≤ (k²W² − (W/2 + |v|)²) h²

where T is the tension of the line that carries more (`mechanism.shallowest`, squared).

"The workspace" means everywhere the same set: strokes of the lines and range of the boom, both lines taut (0 ≤ u ≤ W),
no line carrying more than the tension limit, lines long enough to meet (b + c > W), the gripper not below the table top
(z ≥ 0), and clear of every zone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import atan2, cos, degrees, dist, floor, hypot, inf, pi, sin, sqrt, tau

import numpy as np
from numpy.typing import NDArray

from dmc41x3.i18n import phrase
from maya_un.config import Config, Units
from maya_un.errors import InvalidConfig, Unreachable
from maya_un.kinematics.limits import (
    Limit,
    Margins,
    Reason,
    ReasonBounds,
    Stroke,
    Verdict,
    above_anchors,
    in_zone,
    no_number,
)
from maya_un.kinematics.mechanism import Floats, Mechanism
from maya_un.kinematics.ranges import TOLERANCE, Ranges
from maya_un.kinematics.section import Section
from maya_un.kinematics.zones import Search, Zone, clearances, zone_of
from maya_un.values import FARTHEST, Joints, Point

Flags = NDArray[np.bool_]
"""An array of booleans; each use documents its shape."""

_BLOCK = 16384


@dataclass(frozen=True, slots=True)
class Membership:
    """The limits of a workspace, without zones, prepared for comparisons.

    They hold to `tolerance` (m, rad, and as a share of the tension limit).
    """

    mechanism: Mechanism
    bounds: ReasonBounds
    tolerance: float

    def of_points(self, points: Floats, out: Flags) -> Flags:
        """Return in `out`, shape (n,), which gripper points (n, 3) [m] keep all limits."""
        return _blockwise(self._points, points, out)

    def of_joints(self, joints: Floats, out: Flags) -> Flags:
        """Return in `out`, shape (n,), which joints (n, 3) [rad, m, m] keep all limits."""
        return _blockwise(self._joints, joints, out)

    def _points(self, inside: Flags, flags: Flags, columns: Floats) -> None:
        x, y, h, v, spare, other = columns
        self._directions(inside, flags, columns)
        np.multiply(x, x, out=x)
        np.multiply(y, y, out=y)
        np.add(x, y, out=v)
        np.sqrt(v, out=v)
        np.subtract(v, self.mechanism.delta + 0.5 * self.mechanism.width, out=v)
        np.subtract(self.mechanism.reach_down, h, out=h)
        _within(h, (0.0, self.mechanism.reach_down), self.tolerance, inside, flags)
        np.greater(h, 0.0, out=flags)
        np.logical_and(inside, flags, out=inside)
        np.multiply(h, h, out=h)
        self._lengths(h, v, inside, flags, (x, y, spare, other))
        self._pulls(h, v, inside, flags, x)

    def _joints(self, inside: Flags, flags: Flags, columns: Floats) -> None:
        a, b, c, v, h, spare = columns
        W, bounds, deepest = self.mechanism.width, self.bounds, self.mechanism.reach_down + self.tolerance
        inside.fill(True)
        for column, stroke in ((a, bounds.boom), (b, bounds.line_b), (c, bounds.line_c)):
            _within(column, stroke, self.tolerance, inside, flags)
        np.subtract(b, c, out=v)
        np.add(b, c, out=spare)
        np.multiply(v, spare, out=v)
        np.multiply(v, 0.5 / W, out=v)
        np.add(v, 0.5 * W, out=c)
        np.subtract(b, c, out=h)
        np.add(b, c, out=spare)
        np.multiply(h, spare, out=h)
        np.greater(h, 0.0, out=flags)
        np.logical_and(inside, flags, out=inside)
        np.less_equal(h, deepest * deepest, out=flags)
        np.logical_and(inside, flags, out=inside)
        np.multiply(v, v, out=a)
        self._pulls(h, v, inside, flags, a)

    def _directions(self, inside: Flags, flags: Flags, columns: Floats) -> None:
        """Set `inside` where x, y lie in a direction of the boom's range; uses the last two columns."""
        x, y, _, _, left, right = columns
        first, last = self.bounds.boom[0] - self.tolerance, self.bounds.boom[1] + self.tolerance
        if last - first >= tau:
            inside.fill(True)
            return
        np.multiply(x, cos(first), out=left)
        np.multiply(y, sin(first), out=right)
        np.greater_equal(left, right, out=inside)
        np.multiply(y, sin(last), out=left)
        np.multiply(x, cos(last), out=right)
        np.greater_equal(left, right, out=flags)
        join = np.logical_and if last - first < pi else np.logical_or
        join(inside, flags, out=inside)

    def _lengths(
        self, h: Floats, v: Floats, inside: Flags, flags: Flags, spare: tuple[Floats, Floats, Floats, Floats]
    ) -> None:
        """Clear `inside` where a line is too short or too long; leaves v² in the first of `spare`."""
        square, along, both, found = spare
        W = self.mechanism.width
        np.multiply(v, v, out=square)
        np.add(h, square, out=both)
        np.multiply(v, W, out=along)
        for stroke, join in ((self.bounds.line_b, np.add), (self.bounds.line_c, np.subtract)):
            join(both, along, out=found)
            short, long = stroke[0] - self.tolerance, stroke[1] + self.tolerance
            _within(found, (short * short - 0.25 * W * W, long * long - 0.25 * W * W), 0.0, inside, flags)

    def _pulls(self, h: Floats, v: Floats, inside: Flags, flags: Flags, square: Floats) -> None:
        """Clear `inside` where a line hangs slack or carries too much; `h` is h², `square` is v²."""
        W = self.mechanism.width
        pull = self.bounds.tension_limit * (1.0 + self.tolerance) * W
        np.abs(v, out=v)
        np.less_equal(v, 0.5 * W + self.tolerance, out=flags)
        np.logical_and(inside, flags, out=inside)
        np.add(v, 0.5 * W, out=v)
        np.multiply(v, v, out=v)
        np.subtract(pull * pull, v, out=v)
        np.multiply(v, h, out=v)
        np.subtract(0.25 * W * W, square, out=square)
        np.multiply(square, square, out=square)
        np.less_equal(square, v, out=flags)
        np.logical_and(inside, flags, out=inside)


def _within(column: Floats, stroke: Stroke, tolerance: float, inside: Flags, flags: Flags) -> None:
    np.greater_equal(column, stroke[0] - tolerance, out=flags)
    np.logical_and(inside, flags, out=inside)
    np.less_equal(column, stroke[1] + tolerance, out=flags)
    np.logical_and(inside, flags, out=inside)


def _blockwise(judge: Callable[[Flags, Flags, Floats], None], rows: Floats, out: Flags) -> Flags:
    """Call `judge` for blocks of rows (n, 3), passed in the first three of six columns; it writes to `out`."""
    columns, flags = np.empty((6, _BLOCK)), np.empty(_BLOCK, dtype=np.bool_)
    with np.errstate(invalid="ignore", over="ignore"):
        for start in range(0, len(rows), _BLOCK):
            block = rows[start : start + _BLOCK]
            work = columns[:, : len(block)]
            np.copyto(work[:3], block.T)
            judge(out[start : start + _BLOCK], flags[: len(block)], work)
    return out


__all__ = ["TOLERANCE", "Limit", "Margins", "Reason", "Stroke", "Verdict", "Workspace"]

_INSETS = (1e-6, 1e-5, 1e-4)


@dataclass(frozen=True, slots=True)
class Workspace(Ranges):
    """The set of reachable joints and places of one machine.

    `boom`, `line_b`, `line_c` are the ranges of the axes (rad, m, m), `tension_limit` is a multiple of the load,
    `grain` the size of one encoder count (rad, m, m), `zones` are the avoided zones. Made by `Workspace.of`.
    """

    mechanism: Mechanism
    grain: tuple[float, float, float]
    zones: tuple[Zone, ...] = ()

    @classmethod
    def of(cls, config: Config, strokes: tuple[Stroke, Stroke, Stroke] | None = None) -> Workspace:
        """Return the workspace of a configuration.

        `strokes` replaces the configured ranges of a, b, c (rad, m, m) by measured ones. Raises `InvalidConfig` if no
        place is reachable, even without zones.
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
            reason = phrase("with these lengths and strokes the tension exceeds it everywhere, so nothing is reachable")
            raise InvalidConfig(key="safety.tension_limit", value=limit, reason=reason)
        return workspace

    def with_zones(self, zones: Sequence[Zone]) -> Workspace:
        """Return the same workspace with other zones."""
        return replace(self, zones=tuple(zones))

    @property
    def zone_grain(self) -> float:
        """Bound of how far one count of every axis moves gripper, lines and anchors [m].

        A place beside a zone, rounded to whole counts, may be nearer to the zone by this.
        """
        grain_a, grain_b, grain_c = self.grain
        return self.mechanism.length * grain_a + (1.0 + self.tension_limit) * (grain_b + grain_c)

    @property
    def section(self) -> Section:
        """The reachable area of the vertical plane through the boom, without zones."""
        mechanism = self.mechanism
        return Section(mechanism.width, self.line_b, self.line_c, self.tension_limit, mechanism.reach_down)

    def volume(self) -> float:
        """Return the volume that the gripper point can reach [m³], without zones.

        It is the section, turned through the boom's range: its area times the way of its centroid (Pappus), exact to
        1e-6.
        """
        return (self.boom[1] - self.boom[0]) * self.section.moment(-self.mechanism.delta)

    def contains(self, joints: Joints) -> bool:
        """Whether the joints keep every limit (to `TOLERANCE`); False for numbers that are not finite."""
        return self.within(joints) and (not self.zones or self._is_clear(joints))

    def contains_many(self, joints: Floats, out: Flags | None = None) -> Flags:
        """Return which joints of shape (n, 3) `contains` accepts, shape (n,); in `out` if it is given."""
        inside = self._membership.of_joints(joints, np.empty(len(joints), dtype=np.bool_) if out is None else out)
        if self.zones:
            rows = np.flatnonzero(inside)
            inside[rows] = self._are_clear(joints[rows])
        return inside

    def reachable_many(self, points: Floats, out: Flags | None = None) -> Flags:
        """Return which gripper points (n, 3) [m] are reachable, shape (n,); in `out` if it is given.

        The result agrees with `why_not`, except for points that are within `TOLERANCE` of a limit.
        """
        inside = self._membership.of_points(points, np.empty(len(points), dtype=np.bool_) if out is None else out)
        if self.zones:
            rows = np.flatnonzero(inside)
            inside[rows] = self._are_clear(self.mechanism.ik_many(points[rows]))
        return inside

    def ik(self, point: Point) -> Joints:
        """Return the joints that hold the gripper at `point` [m], or raise `Unreachable` (see `require`)."""
        if _is_sensible(point) and point.z < self.mechanism.height - self.mechanism.drop:
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

        Raises `Unreachable` otherwise. Its details hold `limit`, `excess` (SI), `zone` (its name, "" for another limit)
        and `nearest_point`, which is reachable, or None if the zones leave no place.
        """
        if isinstance(target, Point):
            return self.ik(target)
        if self.contains(target):
            return target
        raise self._unreachable(target)

    def margins(self, joints: Joints) -> Margins:
        """Return the distance to every limit (see `Margins`)."""
        clearances = tuple((zone.name, zone.clearance(self.mechanism, joints)) for zone in self.zones)
        return Ranges.margins(self, joints)._replace(zones=clearances)

    def check(self, joints: Joints) -> Verdict:
        """Return the distance to every limit, and the reason if one is broken."""
        return Verdict(self.margins(joints), self.why_not(joints))

    def why_not(self, target: Point | Joints) -> Reason | None:
        """Return why a target is not reachable, None if it is.

        If several limits are broken, the first in the order of `Limit` is named.
        """
        return next(self._reasons(target), None)

    def all_reasons(self, target: Point | Joints) -> tuple[Reason, ...]:
        """Return a reason for every limit that a target breaks, in the order of `Limit`.

        Empty for a reachable target.
        """
        return tuple(self._reasons(target))

    def nearest(self, target: Point) -> Point:
        """Return the reachable place nearest to `target` [m], or `target` itself if it is reachable.

        The boom turns to the nearest angle of its range; in that vertical plane the nearest place of the section is
        taken, a micrometre inside its edge so that rounding cannot move it outside. If that place is not clear of all
        zones, the nearest clear place is searched for (`zones.Search`), to within a millimetre. A target that is no
        place (not a finite number, or beyond `FARTHEST`) counts as the foot of axis a. Raises `Unreachable` if the
        zones leave no place.
        """
        if self.why_not(target) is None:
            return target
        if not _is_sensible(target):
            target = Point(0.0, 0.0, 0.0)
        found = self._nearest_within_limits(target)
        if self.zones and not self._is_clear(self.mechanism.ik(found)):
            cleared = self._search.nearest(target)
            if cleared is None:
                raise _nothing_left(target)
            return cleared
        return found

    def holds_grain(self, joints: Joints) -> bool:
        """Return whether the joints keep every limit to within an encoder count.

        A place on the edge, rounded to whole counts, may lie that much outside; so may the readings of an axis that
        stands on its switch. Only limits that the rounding itself can break are eased.
        """
        if self.contains(joints):
            return True
        grain_a, grain_b, grain_c = self.grain
        a, b, c = joints
        coarse = self.margins(joints)
        # Longer lines carry less: if the tension is kept with both one count longer, only rounding breaks it.
        longer = self.with_zones(()).margins(Joints(a, b + grain_b, c + grain_c))
        along_u = (b * grain_b + c * grain_c) / self.mechanism.width
        return (
            coarse.boom >= -grain_a
            and coarse.line_b >= -grain_b
            and coarse.line_c >= -grain_c
            and min(coarse.inner, coarse.outer, coarse.floor) >= -along_u
            and min(longer.tension_b, longer.tension_c, longer.coupling) >= 0.0
            and all(clearance >= -self.zone_grain for _, clearance in coarse.zones)
        )

    @property
    def _bounds(self) -> ReasonBounds:
        return ReasonBounds(self.boom, self.line_b, self.line_c, self.tension_limit)

    @property
    def _membership(self) -> Membership:
        return Membership(self.mechanism, self._bounds, TOLERANCE)

    @property
    def _search(self) -> Search:
        inside = self.section.shrunk(_INSETS[-1])
        return Search(self.mechanism, self.boom, inside, self.zones, self.zone_grain)

    def _is_clear(self, joints: Joints) -> bool:
        return bool(self._are_clear(np.array([joints]))[0])

    def _are_clear(self, joints: Floats) -> Flags:
        return clearances(self.zones, self.mechanism, joints, 0.0).min(axis=1) >= -TOLERANCE

    def _reasons(self, target: Point | Joints) -> Iterator[Reason]:
        if not _is_sensible(target):
            yield no_number()
        elif isinstance(target, Joints):
            yield from () if self.contains(target) else self._broken(target)
        elif target.z >= self.mechanism.reach_down:
            yield above_anchors(target.z - self.mechanism.reach_down)
        else:
            joints = self.mechanism.ik(target)
            yield from () if self.contains(joints) else self._broken(joints)

    def _broken(self, joints: Joints) -> Iterator[Reason]:
        margins = self.margins(joints)
        named = False
        for limit, margin in margins.limits.items():
            if -inf < margin < -TOLERANCE:
                named = True
                yield self._bounds.reason(limit, -margin, joints)
        for zone, (name, clearance) in zip(self.zones, margins.zones, strict=True):
            if clearance < -TOLERANCE:
                named = True
                yield in_zone(name, zone.margin, clearance)
        if not named:
            # The remaining case are straight lines: they just meet, at any tension.
            yield self._bounds.reason(Limit.COUPLING, max(0.0, -margins.coupling), joints)

    def _nearest_within_limits(self, target: Point) -> Point:
        mechanism, bare = self.mechanism, self.with_zones(())
        bearing = atan2(target.x, target.y)
        a = _nearest_angle(bearing, self.boom)
        radius = hypot(target.x, target.y) * cos(bearing - a)
        u, h = radius - mechanism.delta, mechanism.reach_down - target.z
        for inset in _INSETS:
            near_u, near_h = self.section.shrunk(inset).nearest(u, h)
            d = mechanism.delta + near_u
            found = Point(d * sin(a), d * cos(a), mechanism.reach_down - near_h)
            if bare.why_not(found) is None:
                return found
        raise AssertionError("a place inside the shrunk section is in the workspace")

    def _unreachable(self, target: Point | Joints) -> Unreachable:
        reason = self.why_not(target)
        nearest: Point | None
        try:
            nearest = found = self.nearest(target if isinstance(target, Point) else self._place(target))
        except Unreachable as nothing_left:
            nearest, words = None, nothing_left.nearest
        else:
            words = _text(self._rounded(found))
        return Unreachable(
            target=_text(target),
            reason=str(reason),
            nearest=words,
            limit=str(reason.limit) if reason else "",
            excess=reason.excess if reason else 0.0,
            zone=reason.zone if reason else "",
            nearest_point=nearest and tuple(nearest),
        )

    def _rounded(self, point: Point) -> Point:
        """Return a reachable place in whole tenths of a millimetre beside `point`, so that its text can be used.

        In a corner too narrow for such a place it is `point` itself.
        """
        steps = [[(floor(value * 1e4) + step) / 1e4 for step in (-1, 0, 1, 2)] for value in point]
        beside = sorted((Point(*place) for place in product(*steps)), key=lambda place: dist(place, point))
        return next((place for place in beside if self.why_not(place) is None), point)

    def _place(self, joints: Joints) -> Point:
        """Return the place of joints, also outside the workspace: the lines are assumed straight if they cannot meet.

        Joints that are not finite, or out of range, count as the foot of axis a.
        """
        if not _is_sensible(joints):
            return Point(0.0, 0.0, 0.0)
        u, square = self.mechanism.section(joints)
        d = self.mechanism.delta + min(max(u, 0.0), self.mechanism.width)
        h = sqrt(square) if square > 0.0 else 0.0
        return Point(d * sin(joints.a), d * cos(joints.a), self.mechanism.reach_down - h)


def _is_sensible(target: Point | Joints) -> bool:
    return all(abs(number) <= FARTHEST for number in target)


def _nothing_left(target: Point) -> Unreachable:
    reason = phrase("the zones leave no place that can be reached")
    return Unreachable(target=_text(target), reason=reason, nearest="none; remove a zone first")


def _text(target: Point | Joints) -> str:
    if not _is_sensible(target):
        return "(" + ", ".join(f"{number:.6g}" for number in target) + ")"
    if isinstance(target, Point):
        return f"({target.x:.4f}, {target.y:.4f}, {target.z:.4f}) m"
    return f"a = {degrees(target.a):.2f}°, b = {target.b:.4f} m, c = {target.c:.4f} m"


def _nearest_angle(angle: float, boom: Stroke) -> float:
    """Return the angle of the boom's range whose direction is nearest to `angle` [rad]."""
    middle = 0.5 * (boom[0] + boom[1])
    turned = middle + (angle - middle + pi) % tau - pi
    return min(max(turned, boom[0]), boom[1])
