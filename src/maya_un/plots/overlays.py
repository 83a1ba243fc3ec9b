"""Overlays of a workspace picture: keep-out zones, and targets that the user marks."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, product
from math import hypot, pi

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from maya_un.kinematics import Floats, Workspace
from maya_un.kinematics.zones import Box, Cylinder, HalfSpace, Zone
from maya_un.plots.style import INK, PURPLE
from maya_un.values import Point

_SIDES = 36

Corners = tuple[Point, Point]
"""Two opposite corners of the visible space of a picture [m]: the lowest and the highest values of x, y and z."""


def draw_zones(axes: Axes, workspace: Workspace, across: Floats, up: Floats, places: Floats) -> None:
    """Draw the cut of every zone with a plane, and a dashed line where the gripper point becomes too near to it.

    `across` (m,) and `up` (n,) are the picture's coordinates, `places` (3, n, m) the same places in space [m].
    """
    _, rows, columns = places.shape
    joints = workspace.mechanism.ik_many(places.reshape(3, -1).T)
    hangs = np.isfinite(joints[:, 1])
    for zone in workspace.zones:
        distance, _ = zone.field(places)
        if np.any(distance < 0.0):
            axes.contourf(across, up, distance, levels=[-np.inf, 0.0], colors=[PURPLE], alpha=0.45, zorder=5)
            _name(axes, zone.name, *(float(of[distance < 0.0].mean()) for of in np.meshgrid(across, up)))
        clear = np.full(rows * columns, np.nan)
        clear[hangs] = zone.clearances(workspace.mechanism, joints[hangs])
        if np.nanmin(clear) < 0.0 < np.nanmax(clear):
            edge = clear.reshape(rows, columns)
            axes.contour(across, up, edge, levels=[0.0], colors=[PURPLE], linewidths=1.0, linestyles="dashed", zorder=5)


def zone_key() -> tuple[list[Artist], list[str]]:
    """Return the marks of `draw_zones`, for a legend, and their meanings."""
    body = Patch(color=PURPLE, alpha=0.45, linewidth=0.0)
    edge = Line2D([], [], color=PURPLE, linewidth=1.0, linestyle="dashed")
    return [body, edge], ["zone", "where the gripper would be too near to it"]


def _name(axes: Axes, name: str, x: float, y: float) -> None:
    axes.text(x, y, name, color=INK, fontsize=8, ha="center", va="center", zorder=7)


def draw_in_space(axes: Axes3D, zones: tuple[Zone, ...], shown: Corners) -> None:
    """Draw zones as translucent bodies; a half-space is drawn as its plane within the picture."""
    for zone in zones:
        faces = _faces(zone, shown)
        axes.add_collection3d(Poly3DCollection(faces, facecolor=PURPLE, edgecolor=PURPLE, alpha=0.3, linewidth=0.5))


def _faces(zone: Zone, shown: Corners) -> list[Floats]:
    """Return the faces of a zone, each (n, 3) [m]."""
    match zone:
        case Box(low=low, high=high):
            return _box(low, high)
        case Cylinder():
            return _cylinder(zone)
        case HalfSpace(point=point, normal=normal):
            return _plane(point, normal, shown)
        case _:
            return []


def _box(low: Point, high: Point) -> list[Floats]:
    faces: list[Floats] = []
    for axis, side in product(range(3), (low, high)):
        one, two = (other for other in range(3) if other != axis)
        face = np.tile(np.array(side, dtype=np.float64), (4, 1))
        face[:, one] = (low[one], high[one], high[one], low[one])
        face[:, two] = (low[two], low[two], high[two], high[two])
        faces.append(face)
    return faces


def _cylinder(zone: Cylinder) -> list[Floats]:
    turned = np.linspace(0.0, 2.0 * pi, _SIDES + 1)
    x, y = zone.x + zone.radius * np.cos(turned), zone.y + zone.radius * np.sin(turned)
    below, above = (np.column_stack((x, y, np.full_like(x, z))) for z in (zone.low, zone.high))
    walls = [np.array([below[i], below[i + 1], above[i + 1], above[i]]) for i in range(_SIDES)]
    return [below, above, *walls]


def _plane(point: Point, normal: Point, shown: Corners) -> list[Floats]:
    """Return the polygon that a plane cuts out of the visible space, empty if it does not intersect it."""
    unit = np.array(normal) / hypot(*normal)
    corners = np.array(list(product(*zip(*shown, strict=True))))
    cuts = [
        start + (end - start) * share
        for start, end in combinations(corners, 2)
        if np.count_nonzero(start != end) == 1
        for share in [_crossing(float((start - point) @ unit), float((end - point) @ unit))]
        if share is not None
    ]
    if len(cuts) < 3:
        return []
    polygon = np.array(cuts)
    along = polygon[0] - polygon.mean(axis=0)
    sideways = np.cross(unit, along)
    spread = polygon - polygon.mean(axis=0)
    return [polygon[np.argsort(np.arctan2(spread @ sideways, spread @ along))]]


def _crossing(start: float, end: float) -> float | None:
    """Return the share at which a value passes 0 on its way from `start` to `end`, None if it does not."""
    return start / (start - end) if start * end < 0.0 or start == 0.0 != end else None


@dataclass(frozen=True, slots=True)
class MarkedTarget:
    """A `target` and the reachable place nearest to it, `held`: the same if the target is reachable."""

    target: Point
    held: Point

    @classmethod
    def of(cls, workspace: Workspace, target: Point) -> MarkedTarget:
        """Return a target with its nearest place [m]."""
        return cls(target, workspace.nearest(target))

    @property
    def reachable(self) -> bool:
        """Whether the target itself is reachable."""
        return self.target == self.held

    def show(self, axes: Axes, target: tuple[float, ...], held: tuple[float, ...]) -> None:
        """Mark both places, given in the coordinates of `axes`, with a line between them."""
        if not self.reachable:
            axes.plot(*zip(target, held, strict=True), color=PURPLE, linewidth=1.0, linestyle="dotted", zorder=7)
            _mark(axes, target, "x", PURPLE, "target")
        _mark(axes, held, "o", INK, "target, reachable" if self.reachable else "nearest reachable place")


def make_room(axes: Axes, place: tuple[float, float]) -> None:
    """Widen a plane picture so that it shows `place` too, unless the place is farther off than the picture's size."""
    limits = (axes.get_xlim(), axes.get_ylim())
    sizes = [high - low for low, high in limits]
    if all(low - size <= at <= high + size for (low, high), size, at in zip(limits, sizes, place, strict=True)):
        across, up = (
            (min(low, at - 0.04 * size), max(high, at + 0.04 * size))
            for (low, high), size, at in zip(limits, sizes, place, strict=True)
        )
        axes.set(xlim=across, ylim=up)


def _mark(axes: Axes, place: tuple[float, ...], marker: str, colour: str, label: str) -> None:
    columns = [[value] for value in place]
    axes.plot(*columns, marker=marker, color=colour, label=label, ls="none", ms=7.0, mew=2.0, zorder=8)
