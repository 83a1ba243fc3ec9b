"""A grid over the vertical section, and which of its places the manual's formulas accept."""

from __future__ import annotations

import numpy as np

STEP = 0.0025
U = np.arange(0.5 * STEP, 2.0, STEP)
Z = np.arange(0.5 * STEP, 2.35, STEP)


def manuals_grid() -> tuple[np.ndarray, np.ndarray]:
    """Return which places of a grid have lines within their strokes, and the greater tension there [loads]."""
    u, z = np.meshgrid(U, Z)
    h = 2.15 - z
    b, c = np.hypot(u, h), np.hypot(2.0 - u, h)
    accepted = (b >= 0.575) & (b <= 2.26) & (c >= 0.565) & (c <= 2.3)
    tension = np.where(h > 0.0, np.maximum((2.0 - u) * b, u * c) / (2.0 * np.abs(h)), np.inf)
    return accepted, tension
