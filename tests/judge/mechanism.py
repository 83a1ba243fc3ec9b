"""Maya's frame by the manual's formulas: position of the gripper, and distance of every limit of the workspace.

    u = (W² + b² − c²) / 2W        h = √(b² − u²)         d = Δ + u        z = H − Φ − h
    T_b = (W − u)/W · b/h          T_c = u/W · c/h        in multiples of the load

A limit k on the tension is a least depth of the lines' meeting point, since T_b ≤ k wherever
h² (k²W² − (W − u)²) ≥ (W − u)² u², and T_c ≤ k wherever the same holds with u and W − u exchanged. So every margin
is a length, that of the boom an arc, and one width of doubt serves them all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ends = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Frame:
    """Lengths of one machine [m], its strokes (a in rad, b and c in m), its tension limit [loads]."""

    height: float
    length: float
    delta: float
    gripper_height: float
    strokes: tuple[Ends, Ends, Ends]
    tension_limit: float

    @property
    def width(self) -> float:
        """W, the distance between the anchors."""
        return self.length - self.delta

    @property
    def top(self) -> float:
        """Height of the gripper point with the lines' meeting point at the anchors."""
        return self.height - self.gripper_height


def section(frame: Frame, joints: Floats) -> tuple[Floats, Floats]:
    """Return u and h of joints (n, 3), each (n,); h is 0 where the lines do not meet."""
    W = frame.width
    b, c = joints[:, 1], joints[:, 2]
    u = (W * W + b * b - c * c) / (2.0 * W)
    return u, np.sqrt(np.maximum(b * b - u * u, 0.0))


def places(frame: Frame, joints: Floats) -> Floats:
    """Return the gripper points (n, 3) of joints (n, 3)."""
    u, h = section(frame, joints)
    return from_cylinder(np.column_stack((joints[:, 0], frame.delta + u, frame.top - h)))


def from_cylinder(cylinder: Floats) -> Floats:
    """Return points (n, 3) for (angle from +y clockwise, radius, height), shape (n, 3)."""
    a, d, z = cylinder.T
    return np.column_stack((d * np.sin(a), d * np.cos(a), z))


def to_cylinder(points: Floats) -> Floats:
    """Return (angle, radius, height) of points, both (n, 3)."""
    x, y, z = points.T
    return np.column_stack((np.arctan2(x, y), np.hypot(x, y), z))


def joints_at(frame: Frame, points: Floats) -> Floats:
    """Return the joints (n, 3) that hold the gripper at points (n, 3) below the anchors."""
    a, d, z = to_cylinder(points).T
    u, h = d - frame.delta, frame.top - z
    return np.column_stack((a, np.hypot(h, u), np.hypot(h, frame.width - u)))


def tensions(frame: Frame, joints: Floats) -> Floats:
    """Return the greater line tension [loads] of joints (n, 3), shape (n,)."""
    W = frame.width
    u, h = section(frame, joints)
    depth = W * np.maximum(h, 1e-12)
    return np.maximum((W - u) * joints[:, 1], u * joints[:, 2]) / depth


def margins(frame: Frame, joints: Floats) -> dict[str, Floats]:
    """Return how far joints (n, 3) are from every limit, negative beyond it, each (n,) in metres."""
    W = frame.width
    u, h = section(frame, joints)
    inner = np.clip(u, 0.0, W)
    radius = frame.delta + inner
    boom, line_b, line_c = frame.strokes
    a, b, c = joints.T
    return {
        "boom": np.minimum(a - boom[0], boom[1] - a) * radius,
        "line_b": np.minimum(b - line_b[0], line_b[1] - b),
        "line_c": np.minimum(c - line_c[0], line_c[1] - c),
        "coupling": b + c - W,
        "inner": u,
        "outer": W - u,
        "floor": frame.top - h,
        "tension_b": h - _least_depth(inner, W, frame.tension_limit),
        "tension_c": h - _least_depth(W - inner, W, frame.tension_limit),
    }


def _least_depth(u: Floats, W: float, limit: float) -> Floats:
    """Return the depth at which the line whose anchor is `u` away carries the limit."""
    rest = W - u
    return rest * u / np.sqrt((limit * W) ** 2 - rest * rest)
