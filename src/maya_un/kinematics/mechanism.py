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
from math import atan2, cos, hypot, isfinite, pi, sin, sqrt, tau

import numpy as np
from numpy.typing import NDArray

from maya_un.config import Config
from maya_un.errors import Unreachable
from maya_un.kinematics.statics import tension
from maya_un.values import Joints, Point

Floats = NDArray[np.float64]
"""An array of double precision numbers; the shape stands where it is used."""

_BLOCK = 4096
"""Rows worked on at a time, so that all columns of a block stay in the processor's cache."""


@dataclass(frozen=True, slots=True)
class Mechanism:
    """The lengths of one Maya [m], and the maths that needs nothing else.

    `height` is H, `length` D, `delta` Δ, `drop` Φ, `width` W = D − Δ. `turn_start` [rad] is where the
    boom's angle is counted from: `ik` gives angles in [turn_start, turn_start + 2π).
    """

    height: float
    length: float
    delta: float
    drop: float
    width: float
    turn_start: float

    @classmethod
    def of(cls, config: Config) -> Mechanism:
        """Return the mechanism of a configuration; angles are counted around the middle of axis a."""
        geometry, boom = config.geometry, config.axes.a
        return cls(
            height=geometry.height,
            length=geometry.length,
            delta=geometry.delta,
            drop=geometry.gripper_height,
            width=geometry.width,
            turn_start=0.5 * (boom.minimum + boom.maximum) - pi,
        )

    @property
    def reach_down(self) -> float:
        """Depth of the meeting point below the anchors when the gripper point touches z = 0: H − Φ [m]."""
        return self.height - self.drop

    def section(self, joints: Joints) -> tuple[float, float]:
        """Return (u, h²) of the meeting point [m, m²]; h² is negative where the lines cannot meet."""
        _, b, c = joints
        W = self.width
        u = 0.5 * W + (b - c) * (b + c) / (2.0 * W)
        return u, (b - u) * (b + u)

    def fk(self, joints: Joints) -> Point:
        """Return the gripper point of joints whose lines are taut.

        Raises `Unreachable` where b, c and W form no triangle.
        """
        a, b, c = joints
        W = self.width
        u = 0.5 * W + (b - c) * (b + c) / (2.0 * W)
        square = (b - u) * (b + u)
        if not square >= 0.0:
            raise _no_triangle(joints)
        d = self.delta + u
        return Point(d * sin(a), d * cos(a), self.height - self.drop - sqrt(square))

    def ik(self, point: Point) -> Joints:
        """Return the joints that hold the gripper at `point`.

        Raises `Unreachable` where the lines would have to meet above their anchors, and for numbers that are
        not finite. Strokes and tension are the workspace's affair.
        """
        x, y, z = point
        h = self.height - self.drop - z
        u = hypot(x, y) - self.delta
        beyond = self.width - u
        if not (h >= 0.0 and isfinite(u + h)):
            raise _no_lines(point, h)
        a = atan2(x, y)
        if a < self.turn_start:
            a += tau
        square = h * h
        return Joints(a, sqrt(square + u * u), sqrt(square + beyond * beyond))

    def jacobian(self, joints: Joints) -> Floats:
        """Return ∂(x, y, z)/∂(a, b, c), shape (3, 3), in m/rad and m/m.

        The last row is (0, −T_b, −T_c): by virtual work the load sinks by the tension of a line times the
        length paid out. Raises `Unreachable` where the lines are straight or cannot meet.
        """
        a, b, c = joints
        W = self.width
        u, square = self.section(joints)
        if not square > 0.0:
            raise _no_triangle(joints)
        pull_b, pull_c = tension(u, sqrt(square), W)
        d, s, k = self.delta + u, sin(a), cos(a)
        return np.array(
            [
                [d * k, s * b / W, -s * c / W],
                [-d * s, k * b / W, -k * c / W],
                [0.0, -pull_b, -pull_c],
            ]
        )

    def fk_many(self, joints: Floats) -> Floats:
        """Return the gripper points, shape (n, 3) [m], of joints of shape (n, 3) [rad, m, m].

        Rows whose lines cannot meet have z = nan.
        """
        out = np.empty(joints.shape)
        columns = np.empty((6, min(_BLOCK, len(joints))))
        for start in range(0, len(joints), _BLOCK):
            block = joints[start : start + _BLOCK]
            self._fk_block(block, out[start : start + _BLOCK], columns[:, : len(block)])
        return out

    def ik_many(self, points: Floats) -> Floats:
        """Return the joints, shape (n, 3) [rad, m, m], of gripper points of shape (n, 3) [m].

        Rows above the anchors have b = c = nan.
        """
        out = np.empty(points.shape)
        columns = np.empty((6, min(_BLOCK, len(points))))
        for start in range(0, len(points), _BLOCK):
            block = points[start : start + _BLOCK]
            self._ik_block(block, out[start : start + _BLOCK], columns[:, : len(block)])
        return out

    def angles(self, x: Floats, y: Floats) -> Floats:
        """Return the boom's angles [rad] that point to x, y [m], of any one shape."""
        found = np.arctan2(x, y)
        np.add(found, tau, out=found, where=found < self.turn_start)
        return found

    def _fk_block(self, joints: Floats, out: Floats, columns: Floats) -> None:
        a, b, c, u, h, spare = columns
        W = self.width
        np.copyto(columns[:3], joints.T)
        np.subtract(b, c, out=u)
        np.add(b, c, out=spare)
        np.multiply(u, spare, out=u)
        np.multiply(u, 0.5 / W, out=u)
        np.add(u, 0.5 * W, out=u)
        np.subtract(b, u, out=h)
        np.add(b, u, out=spare)
        np.multiply(h, spare, out=h)
        with np.errstate(invalid="ignore"):
            np.sqrt(h, out=h)
        np.add(u, self.delta, out=u)
        np.sin(a, out=b)
        np.cos(a, out=c)
        np.multiply(u, b, out=out[:, 0])
        np.multiply(u, c, out=out[:, 1])
        np.subtract(self.height - self.drop, h, out=out[:, 2])

    def _ik_block(self, points: Floats, out: Floats, columns: Floats) -> None:
        x, y, z, u, h, spare = columns
        np.copyto(columns[:3], points.T)
        np.multiply(x, x, out=u)
        np.multiply(y, y, out=spare)
        np.add(u, spare, out=u)
        np.sqrt(u, out=u)
        np.subtract(u, self.delta, out=u)
        np.subtract(self.height - self.drop, z, out=h)
        above = h < 0.0
        np.multiply(h, h, out=h)
        np.multiply(u, u, out=spare)
        np.add(h, spare, out=spare)
        np.sqrt(spare, out=out[:, 1])
        np.subtract(self.width, u, out=spare)
        np.multiply(spare, spare, out=spare)
        np.add(h, spare, out=spare)
        np.sqrt(spare, out=out[:, 2])
        out[:, 0] = self.angles(x, y)
        if above.any():
            out[above, 1:] = np.nan


def _no_triangle(joints: Joints) -> Unreachable:
    a, b, c = joints
    return Unreachable(
        target=f"a = {a:.4f} rad, b = {b:.4f} m, c = {c:.4f} m",
        reason="lines of these lengths cannot meet below the boom",
        nearest="none",
    )


def _no_lines(point: Point, h: float) -> Unreachable:
    finite = isfinite(h) and isfinite(point.x) and isfinite(point.y)
    return Unreachable(
        target=f"({point.x:.4f}, {point.y:.4f}, {point.z:.4f}) m",
        reason=f"its lines would have to meet {-h * 1e3:.3g} mm above their anchors"
        if finite
        else "it is not a place: not finite",
        nearest="none",
    )
