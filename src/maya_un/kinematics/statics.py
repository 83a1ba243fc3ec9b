"""Tensions of the two lines, in the vertical section through the boom.

The section's coordinates: `u` is the radial distance of the meeting point from anchor b, `h` its depth below
the anchors, `W` the distance between the anchors, all [m]. Anchor b is at (0, 0), anchor c at (W, 0). The load
hangs from the meeting point; its weight is the unit of every tension.
"""

from __future__ import annotations

from math import hypot, inf, sqrt

import numpy as np
from numpy.typing import NDArray


def tension(u: float, h: float, W: float) -> tuple[float, float]:
    """Return the tensions (T_b, T_c) in multiples of the load.

    The two lines together balance the weight: T_b = (W − u)/W · b/h and T_c = u/W · c/h with b = √(u² + h²),
    c = √((W − u)² + h²). A negative tension means that this line would have to push, so it hangs slack.
    At h = 0 and above no tension balances the load: both are infinite.
    """
    if h <= 0.0:
        return inf, inf
    return (W - u) / W * hypot(u, h) / h, u / W * hypot(W - u, h) / h


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
    """Return where (u, h) the meeting point really hangs [m] for free line lengths b and c [m].

    If a line is slack, the load hangs straight below the other anchor: at (0, b) or at (W, c). Lines too
    short to meet (b + c < W) are drawn straight: h is 0.
    """
    u = 0.5 * W + (b - c) * (b + c) / (2.0 * W)
    if u < 0.0:
        return 0.0, b
    if u > W:
        return W, c
    return u, sqrt(max(0.0, (b - u) * (b + u)))


def slack(b: float, c: float, W: float) -> tuple[float, float]:
    """Return how much of each line (b, c) hangs loose [m]; both are 0 where the lines are taut."""
    return max(0.0, b - hypot(W, c)), max(0.0, c - hypot(W, b))
