"""Forward and inverse kinematics of Maya (manual, figures 7 to 9, with the corrections of its formulas).

A boom turns about a vertical axis by α (axis a, clockwise from +y seen from above). Two lines of free lengths b
and c run from two anchors on the boom, at height H and radial distances Δ and D, to the point where they meet;
the gripper point hangs Φ below. With W = D − Δ, u = d − Δ and h = H − Φ − z the lines and the piece of boom
between the anchors are a triangle:

    u = (W² + b² − c²) / 2W     h = √(b² − u²)      x = (Δ + u) sin α   y = (Δ + u) cos α   z = H − Φ − h
    b = √(u² + h²)              c = √((W − u)² + h²)                    α = atan2(x, y)
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, hypot, inf, isfinite, pi, sin, sqrt, tau
from typing import TYPE_CHECKING, Self

from maya_un.errors import Unreachable
from maya_un.kinematics.limits import above_anchors
from maya_un.values import Joints, Point

if TYPE_CHECKING:
    from maya_un.config import Config


@dataclass(frozen=True, slots=True)
class ClosedForm:
    """The lengths of one Maya [m], and the mathematics that needs only them.

    `height` is H, `length` D, `delta` Δ, `drop` Φ, `width` W = D − Δ. `turn_start` [rad] is the least angle of the
    boom: `ik` returns angles in [turn_start, turn_start + 2π).
    """

    height: float
    length: float
    delta: float
    drop: float
    width: float
    turn_start: float

    @classmethod
    def of(cls, config: Config) -> Self:
        """Return the mechanism of a configuration; angles are counted around the middle of axis a."""
        geometry, boom = config.geometry, config.axes.a
        lengths = (geometry.height, geometry.length, geometry.delta, geometry.gripper_height)
        return cls.measured(lengths, (boom.minimum, boom.maximum))

    @classmethod
    def measured(cls, lengths: tuple[float, float, float, float], boom: tuple[float, float]) -> Self:
        """Return the mechanism with these lengths H, D, Δ, Φ [m], and this range of axis a [rad]."""
        height, length, delta, drop = lengths
        # The angles begin in the middle of the directions that the boom cannot reach. If it can turn all the way round,
        # they begin just before its lower end, which rounding must not turn into the upper one.
        turn_start = min(0.5 * (boom[0] + boom[1]) - pi, boom[0] - 1e-9)
        return cls(height, length, delta, drop, width=length - delta, turn_start=turn_start)

    @property
    def reach_down(self) -> float:
        """Depth of the meeting point below the anchors when the gripper point touches z = 0: H − Φ [m]."""
        return self.height - self.drop

    def section(self, joints: Joints) -> tuple[float, float]:
        """Return (u, h²) of the meeting point [m, m²]; h² is negative if the lines cannot meet."""
        _, b, c = joints
        W = self.width
        u = 0.5 * W + (b - c) * (b + c) / (2.0 * W)
        return u, (b - u) * (b + u)

    def fk(self, joints: Joints) -> Point:
        """Return the gripper point of joints whose lines are taut.

        Raises `Unreachable` if b, c and W form no triangle.
        """
        a, b, c = joints
        W = self.width
        u = 0.5 * W + (b - c) * (b + c) / (2.0 * W)
        square = (b - u) * (b + u)
        if not square >= 0.0:
            raise no_triangle(joints)
        d = self.delta + u
        return Point(d * sin(a), d * cos(a), self.height - self.drop - sqrt(square))

    def ik(self, point: Point) -> Joints:
        """Return the joints that hold the gripper at `point`.

        Raises `Unreachable` if the lines would have to meet above their anchors, and for numbers that are not finite.
        The workspace checks strokes and tension.
        """
        x, y, z = point
        h = self.height - self.drop - z
        u = hypot(x, y) - self.delta
        beyond = self.width - u
        if not (h >= 0.0 and isfinite(u + h)):
            raise no_lines(point, h)
        a = atan2(x, y)
        if a < self.turn_start:
            a += tau
        square = h * h
        return Joints(a, sqrt(square + u * u), sqrt(square + beyond * beyond))


def tension(u: float, h: float, W: float) -> tuple[float, float]:
    """Return the tensions (T_b, T_c) in multiples of the load.

    The two lines together balance the weight: T_b = (W − u)/W · b/h and T_c = u/W · c/h with b = √(u² + h²),
    c = √((W − u)² + h²). A negative tension means that this line would have to push, so it hangs slack.
    At h = 0 and above no tension balances the load: both are infinite.
    """
    if h <= 0.0:
        return inf, inf
    return (W - u) / W * hypot(u, h) / h, u / W * hypot(W - u, h) / h


def no_triangle(joints: Joints) -> Unreachable:
    """Return the error for lines that cannot meet."""
    a, b, c = joints
    return Unreachable(
        target=f"a = {a:.4f} rad, b = {b:.4f} m, c = {c:.4f} m",
        reason="lines of these lengths cannot meet below the boom",
        nearest="none",
    )


def no_lines(point: Point, h: float) -> Unreachable:
    """Return the error for a place that no lines can hold, `h` [m] below the anchors."""
    finite = isfinite(h) and isfinite(point.x) and isfinite(point.y)
    return Unreachable(
        target=f"({point.x:.4f}, {point.y:.4f}, {point.z:.4f}) m",
        reason=above_anchors(-h).text if finite else "it is not a place: a coordinate is not finite",
        nearest="none",
    )
