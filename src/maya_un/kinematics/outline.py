"""The edges of the workspace without zones: its vertical section as a polygon, and its rings at a height.

The section's coordinates (u, h) of `kinematics.section` are converted: d = Δ + u is the distance from axis a, and
z = H − Φ − h the height, both of the gripper point.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from maya_un.kinematics.mechanism import Floats
from maya_un.kinematics.workspace import Workspace
from maya_un.values import Joints

_COLUMNS, _RING_COLUMNS = 2001, 801


def outline(workspace: Workspace, *, bend: float = 0.03, stride: float = 0.1) -> tuple[Floats, Floats]:
    """Return the edge of the reachable section, without zones, as a closed polygon (d, z), each (n,) [m].

    There is a point at least every `bend` [rad] of turning and every `stride` [m] of path length.
    """
    section, mechanism = workspace.section, workspace.mechanism
    ends = [mechanism.section(Joints(0.0, b, c))[0] for b in workspace.line_b for c in workspace.line_c]
    inner = [u for u in ends if 0.0 < u < mechanism.width]
    columns = [
        (u, section.depths(float(u))) for u in np.sort(np.append(np.linspace(0.0, mechanism.width, _COLUMNS), inner))
    ]
    u, low, high = np.array([(u, *depths) for u, depths in columns if depths is not None]).T
    d = mechanism.delta + np.concatenate((u, u[::-1], u[:1]))
    z = mechanism.reach_down - np.concatenate((low, high[::-1], low[:1]))
    kept = _kept(d, z, bend, stride)
    return d[kept], z[kept]


def _kept(d: Floats, z: Floats, bend: float, stride: float) -> NDArray[np.intp]:
    """Return the indices of the points to keep."""
    along = np.append(0.0, np.cumsum(np.hypot(np.diff(d), np.diff(z))))
    turns = np.abs(np.diff(np.unwrap(np.arctan2(np.diff(z), np.diff(d)))))
    turned = np.concatenate(([0.0], np.cumsum(turns), [0.0]))
    turned[-1] = turned[-2]
    fresh = (np.diff(np.floor(turned / bend)) > 0.0) | (np.diff(np.floor(along / stride)) > 0.0)
    fresh[-1] = True
    return np.flatnonzero(np.append(True, fresh))


def rings(workspace: Workspace, height: float) -> list[tuple[float, float]]:
    """Return the ranges of the distance d from axis a [m] that are reachable at a `height` z [m], without zones."""
    mechanism, section = workspace.mechanism, workspace.section
    h = mechanism.reach_down - height
    found: list[tuple[float, float]] = []
    begun: float | None = None
    last = 0.0
    for u in np.linspace(0.0, mechanism.width, _RING_COLUMNS):
        depths = section.depths(float(u))
        inside = depths is not None and depths[0] <= h <= depths[1]
        if inside:
            begun = float(u) if begun is None else begun
            last = float(u)
        elif begun is not None:
            found.append((begun, last))
            begun = None
    if begun is not None:
        found.append((begun, last))
    return [(mechanism.delta + start, mechanism.delta + end) for start, end in found]
