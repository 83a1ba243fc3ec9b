"""The workspace from above, at one height: the reachable area of the gripper point, the boom, the directions."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, degrees, sin

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc, FancyArrowPatch, Wedge

from maya_un.kinematics import Workspace
from maya_un.kinematics.outline import rings
from maya_un.plots import overlays
from maya_un.plots.overlays import MarkedTarget, make_room
from maya_un.plots.style import BOOM, GREY, INK, LINE_B, LINE_C, REACHABLE, quiet_grid

_GRID = 0.015
_ROOM = 0.3
_ARROW, _ARC = 0.18, 0.27


def draw_plan(
    axes: Axes, workspace: Workspace, height: float, bearing: float, marked: MarkedTarget | None = None
) -> None:
    """Draw the reachable area at `height` [m], with the boom at the angle `bearing` [rad]."""
    _PlanDrawing(axes, workspace, height, bearing).all(marked)


def frame(axes: Axes, workspace: Workspace) -> None:
    """Set up `axes` to show everything that the boom passes over, in metres, seen from above."""
    quiet_grid(axes)
    left, right, low, high = _extent(workspace)
    axes.set(aspect="equal", xlim=(left, right), ylim=(low, high), xlabel="x [m]", ylabel="y [m]")


def sectors(axes: Axes, workspace: Workspace, height: float) -> None:
    """Fill the reachable area at `height` [m], without zones."""
    start, end = (90.0 - degrees(angle) for angle in reversed(workspace.boom))
    for inner, outer in rings(workspace, height):
        axes.add_patch(
            Wedge((0.0, 0.0), outer, start, end, width=outer - inner, fc=REACHABLE, ec=INK, lw=1.4, zorder=1.5)
        )


def zones_at(axes: Axes, workspace: Workspace, height: float) -> None:
    """Draw the zones, cut at `height` [m]."""
    left, right, low, high = _extent(workspace)
    x, y = np.arange(left, right + _GRID, _GRID), np.arange(low, high + _GRID, _GRID)
    across, up = np.meshgrid(x, y)
    overlays.draw_zones(axes, workspace, x, y, np.stack((across, up, np.full_like(across, height))))


@dataclass(frozen=True, slots=True)
class _PlanDrawing:
    axes: Axes
    workspace: Workspace
    height: float
    bearing: float

    def all(self, marked: MarkedTarget | None) -> None:
        frame(self.axes, self.workspace)
        sectors(self.axes, self.workspace, self.height)
        self._radii()
        self._range()
        self._directions()
        self._boom()
        zones_at(self.axes, self.workspace, self.height)
        if marked is not None:
            marked.show(self.axes, marked.target[:2], marked.held[:2])
            make_room(self.axes, marked.target[:2])
        self.axes.set_title(f"From above, at z = {self.height:.2f} m", loc="left")

    def _radii(self) -> None:
        """Label the ends of the reachable ranges along the start of the boom's range."""
        angle = self.workspace.boom[0]
        for ring in rings(self.workspace, self.height):
            for radius, side in zip(ring, (10, -10), strict=True):
                x, y = _at(radius, angle)
                self.axes.annotate(
                    f"{radius:.2f} m", (x, y), (4, side), textcoords="offset points", fontsize=8, va="center"
                )

    def _range(self) -> None:
        """Draw the circles of the anchors, and label the ends of the boom's range."""
        axes, mechanism = self.axes, self.workspace.mechanism
        start, end = (90.0 - degrees(angle) for angle in reversed(self.workspace.boom))
        for radius, colour in ((mechanism.delta, LINE_B), (mechanism.length, LINE_C)):
            axes.add_patch(
                Arc((0, 0), 2 * radius, 2 * radius, theta1=start, theta2=end, color=colour, lw=0.9, ls="dotted")
            )
        for angle in self.workspace.boom:
            x, y = _at(1.02 * mechanism.length, angle)
            axes.plot((0.0, x), (0.0, y), color=GREY, linewidth=0.8, linestyle="dashed", zorder=1.4)
            x, y = _at(mechanism.length + 0.13, angle)
            axes.text(x, y, f"α = {degrees(angle):.0f}°", color=INK, fontsize=8, ha="center", va="center")

    def _directions(self) -> None:
        """Draw the directions +x and +y."""
        axes, size = self.axes, _ARROW * self.workspace.mechanism.length
        for x, y, name in ((0.0, size, "+y"), (size, 0.0, "+x")):
            axes.add_patch(FancyArrowPatch((0, 0), (x, y), arrowstyle="-|>", mutation_scale=9, color=INK, zorder=5))
            axes.annotate(name, (x, y), (3, 3), textcoords="offset points", fontsize=8, zorder=5)

    def _boom(self) -> None:
        axes, mechanism, bearing = self.axes, self.workspace.mechanism, self.bearing
        x, y = _at(mechanism.length + 0.06, bearing)
        axes.plot((0.0, x), (0.0, y), color=GREY, linewidth=3.5, solid_capstyle="butt", zorder=4)
        for radius, colour in ((mechanism.delta, LINE_B), (mechanism.length, LINE_C)):
            x, y = _at(radius, bearing)
            axes.plot(x, y, marker="o", markersize=5.5, color=colour, zorder=6)
        axes.plot(0.0, 0.0, marker="o", markersize=9, color=GREY, zorder=6)
        axes.annotate("axis a", (0.0, 0.0), (-8, -10), textcoords="offset points", ha="right", fontsize=8, color=GREY)
        self._angle()

    def _angle(self) -> None:
        """Show how the boom's angle is measured: from +y, clockwise."""
        if self.bearing < 0.15:
            return
        radius = _ARC * self.workspace.mechanism.length
        swept = np.linspace(0.0, self.bearing, 61)
        x, y = radius * np.sin(swept), radius * np.cos(swept)
        self.axes.plot(x, y, color=BOOM, linewidth=1.2, zorder=4)
        tip = FancyArrowPatch((x[-4], y[-4]), (x[-1], y[-1]), arrowstyle="-|>", mutation_scale=9, color=BOOM, zorder=4)
        self.axes.add_patch(tip)
        place = _at(radius + 0.02, 0.5 * self.bearing)
        self.axes.annotate("α", place, (3, 3), textcoords="offset points", color=BOOM, fontsize=10, zorder=5)


def _at(radius: float, angle: float) -> tuple[float, float]:
    return radius * sin(angle), radius * cos(angle)


def _extent(workspace: Workspace) -> tuple[float, float, float, float]:
    """Return left, right, low and high ends of the area that the boom passes over, with a margin [m]."""
    reach = workspace.mechanism.length
    turned = np.linspace(*workspace.boom, 181)
    counted = np.linspace(min(0.0, workspace.boom[0]), workspace.boom[1], 181)
    size = _ARC * reach
    x = np.concatenate((reach * np.sin(turned), size * np.sin(counted), [0.0, _ARROW * reach]))
    y = np.concatenate((reach * np.cos(turned), size * np.cos(counted), [0.0, _ARROW * reach]))
    return float(x.min()) - _ROOM, float(x.max()) + _ROOM, float(y.min()) - _ROOM, float(y.max()) + _ROOM
