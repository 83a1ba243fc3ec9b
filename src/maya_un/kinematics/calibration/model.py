"""The gripper position for raw counts and given constants, and its derivatives by the constants.

With W = D − Δ, u = W/2 + (b² − c²) / 2W, h = √(b² − u²) and the counts converted to joints as in `parameters`:

    x = (Δ + u) sin α     y = (Δ + u) cos α     z = H − Φ − h
    ∂u/∂b = b/W           ∂u/∂c = −c/W          ∂u/∂W = 1 − u/W
    ∂h/∂b = T_b           ∂h/∂c = T_c           ∂h/∂W = −u (1 − u/W) / h

T_b and T_c are the tensions in loads (`kinematics.mechanism`).
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np

from maya_un.kinematics.calibration.parameters import FittedConstants
from maya_un.kinematics.mechanism import Floats

_FLATTEST = 1e-6
"""Lines count as hanging at least √this [m] deep, so that a fit continues through impossible lengths."""


class _Posture(NamedTuple):
    """Joints, and the triangle of the lines, of many readings; each of shape (n,)."""

    a: Floats
    b: Floats
    c: Floats
    u: Floats
    h: Floats


def joints(parameters: FittedConstants, counts: Floats) -> Floats:
    """Return the joints, shape (n, 3) [rad, m, m], for counts of shape (n, 3)."""
    at = _posture(parameters, counts)
    return np.stack([at.a, at.b, at.c], axis=1)


def points(parameters: FittedConstants, counts: Floats) -> Floats:
    """Return the gripper points, shape (n, 3) [m], for counts of shape (n, 3).

    If lines of such lengths cannot meet, they are assumed to hang a millimetre deep.
    """
    at = _posture(parameters, counts)
    d = parameters.delta + at.u
    z = parameters.height - parameters.gripper_height - at.h
    return np.stack([d * np.sin(at.a), d * np.cos(at.a), z], axis=1)


def jacobian(parameters: FittedConstants, counts: Floats) -> Floats:
    """Return ∂(x, y, z)/∂(the constants, in the order of `FittedConstants`), shape (n, 3, 10), for counts (n, 3)."""
    at = _posture(parameters, counts)
    by_joints = _by_joints(parameters, at)
    out = np.zeros((len(counts), 3, len(FittedConstants._fields)))
    out[:, 2, 0], out[:, 2, 3] = 1.0, -1.0
    _by_lengths(parameters, at, out)
    e = parameters.line_difference
    turned, long_b, long_c = (at.a - parameters.zero_a, at.b - parameters.zero_b, at.c - parameters.zero_c)
    by_a, by_b, by_c = by_joints[:, :, 0], by_joints[:, :, 1], by_joints[:, :, 2]
    out[:, :, 4] = -(by_b * long_b[:, None] + by_c * long_c[:, None]) / parameters.pulses_per_metre
    out[:, :, 5] = -by_a * turned[:, None] / parameters.pulses_per_degree
    out[:, :, 6:9] = by_joints
    out[:, :, 9] = by_c * (long_c / (2.0 - e))[:, None] - by_b * (long_b / (2.0 + e))[:, None]
    return out


def _posture(parameters: FittedConstants, counts: Floats) -> _Posture:
    k, e = parameters.pulses_per_metre, parameters.line_difference
    a = counts[:, 0] * (pi / 180.0 / parameters.pulses_per_degree) + parameters.zero_a
    b = counts[:, 1] / (k * (1.0 + 0.5 * e)) + parameters.zero_b
    c = counts[:, 2] / (k * (1.0 - 0.5 * e)) + parameters.zero_c
    W = parameters.length - parameters.delta
    u = 0.5 * W + (b - c) * (b + c) / (2.0 * W)
    return _Posture(a, b, c, u, np.sqrt(np.maximum((b - u) * (b + u), _FLATTEST)))


def _by_joints(parameters: FittedConstants, at: _Posture) -> Floats:
    """Return ∂(x, y, z)/∂(α, b, c), shape (n, 3, 3); as `Mechanism.jacobian`, for many."""
    W, d = parameters.length - parameters.delta, parameters.delta + at.u
    s, k, zero = np.sin(at.a), np.cos(at.a), np.zeros_like(at.a)
    pull_b, pull_c = at.b * (W - at.u) / (W * at.h), at.c * at.u / (W * at.h)
    rows = [[d * k, s * at.b / W, -s * at.c / W], [-d * s, k * at.b / W, -k * at.c / W], [zero, -pull_b, -pull_c]]
    return np.moveaxis(np.array(rows), 2, 0)


def _by_lengths(parameters: FittedConstants, at: _Posture, out: Floats) -> None:
    """Fill in ∂(x, y, z)/∂(D, Δ)."""
    by_width = 1.0 - at.u / (parameters.length - parameters.delta)
    sinks = -at.u * by_width / at.h
    for column, outward, sign in ((1, by_width, 1.0), (2, 1.0 - by_width, -1.0)):
        out[:, 0, column] = outward * np.sin(at.a)
        out[:, 1, column] = outward * np.cos(at.a)
        out[:, 2, column] = -sign * sinks
