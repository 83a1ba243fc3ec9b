"""The kinematics of Maya in arrays, their derivatives, and the tensions of the two lines.

The kinematics use the formulas of `closed`. Tensions are computed in the vertical section through the boom.

The section's coordinates: `u` is the radial distance of the meeting point from anchor b, `h` its depth below the
anchors, `W` the distance between the anchors, all [m]. Anchor b is at (0, 0), anchor c at (W, 0). The load hangs from
the meeting point; its weight is the unit of every tension.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, hypot, sin, sqrt, tau

import numpy as np
from numpy.typing import NDArray

from maya_un.kinematics.closed import ClosedForm, no_triangle, tension
from maya_un.values import Joints


def shallowest(u: float, W: float, tension_limit: float) -> float:
    """Return the smallest depth h [m] at which neither line carries more than `tension_limit` × the load.

    Solving T_b = k for h gives h = u(W − u)/√(k²W² − (W − u)²), and T_c = k the same with u² under the root.
    Needs 0 ≤ u ≤ W and k > 1, for which the root is real.
    """
    longer = max(u, W - u)
    return u * (W - u) / sqrt((tension_limit * W) ** 2 - longer * longer)


def shallowest_many(u: NDArray[np.float64], W: float, tension_limit: float) -> NDArray[np.float64]:
    """Return `shallowest` for many u, shape (n,)."""
    longer = np.maximum(u, W - u)
    return u * (W - u) / np.sqrt((tension_limit * W) ** 2 - longer * longer)


def hanging(b: float, c: float, W: float) -> tuple[float, float]:
    """Return the true place (u, h) of the meeting point [m] for free line lengths b and c [m].

    If a line is slack, the load hangs straight below the other anchor: at (0, b) or at (W, c). Lines too short to meet
    (b + c < W) are assumed straight: h is 0.
    """
    u = 0.5 * W + (b - c) * (b + c) / (2.0 * W)
    if u < 0.0:
        return 0.0, b
    if u > W:
        return W, c
    return u, sqrt(max(0.0, (b - u) * (b + u)))


def slack(b: float, c: float, W: float) -> tuple[float, float]:
    """Return the loose length of each line (b, c) [m]; both are 0 if the lines are taut."""
    return max(0.0, b - hypot(W, c)), max(0.0, c - hypot(W, b))


Floats = NDArray[np.float64]
"""An array of double precision numbers; each use documents its shape."""

_BLOCK = 4096
"""Rows per block, so that all columns of a block stay in the processor's cache."""


@dataclass(frozen=True, slots=True)
class Mechanism(ClosedForm):
    """The lengths of one Maya [m], and the mathematics that needs only them; see `ClosedForm`."""

    def jacobian(self, joints: Joints) -> Floats:
        """Return ∂(x, y, z)/∂(a, b, c), shape (3, 3), in m/rad and m/m.

        The last row is (0, −T_b, −T_c): by virtual work the load sinks by the tension of a line times the length paid
        out. Raises `Unreachable` if the lines are straight or cannot meet.
        """
        a, b, c = joints
        W = self.width
        u, square = self.section(joints)
        if not square > 0.0:
            raise no_triangle(joints)
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
